"""Largest peaks of a coupled tool, between the measured lines, with their 95 % intervals; and what lines cannot show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import Array, FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.substructuring.receptance import PlaneReceptance

PEAKS = 3
ABOVE = 2.0  # standard deviations by which a peak must rise above its valleys
REGION = 0.5  # share of a peak's height down to which every draw has its peak
BESIDE = 3  # lines beyond that
FEW = 2  # lines within the half-power width of a peak that show its height
POINTS = 201  # between three lines, where a peak is looked for
BETWEEN = 0.05  # of the distance of lines: what a parabola between them may miss of a peak's frequency
WIDE = 30.0  # half-width of the 95 % interval of the largest peak, percent of it, above which the result is doubtful

Interval = tuple[float, float]


@dataclass(frozen=True)
class TipPeak:
    """A peak of the deflection per force: Hz, m/N; `intervals` of both (95 %), None where nothing is known of the uncertainty;
    `lines` within its half-power width; `line` nearest to it."""

    frequency: float
    height: float
    intervals: tuple[Interval, Interval] | None
    lines: int
    line: int


def peaks_of(tip: PlaneReceptance) -> list[TipPeak]:
    """Return the largest peaks that rise above their noise, largest first."""
    size = np.abs(tip.values[:, 0, 0])
    deviation = np.zeros(size.size) if tip.draws is None else np.abs(tip.draws[:, :, 0, 0]).std(axis=0)
    peaks, prominence = find_peaks(size, prominence=0)
    at = peaks[prominence["prominences"] > ABOVE * deviation[peaks]]
    if not at.size:
        at = peaks[np.argsort(-size[peaks])][:1] if peaks.size else np.array([int(np.argmax(size))])
    return [_peak(tip, int(k)) for k in at[np.argsort(-size[at])][:PEAKS]]


def _peak(tip: PlaneReceptance, line: int) -> TipPeak:
    size = np.abs(tip.values[:, 0, 0])
    low, high = line, line
    while low > 0 and size[low - 1] >= REGION * size[line]:
        low -= 1
    while high < size.size - 1 and size[high + 1] >= REGION * size[line]:
        high += 1
    region = np.arange(max(low - BESIDE, 0), min(high + BESIDE, size.size - 1) + 1)
    (frequency,), (height,) = _between_lines(tip.frequency, tip.values[None, :, 0, 0], np.array([line]))
    within = size[region] >= size[line] / np.sqrt(2)
    intervals = None
    if tip.draws is not None:
        drawn = tip.draws[:, :, 0, 0]
        hertz, heights = _between_lines(tip.frequency, drawn, region[np.argmax(np.abs(drawn[:, region]), axis=1)])
        missed = BETWEEN * (tip.frequency[region[-1]] - tip.frequency[region[0]]) / (region.size - 1)
        intervals = _interval(hertz, float(missed)), _interval(heights)
    return TipPeak(float(frequency), float(height), intervals, int(within.sum()), line)


def _interval(values: FloatArray, beside: float = 0.0) -> Interval:
    low, high = np.percentile(values, [2.5, 97.5], method="weibull")
    return float(low) - beside, float(high) + beside


def _between_lines(frequency: FloatArray, values: Array, at: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Return frequency (Hz) and height of a peak of each row of values (n, n_f) near a line (n,).

    About a resonance 1/G is nearly linear in the frequency: a parabola of it goes through three lines.
    """
    k = np.clip(at, 1, frequency.size - 2)
    rows = np.arange(len(values))
    before, middle, after = (1 / values[rows, k + j] for j in (-1, 0, 1))
    x0, x1 = frequency[k - 1] - frequency[k], frequency[k + 1] - frequency[k]
    first, last = (before - middle) / x0, (after - middle) / x1
    curve = (last - first) / (x1 - x0)
    x = x0[:, None] + (x1 - x0)[:, None] * np.linspace(0, 1, POINTS)
    size = np.abs(middle[:, None] + (first - curve * x0)[:, None] * x + curve[:, None] * x**2)
    best = np.argmin(size, axis=1)
    return frequency[k] + x[rows, best], 1 / size[rows, best]


def question_peaks(tip: PlaneReceptance) -> list[Doubt]:
    """Return doubts of the largest peak: known too roughly, too few lines, or cut off by the band."""
    peak, size = peaks_of(tip)[0], np.abs(tip.values[:, 0, 0])
    name = f"largest peak along {tip.plane}"
    doubts = []
    low, high = peak.intervals[1] if peak.intervals is not None else (peak.height, peak.height)
    if (half := 50 * (high - low) / peak.height) > WIDE:
        doubts.append(Doubt(name, f"{peak.frequency:.0f} Hz, is known to ±{half:.0f} %: its tilt is seen too weakly",
                            "use a longer gauge, stations farther apart, less noise", figure=float(half) / 100))
    if peak.lines < FEW:
        step = tip.frequency[min(peak.line + 1, size.size - 1)] - tip.frequency[max(peak.line - 1, 0)]
        doubts.append(Doubt(name, f"{peak.frequency:.0f} Hz, has {peak.lines} lines within its half-power width, "
                            f"{step / 2:.3g} Hz apart: its height may be missed", "measure longer blocks"))
    ends = [(float(tip.frequency[k]), float(size[k])) for k in (0, -1)]
    for f, end in ends:
        if end > peak.height:
            doubts.append(Doubt("band", f"along {tip.plane} the response at its end, {f:.0f} Hz, is {end / peak.height:.2g} "
                                "times the largest peak: a larger one may lie outside", "measure a wider band"))
    return doubts
