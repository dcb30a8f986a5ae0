r"""Receptance of a spindle with its rotations, from translations measured on a gauge of known size in it.

With the gauge held at its base plane, its stations answer by A and follow the base by Phi; so measured responses are
:math:`H_{ij} = A_{ij} + \Phi_i H' \Phi_j^T`, H' the base with the gauge in it: three unknowns a line, linear. The gauge's
dynamic stiffness at its base, Z, is then taken away: :math:`H_b = H' (I - Z H')^{-1}`. No finite differences, and no
rotation is measured; but the tilt of the base is seen only over the distance of the stations, so noise grows.
Sources: Duncan, Schmitz, J. Manuf. Sci. Eng. 127 (2005) (inverse receptance coupling); Schmitz, Smith, Machining
Dynamics, 2nd ed., chapter 9.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, IndexArray, ToolpointWarning, fail
from toolpoint._doubt import Doubt
from toolpoint.substructuring.receptance import DEFAULT_DRAW_COUNT, PlaneReceptance, complex_noise, is_uncertain_shaft
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.substructuring.shaft_stiffness import station_stiffness
from toolpoint.vibration import Dof, Frf

MAX_GAUGE_MISFIT = 3.0  # misfit over the noise (root mean square) above which the gauge is doubted
BASE_REFINEMENTS = 2  # corrections of a solution by its residual
MIN_STATION_SINGULAR_RATIO = 1e-6  # smallest over largest singular value of the stations' geometry


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Measured responses of the gauge: station index of every output and input (p,), values and variance (n_f, p)."""

    output: IndexArray
    input: IndexArray
    values: ComplexArray
    variance: FloatArray | None


def identify_base(frf: Frf, gauge: ShaftDescription, plane: str = "x", *, calibration: float = 0.0,
                  draws: int = DEFAULT_DRAW_COUNT, generator: np.random.Generator | None = None,
                  common: np.random.Generator | None = None) -> PlaneReceptance:
    """Identify the receptance of a spindle at the base plane of a gauge, without the gauge.

    Parameters
    ----------
    frf : Frf
        Responses among the gauge's stations along the plane (labels ``station:+x``); those at two stations to forces at both
        are the least: a row alone leaves the tilt by moments open. With `variance`, it is carried to the result.
    gauge : ShaftDescription
        With `stations`.
    plane : str
        ``x`` or ``y``.
    calibration : float
        Standard deviation of a gain that all responses share, as a share.
    draws : int
        How many equally likely bases to draw from the variance and the gauge's deviations; 0 for none.
    generator : numpy Generator, optional
        Needed for draws.
    common : numpy Generator, optional
        For gain and gauge, which the planes of a test share: one of the same seed for each plane. `generator` where left out.

    Raises
    ------
    ToolpointError
        For fewer than two stations, forces at one station only, stations that lie together, and draws without a generator.
    """
    lines = frf.converted_to("receptance")
    pairs = _measured_pairs(lines, gauge, plane)
    values, misfit = _base(pairs, gauge, lines.frequency, pairs.values, is_refined=True)
    notes = [*lines.notes, *_doubts(misfit, pairs)]
    drawn = None
    if draws and (pairs.variance is not None or calibration or _is_uncertain(gauge)):
        if generator is None:
            fail("generator", "None", "draws need a numpy Generator",
                 remedy="for example numpy.random.default_rng(1); or draws=0")
        shared = generator if common is None else common
        # Noise is of each plane's own responses, the gain is of the hammer: it comes from the generator that both planes
        # share.
        noise = 0 if pairs.variance is None else complex_noise(pairs.variance, draws, generator)
        # A gain is uncertain by a factor: its logarithm is drawn, so that no draw turns the sign.
        gains = np.exp(calibration * shared.normal(size=draws))
        drawn = _drawn_bases(pairs, gauge, lines.frequency, gains[:, None, None] * (pairs.values + noise), shared)
    elif draws:
        notes.append("the measured responses state no variance: no interval of the tool-point response can be given")
    return PlaneReceptance(lines.frequency, values, plane, drawn, tuple(dict.fromkeys(notes)))


def _measured_pairs(frf: Frf, gauge: ShaftDescription, plane: str) -> _Pairs:
    names = list(gauge.stations)
    if len(names) < 2:
        fail("gauge.stations", f"{len(names)}", "must be at least two, apart along the gauge",
             remedy="rotations are seen by the difference of deflections")
    outputs = [k for k, dof in enumerate(frf.outputs) if _station(dof, plane) in names]
    inputs = [k for k, dof in enumerate(frf.inputs) if _station(dof, plane) in names]
    first, second = (np.array([names.index(str(labels[k].point)) for k in positions], int)
                     for labels, positions in ((frf.outputs, outputs), (frf.inputs, inputs)))
    if len(set(first) | set(second)) < 2 or not len(first) or not len(second):
        fail("frf", f"responses {', '.join(map(str, frf.outputs))} to forces {', '.join(map(str, frf.inputs))}",
             f"must be of the gauge's stations {', '.join(names)} along +{plane}")
    _check_forces(first, second, names)
    values = frf.values[:, outputs][:, :, inputs].reshape(frf.frequency.size, -1)
    variance = None if frf.variance is None else frf.variance[:, outputs][:, :, inputs].reshape(frf.frequency.size, -1)
    rows, columns = np.meshgrid(first, second, indexing="ij")
    return _Pairs(rows.ravel(), columns.ravel(), values, variance)


