r"""Harmonics of rotating parts in records: found as lines of constant amplitude, and removed before modes are sought.

A mode under random loads has the envelope of a narrow-band Gaussian process, a harmonic a constant one, also where its speed
wanders. So a line that stands out of its neighbours is judged by the kurtosis of its envelope a(t),

.. math:: \kappa = \frac{\langle |a|^4 \rangle}{\langle |a|^2 \rangle^2},

1 for a harmonic and 2 for a Gaussian process (the envelope's form of 1.5 against 3 for the samples themselves: Jacobsen,
Andersen, Brincker, IMAC 25 (2007)). Its phase is tracked in the direction of the channels that shows it best, and a cosine
and a sine of that phase are taken off every channel by least squares: a constant amplitude, so the response of modes under
the line stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft
from scipy.ndimage import uniform_filter1d

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._notebook import NotebookText

SMOOTHING_LINES = (1, 5, 25)  # spectra are searched at these resolutions: steady lines first, then lines whose speed wanders
BACKGROUND_WIDTHS = 20  # half width of the running median, in smoothing widths
FALSE_ALARM_RATE = 1e-6  # of a record without harmonics, for the narrowest lines
WIDE_LINE_RATIO = 8.0  # of smoothed power over the background, beyond which the envelope is judged
# Kurtosis of a Gaussian envelope falls with the number of lines: these bounds lie below its 0.1 % quantile (simulated for bands
# shaped by a mode, 4 .. 160 lines: 1.02, 1.06, 1.12, 1.20, 1.30, 1.42, 1.54, 1.66).
ENVELOPE_LINES = (8.0, 12.0, 20.0, 40.0, 80.0, 160.0)
MAX_ENVELOPE_KURTOSIS = (1.12, 1.18, 1.25, 1.35, 1.45, 1.5)
NARROW_LINES = 8  # up to so many, the envelope cannot tell: a line is a harmonic where a mode would be wider
LIGHTEST_DAMPING = 5e-4  # ratio of the lightest mode that is believed to be one; lighter ones are taken for harmonics
MAX_TRACK_WIDENINGS = 6  # doublings
MAX_SKIRT_RATIO = 2.5  # of lines beside the band of a track over lines farther out
MAX_FREQUENCY_ROUNDS = 4
FREQUENCY_TOLERANCE_LINES = 0.02  # of the last correction
ORDER_TOLERANCE_LINES = 1.5  # between a harmonic and an integer multiple of the rotating frequency
MAX_HARMONIC_ORDER = 40


@dataclass(frozen=True)
class Harmonic(NotebookText):
    """A line of constant amplitude.

    Parameters
    ----------
    frequency : float
        Mean over the record, Hz.
    wander : float
        Rms of its frequency over the mean.
    power_share : float
        Of the power of the channel where it is strongest.
    kurtosis : float
        Of its envelope: 1 for a constant amplitude, 2 for a Gaussian process.
    is_removed : bool
        False where a very light mode would look the same in a record so short: it is then left in the record.
    order : int, optional
        Multiple of the lowest rotating frequency that explains at least two lines.

    >>> line = Harmonic(50.0, wander=1e-4, power_share=0.2, kurtosis=1.01, is_removed=True, order=1)
    >>> line.kurtosis < MAX_ENVELOPE_KURTOSIS[0]  # a constant amplitude, so no mode
    True
    """

    frequency: float
    wander: float
    power_share: float
    kurtosis: float
    is_removed: bool = True
    order: int | None = None

    def __repr__(self) -> str:
        kind = "harmonic" if self.is_removed else "narrow line"
        return f"Harmonic({kind} at {self.frequency:.5g} Hz, envelope kurtosis {self.kurtosis:.3f})"


def remove_harmonics(samples: FloatArray, rate: float) -> tuple[FloatArray, tuple[Harmonic, ...]]:
    """Return the record (n_samples, n_channels), without its mean, less its harmonics, and these, lowest first."""
    # Transforms of a length with large prime factors take several times as long; at most one sample in a thousand goes.
    cleaned = samples[:_fast_length(samples.shape[0])]
    cleaned = cleaned - cleaned.mean(axis=0)
    found: list[Harmonic] = []
    for width in SMOOTHING_LINES:
        ratio, background = _line_ratio(cleaned, width)
        for lines in _candidates(ratio, width, cleaned.shape[0]):
            harmonic, remainder = _take_off(cleaned, rate, lines, background)
            if harmonic is None:
                continue
            found.append(harmonic)
            if harmonic.is_removed:
                cleaned = remainder
    return cleaned, tuple(_merge(found, rate / samples.shape[0]))


def _fast_length(count: int) -> int:
    """Return the largest length up to `count` whose transforms are fast."""
    return next(length for length in range(count, 0, -1) if fft.next_fast_len(length, real=True) == length)


def number_orders(harmonics: tuple[Harmonic, ...], resolution: float) -> tuple[Harmonic, ...]:
    """Return the harmonics with their order over the largest rotating frequency that makes at least two of them multiples.

    resolution : Hz, of a line of the record.
    """
    best: tuple[int, float, list[int | None]] = (1, 0.0, [None] * len(harmonics))
    frequencies = np.array([h.frequency for h in harmonics])
    for first in frequencies:
        for division in range(1, MAX_HARMONIC_ORDER // 4):
            base = first / division
            orders = np.rint(frequencies / base)
            fits = (np.abs(frequencies - orders * base) < ORDER_TOLERANCE_LINES * resolution * np.maximum(1, orders / division))
            fits &= (orders >= 1) & (orders <= MAX_HARMONIC_ORDER)
            # Most lines first, then the largest base: every divisor of a right base explains the same lines.
            if (int(fits.sum()), base) > best[:2] and fits.sum() > 1:
                best = (int(fits.sum()), float(base), [int(k) if ok else None for k, ok in zip(orders, fits, strict=True)])
    return tuple(replace(h, order=k) for h, k in zip(harmonics, best[2], strict=True))


def _line_ratio(samples: FloatArray, width: int) -> tuple[FloatArray, FloatArray]:
    """Return power over its local background, mean of the channels (n_lines,), and the background (n_lines, n_channels)."""
    window = np.hanning(samples.shape[0])[:, None]
    power = np.abs(fft.rfft(samples * window, axis=0)) ** 2
    smooth = uniform_filter1d(power, width, axis=0, mode="nearest")
    # One line in `width` carries all that the smoothed power knows; medians at every `BACKGROUND_WIDTHS`-th of them are
    # spread over the lines between: a running median is ten times as slow and differs by less than the threshold needs.
    coarse = np.pad(smooth[::width], ((BACKGROUND_WIDTHS, 2 * BACKGROUND_WIDTHS), (0, 0)), mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(coarse, 2 * BACKGROUND_WIDTHS + 1, axis=0)[::BACKGROUND_WIDTHS]
    medians = np.median(windows, axis=-1)
    median_index = (np.arange(power.shape[0]) // width + BACKGROUND_WIDTHS // 2) // BACKGROUND_WIDTHS
    background = medians[np.minimum(median_index, medians.shape[0] - 1)]
    # The median of exponential power is ln 2 of its mean; of a mean of several lines nearly the mean.
    floor = max(1e-30 * power.max(initial=0.0), float(np.finfo(float).tiny))
    background = np.maximum(background / (np.log(2) if width == 1 else 1.0), floor)
    return (smooth / background).mean(axis=1), background


def _candidates(ratio: FloatArray, width: int, samples: int) -> list[np.ndarray]:
    """Return the runs of lines that stand out, strongest first, as arrays of line numbers."""
    # Power of one line of noise is exponential: the largest of n lines exceeds ln(n/p) with probability p. Half more is for
    # windows, which correlate neighbours.
    threshold = 1.5 * np.log(samples / 2 / FALSE_ALARM_RATE) if width == 1 else WIDE_LINE_RATIO
    lines = np.flatnonzero(ratio > threshold)
    lines = lines[lines > 2 * width]
    if lines.size == 0:
        return []
    runs = np.split(lines, np.flatnonzero(np.diff(lines) > 2 * width + 2) + 1)
    return sorted(runs, key=lambda run: -float(ratio[run].max()))


@dataclass(frozen=True, eq=False)
class _Track:
    """Complex envelope of a line about its mean frequency (Hz), at the rate of the record, and the lines of its band."""

    frequency: float
    envelope: ComplexArray
    lines: int

    @property
    def kurtosis(self) -> float:
        power = np.abs(self.envelope) ** 2
        return float((power**2).mean() / power.mean() ** 2)


def _take_off(samples: FloatArray, rate: float, lines: np.ndarray, background: FloatArray) -> tuple[Harmonic | None,
                                                                                                    FloatArray]:
    """Return the harmonic at a run of lines, None where its envelope is that of a mode, and the record without it.

    The band of the track is the narrowest that leaves no skirts beside it: a wider one also takes the motion of a mode below
    the line that is in quadrature to it.
    """
    half = int((lines[-1] - lines[0] + 1) / 2 + 2)
    centre = round(float(lines.mean()))
    weight = 1 / np.sqrt(background[centre])
    best: tuple[Harmonic | None, FloatArray] = (None, samples)
    spectrum = fft.rfft(samples, axis=0) * weight
    for _ in range(MAX_TRACK_WIDENINGS):
        track = _track(samples * weight, spectrum, rate, centre, half=half)
        harmonic, remainder = _judge(samples, track, rate, lines)
        if harmonic is None:
            return best
        best = harmonic, remainder
        if _skirt_ratio(remainder, centre, half) < MAX_SKIRT_RATIO:
            break
        half *= 2
    return best


def _skirt_ratio(remainder: FloatArray, centre: int, half: int) -> float:
    """Return the power of the lines beside a band over that of lines farther out, mean of the channels."""
    power = np.abs(fft.rfft(remainder * np.hanning(remainder.shape[0])[:, None], axis=0)) ** 2

    def mean_power(first: int, last: int) -> FloatArray:
        offsets = np.arange(first, last)
        lines = np.concatenate([centre - offsets, centre + offsets])
        return np.asarray(power[lines[(lines > 0) & (lines < power.shape[0])]].mean(axis=0))

    return float((mean_power(half + 1, 2 * half + 3) / np.maximum(mean_power(3 * half + 3, 6 * half + 9), 1e-300)).mean())


def _track(weighted: FloatArray, spectrum: ComplexArray, rate: float, centre: int, *, half: int) -> _Track:
    """Return the envelope of the line in the combination of weighted channels where it stands out most.

    The record is mixed down by the line's own mean frequency, found in rounds, so that a steady line becomes a constant and the
    ends of the record meet; a band about zero is then its envelope.
    """
    count = weighted.shape[0]
    frequency = centre * rate / count
    signal = weighted @ _strongest_direction(spectrum, centre, half)
    cycles = np.arange(count) / rate
    for _ in range(MAX_FREQUENCY_ROUNDS):
        mixed = fft.fft(signal * np.exp(-2j * np.pi * frequency * cycles))
        mixed[half + 1:-half] = 0.0
        envelope = fft.ifft(mixed)
        # The mean turn from sample to sample, weighted by power: phases of single samples wrap where the envelope is small.
        step = float(np.angle(np.vdot(envelope[:-1], envelope[1:]))) * rate / (2 * np.pi)
        if abs(step) < FREQUENCY_TOLERANCE_LINES * rate / count:
            break
        frequency += step
    return _Track(frequency, envelope, 2 * half + 1)


def _strongest_direction(spectrum: ComplexArray, centre: int, half: int) -> ComplexArray:
    """Return the first principal direction of the channels over the lines within `half` of a line, (n_channels,)."""
    lines = slice(max(1, centre - half), centre + half + 1)
    return np.asarray(np.linalg.svd(spectrum[lines], full_matrices=False)[2][0].conj())


def _judge(samples: FloatArray, track: _Track, rate: float, lines: np.ndarray) -> tuple[Harmonic | None, FloatArray]:
    """Return the harmonic of a track, None where its envelope is that of a mode, and the record without it."""
    count = samples.shape[0]
    kurtosis, bound = track.kurtosis, float(np.interp(track.lines, ENVELOPE_LINES, MAX_ENVELOPE_KURTOSIS))
    is_narrow = lines.size <= NARROW_LINES
    lightest_width = 2 * LIGHTEST_DAMPING * track.frequency * count / rate
    if kurtosis > bound:
        return None, samples
    phase = np.unwrap(np.angle(track.envelope))
    wander = float(np.std(np.diff(phase))) * rate / (2 * np.pi) / track.frequency
    angle = 2 * np.pi * track.frequency * np.arange(count) / rate + phase
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # The measured phase with a constant amplitude: what varies in amplitude is the response of modes, and stays.
    coefficients = np.linalg.lstsq(waves, samples, rcond=None)[0]
    power = (coefficients**2).sum(axis=0) / 2
    share = float((power / np.maximum((samples**2).mean(axis=0), 1e-300)).max())
    is_certain = not is_narrow or lightest_width > 1.0
    return Harmonic(track.frequency, wander, min(share, 1.0), kurtosis, is_certain), samples - waves @ coefficients


def _merge(found: list[Harmonic], resolution: float) -> list[Harmonic]:
    """Return the harmonics, remainders of one that was removed in two steps joined to it."""
    result: list[Harmonic] = []
    for harmonic in sorted(found, key=lambda h: -h.power_share):
        # Two tracks of one wandering line end at frequencies that differ by its wander.
        width = max(4 * resolution, 3 * harmonic.wander * harmonic.frequency)
        if all(abs(harmonic.frequency - other.frequency) > width for other in result):
            result.append(harmonic)
    return sorted(result, key=lambda h: h.frequency)
