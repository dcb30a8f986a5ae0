r"""Mass of one sensor that is moved from point to point: taken out of the responses where it is told, estimated where not.

At a point p whose bare accelerances (in the measured directions) are :math:`A_{pp}`, a sensor of mass m measures
:math:`A'_{ps} = (I + m A_{pp})^{-1} A_{ps}` of a force at s (Ewins, Modal Testing, 2nd ed., section 3.10), in any quantity.
Every point thus shows the modes at frequencies of its own, lower by :math:`m |\phi_p|^2 / 2` to first order. :math:`A_{pp}` is
that of the identified modes: its error counts by the ratio of the sensor's mass to the structure's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.judgement.complexity import phase_collinearity, real_modes
from toolpoint.modal_identification.scaling import factor_rank_one, scale_shapes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MAX_SPLIT = 1.0  # gap of two modes that one mode splits into, over the sum of their half-power half-widths
MIN_SPLIT_LIKENESS = 0.9  # correlation of their participation
MIN_MASS_DEVIATIONS = 5.0  # of an estimated mass from zero, in standard deviations
MIN_FREQUENCY_SHIFT = 3e-4  # of a frequency, by an estimated mass where it moves most
MIN_JUDGED_POINTS = 6
MAX_SMALL_SHIFT = 0.3  # of a mode's half-power half-width: above, shifts are no longer to first order
MAX_STATED_ERROR = 0.3  # of a stated mass, within which the frequencies agree with it
MIN_LOUD_PEAK = 0.02  # of the highest peak of accelerance, that a mode must have to tell the mass
# Peak over the highest, and phase collinearity, below which a mode beside a mass that was taken out is a rest of that mass.
MAX_FAINT_PEAK, MIN_FAINT_COLLINEARITY = 2e-2, 0.5
MIN_SENSOR_SHARE = 0.4  # of a told mass, that the frequencies must show of a sensor that was moved alone
_DERIVATIVES = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True)
class SensorMass:
    """Mass of a moved sensor (kg) as the frequencies at the points show it, its standard deviation, its largest relative shift
    of a frequency, and whether shifts are small beside the widths of the modes: else it is a lower limit."""

    mass: float
    deviation: float
    shift: float
    is_small: bool

    @property
    def is_significant(self) -> bool:
        """Whether the mass stands out of its own deviation and moves a frequency by what matters."""
        return abs(self.mass) >= MIN_MASS_DEVIATIONS * self.deviation and abs(self.shift) >= MIN_FREQUENCY_SHIFT


def merge_split_modes(modes: Modes) -> Modes:
    """Return the modes with those as one that the loads of a moved sensor split: near each other, of equal participation.

    modes : of modal A scaling, with participation.
    """
    groups: list[list[int]] = []
    for k in range(modes.count):
        if groups and _are_split(modes, groups[-1][-1], k):
            groups[-1].append(k)
        else:
            groups.append([k])
    if len(groups) == modes.count:
        return modes
    points = driving_points(modes.dofs, modes.input_dofs)
    frequency, ratio = np.empty(len(groups)), np.empty(len(groups))
    shape = np.empty((len(modes.dofs), len(groups)), complex)
    participation = np.empty((len(modes.input_dofs), len(groups)), complex)
    assert modes.participation is not None
    for place, group in enumerate(groups):
        residue = modes.shape[:, group] @ modes.participation[:, group].T
        size = np.array([np.linalg.norm(modes.shape[:, k]) * np.linalg.norm(modes.participation[:, k]) for k in group])
        frequency[place], ratio[place] = (float(size @ part[group] / size.sum())
                                          for part in (modes.frequency, modes.damping_ratio))
        left, right, _ = factor_rank_one(residue)
        shape[:, place], participation[:, place], _ = scale_shapes(left + 0j, right + 0j, points)
    return Modes(frequency, ratio, shape, modes.dofs, "modal A", participation=participation, input_dofs=modes.input_dofs)


def is_split(modes: Modes) -> bool:
    """Whether modes overlap and answer the inputs alike, as those do that the loads of a moved sensor split."""
    return (modes.participation is not None and modes.scaling == "modal A"
            and any(_are_split(modes, k, k + 1) for k in range(modes.count - 1)))


def _are_split(modes: Modes, first: int, second: int) -> bool:
    """Whether two neighbouring modes are within their widths and answer the inputs alike."""
    assert modes.participation is not None
    width = (modes.damping_ratio[[first, second]] * modes.frequency[[first, second]]).sum()
    shares = modes.participation[:, [first, second]]
    sizes = np.linalg.norm(shares, axis=0)
    likeness = abs(np.vdot(shares[:, 0], shares[:, 1])) / max(float(sizes.prod()), 1e-300)
    return bool(modes.frequency[second] - modes.frequency[first] < MAX_SPLIT * width and likeness > MIN_SPLIT_LIKENESS)


def free_of_moved_sensor(frf: Frf, modes: Modes, mass: float) -> Frf:
    """Return responses without the mass (kg) of the sensor that was at each point while its responses were measured.

    modes : of these responses, modal A scaling, split ones merged.
    """
    s = 2j * np.pi * frf.frequency + frf.decay
    poles = modes.poles
    factors = s[:, None] ** 2 / (s[:, None] - poles), s[:, None] ** 2 / (s[:, None] - poles.conj())
    values = frf.values.copy()
    for rows in _rows_of_points(frf):
        shape = modes.shape_at([frf.outputs[row] for row in rows])
        direct = _squares(factors[0], shape) + _squares(factors[1], shape.conj())
        values[:, rows] += mass * direct @ frf.values[:, rows]
    return replace(frf, values=values, draws=None)


def _squares(factor: ComplexArray, shape: ComplexArray) -> ComplexArray:
    """Return the sum over modes of factor times shape times shape, (n_f, n_rows, n_rows)."""
    return np.asarray(np.einsum("fr,ar,br->fab", factor, shape, shape))


def _rows_of_points(frf: Frf) -> list[list[int]]:
    """Return the rows of every point."""
    rows: dict[int | str, list[int]] = {}
    for row, dof in enumerate(frf.outputs):
        rows.setdefault(dof.point, []).append(row)
    return list(rows.values())


def largest_shift(modes: Modes, mass: float) -> float:
    """Return the largest share of a frequency by which a mass (kg) at one point lowers it; modes of modal A scaling."""
    rows: dict[int | str, list[int]] = {}
    for row, dof in enumerate(modes.dofs):
        rows.setdefault(dof.point, []).append(row)
    return float(mass * _point_squares(modes, list(rows.values())).max() / 2)


def is_moved_alone(frf: Frf, modes: Modes, mass: float) -> bool:
    """Whether the frequencies at the points allow that one sensor of this mass (kg) was moved from point to point.

    They do not where it would show and much less is there: then all sensors were on the structure at once. Nor is a mass taken
    out that moves modes by their own widths.
    """
    if modes.participation is None or modes.scaling != "modal A":
        return False
    merged = merge_split_modes(modes)
    estimate = estimate_sensor_mass(frf, merged)
    if estimate is None or largest_shift(merged.selected(_loud_modes(merged)), mass) < MIN_FREQUENCY_SHIFT:
        return True
    return estimate.is_small and estimate.mass > MIN_SENSOR_SHARE * mass - MIN_MASS_DEVIATIONS * estimate.deviation


def _point_squares(modes: Modes, points: list[list[int]]) -> FloatArray:
    """Return the square of the motion of points (by their rows) in modes of unit modal mass, 1/kg, (n_modes, n_points)."""
    shape = np.real(real_modes(modes).shape)
    return np.array([(shape[rows] ** 2).sum(axis=0) for rows in points]).T


def estimate_sensor_mass(frf: Frf, modes: Modes) -> SensorMass | None:
    """Return the mass that one moved sensor must have for the points to show their frequencies; None where nothing tells it.

    With common poles, a shift d of a pole at one point adds R d / (s - p)^2 to its responses; the shifts of all modes and
    points are regressed on the square of the point's motion, each mode with a frequency of its own.
    modes : of these responses, modal A scaling, split ones merged.
    """
    points = _rows_of_points(frf)
    if len(points) < MIN_JUDGED_POINTS or modes.scaling != "modal A":
        return None
    loud = _loud_modes(modes)
    modes = modes.selected(loud)
    shift, weight = _pole_shifts(frf, modes, points)
    predicted = _point_squares(modes, points) / 2
    centred, shift = (part - (weight * part).sum(axis=1, keepdims=True) / weight.sum(axis=1, keepdims=True)
                      for part in (predicted, shift))
    information = (weight * centred**2).sum(axis=1)
    if not information.sum() > 0:
        return None
    # Modes that tell another mass than all together are false, or badly scaled: the deviation holds their scatter.
    masses = -(weight * centred * shift).sum(axis=1) / np.maximum(information, 1e-300)
    mass = float((information * masses).sum() / information.sum())
    left = float((weight * (shift + mass * centred) ** 2).sum()) / max(shift.size - len(shift) - 1, 1)
    scatter = float((information * (masses - mass) ** 2).sum()) / max(len(shift) - 1, 1)
    largest = abs(mass) * predicted.max(axis=1)
    return SensorMass(mass, float(np.sqrt(max(left, scatter, 1.0) / information.sum())), mass * float(predicted.max()),
                      bool((largest < MAX_SMALL_SHIFT * modes.damping_ratio).all()))


def steady_modes(modes: Modes) -> list[int]:
    """Return the modes without those that are faint and whose points move in no common phase."""
    is_faint = _peaks(modes) < MAX_FAINT_PEAK
    return np.flatnonzero(~is_faint | (phase_collinearity(modes.shape) >= MIN_FAINT_COLLINEARITY)).tolist()


def _loud_modes(modes: Modes) -> list[int]:
    """Return the modes whose peaks are not faint beside the highest: the shapes of faint ones are badly scaled."""
    return np.flatnonzero(_peaks(modes) > MIN_LOUD_PEAK).tolist()


def _peaks(modes: Modes) -> FloatArray:
    """Return the peaks (k,) of accelerance of modes, over the highest."""
    assert modes.participation is not None
    peaks = (np.linalg.norm(modes.shape, axis=0) * np.linalg.norm(modes.participation, axis=0)
             / np.maximum(np.abs(modes.poles.real), 1e-300) * np.abs(modes.poles) ** 2)
    return np.asarray(peaks / peaks.max())


def _pole_shifts(frf: Frf, modes: Modes, points: list[list[int]]) -> tuple[FloatArray, FloatArray]:
    """Return the relative shift of every mode at every point, (n_modes, n_points), and one over its variance."""
    s, poles, count = 2j * np.pi * frf.frequency + frf.decay, modes.poles, modes.count
    motion = s[:, None] ** _DERIVATIVES[frf.quantity]
    upper = 1 / (s[:, None] - poles)
    basis = np.concatenate([upper, upper**2, 1 / (s[:, None] - poles.conj()), np.ones((s.size, 1)), s[:, None] ** -2], axis=1)
    basis = basis * motion
    size = np.linalg.norm(basis, axis=0)
    values = frf.values.reshape(s.size, -1)
    factors, remainder = np.linalg.qr(basis / size)
    projected = factors.conj().T @ values
    inverse = np.linalg.pinv(remainder)
    coefficients = (inverse @ projected) / size[:, None]
    noise = (np.abs(values - factors @ projected) ** 2).sum(axis=0) / max(s.size - basis.shape[1], 1)
    spread = (np.abs(inverse) ** 2).sum(axis=1) / size**2
    shape = (len(frf.outputs), len(frf.inputs))
    residues, changes = (part.reshape(count, *shape) for part in (coefficients[:count], coefficients[count:2 * count]))
    noise = noise.reshape(shape)
    shift, weight = np.zeros((count, len(points))), np.zeros((count, len(points)))
    for place, rows in enumerate(points):
        trust = np.abs(residues[:, rows]) ** 2 / np.maximum(noise[rows], 1e-300)
        ratio = (residues[:, rows].conj() * changes[:, rows] / np.maximum(noise[rows], 1e-300)).sum(axis=(1, 2))
        total = np.maximum(trust.sum(axis=(1, 2)), 1e-300)
        shift[:, place] = (ratio / total).imag / poles.imag
        weight[:, place] = total * poles.imag**2 / (0.5 * spread[count:2 * count])
    return shift, weight


def question_moved_sensor(frf: Frf, modes: Modes, stated_mass: float | None, *, is_taken_out: bool) -> tuple[Doubt, ...]:
    """Return the doubt that the points show their frequencies as a moved sensor of another mass than the told one (kg) makes
    them; none where they do not.

    is_taken_out : whether the told mass was taken out of the responses and modes.
    """
    if modes.participation is None or modes.scaling != "modal A":
        return ()
    estimate = estimate_sensor_mass(frf, merge_split_modes(modes))
    if estimate is None or not estimate.is_significant:
        return ()
    total = estimate.mass + (stated_mass if stated_mass is not None and is_taken_out else 0.0)
    if total <= 0:
        return ()
    size = f"{'' if estimate.is_small else 'at least '}about {1e3 * total:.0f} g"
    if stated_mass is None:
        why = (f"points show the same modes at frequencies that differ as a sensor of {size} moved between them makes them "
               f"differ, by up to {100 * estimate.shift:.2g} %: modes may be split or counted twice")
        remedy = "give the sensor's mass (`sensor_mass`, or `mass` of its channels in the test file)"
    elif not estimate.is_small:
        why = (f"{1e3 * stated_mass:.3g} g move the modes by as much as their own width from point to point: the mass cannot "
               "be taken out, and modes are counted twice")
        remedy = "measure with a lighter sensor"
    elif not is_taken_out and abs(total / stated_mass - 1) < MAX_STATED_ERROR:
        why = (f"{1e3 * stated_mass:.3g} g lower frequencies by up to {100 * estimate.shift:.2g} %, and taking them out leaves "
               "more modes, or modes twice: they are still in the responses")
        remedy = "look for modes that are counted twice, and measure with a lighter sensor"
    else:
        why = (f"{1e3 * stated_mass:.3g} g were stated, and the frequencies at the points differ as one of {size} makes them")
        remedy = "weigh it with its magnet and cable, and check the calibration of its channels"
    return (Doubt("sensor's mass", why, remedy, figure=abs(estimate.shift)),)
