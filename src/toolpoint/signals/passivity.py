r"""Passivity of a measured driving point: power, phase at its peaks, and the compliance outside its band.

A driving point takes in power at every line: the real part of its mobility is not negative. Where damping
hides a turned phase from single lines, peaks show it: the residue of a mode that vibrates in phase is at -90 degrees, so a
delay :math:`\tau` turns every peak by :math:`-\omega_k \tau`. The real part of a causal response follows from its imaginary
part (Kramers and Kronig), up to the compliance of modes above the band and the mobility of modes below it.
Source: Ewins, Modal Testing, 2nd ed., sections 3.9, 4.3 and 4.4; Maclaurin's formula: Ohta, Ishida, Appl. Spectrosc. 42
(1988) 952.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray, IndexArray
from toolpoint.vibration.frf import Frf

MIN_BAND_LINES = 24  # below, a band is not judged
SIGNAL_TO_NOISE = 5.0  # of a line that is judged
ACTIVE_DEVIATIONS = 3.0  # standard deviations of noise by which the power of an active line is negative
ACTIVE_ANGLE = np.radians(1.5)  # by which the phase of an active line is outside the passive range
NOISE_WINDOW_LINES = 48  # over which noise is taken as constant
MIN_PEAK_RATIO = 0.1  # over the largest peak of the receptance: smaller ones do not determine a phase
PEAK_WINDOW_WIDTHS = 1.25  # half-power widths to each side of a peak within which it is fitted
MAX_PEAK_MISFIT = 0.05  # relative residual of a peak's fit: above, neighbours or noise determine its phase
MIN_LOW_END_LINES = 16  # at the low end, from which modes below the band are estimated
LOW_END_RATIOS = (1.05, 1.6)  # over the lowest line, between which modes below the band are estimated
# Apparent part of modes below the band by structural damping, over the loss at the lowest lines: constant, and for every e-fold
# of frequency from there to the largest peak. 95 of 100 random structures with structural damping show less.
STRUCTURAL_LOSS_FACTOR, STRUCTURAL_LOSS_RISE = 0.8, 1.4
CAUSALITY_LINES = 160  # at which the real part is computed from the imaginary one


@dataclass(frozen=True, eq=False)
class BandLines:
    """Lines of one driving point in the band that can be believed: rad/s, receptance (m/N), standard deviation of its noise."""

    omega: FloatArray
    receptance: ComplexArray
    noise: FloatArray

    @property
    def is_loud(self) -> BoolArray:
        """Lines above the noise by `SIGNAL_TO_NOISE`."""
        return np.asarray(np.abs(self.receptance) > SIGNAL_TO_NOISE * self.noise)

    def turned(self, factor: ComplexArray | complex) -> BandLines:
        """Return the lines times a factor."""
        return BandLines(self.omega, self.receptance * factor, self.noise * np.abs(factor))

    def conjugated(self) -> BandLines:
        """Return the lines with the opposite time factor."""
        return BandLines(self.omega, self.receptance.conj(), self.noise)


@dataclass(frozen=True)
class ResonancePeak:
    """Peak of the receptance.

    frequency, Hz; damping, ratio; height, m/N; phase of the residue less that of a mode in phase, rad; its standard deviation.
    """

    frequency: float
    damping: float
    height: float
    phase: float
    deviation: float


@dataclass(frozen=True)
class Outside:
    """Parts of a response outside its band.

    above : compliance of modes above it, m/N; below : that of modes below it, at the lowest line, m/N; misfit : of the real
    part that follows from the imaginary one, relative.
    """

    above: float
    below: float
    misfit: float


def band_lines(frf: Frf) -> BandLines | None:
    """Return the lines of a single response as receptance; None where they are too few to be judged."""
    above_zero = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    if above_zero.frequency.size < MIN_BAND_LINES:
        return None
    power = {"receptance": 0, "mobility": 1, "accelerance": 2}[frf.quantity]
    factor = (1j * above_zero.omega) ** power
    values: ComplexArray = np.asarray(above_zero.values[:, 0, 0] / factor, complex)
    noise = line_scatter(np.asarray(values * above_zero.omega**2, complex)) / above_zero.omega**2
    if above_zero.variance is not None:
        noise = np.maximum(noise, np.sqrt(above_zero.variance[:, 0, 0]) / np.abs(factor))
    return BandLines(above_zero.omega, values, noise)


def line_scatter(values: ComplexArray) -> FloatArray:
    """Return the standard deviation of lines by the scatter of their neighbours, the median within windows of lines."""
    third_differences = np.abs(np.diff(values, 3)) ** 2 / 20
    size = min(NOISE_WINDOW_LINES, third_differences.size)
    starts = np.arange(0, third_differences.size - size + 1, size)
    level = np.array([np.sqrt(np.median(third_differences[start:start + size]) / np.log(2)) for start in starts])
    return np.interp(np.arange(values.size), starts + 1.5 + size / 2, level)


def active_share(lines: BandLines) -> float:
    """Return the fraction of loud lines that give off power beyond noise; 0 where no line is loud."""
    is_loud = lines.is_loud
    if not is_loud.any():
        return 0.0
    values, noise = lines.receptance[is_loud], lines.noise[is_loud]
    size = np.abs(values)
    excess_angle = np.arcsin(np.clip(values.imag / size, -1, 1))
    return float(np.mean(excess_angle > ACTIVE_ANGLE + ACTIVE_DEVIATIONS * noise / size))


def find_peaks(lines: BandLines) -> list[ResonancePeak]:
    """Return the peaks of the receptance with a determined phase, largest first."""
    values, omega = lines.receptance, lines.omega
    mobility = np.abs(values) * omega
    peaks: list[ResonancePeak] = []
    for k in _find_maxima(mobility):
        is_near, width = _peak_window(mobility, omega, int(k))
        if is_near.sum() < 7 or width <= 0:
            continue
        peak = _fit_peak(values[is_near], omega[is_near], float(omega[k]), width)
        if peak is not None and abs(2 * np.pi * peak.frequency - omega[k]) < width:
            peaks.append(peak)
    if not peaks:
        return []
    highest = max(float(np.abs(values).max()), max(peak.height for peak in peaks))
    return sorted((peak for peak in peaks if peak.height > MIN_PEAK_RATIO * highest), key=lambda peak: -peak.height)


def _find_maxima(size: FloatArray) -> IndexArray:
    """Return at most twelve maxima of the smoothed curve, largest first, none within the half-power width of another."""
    smooth = size if size.size < 64 else np.convolve(np.pad(size, 2, mode="edge"), np.ones(5) / 5, "valid")
    candidates = np.flatnonzero((smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:])) + 1
    maxima: list[int] = []
    for k in candidates[np.argsort(-smooth[candidates])].tolist():
        lower, upper = _half_power(smooth, k)
        if smooth[k] > 0.02 * smooth.max() and not any(lower <= other <= upper for other in maxima):
            maxima.append(k)
        if len(maxima) == 12:
            break
    return np.array(maxima, int)


def _half_power(size: FloatArray, k: int) -> tuple[int, int]:
    """Return the lines below half power on either side of a maximum."""
    under_left = np.flatnonzero(size[:k] < size[k] / np.sqrt(2))
    under_right = np.flatnonzero(size[k:] < size[k] / np.sqrt(2))
    return (int(under_left[-1]) if under_left.size else 0), (k + int(under_right[0]) if under_right.size else size.size - 1)


def _peak_window(size: FloatArray, omega: FloatArray, k: int) -> tuple[BoolArray, float]:
    """Return the lines about a peak within which it is fitted, and its half-power width, rad/s."""
    lower, upper = _half_power(size, k)
    # The narrower side is that of the mode alone; a neighbour widens the other.
    width = 2 * float(min(omega[k] - omega[lower], omega[upper] - omega[k]))
    width = max(width, 4 * float(omega[min(k + 1, omega.size - 1)] - omega[k]))
    return np.abs(omega - omega[k]) <= PEAK_WINDOW_WIDTHS * width, width


def _fit_peak(values: ComplexArray, omega: FloatArray, centre: float, width: float) -> ResonancePeak | None:
    """Return the mode of a peak: :math:`(x - p) H` is a polynomial in x = (omega - centre)/width where others are smooth."""
    x = (omega - centre) / width
    weight = np.ones(x.size)
    for _ in range(5):
        matrix = np.stack([values, np.ones(x.size), x, x * x], axis=1) * weight[:, None]
        solution = np.linalg.lstsq(matrix, x * values * weight, rcond=None)[0]
        pole = complex(solution[0])
        weight = 1 / np.maximum(np.abs(x - pole), 1e-6)
    residual = matrix @ solution - x * values * weight
    misfit = float(np.linalg.norm(residual) / max(float(np.linalg.norm(values)), 1e-300))
    s = centre + width * pole
    if misfit > MAX_PEAK_MISFIT or pole.imag <= 0 or s.real <= 0:
        return None
    residue = complex(solution[1] + solution[2] * pole + solution[3] * pole**2)
    gradient = np.array([solution[2] + 2 * solution[3] * pole, 1, pole, pole**2])
    covariance = np.linalg.pinv(matrix.conj().T @ matrix) * (np.abs(residual) ** 2).sum() / max(x.size - 4, 1)
    deviation = np.sqrt(abs(gradient.conj() @ covariance @ gradient)) / max(abs(residue), 1e-300)
    # H = a/(w0^2 - w^2 + 2 i zeta w0 w) has the residue -a/(2 w_d) at its pole in omega: a real negative number.
    return ResonancePeak(abs(s) / (2 * np.pi), s.imag / abs(s), abs(residue) / pole.imag, float(np.angle(-residue)),
                         float(deviation))


def look_outside(lines: BandLines) -> Outside:
    """Return the parts outside the band, from the real part that the imaginary part does not explain."""
    omega, values = lines.omega, lines.receptance
    step = float(np.median(np.diff(omega)))
    grid = np.arange(omega[0], omega[-1], step)
    loss, real = -np.interp(grid, omega, values.imag), np.interp(grid, omega, values.real)
    magnitude = np.abs(np.interp(grid, omega, np.abs(values)))
    spread_places = np.linspace(3, grid.size - 4, CAUSALITY_LINES)
    low_end = max(LOW_END_RATIOS[1] * omega[0], omega[0] + MIN_LOW_END_LINES * step)
    low_places = np.searchsorted(grid, np.linspace(LOW_END_RATIOS[0] * omega[0], low_end, CAUSALITY_LINES // 4))
    places = np.unique(np.append(spread_places, low_places[low_places < grid.size - 4]).astype(int))
    causal_part = np.empty(places.size)
    for row, k in enumerate(places.tolist()):
        other = np.arange((k + 1) % 2, grid.size, 2)  # Maclaurin: every second line, the pole in the middle between two
        causal_part[row] = 4 / np.pi * step * float(np.sum(grid[other] * loss[other] / (grid[other] ** 2 - grid[k] ** 2)))
    w = grid[places]
    remaining = real[places] - causal_part
    # Relative errors count, but for antiresonances, where nothing but noise is left.
    weight = 1 / (magnitude[places] + 0.02 * float(magnitude.max()))
    columns = np.stack([np.ones(w.size), -(omega[0] / w) ** 2], axis=1)
    above, below = np.linalg.lstsq(columns * weight[:, None], remaining * weight, rcond=None)[0]
    # Modes below the band show at its low end, where other errors of the integral are smallest.
    is_low = (w >= LOW_END_RATIOS[0] * omega[0]) & (w <= low_end)
    scaled = (w[is_low] / omega[0]) ** 2
    below = float(np.median((above - remaining[is_low]) * scaled))
    if below < ACTIVE_DEVIATIONS * float(np.median(np.interp(w[is_low], omega, lines.noise) * scaled)):
        below = min(below, 0.0)
    if below > 0:
        below = max(below - _structural_shortfall(lines), 0.0)
    residual = (remaining - columns @ np.array([above, below])) * weight
    return Outside(float(above), float(below), float(np.linalg.norm(residual) / np.linalg.norm(real[places] * weight)))


def _structural_shortfall(lines: BandLines) -> float:
    r"""Return the difference by structural damping, at the lowest lines, of the real part from the causal one, m/N.

    Such damping loses nearly as much at low lines as at high ones, and no causal response does: Kramers and Kronig turn a loss
    L that is constant from w up to a resonance into :math:`(2/\pi) L \ln(\omega_r/w)`, which the response does not have.
    The loss of modes above rises with frequency. What falls from the lowest lines on is the flank of a mode below them, and
    no such loss: of blocks of lines up to the largest response the least counts.
    """
    place = int(np.argmax(np.abs(lines.receptance)))
    count = max(place // MIN_LOW_END_LINES, 1)
    loss = -lines.receptance.imag[:count * MIN_LOW_END_LINES]
    constant = max(min(float(np.median(block)) for block in np.array_split(loss, count)), 0.0)
    if count == 1:
        # The flank of a largest peak close to the low end is no constant loss: that of a mode is eta / k = 4 zeta^2 height.
        constant = min(constant, sum(4 * each.damping**2 * each.height for each in find_peaks(lines)) or constant)
    peak = float(lines.omega[place])
    return constant * (STRUCTURAL_LOSS_FACTOR + STRUCTURAL_LOSS_RISE * float(np.log(max(peak / lines.omega[0], 1.0))))


def active_matrix_share(frf: Frf) -> float:
    """Return the fraction of lines at which some combination of forces gives off power, for responses between the same Dofs.

    The loss matrix :math:`(H^H - H)/2i` of a passive structure has no negative eigenvalue.
    """
    parts = [[band_lines(frf.selected([a], [b])) for b in frf.inputs] for a in frf.outputs]
    if any(part is None for row in parts for part in row):
        return 0.0
    values = np.stack([np.stack([part.receptance for part in row if part], -1) for row in parts], -2)
    noise = np.stack([np.stack([part.noise for part in row if part], -1) for row in parts], -2).max(axis=(1, 2))
    loss = (values.conj().swapaxes(1, 2) - values) / 2j
    smallest = np.linalg.eigvalsh((loss + loss.conj().swapaxes(1, 2)) / 2)[:, 0]
    size = np.abs(values).max(axis=(1, 2))
    is_loud = size > SIGNAL_TO_NOISE * noise
    is_active = -smallest > (np.sin(ACTIVE_ANGLE) * size + ACTIVE_DEVIATIONS * noise)
    return float(np.mean(is_active[is_loud])) if is_loud.any() else 0.0
