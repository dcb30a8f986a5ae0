"""Correlation of a test with a machine: points paired, modes paired, and their differences by place, band and size."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from toolpoint._check import Array, FloatArray, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine, assemble
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.description import PointDescription
from toolpoint.signals.doubts import question
from toolpoint.spatial import transform as tf
from toolpoint.studies.measured.channel_doubts import question_responses, question_shapes
from toolpoint.studies.measured.point_pairing import PointPairing
from toolpoint.updating.measured.correlation_coefficients import CorrelationCoefficients, coefficients
from toolpoint.vibration import Frf, Modes, correlation, eigen, frequency_response

Point = str | int
_FRAC_BAND_COUNT = 4  # where fewer than two measured modes part the lines
MAX_SINGLE_FRACTION = 0.34  # of measured points without a point of the machine
MAX_RANDOM_PAIRS = 0.05  # pairs expected among random shapes above which MAC says little
MAX_PAIRED_FREQUENCY_RATIO = 1.4  # ratio of paired frequencies


@dataclass(frozen=True, eq=False)
class ModelCorrelation(NotebookText):
    """Correlation of a test with a machine.

    points : pairing of the points; measured, predicted : Modes at the paired Dofs; mac : (n_measured, n_predicted);
    pairs : of the modes; coefficients : of the paired modes, None without any; comac, ecomac : point of the model to value;
    bands : (n_bands, 2), Hz, and frac : (n_bands, n_outputs, n_inputs), None without responses; measured_frf, predicted_frf.
    """

    points: PointPairing
    measured: Modes
    predicted: Modes
    mac: FloatArray
    pairs: correlation.Pairing
    coefficients: CorrelationCoefficients | None
    comac: Mapping[Point, float]
    ecomac: Mapping[Point, float]
    bands: FloatArray
    frac: FloatArray | None = None
    measured_frf: Frf | None = None
    predicted_frf: Frf | None = None
    doubts: tuple[Doubt, ...] = ()

    def table(self) -> str:
        """Return paired modes, coefficients, the points that agree least, and FRAC over bands as text."""
        lines = [*mark_notes(self.doubts), f"points: {len(self.points.pairs)} paired, {self.points.status}",
                 " measured Hz  predicted Hz        %    MAC"]
        for i, j in self.pairs.pairs:
            f, g = self.measured.frequency[i], self.predicted.frequency[j]
            lines.append(f"{f:12.4f} {g:13.4f} {100 * (g / f - 1):8.2f} {self.mac[i, j]:6.3f}")
        lines += [f"{self.measured.frequency[i]:12.4f}        single" for i in self.pairs.single_first]
        if self.coefficients is not None:
            lines.append(self.coefficients.table())
            least_comac = sorted(self.comac, key=lambda p: self.comac[p])[:5]
            lines.append("lowest COMAC: " + ", ".join(f"{p} {self.comac[p]:.3f} (ECOMAC {self.ecomac[p]:.3f})"
                                                      for p in least_comac))
        if self.frac is not None:
            lines += [f"FRAC {frequency_min:8.2f} .. {frequency_max:8.2f} Hz: lowest {part.min():.3f}, mean {part.mean():.3f}"
                      for (frequency_min, frequency_max), part in zip(self.bands, self.frac, strict=True)]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers of the correlation as plain data; transform in m, frequencies in Hz."""
        c = self.coefficients
        return {
            "doubts": list(self.doubts), "points_paired": {str(a): str(b) for a, b in self.points.pairs.items()},
            "transform": self.points.transform.tolist(),
            "modes": [{"measured_hz": float(self.measured.frequency[i]), "model_hz": float(self.predicted.frequency[j]),
                       "mac": float(self.mac[i, j])} for i, j in self.pairs.pairs],
            "mean": None if c is None else c.mean, "mass": None if c is None else c.mass,
            "total": None if c is None else c.total, "comac": {str(p): v for p, v in self.comac.items()},
            "ecomac": {str(p): v for p, v in self.ecomac.items()},
            "frac": None if self.frac is None else self.frac.tolist(), "bands_hz": self.bands.tolist()}

    def __repr__(self) -> str:
        return (f"ModelCorrelation({len(self.points.pairs)} points, {len(self.pairs.pairs)} of {self.measured.count} modes"
                + (f", total {self.coefficients.total:.3f}" if self.coefficients else "") + ")")


def with_measured_points(machine: Machine, points: Mapping[Point, FloatArray], owner: Mapping[str, Sequence[Point]]) -> Machine:
    """Return the machine with measured points on its (rigid) bodies; positions in the machine frame at the reference pose.

    owner : body to its points. Raises ToolpointError for a body or a point that is not there.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}))
    >>> list(with_measured_points(machine, {7: np.array([0.1, 0.0, 0.2])}, {"head": [7]}).description.points)
    ['7']
    """
    added = dict(machine.description.points)
    for body, names in owner.items():
        frame = machine.body_frames[machine.link(body)]
        for name in names:
            if name not in points:
                fail("points", f"no position for {name!r}", f"is on {body} by the components")
            x, y, z = tf.move(tf.inverse(frame), np.asarray(points[name])[None])[0].tolist()
            added[str(name)] = PointDescription(body, (x, y, z))
    return machine.rebuild(replace(machine.description, points=added))


