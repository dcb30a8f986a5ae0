r"""Quadrature picking: modes from the peaks of the imaginary part (real part of mobility).

At a resonance of real modes the receptance is purely imaginary. Its imaginary part around a single mode is

.. math:: -\Im H_{jk} = R_{jk}\,\frac{2 \zeta \omega_r \omega}{(\omega_r^2 - \omega^2)^2 + (2 \zeta \omega_r \omega)^2},

so :math:`\omega / (-\Im H)` is a parabola in :math:`\omega^2`: its lowest point gives frequency, its width the damping,
and it needs no more than the lines above half of the peak. Source: Ewins, Modal Testing, 2nd ed., section 4.2;
Kennedy, Pancu, J. Aeronautical Sciences 14 (1947).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import FloatArray, fail, positive
from toolpoint._doubt import Doubt
from toolpoint.modal_identification.band import QUANTITY_POWERS, cut, noise_level
from toolpoint.modal_identification.scaling import factor_rank_one, scale_shapes
from toolpoint.vibration.driving_point import driving_points
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes

MIN_PEAK_DEVIATIONS = 8.0  # standard deviations of the noise
PARABOLA_PASSES = 3


@dataclass(frozen=True)
class Peak:
    """One picked peak: line, natural frequency (rad/s), damping ratio, lines used, residues (n_outputs, n_inputs)."""

    line: int
    omega: float
    ratio: float
    lines: int
    residue: FloatArray

    @property
    def height(self) -> float:
        """Root of the sum of squares of the peak over all responses, as mobility."""
        return float(np.linalg.norm(self.residue)) / (2 * self.ratio * self.omega)


def quadrature(
    frf: Frf, band: tuple[float, float] | None = None, *, prominence: float = 0.1, floor: float = 0.003
) -> Modes:
    """Return the real modes picked at the peaks of the imaginary part of all responses together.

    A line is a peak where the root-mean-square imaginary part over all responses (as mobility, so that high and low
    modes weigh alike) has a maximum whose prominence is at least

    - `prominence` of its own height,
    - `floor` of the highest peak, and
    - eight standard deviations of the noise, estimated from third differences along the lines.

    Parameters
    ----------
    frf : Frf
        One pose; receptance, mobility or accelerance, any line spacing.
    band : (low, high) in Hz, optional
        The whole axis where left out.
    prominence, floor : float
        See above, 0 .. 1.

    Returns
    -------
    Modes
        Real; of unit modal mass where every mode moves at a driving point, otherwise ``unscaled``. `notes` names modes
        with doubtful damping. Close modes (nearer than about the sum of their half widths) appear as one peak: use the
        default method of `identify` for them.

    Raises
    ------
    ToolpointError
        Where no peak meets the criterion, or the band is too narrow.

    >>> from toolpoint.vibration import frequency_response
    >>> modes = Modes([100.0], [0.01], [[0.1]], ["tool:+x"])
    >>> frf = frequency_response.modal(modes, np.arange(80.0, 120.0, 0.1), outputs=["tool:+x"], inputs=["tool:+x"])
    >>> picked = quadrature(frf)
    >>> picked.frequency.round(2).tolist(), picked.damping_ratio.round(4).tolist(), abs(picked.shape).round(4).tolist()
    ([100.0], [0.01], [[0.1]])
    """
    positive("prominence", prominence, 1.0)
    positive("floor", floor, 1.0)
    inside = cut(frf, band)
    omega = inside.omega
    curves = imaginary(inside)
    lines = pick_peaks(curves, frf_noise(inside), prominence, floor=floor)
    limits = _valleys(curves, lines)
    peaks = _drop_ripples([peak for line, pair in zip(lines, limits) if (peak := _fit_peak(curves, omega, line, pair))])
    if not peaks:
        fail("frf", "no peak of the imaginary part stands out of the noise",
             f"prominence must be {prominence:g} of the height, {floor:g} of the highest and {MIN_PEAK_DEVIATIONS:g} noise",
             remedy="lower them, or widen the band")
    return _modes(inside, sorted(peaks, key=lambda peak: peak.omega))


def imaginary(frf: Frf) -> FloatArray:
    """Return -w Im H of the receptance H, shape (n_f, n_outputs * n_inputs), from any quantity.

    It is the real part of the mobility i w H (the lines must be above 0 Hz).
    """
    values = frf.values.reshape(frf.frequency.size, -1)
    part = values.real if frf.quantity == "mobility" else values.imag
    sign = -1.0 if frf.quantity == "receptance" else 1.0
    return sign * part * frf.omega[:, None] ** (1 - QUANTITY_POWERS[frf.quantity])


def frf_noise(frf: Frf) -> FloatArray:
    """Return the standard deviation of the noise of the root-mean-square curve, shape (n_f,).

    It is taken from the measured quantity, where noise tends to be even, over some 60 lines around each line.
    """
    values = frf.values.reshape(frf.frequency.size, -1)
    part = values.real if frf.quantity == "mobility" else values.imag
    count = part.shape[0]
    centres = np.arange(0, count, 16)
    level = [np.sqrt((noise_level(part[max(c - 32, 0):c + 32]) ** 2).mean() / part.shape[1]) for c in centres]
    return np.interp(np.arange(count), centres, level) * frf.omega ** (1 - QUANTITY_POWERS[frf.quantity])


def pick_peaks(curves: FloatArray, noise: FloatArray, prominence: float, *, floor: float) -> list[int]:
    """Return the lines of the peaks of the root-mean-square curve that meet the criterion of `quadrature`."""
    height = np.sqrt((curves**2).mean(axis=1))
    peaks, properties = find_peaks(height, prominence=floor * height.max())
    keep = (properties["prominences"] >= prominence * height[peaks]) & (
        properties["prominences"] >= MIN_PEAK_DEVIATIONS * noise[peaks])
    return [int(line) for line in peaks[keep]]


def _drop_ripples(peaks: list[Peak]) -> list[Peak]:
    """Return the peaks without those whose fit ended at the mode of a higher one (ripples on one peak)."""
    kept: list[Peak] = []
    for peak in sorted(peaks, key=lambda candidate: -candidate.height):
        if not any(_is_same_mode(peak, other) for other in kept):
            kept.append(peak)
    return kept


def _is_same_mode(peak: Peak, other: Peak) -> bool:
    is_near = abs(peak.omega - other.omega) < max(peak.ratio * peak.omega, other.ratio * other.omega)
    product = abs((peak.residue * other.residue).sum())
    # Two peaks of one mode have one shape; two close modes of different shape stay two.
    return is_near and product > 0.7 * np.linalg.norm(peak.residue) * np.linalg.norm(other.residue)


def _valleys(curves: FloatArray, lines: list[int]) -> list[tuple[int, int]]:
    """Return the first and last line that belongs to each peak: as far as the lowest line between two peaks."""
    height = (curves**2).sum(axis=1)
    lowest = [first + int(np.argmin(height[first:second + 1])) for first, second in pairwise(lines)]
    return list(zip([0, *lowest], [*lowest, height.size - 1]))


def _fit_peak(curves: FloatArray, omega: FloatArray, line: int, limits: tuple[int, int]) -> Peak | None:
    """Return the peak refined on the lines above half of its height; None where no bell curve can be found."""
    weight, pole = curves[max(line - 1, 0):line + 2].mean(axis=0), (0.0, 0.0)
    for _ in range(PARABOLA_PASSES):
        bell = curves @ weight  # the responses joined in phase with the mode: noise and other modes average out
        lines = _above_half(bell, line, limits)
        fit = _parabola(bell[lines] / omega[lines], omega[lines])
        if fit is None:
            return None
        pole = fit
        unit = _bell(omega[lines], *pole)
        weight = unit @ curves[lines] / (unit @ unit)
    # A fit whose top lies outside its own lines describes the flank of something else.
    if not omega[lines[0]] <= pole[0] <= omega[lines[-1]]:
        return None
    return Peak(line, *pole, lines.size, weight)


def _above_half(bell: FloatArray, line: int, limits: tuple[int, int]) -> FloatArray:
    below_half = np.flatnonzero(bell <= 0.5 * bell[line])
    lower = max(below_half[below_half < line].max(initial=-1) + 1, limits[0])
    upper = min(below_half[below_half > line].min(initial=bell.size), limits[1] + 1)
    if upper - lower < 3:
        lower, upper = max(line - 1, 0), min(line + 2, bell.size)
    lines = np.arange(lower, upper)
    return lines[bell[lines] > 0]


def _parabola(bell: FloatArray, omega: FloatArray) -> tuple[float, float] | None:
    r"""Return (w_r, zeta) from :math:`\omega / y = ((\omega^2 - u)^2 + D) / A` with u = w_r^2 (1 - 2 zeta^2)."""
    if bell.size < 3:
        return None
    scale = omega[int(np.argmax(bell))]
    x = (omega / scale) ** 2 - 1
    basis = np.stack([np.ones_like(x), x, x**2], axis=1)
    target, weight = omega / scale / bell, bell**2
    for _ in range(4):
        fit = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)[0]
        model = basis @ fit
        if fit[2] <= 0 or model.min() <= 0:
            break
        # An error e of y is an error e x / y^2 of x / y: the weight is y^2 / x, with y from the model, without noise.
        weight = omega / scale / model**2
    if fit[2] <= 0:
        return None
    vertex = 1 - fit[1] / (2 * fit[2])
    width = fit[0] / fit[2] - (fit[1] / (2 * fit[2])) ** 2
    if width <= 0 or vertex <= 0:
        return None
    square = np.sqrt(vertex**2 + width)
    return float(scale * np.sqrt(square)), float(np.sqrt(width / (2 * square * (square + vertex))))


def _bell(omega: FloatArray, natural: float, ratio: float) -> FloatArray:
    loss = 2 * ratio * natural * omega
    return omega * loss / ((natural**2 - omega**2) ** 2 + loss**2)


def _modes(frf: Frf, peaks: list[Peak]) -> Modes:
    points = driving_points(frf.outputs, frf.inputs)
    outputs, inputs = len(frf.outputs), len(frf.inputs)
    parts = []
    for peak in peaks:
        shape, participation, _ = factor_rank_one(peak.residue.reshape(outputs, inputs))
        parts.append(scale_shapes(shape, participation, points))
    shapes = np.stack([part[0] for part in parts], axis=1)
    participation = np.stack([part[1] for part in parts], axis=1)
    unit_mass = all(part[2] for part in parts)
    rate = np.array([peak.ratio * peak.omega for peak in peaks]) - frf.decay
    damped_square = np.array([peak.omega**2 * (1 - peak.ratio**2) for peak in peaks])
    natural = np.sqrt(damped_square + rate**2)
    return Modes(
        natural / (2 * np.pi), rate / natural, shapes, frf.outputs,
        "unit modal mass" if unit_mass else "unscaled", participation=participation, input_dofs=frf.inputs,
        notes=(*frf.notes, *_doubts(frf, peaks, unit_mass)))


def _doubts(frf: Frf, peaks: list[Peak], unit_mass: bool) -> list[Doubt]:
    doubts = [Doubt("quadrature picking", "shapes are real, each mode is seen alone")]
    for number, peak in enumerate(peaks, start=1):
        if peak.lines < 5:
            doubts.append(Doubt(f"mode {number}", f"only {peak.lines} lines above half of the peak, the damping is uncertain",
                                "measure with a finer line spacing"))
        if peak.line < peak.lines or peak.line > frf.frequency.size - 1 - peak.lines:
            doubts.append(Doubt(f"mode {number}", "lies at the edge of the band", "widen it"))
    for number, (first, second) in enumerate(pairwise(peaks), start=1):
        if second.omega - first.omega < 2 * (first.ratio * first.omega + second.ratio * second.omega):
            doubts.append(Doubt(f"modes {number} and {number + 1}", "overlap, so that their damping is uncertain here"))
    if not unit_mass:
        doubts.append(Doubt("no scale", "no driving point among the responses moves in every mode with the right sign"))
    return doubts
