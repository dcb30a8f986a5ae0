"""Spindle speed from a spectrum: the comb of orders whose lines stand out most, refined by the frequencies of its lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, count, fail
from toolpoint.signals.orders.line_spectrum import LineSpectrum

HIGHEST_TOOTH_HARMONIC = 24  # harmonics of tooth passing that the comb takes
MAX_LOG_EXCESS = 5.0  # log of power over floor: a stronger line counts no more, so no single line decides
NOISE_LOG_EXCESS = 1.5  # log of power over floor: below, a bin is noise and counts nothing
SPINDLE_WEIGHT = 0.35  # of orders between those of tooth passing, which run-out alone brings
RIVAL_COUNT = 12  # speeds of an unknown spindle that are looked at
RIVAL_DISTANCE = 0.004  # relative: nearer candidates are one
LAG_SHARE = 0.5  # weight of the distances between all lines in the search of an unknown speed


@dataclass(frozen=True)
class SpindleSpeed:
    """A spindle frequency (Hz) with its standard deviation, the score of its comb (standard deviations above chance), and the
    number of tooth-passing harmonics that stand out."""

    frequency: float
    deviation: float
    score: float
    harmonics: int

    @property
    def speed(self) -> float:
        """rev/min."""
        return 60 * self.frequency


def search_speed(spectrum: LineSpectrum, teeth: int, limits: tuple[float, float]) -> tuple[SpindleSpeed, ...]:
    """Search the spindle frequency between two limits; return the best and its rivals, best first.

    Parameters
    ----------
    spectrum : LineSpectrum
    teeth : int
        Teeth of the tool; orders that are multiples of it count most.
    limits : (lower, upper)
        Limits of the spindle frequency, Hz. Where they are an octave apart or more, distances between all lines count too:
        chatter lines are tooth passings apart though none lies on the comb.

    Raises
    ------
    ToolpointError
        Where the limits are not in order or the spectrum ends below one tooth passing.
    """
    teeth = count("teeth", teeth)
    lower, upper = limits
    if not 0 < lower < upper:
        fail("limits", f"{lower:g} and {upper:g} Hz", "must be above zero and in order")
    highest = float(spectrum.frequency[-1])
    if teeth * lower > highest:
        fail("spectrum", f"ends at {highest:.4g} Hz", f"must reach one tooth passing, {teeth * lower:.4g} Hz",
             remedy="record with a higher rate, or check speed and teeth")
    upper = min(upper, highest / teeth)
    log_excess = mark_lines(spectrum)
    step = 0.4 * spectrum.cell / min(highest, HIGHEST_TOOTH_HARMONIC * teeth * upper)
    grid = lower * np.exp(np.arange(0, np.log(upper / lower) + step, step))
    score = score_speeds(log_excess, spectrum.frequency[1], grid, teeth=teeth)
    if upper / lower > 2:
        lag = _lag_scores(log_excess, spectrum.frequency[1], grid * teeth)
        score = score + LAG_SHARE * lag
    return tuple(refine_speed(spectrum, teeth, float(grid[peak]), score=float(score[peak])) for peak in _peaks(grid, score))


def mark_lines(spectrum: LineSpectrum) -> FloatArray:
    """Mark the lines: log of power over floor, without what noise has, limited, each line widened to its neighbours."""
    marks = np.clip(np.log(spectrum.excess) - NOISE_LOG_EXCESS, 0.0, MAX_LOG_EXCESS)
    return np.asarray(np.maximum(marks, np.maximum(np.roll(marks, 1), np.roll(marks, -1))))


def score_speeds(marks: FloatArray, step: float, grid: FloatArray, *, teeth: int) -> FloatArray:
    """Score spindle frequencies: weighted sum of marks on its comb less what chance gives, in standard deviations."""
    mean, deviation = float(marks.mean()), max(float(marks.std()), 1e-12)
    total, weights = np.zeros(grid.size), np.zeros(grid.size)
    for order in range(1, HIGHEST_TOOTH_HARMONIC * teeth + 1):
        weight = 1.0 if order % teeth == 0 else SPINDLE_WEIGHT
        bins = np.rint(order * grid / step).astype(int)
        is_inside = bins < marks.size
        if not is_inside.any():
            break
        total += np.where(is_inside, weight * (marks[np.minimum(bins, marks.size - 1)] - mean), 0.0)
        weights += np.where(is_inside, weight**2, 0.0)
    return np.asarray(total / (deviation * np.sqrt(np.maximum(weights, 1.0))))


def _lag_scores(marks: FloatArray, step: float, lag: FloatArray) -> FloatArray:
    """Correlation of the marks with themselves a tooth-passing frequency further on, in standard deviations of chance."""
    centred = marks - marks.mean()
    transform = np.fft.rfft(centred, 2 * centred.size)
    correlation = np.fft.irfft(np.abs(transform) ** 2)[:centred.size]
    scale = np.sqrt(centred.size) * float(np.var(marks)) + 1e-300
    return np.asarray(np.interp(lag / step, np.arange(centred.size), correlation) / scale)


def _peaks(grid: FloatArray, score: FloatArray) -> list[int]:
    """Return the highest grid points that are a rival's distance apart."""
    peaks: list[int] = []
    left = score.copy()
    while len(peaks) < RIVAL_COUNT and np.isfinite(left).any():
        peak = int(np.argmax(left))
        peaks.append(peak)
        left[np.abs(grid / grid[peak] - 1) < RIVAL_DISTANCE] = -np.inf
        if not np.isfinite(left.max()):
            break
    return peaks


def refine_speed(spectrum: LineSpectrum, teeth: int, frequency: float, *, score: float = 0.0) -> SpindleSpeed:
    """Return the spindle frequency by weighted least squares through the lines of the comb, twice."""
    lines = spectrum.lines()
    deviation, harmonics = 0.5 * spectrum.cell / teeth, 0
    for half_width in (1.5, 1.0):
        order = np.rint(lines.frequency / frequency)
        is_on = (order >= 1) & (np.abs(lines.frequency - order * frequency) < half_width * spectrum.cell) & (
            order <= 4 * HIGHEST_TOOTH_HARMONIC * teeth)
        if not is_on.any():
            break
        k, f = order[is_on], lines.frequency[is_on]
        weight = 1 / np.maximum(lines.deviation[is_on], 0.05 * spectrum.cell) ** 2
        frequency = float(np.sum(weight * k * f) / np.sum(weight * k * k))
        scatter = float(np.sqrt(np.sum(weight * (f - k * frequency) ** 2) / np.sum(weight)))
        deviation = float(max(scatter, 0.05 * spectrum.cell) / np.sqrt(np.mean(k * k) * k.size))
        harmonics = int(np.sum(k % teeth == 0))
    return SpindleSpeed(frequency, deviation, score, harmonics)
