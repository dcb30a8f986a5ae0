"""Spectrum of a record as lines over a noise floor: power of each line, its excess over the floor, its frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail, floats, positive

PADDING_FACTOR = 2  # factor of zero padding: peaks are interpolated between half bins
FLOOR_BLOCK_BINS = 96  # padded bins of a block whose median is the floor: 48 resolution cells
MIN_LINE_EXCESS = 25.0  # of a line over the floor: noise alone passes it once in 1e11 cells
EFFICIENCY_LOSS = 1.3  # of the Hann window: standard deviation of a frequency over the Cramer-Rao bound
MIN_SAMPLES = 64  # samples of a spectrum
HANN_CELLS = 1.5  # equivalent noise bandwidth of the Hann window, resolution cells


@dataclass(frozen=True, eq=False)
class SpectralLines:
    """SpectralLines of a spectrum, strongest first.

    Parameters
    ----------
    frequency : (n,) floats
        Hz.
    power : (n,) floats
        Mean square of each line less the floor, square of the record's unit.
    excess : (n,) floats
        Power over the floor.
    deviation : (n,) floats
        Standard deviation of each frequency, Hz.
    """

    frequency: FloatArray
    power: FloatArray
    excess: FloatArray
    deviation: FloatArray

    def selected(self, choice: BoolArray) -> SpectralLines:
        """Return the chosen lines."""
        return SpectralLines(self.frequency[choice], self.power[choice], self.excess[choice], self.deviation[choice])


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """Spectrum by one Hann window over the whole record.

    Parameters
    ----------
    frequency, power, floor : (n,) floats
        Hz; mean square of a sine at each bin; mean noise power of the same bin, by block medians.
    duration : float
        Length of the record, s: its reciprocal is the resolution cell.
    """

    frequency: FloatArray
    power: FloatArray
    floor: FloatArray
    duration: float

    @property
    def cell(self) -> float:
        """Resolution cell, Hz."""
        return 1 / self.duration

    @property
    def excess(self) -> FloatArray:
        """Power over the floor."""
        return np.asarray(self.power / self.floor)

    @property
    def noise(self) -> float:
        """Mean square of the noise in the band, square of the record's unit."""
        return float(np.sum(self.floor) / PADDING_FACTOR / HANN_CELLS)

    def lines(self, min_excess: float = MIN_LINE_EXCESS) -> SpectralLines:
        """Return the peaks that stand above the floor by a factor, strongest first, with frequencies between bins."""
        p, excess = self.power, self.excess
        peak = np.flatnonzero((p[1:-1] >= p[:-2]) & (p[1:-1] > p[2:]) & (excess[1:-1] > min_excess)) + 1
        peak = peak[_is_no_side_lobe(p, peak)]
        left, centre, right = (np.log(p[peak + step]) for step in (-1, 0, 1))
        curvature = left - 2 * centre + right
        shift = 0.5 * (left - right) / np.where(curvature < 0, curvature, -1.0)
        frequency = self.frequency[peak] + np.clip(shift, -1, 1) * self.frequency[1]
        order = np.argsort(-p[peak])
        deviation = EFFICIENCY_LOSS / (np.pi * self.duration * np.sqrt(excess[peak]))
        lines = SpectralLines(frequency, p[peak] - self.floor[peak], excess[peak], deviation)
        return SpectralLines(lines.frequency[order], lines.power[order], lines.excess[order], lines.deviation[order])

    def highest_near(self, frequency: FloatArray, half_width: float) -> FloatArray:
        """Return the largest power within a half width (Hz) of each frequency, less the floor; zero beyond the band."""
        step = self.frequency[1]
        bins = np.rint(np.asarray(frequency) / step).astype(int)
        reach = np.arange(-max(int(half_width / step), 1), max(int(half_width / step), 1) + 1)
        index = bins[:, None] + reach
        is_inside = (index >= 0) & (index < self.power.size)
        index = np.clip(index, 0, self.power.size - 1)
        return np.asarray(np.where(is_inside, np.maximum(self.power - self.floor, 0)[index], 0.0).max(axis=1))

    def between(self, lower: float, upper: float) -> LineSpectrum:
        """Return the spectrum with power outside a band (Hz) set to the floor, so that no line lies there."""
        is_inside = (self.frequency >= lower) & (self.frequency <= upper)
        return replace(self, power=np.where(is_inside, self.power, self.floor))


def _is_no_side_lobe(power: FloatArray, peak: np.ndarray) -> BoolArray:
    """Whether each peak is more than the side lobes and the skirt that a stronger neighbour leaves (Hann: -31 dB, then 18 dB an
    octave); a truncated or modulated line has a wider skirt, so 26 dB within eight cells are kept free."""
    result = np.ones(peak.size, bool)
    if peak.size == 0:
        return result
    reach = 8 * PADDING_FACTOR
    for k in range(peak.size):
        is_near = np.abs(peak - peak[k]) <= reach
        result[k] = power[peak[k]] > 2.5e-3 * power[peak[is_near]].max()
    return result


def line_spectrum(samples: FloatArray, rate: float, *, highest: float | None = None) -> LineSpectrum:
    """Compute the spectrum of one channel by one Hann window.

    Parameters
    ----------
    samples : (n,) floats
    rate : float
        Samples per second.
    highest : float, optional
        End of the band, Hz; 0.45 of the rate where left out.

    Raises
    ------
    ToolpointError
        For fewer than 64 samples.
    """
    x = floats("samples", samples, (None,))
    rate = positive("rate", rate)
    if x.size < MIN_SAMPLES:
        fail("samples", f"{x.size} samples", f"must be at least {MIN_SAMPLES}")
    window = np.hanning(x.size + 1)[:-1]
    size = PADDING_FACTOR * x.size
    spectrum = np.fft.rfft((x - x.mean()) * window, _fast_size(size))
    frequency = np.fft.rfftfreq(_fast_size(size), 1 / rate)
    power = 2 * np.abs(spectrum / window.sum()) ** 2
    kept = frequency <= (0.45 * rate if highest is None else min(highest, 0.45 * rate))
    tiny = 1e-24 * max(float(power.max()), 1e-280)
    return LineSpectrum(frequency[kept], np.maximum(power[kept], tiny), np.maximum(_floor(power[kept]), tiny),
                        x.size / rate)


def _fast_size(size: int) -> int:
    from scipy.fft import next_fast_len

    return int(next_fast_len(size, real=True))


def _floor(power: FloatArray) -> FloatArray:
    """Mean noise power of each bin: medians of blocks, over ln 2 (power of noise is exponentially distributed), each the least
    of three neighbours' middle so that a dense group of lines does not lift it, joined by straight lines."""
    count = max(power.size // FLOOR_BLOCK_BINS, 1)
    blocks = np.array_split(power, count)
    level = np.array([np.median(block) for block in blocks]) / np.log(2)
    padded = np.concatenate([level[:1], level, level[-1:]])
    smooth = np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)
    centre = np.cumsum([block.size for block in blocks]) - 0.5 * np.array([block.size for block in blocks])
    return np.asarray(np.exp(np.interp(np.arange(power.size), centre, np.log(np.maximum(smooth, 1e-300)))))
