r"""Whether a measured driving point is one of a passive structure: power, phase at its peaks, and what lies outside its band.

A driving point takes in power at every line: the real part of its mobility is not negative. Where single lines cannot tell (a
turned phase hides in damping), peaks do: the residue of a mode that vibrates in phase lies at -90 degrees, so a delay
:math:`\tau` shows as :math:`-\omega_k \tau` at every peak. The real part of a causal response follows from its imaginary part
(Kramers and Kronig), up to the compliance of what vibrates above the band and the mobility of what vibrates below it.
Source: Ewins, Modal Testing, 2nd ed., sections 3.9, 4.3 and 4.4; Maclaurin's formula: Ohta, Ishida, Appl. Spectrosc. 42
(1988) 952.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray, IndexArray
from toolpoint.vibration.frf import Frf

MIN_LINES = 24  # lines of a band below which nothing is judged
SIGNAL_TO_NOISE = 5.0  # of a line that is judged
STANDARD_DEVIATIONS = 3.0  # of noise by which the power of a line must be negative
ANGLE = np.radians(1.5)  # by which the phase of a line must be outside what is passive
NOISE_WINDOW = 48  # lines over which noise is taken as one
MIN_PEAK = 0.1  # over the largest peak of the receptance: smaller ones tell no phase
WINDOW_WIDTHS = 1.25  # half-power widths to each side of a peak within which it is fitted
MAX_FIT_MISFIT = 0.05  # of a peak's fit: beyond it, neighbours or noise decide its phase
MIN_LOW_LINES = 16  # over which what vibrates below the band is looked for, at least
LOW_END = (1.05, 1.6)  # over the lowest line, where what vibrates below the band is looked for
# Over the loss at the lowest lines: what structural damping shows of modes below the band, and more of it for every e-fold of
# frequency from there to the largest peak: 95 of 100 of random structures with structural damping show less.
STRUCTURAL_LOSS_FACTOR, STRUCTURAL_LOSS_RISE = 0.8, 1.4
EVALUATED_LINES = 160  # at which the real part is computed from the imaginary one


@dataclass(frozen=True, eq=False)
class BandLines:
    """Lines of one driving point in the band that can be believed: rad/s, receptance (m/N), standard deviation of its noise."""

    omega: FloatArray
    receptance: ComplexArray
    noise: FloatArray

    @property
    def is_loud(self) -> BoolArray:
        """Which lines stand out of the noise."""
        return np.asarray(np.abs(self.receptance) > SIGNAL_TO_NOISE * self.noise)

    def turned(self, factor: ComplexArray | complex) -> BandLines:
        """Return the lines times a factor."""
        return BandLines(self.omega, self.receptance * factor, self.noise * np.abs(factor))

    def conjugated(self) -> BandLines:
        """Return the lines with the opposite time factor."""
        return BandLines(self.omega, self.receptance.conj(), self.noise)


@dataclass(frozen=True)
class ResonancePeak:
    """A peak of the receptance: frequency (Hz), damping ratio, height (m/N), phase of the residue less that of a mode in phase
    (rad), its standard deviation."""

    frequency: float
    damping: float
    height: float
    phase: float
    deviation: float


@dataclass(frozen=True)
class Outside:
    """What a band leaves out: compliance of what vibrates above it (m/N), and of what vibrates below it, at the lowest line
    (m/N); misfit : of the real part that follows from the imaginary one, as a share of it."""

    above: float
    below: float
    misfit: float


def band_lines(frf: Frf) -> BandLines | None:
    """Return the lines of a single response as receptance; None where they are too few to be judged."""
    inside = frf.between(float(np.nextafter(0, 1)), float(frf.frequency[-1]))
    if inside.frequency.size < MIN_LINES:
        return None
    power = {"receptance": 0, "mobility": 1, "accelerance": 2}[frf.quantity]
    factor = (1j * inside.omega) ** power
    values: ComplexArray = np.asarray(inside.values[:, 0, 0] / factor, complex)
    noise = line_scatter(np.asarray(values * inside.omega**2, complex)) / inside.omega**2
    if inside.variance is not None:
        noise = np.maximum(noise, np.sqrt(inside.variance[:, 0, 0]) / np.abs(factor))
    return BandLines(inside.omega, values, noise)


def line_scatter(values: ComplexArray) -> FloatArray:
    """Return the standard deviation of lines by the scatter of their neighbours, the median within windows of lines."""
    third = np.abs(np.diff(values, 3)) ** 2 / 20
    size = min(NOISE_WINDOW, third.size)
    starts = np.arange(0, third.size - size + 1, size)
    level = np.array([np.sqrt(np.median(third[start:start + size]) / np.log(2)) for start in starts])
    return np.interp(np.arange(values.size), starts + 1.5 + size / 2, level)


def active_share(lines: BandLines) -> float:
    """Return the share of loud lines that give off power beyond noise; 0 where no line is loud."""
    loud = lines.is_loud
    if not loud.any():
        return 0.0
    values, noise = lines.receptance[loud], lines.noise[loud]
    size = np.abs(values)
    beyond = np.arcsin(np.clip(values.imag / size, -1, 1))
    return float(np.mean(beyond > ANGLE + STANDARD_DEVIATIONS * noise / size))


def find_peaks(lines: BandLines) -> list[ResonancePeak]:
    """Return the peaks of the receptance whose phase is clear, largest first."""
    values, omega = lines.receptance, lines.omega
    size = np.abs(values) * omega
    peaks: list[ResonancePeak] = []
    for k in _maxima(size):
        near, width = _near(size, omega, int(k))
        if near.sum() < 7 or width <= 0:
            continue
        peak = _fitted(values[near], omega[near], float(omega[k]), width)
        if peak is not None and abs(2 * np.pi * peak.frequency - omega[k]) < width:
            peaks.append(peak)
    if not peaks:
        return []
    highest = max(float(np.abs(values).max()), max(peak.height for peak in peaks))
    return sorted((peak for peak in peaks if peak.height > MIN_PEAK * highest), key=lambda peak: -peak.height)


def _maxima(size: FloatArray) -> IndexArray:
    smooth = size if size.size < 64 else np.convolve(np.pad(size, 2, mode="edge"), np.ones(5) / 5, "valid")
    inner = np.flatnonzero((smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:])) + 1
    kept: list[int] = []
    for k in inner[np.argsort(-smooth[inner])].tolist():
        low, high = _half_power(smooth, k)
        if smooth[k] > 0.02 * smooth.max() and not any(low <= other <= high for other in kept):
            kept.append(k)
        if len(kept) == 12:
            break
    return np.array(kept, int)


def _half_power(size: FloatArray, k: int) -> tuple[int, int]:
    below = np.flatnonzero(size[:k] < size[k] / np.sqrt(2))
    above = np.flatnonzero(size[k:] < size[k] / np.sqrt(2))
    return (int(below[-1]) if below.size else 0), (k + int(above[0]) if above.size else size.size - 1)


def _near(size: FloatArray, omega: FloatArray, k: int) -> tuple[BoolArray, float]:
    low, high = _half_power(size, k)
    # The narrower side is that of the mode alone; a neighbour widens the other.
    width = 2 * float(min(omega[k] - omega[low], omega[high] - omega[k]))
    width = max(width, 4 * float(omega[min(k + 1, omega.size - 1)] - omega[k]))
    return np.abs(omega - omega[k]) <= WINDOW_WIDTHS * width, width


def _fitted(values: ComplexArray, omega: FloatArray, centre: float, width: float) -> ResonancePeak | None:
    """Return the mode of a peak: :math:`(x - p) H` is a polynomial in x = (omega - centre)/width where others are smooth."""
    x = (omega - centre) / width
    weight = np.ones(x.size)
    for _ in range(5):
        matrix = np.stack([values, np.ones(x.size), x, x * x], axis=1) * weight[:, None]
        solution = np.linalg.lstsq(matrix, x * values * weight, rcond=None)[0]
        pole = complex(solution[0])
        weight = 1 / np.maximum(np.abs(x - pole), 1e-6)
    left = matrix @ solution - x * values * weight
    misfit = float(np.linalg.norm(left) / max(float(np.linalg.norm(values)), 1e-300))
    s = centre + width * pole
    if misfit > MAX_FIT_MISFIT or pole.imag <= 0 or s.real <= 0:
        return None
    residue = complex(solution[1] + solution[2] * pole + solution[3] * pole**2)
    gradient = np.array([solution[2] + 2 * solution[3] * pole, 1, pole, pole**2])
    spread = np.linalg.pinv(matrix.conj().T @ matrix) * (np.abs(left) ** 2).sum() / max(x.size - 4, 1)
    deviation = np.sqrt(abs(gradient.conj() @ spread @ gradient)) / max(abs(residue), 1e-300)
    # H = a/(w0^2 - w^2 + 2 i zeta w0 w) has the residue -a/(2 w_d) at its pole in omega: a real negative number.
    return ResonancePeak(abs(s) / (2 * np.pi), s.imag / abs(s), abs(residue) / pole.imag, float(np.angle(-residue)),
                         float(deviation))


def look_outside(lines: BandLines) -> Outside:
    """Return what the band leaves out, from the real part that its imaginary part does not explain."""
    omega, values = lines.omega, lines.receptance
    step = float(np.median(np.diff(omega)))
    even = np.arange(omega[0], omega[-1], step)
    loss, real = -np.interp(even, omega, values.imag), np.interp(even, omega, values.real)
    size = np.abs(np.interp(even, omega, np.abs(values)))
    spread = np.linspace(3, even.size - 4, EVALUATED_LINES)
    last = max(LOW_END[1] * omega[0], omega[0] + MIN_LOW_LINES * step)
    start = np.searchsorted(even, np.linspace(LOW_END[0] * omega[0], last, EVALUATED_LINES // 4))
    places = np.unique(np.append(spread, start[start < even.size - 4]).astype(int))
    follows = np.empty(places.size)
    for row, k in enumerate(places.tolist()):
        other = np.arange((k + 1) % 2, even.size, 2)  # Maclaurin: every second line, the pole in the middle between two
        follows[row] = 4 / np.pi * step * float(np.sum(even[other] * loss[other] / (even[other] ** 2 - even[k] ** 2)))
    w = even[places]
    rest = real[places] - follows
    weight = 1 / (size[places] + 0.02 * float(size.max()))
    columns = np.stack([np.ones(w.size), -(omega[0] / w) ** 2], axis=1)
    above, below = np.linalg.lstsq(columns * weight[:, None], rest * weight, rcond=None)[0]
    # What vibrates below the band shows at its low end, where the integral sees least of other errors.
    near = (w >= LOW_END[0] * omega[0]) & (w <= last)
    scaled = (w[near] / omega[0]) ** 2
    below = float(np.median((above - rest[near]) * scaled))
    if below < STANDARD_DEVIATIONS * float(np.median(np.interp(w[near], omega, lines.noise) * scaled)):
        below = min(below, 0.0)
    if below > 0:
        below = max(below - _structural_shortfall(lines), 0.0)
    left = (rest - columns @ np.array([above, below])) * weight
    return Outside(float(above), float(below), float(np.linalg.norm(left) / np.linalg.norm(real[places] * weight)))


def _structural_shortfall(lines: BandLines) -> float:
    r"""Return what the real part at the lowest lines lacks of the one that follows from the imaginary part, m/N, by structural
    damping.

    Such damping loses nearly as much at low lines as at high ones, and no causal response does: Kramers and Kronig turn a loss
    L that is constant from w up to a resonance into :math:`(2/\pi) L \ln(\omega_r/w)`, which the response does not have.
    """
    constant = max(float(np.median(-lines.receptance.imag[:MIN_LOW_LINES])), 0.0)
    peak = float(lines.omega[np.argmax(np.abs(lines.receptance))])
    return constant * (STRUCTURAL_LOSS_FACTOR + STRUCTURAL_LOSS_RISE * float(np.log(max(peak / lines.omega[0], 1.0))))


def active_matrix_share(frf: Frf) -> float:
    """Return the share of lines at which some mix of forces gives off power, of responses between the same Dofs: the loss
    matrix :math:`(H^H - H)/2i` of a passive structure has no negative eigenvalue."""
    parts = [[band_lines(frf.selected([a], [b])) for b in frf.inputs] for a in frf.outputs]
    if any(part is None for row in parts for part in row):
        return 0.0
    values = np.stack([np.stack([part.receptance for part in row if part], -1) for row in parts], -2)
    noise = np.stack([np.stack([part.noise for part in row if part], -1) for row in parts], -2).max(axis=(1, 2))
    loss = (values.conj().swapaxes(1, 2) - values) / 2j
    power = np.linalg.eigvalsh((loss + loss.conj().swapaxes(1, 2)) / 2)[:, 0]
    size = np.abs(values).max(axis=(1, 2))
    loud = size > SIGNAL_TO_NOISE * noise
    beyond = -power > (np.sin(ANGLE) * size + STANDARD_DEVIATIONS * noise)
    return float(np.mean(beyond[loud])) if loud.any() else 0.0