def _station(dof: Dof, plane: str) -> str:
    return str(dof.point) if dof.direction == f"+{plane}" and dof.vector is None else ""


def _check_forces(outputs: IndexArray, inputs: IndexArray, names: list[str]) -> None:
    pairs = {tuple(sorted((int(i), int(j)))) for i in outputs for j in inputs}
    driven = {i for pair in pairs for i in pair if (i, i) in pairs}
    if len(driven) < 2:
        fail("frf", f"driving points at {', '.join(names[i] for i in sorted(driven)) or 'no station'}", "must be two stations",
             remedy="a force at one station only leaves open how the base tilts under a moment; strike the other station too")


@dataclass(frozen=True, eq=False)
class _HeldGauge:
    """Gauge with its base held, and the least-squares problem of its base, line by line (n_f first).

    dynamic : dynamic stiffness over all sections; sections : of the stations; held : responses with the base held (n, n);
    base_stiffness : Z, the held gauge at its base (2, 2); design, weight, solver : of the three unknowns of a line in the
    measured pairs.
    """

    dynamic: ComplexArray
    sections: IndexArray
    held: ComplexArray
    base_stiffness: ComplexArray
    design: ComplexArray
    weight: FloatArray
    solver: ComplexArray

    def unknowns(self, answers: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Fit symmetric matrices (..., 2, 2) to answers (..., n_f, p) by least squares; return them and the weighted misfit."""
        three = (self.solver @ (self.weight * answers)[..., None])[..., 0]
        misfit: ComplexArray = self.weight * (answers - (self.design @ three[..., None])[..., 0])
        return np.stack([three[..., [0, 1]], three[..., [1, 2]]], axis=-2), misfit


def _held_gauge(pairs: _Pairs, gauge: ShaftDescription, frequency: FloatArray) -> _HeldGauge:
    stiffness = station_stiffness(gauge, frequency)
    z = stiffness.matrix
    # Coordinates 0 and 1 are deflection and slope of the base: without their rows it stands still.
    held = np.linalg.inv(z[:, 2:, 2:])
    follow = -held @ z[:, 2:, :2]
    padded = np.zeros((len(z), 2 + held.shape[1], 2 + held.shape[1]), complex)  # the base itself stands still
    padded[:, 2:, 2:] = held
    motion = np.concatenate([np.broadcast_to(np.eye(2), (len(z), 2, 2)), follow], axis=1)
    sections = np.array(list(stiffness.sections.values()))
    left, right = motion[:, 2 * sections[pairs.output]], motion[:, 2 * sections[pairs.input]]
    # H_ij - A_ij = Phi_i H' Phi_j^T with H' symmetric: columns of H'_11, H'_12 and H'_22.
    design = np.stack([left[..., 0] * right[..., 0], left[..., 0] * right[..., 1] + left[..., 1] * right[..., 0],
                       left[..., 1] * right[..., 1]], axis=-1)
    _check_geometry(design, gauge.length)
    # A variance of zero at single lines would leave these alone to decide: none counts below 1e-12 of the largest of its
    # line.
    weight = np.ones(pairs.values.shape) if pairs.variance is None else 1 / np.sqrt(np.maximum(
        pairs.variance, 1e-12 * pairs.variance.max(axis=1, keepdims=True) + 1e-300))
    return _HeldGauge(z, sections, padded, z[:, :2, :2] + z[:, :2, 2:] @ follow, design, weight,
                      np.linalg.pinv(weight[..., None] * design))


def _base(pairs: _Pairs, gauge: ShaftDescription, frequency: FloatArray, measured: ComplexArray, *, is_refined: bool = False
          ) -> tuple[ComplexArray, ComplexArray]:
    """Return the base's receptance (..., n_f, 2, 2) of measured values (..., n_f, p), and what they leave unexplained.

    Near a resonance of the held gauge both A and Phi H' Phi^T are large and differ by little; `is_refined` corrects the base
    by what the whole with it still differs from the measured values.
    """
    held = _held_gauge(pairs, gauge, frequency)
    deflections = 2 * held.sections
    # H' from the pairs, then H_b = H' (I - Z H')^-1: solved from the right, the base's receptance is never inverted.
    # What the gauge does with its base held stands still is known from its drawing: only the rest tells of the spindle.
    joined, misfit = held.unknowns(measured - held.held[:, deflections[pairs.output], deflections[pairs.input]])
    right = np.linalg.solve(np.swapaxes(np.eye(2) - held.base_stiffness @ joined, -1, -2), np.swapaxes(joined, -1, -2))
    base = np.swapaxes(right, -1, -2)
    if not is_refined:
        return base, misfit
    for _ in range(BASE_REFINEMENTS):
        predicted = _solve_coupled(held, base)[:, pairs.output, pairs.input]
        change, misfit = held.unknowns(measured - predicted)
        # The slope of the joined base to the base alone: H' = (H_b^-1 + Z)^-1, so dH_b = (I + H_b Z) dH' (I + H_b Z)^T.
        turn = np.eye(2) + base @ held.base_stiffness
        base = base + turn @ change @ np.swapaxes(turn, -1, -2)
    return base, misfit


def _solve_coupled(held: _HeldGauge, base: ComplexArray) -> ComplexArray:
    """Return the responses among the stations of the gauge on a base (n_f, 2, 2), to the last digit.

    Deflections and forces at the base are solved for together, so that neither the base nor the held gauge is inverted; the
    residuals are summed with the longest numbers that the machine has.
    """
    lines, n = held.dynamic.shape[:2]
    matrix = np.zeros((lines, n + 2, n + 2), complex)
    matrix[:, :n, :n], matrix[:, n:, n:] = held.dynamic, -base
    matrix[:, [0, 1], [n, n + 1]] = matrix[:, [n, n + 1], [0, 1]] = 1.0
    deflections = 2 * held.sections
    right = np.zeros((lines, n + 2, len(deflections)), complex)
    right[:, deflections, range(len(deflections))] = 1.0
    # Stiffnesses of 1e9 stand beside receptances of 1e-9: rows and columns of one size keep the inverse accurate to begin
    # with.
    scale = 1 / np.sqrt(np.abs(matrix).max(axis=2))
    inverse = scale[:, :, None] * np.linalg.inv(scale[:, :, None] * matrix * scale[:, None, :]) * scale[:, None, :]
    exact = matrix.astype(np.clongdouble)
    solution = (inverse @ right).astype(np.clongdouble)
    for _ in range(BASE_REFINEMENTS):
        residual = right - np.einsum("fij,fjk->fik", exact, solution)
        solution = solution + inverse @ residual.astype(complex)
    return solution[:, deflections].astype(complex)


def _check_geometry(design: ComplexArray, length: float) -> None:
    scale = np.array([1.0, 1 / length, 1 / length**2])
    singular = np.linalg.svd(design[0] * scale, compute_uv=False)
    if singular[-1] < MIN_STATION_SINGULAR_RATIO * singular[0]:
        fail("gauge.stations", "stations that lie together", "must be apart along the gauge",
             remedy="spread them over its length")


def _drawn_bases(pairs: _Pairs, gauge: ShaftDescription, frequency: FloatArray, measured: ComplexArray,
                 generator: np.random.Generator) -> ComplexArray:
    if not _is_uncertain(gauge):
        return _base(pairs, gauge, frequency, measured)[0]
    return np.stack([_base(pairs, gauge.drawn(generator), frequency, part)[0] for part in measured])


def _is_uncertain(gauge: ShaftDescription) -> bool:
    return is_uncertain_shaft(gauge) or gauge.station_deviation > 0


def _doubts(misfit: ComplexArray, pairs: _Pairs) -> list[Doubt]:
    """Return a doubt where the responses fit no base behind this gauge, or are too few to tell."""
    spare = pairs.values.shape[1] - 3
    if spare < 1:
        return [Doubt("gauge", "three responses for three unknowns a line: nothing left to check it and its stations by")]
    if pairs.variance is None:
        relative_misfit = np.sqrt((np.abs(misfit) ** 2).sum() / (np.abs(pairs.values) ** 2).sum())
        words = f"responses differ from those of any base behind this gauge by {100 * relative_misfit:.2g} % of their size"
        level = relative_misfit > 0.05
    else:
        # The median over lines, as single ones lie on resonances: of a sum of n exponentials it is about n ln(2)^(1/n).
        ratio = float(np.sqrt(np.median((np.abs(misfit) ** 2).sum(axis=-1) / (spare * np.log(2) ** (1 / spare)))))
        words = f"responses differ from those of any base behind this gauge by {ratio:.2g} times their stated noise"
        level = ratio > MAX_GAUGE_MISFIT
    if not level:
        return []
    doubt = Doubt("gauge", words, "check its diameter, modulus and stations, and which response is which")
    warnings.warn(doubt, ToolpointWarning, stacklevel=4)
    return [doubt]
