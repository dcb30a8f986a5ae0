"""Largest peaks of a coupled tool between the measured lines, with their 95 % intervals, and doubts about their resolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from toolpoint._check import Array, FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.substructuring.receptance import PlaneReceptance

MAX_TIP_PEAKS = 3  # peaks returned
MIN_PROMINENCE_DEVIATIONS = 2.0  # standard deviations by which a peak must rise above its valleys
PEAK_REGION_RATIO = 0.5  # of a peak's height: above, every draw has its peak
REGION_MARGIN_LINES = 3  # lines to each side of that region
MIN_HALF_POWER_LINES = 2  # lines within the half-power width of a peak that show its height
PEAK_SEARCH_POINTS = 201  # between three lines
PARABOLA_ERROR_FRACTION = 0.05  # of the distance of lines: error of a peak's frequency by a parabola
MAX_PEAK_INTERVAL_PERCENT = 30.0  # half-width of the 95 % interval of the largest peak, per cent of it

Interval = tuple[float, float]


@dataclass(frozen=True)
class TipPeak:
    """Peak of the deflection per force: frequency, Hz, and height, m/N.

    intervals : of both (95 %), None where the uncertainty is not known; lines : number within its half-power width; line :
    nearest to it.
    """

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
    chosen = peaks[prominence["prominences"] > MIN_PROMINENCE_DEVIATIONS * deviation[peaks]]
    if not chosen.size:
        chosen = peaks[np.argsort(-size[peaks])][:1] if peaks.size else np.array([int(np.argmax(size))])
    return [_peak(tip, int(k)) for k in chosen[np.argsort(-size[chosen])][:MAX_TIP_PEAKS]]


def _peak(tip: PlaneReceptance, line: int) -> TipPeak:
    size = np.abs(tip.values[:, 0, 0])
    first_line, last_line = line, line
    while first_line > 0 and size[first_line - 1] >= PEAK_REGION_RATIO * size[line]:
        first_line -= 1
    while last_line < size.size - 1 and size[last_line + 1] >= PEAK_REGION_RATIO * size[line]:
        last_line += 1
    region = np.arange(max(first_line - REGION_MARGIN_LINES, 0), min(last_line + REGION_MARGIN_LINES, size.size - 1) + 1)
    (frequency,), (height,) = _between_lines(tip.frequency, tip.values[None, :, 0, 0], np.array([line]))
    within = size[region] >= size[line] / np.sqrt(2)
    intervals = None
    if tip.draws is not None:
        drawn = tip.draws[:, :, 0, 0]
        hertz, heights = _between_lines(tip.frequency, drawn, region[np.argmax(np.abs(drawn[:, region]), axis=1)])
        spacing = (tip.frequency[region[-1]] - tip.frequency[region[0]]) / max(region.size - 1, 1)
        parabola_error = PARABOLA_ERROR_FRACTION * spacing
        intervals = _interval(hertz, float(parabola_error)), _interval(heights)
    return TipPeak(float(frequency), float(height), intervals, int(within.sum()), line)


def _interval(values: FloatArray, margin: float = 0.0) -> Interval:
    # Weibull's plotting positions: of few draws the plain percentiles lie inside the interval that they stand for.
    lower, upper = np.percentile(values, [2.5, 97.5], method="weibull")
    return float(lower) - margin, float(upper) + margin


def _between_lines(frequency: FloatArray, values: Array, lines: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Return frequency (Hz) and height of a peak of each row of values (n, n_f) near a line (n,).

    About a resonance 1/G is nearly linear in the frequency: a parabola of it goes through three lines. Where there are fewer,
    or one of them is zero, the peak is the line itself.
    """
    height = np.abs(values[np.arange(len(values)), lines])
    hertz = np.broadcast_to(frequency[lines], height.shape).astype(float)
    if frequency.size < 3:
        return hertz, height
    neighbours = np.clip(lines, 1, frequency.size - 2)[:, None] + np.array([-1, 0, 1])
    has_parabola = (values[np.arange(len(values))[:, None], neighbours] != 0).all(axis=1)
    if has_parabola.any():
        fitted = _parabola_peaks(frequency, values[has_parabola], np.broadcast_to(lines, height.shape)[has_parabola])
        hertz[has_parabola], height[has_parabola] = fitted
    return hertz, height


def _parabola_peaks(frequency: FloatArray, values: Array, lines: IndexArray) -> tuple[FloatArray, FloatArray]:
    """Return frequency (Hz) and height of the peaks of parabolas of 1/G through three lines each, none of them zero."""
    k = np.clip(lines, 1, frequency.size - 2)
    rows = np.arange(len(values))
    left, centre, right = (1 / values[rows, k + j] for j in (-1, 0, 1))
    x0, x1 = frequency[k - 1] - frequency[k], frequency[k + 1] - frequency[k]
    first, last = (left - centre) / x0, (right - centre) / x1
    curve = (last - first) / (x1 - x0)
    x = x0[:, None] + (x1 - x0)[:, None] * np.linspace(0, 1, PEAK_SEARCH_POINTS)
    size = np.abs(centre[:, None] + (first - curve * x0)[:, None] * x + curve[:, None] * x**2)
    best = np.argmin(size, axis=1)
    return frequency[k] + x[rows, best], 1 / size[rows, best]


def question_peaks(tip: PlaneReceptance) -> list[Doubt]:
    """Return doubts of the largest peak: known too roughly, too few lines, or cut off by the band."""
    peak, size = peaks_of(tip)[0], np.abs(tip.values[:, 0, 0])
    name = f"largest peak along {tip.plane}"
    doubts = []
    lower, upper = peak.intervals[1] if peak.intervals is not None else (peak.height, peak.height)
    if peak.height == 0:
        return [Doubt(name, "is zero: nothing yields there", "check the responses and their unit", grave=True)]
    if (half_width := 50 * (upper - lower) / peak.height) > MAX_PEAK_INTERVAL_PERCENT:
        doubts.append(Doubt(name, f"{peak.frequency:.0f} Hz, is known to ±{half_width:.0f} %: its tilt is seen too weakly",
                            "use a longer gauge, stations farther apart, less noise", figure=float(half_width) / 100))
    if peak.lines < MIN_HALF_POWER_LINES:
        step = tip.frequency[min(peak.line + 1, size.size - 1)] - tip.frequency[max(peak.line - 1, 0)]
        doubts.append(Doubt(name, f"{peak.frequency:.0f} Hz, has {peak.lines} lines within its half-power width, "
                            f"{step / 2:.3g} Hz apart: its height may be missed", "measure longer blocks"))
    ends = [(float(tip.frequency[k]), float(size[k])) for k in (0, -1)]
    for f, end in ends:
        if end > peak.height:
            doubts.append(Doubt("band", f"along {tip.plane} the response at its end, {f:.0f} Hz, is {end / peak.height:.2g} "
                                "times the largest peak: a larger one may lie outside", "measure a wider band"))
    return doubts