def correlate(
    machine: Machine, modes: Modes, points: PointPairing | None = None, *, frf: Frf | None = None, pose: Pose | None = None,
    lowest_mac: float = 0.5, frequency_shift: float = np.inf, bands: Sequence[tuple[float, float]] | None = None,
) -> ModelCorrelation:
    """Return the agreement of a machine with measured modes and responses.

    Parameters
    ----------
    machine : Machine
    modes : Modes
        Measured, one pose, any scaling.
    points : PointPairing, optional
        From test to machine points; the same names and frame where left out.
    frf : Frf, optional
        Measured, any quantity.
    pose : mapping, optional
    lowest_mac, frequency_shift : float
        The shape filter and the largest relative difference of frequency of a pair, see `vibration.correlation.pair_modes`.
    bands : pairs of Hz, optional
        For FRAC; between the middles of neighbouring measured frequencies where left out.
    """
    pairing = points or PointPairing.identity([p for p in dict.fromkeys(d.point for d in modes.dofs)
                                               if str(p) in machine.description.points])
    measured = pairing.renamed(modes)
    everything = eigen.solve_undamped(assemble(machine, pose, measured.dofs))
    result = correlate_modes(pairing, measured, everything, mass=lambda: effective_mass(machine, pose),
                             lowest_mac=lowest_mac, frequency_shift=frequency_shift)
    edges = _bands(measured.frequency, frf) if bands is None else np.array(bands, float).reshape(-1, 2)
    result = replace(result, bands=edges)
    return result if frf is None else _with_responses(result, machine, pairing.renamed_frf(frf), pose)


def correlate_modes(points: PointPairing, measured: Modes, predicted: Modes, *, mass: Callable[[], FloatArray],
                    lowest_mac: float = 0.5, frequency_shift: float = np.inf) -> ModelCorrelation:
    """Return the agreement of modes with measured ones at the same Dofs, without responses.

    mass : called for the effective modal mass of every predicted mode, kg, (n_predicted,), where pairs are there to weigh;
    points, lowest_mac, frequency_shift : see `correlate`. Modes above 1.5 times the highest measured one are left out.
    """
    frequency_max = 1.5 * float(measured.frequency.max())
    kept = [i for i, f in enumerate(predicted.frequency) if f <= frequency_max] or [0]
    inside = predicted.selected(kept)
    pairs = correlation.pair_modes(measured, inside, lowest_mac, frequency_shift=frequency_shift)
    values = correlation.mac(measured.shape, inside.shape)
    result = ModelCorrelation(points, measured, inside, values, pairs, None, {}, {}, _bands(measured.frequency, None),
                              doubts=(*points.doubts, *_single_doubt(points), *_pair_doubts(measured, inside, pairs)))
    return _weigh_pairs(result, mass()[kept]) if len(pairs.pairs) else result


def _single_doubt(points: PointPairing) -> list[Doubt]:
    share = len(points.single) / max(len(points.single) + len(points.pairs), 1)
    if share < MAX_SINGLE_FRACTION:
        return []
    return [Doubt("points", f"{len(points.single)} of {len(points.single) + len(points.pairs)} have no point of the machine "
                  "near: the frame may be wrong, or the geometry's unit", "give three known pairs", figure=share)]


def _pair_doubts(measured: Modes, predicted: Modes, pairs: correlation.Pairing) -> list[Doubt]:
    """Doubt pairs whose MAC so few Dofs reach by chance, and pairs of far frequencies.

    The MAC of two random real shapes over n Dofs has the beta distribution of parameters 1/2, (n - 1)/2.
    """
    doubts = []
    n = len(measured.dofs)
    tries = measured.count * predicted.count
    weak = [k for k, value in enumerate(pairs.values)
            if n < 2 or tries * float(scipy.stats.beta.sf(min(value, 1.0), 0.5, (n - 1) / 2)) > MAX_RANDOM_PAIRS]
    if weak:
        doubts.append(Doubt("modes", f"{len(weak)} of {len(pairs.pairs)} pairs (MAC from {pairs.values[weak].min():.2f}) would "
                            f"be found among random shapes too: {n} Dofs are too few", "measure more points"))
    first, second = (modes.frequency[pairs.pairs[:, k]] for k, modes in ((0, measured), (1, predicted)))
    is_far = np.abs(np.log(np.maximum(second, 1e-12) / np.maximum(first, 1e-12))) > np.log(MAX_PAIRED_FREQUENCY_RATIO)
    if is_far.any():
        doubts.append(Doubt("modes",
                            f"{int(is_far.sum())} of {is_far.size} pairs differ by more than "
                            f"{100 * (MAX_PAIRED_FREQUENCY_RATIO - 1):.0f} % in "
                            "frequency: alike in shape at these points only, or the machine is another",
                            "look at the shapes, add points"))
    return doubts


def _weigh_pairs(result: ModelCorrelation, mass: FloatArray) -> ModelCorrelation:
    first, second = result.measured.selected(result.pairs.pairs[:, 0]), result.predicted.selected(result.pairs.pairs[:, 1])
    weight = mass[result.pairs.pairs[:, 1]]
    weights = coefficients(first, second, weight if weight.sum() > 0 else None)
    # COMAC compares modes with each other: measured shapes get the scale of the model's.
    scaled = first.shape * np.diag(correlation.modal_scale_factor(first.shape, second.shape))
    rows = _rows(result.measured)
    doubts = (*result.doubts, *question_shapes(first, second))
    comac, ecomac = _coordinate_mac(scaled, second.shape, rows), _enhanced_mac(scaled, second.shape, rows)
    return replace(result, coefficients=weights, comac=comac, ecomac=ecomac, doubts=doubts)


def _rows(modes: Modes) -> dict[Point, list[int]]:
    result: dict[Point, list[int]] = {}
    for i, d in enumerate(modes.dofs):
        result.setdefault(d.point, []).append(i)
    return result


def _coordinate_mac(a: Array, b: Array, rows: Mapping[Point, list[int]]) -> dict[Point, float]:
    """Return the COMAC (Lieven, Ewins, 1988) of every point, its sums taken over the point's directions as well."""
    result = {}
    for point, indices in rows.items():
        numerator = np.abs(a[indices] * b[indices].conj()).sum() ** 2
        denominator = (np.abs(a[indices]) ** 2).sum() * (np.abs(b[indices]) ** 2).sum()
        result[point] = float(numerator / denominator) if denominator > 0 else float((np.abs(a[indices]) +
                                                                                      np.abs(b[indices])).sum() == 0)
    return result


def _enhanced_mac(a: Array, b: Array, rows: Mapping[Point, list[int]]) -> dict[Point, float]:
    """Return the ECOMAC (Hunt, 1992) of every point: mean over modes of half the length of the scaled difference."""
    largest = np.abs(b).max(axis=0)
    difference = (a - b) / largest
    return {point: float(np.linalg.norm(difference[indices], axis=0).mean() / 2) for point, indices in rows.items()}


def effective_mass(machine: Machine, pose: Pose | None = None) -> FloatArray:
    """Return the mass that takes part in translation in every mode, (n_modes,), kg.

    The square of the sum of all bodies' momenta at unit modal mass (effective modal mass, all three directions together).
    """
    shapes = body_shapes(machine, pose)
    momentum = np.zeros((3, shapes.frequency.size))
    for link, body in enumerate(machine.bodies):
        first = body.mass[3:6, :3] / body.mass[0, 0]
        centre = np.array([first[2, 1], first[0, 2], first[1, 0]])
        centre_of_mass = tf.move(shapes.place.frames[0, link], centre[None])[0]
        momentum += body.mass[0, 0] * tf.point_velocity(centre_of_mass) @ shapes.twists[link]
    return np.asarray((momentum**2).sum(axis=0))


def _bands(frequency: FloatArray, frf: Frf | None) -> FloatArray:
    frequency_min, frequency_max = (0.0, 1.2 * float(frequency[-1])) if frf is None else (float(frf.frequency[0]),
                                                                                          float(frf.frequency[-1]))
    inner_modes = np.sort(frequency[(frequency > frequency_min) & (frequency < frequency_max)])
    edges = np.linspace(frequency_min, frequency_max, _FRAC_BAND_COUNT +
                        1) if inner_modes.size < 2 else np.array([frequency_min, *(inner_modes[1:] + inner_modes[:-1]) / 2,
                                                                  frequency_max])
    return np.stack([edges[:-1], edges[1:]], axis=1)


def _with_responses(result: ModelCorrelation, machine: Machine, frf: Frf, pose: Pose | None) -> ModelCorrelation:
    lines = frf if frf.frequency[0] > 0 else frf.between(float(frf.frequency[1]), np.inf)
    measured = replace(lines, coherence=None)
    system = assemble(machine, pose, measured.outputs, inputs=measured.inputs)
    # In the quantity that was measured: receptance would blow up the noise of accelerations at low frequency.
    predicted = frequency_response.direct(system, measured.frequency).converted_to(measured.quantity)
    used, values = [], []
    for frequency_min, frequency_max in result.bands:
        inside = (measured.frequency >= frequency_min) & (measured.frequency <= frequency_max)
        if inside.sum() >= 3:
            used.append((frequency_min, frequency_max))
            values.append(correlation.frac(measured.between(frequency_min, frequency_max),
                                           predicted.between(frequency_min, frequency_max)))
    if not used:
        fail("bands", "none with three measured lines", "must hold some", remedy="give bands within the measured lines")
    return replace(result, bands=np.array(used), frac=np.stack(values), measured_frf=measured, predicted_frf=predicted,
                   doubts=(*result.doubts, *question(measured), *question_responses(measured, predicted)))
