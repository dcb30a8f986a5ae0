"""Order tracking: the spindle speed over time from short spectra, and the record at equal steps of angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.signals.orders.line_spectrum import line_spectrum
from toolpoint.signals.orders.spindle_comb import mark_lines, score_speeds

MIN_SPEED_FRAME_SECONDS = 0.25  # lines are then 4 Hz wide: of 200 Hz and more the comb still follows a percent of the speed
MIN_FRAME_TURNS = 16  # revolutions of a frame
SEARCH_RANGE = 0.012  # relative: speeds of a frame on both sides of the mean speed
MIN_FRAME_COUNT = 5
MAX_DEGREE = 3  # of the polynomial in time
MIN_SCORE = 3.0  # standard deviations: a frame whose comb stands out less tells no speed
KNEE_SCATTERS = 4.0  # deviations from the polynomial beyond which a frame is left out


@dataclass(frozen=True, eq=False)
class SpeedCourse:
    """Spindle frequency over time: Hz at the samples of a record, and its largest deviation from the mean, relative."""

    frequency: FloatArray
    variation: float


def track_speed(samples: FloatArray, rate: float, frequency: float, *, teeth: int) -> SpeedCourse:
    """Track the spindle frequency about a known mean; constant where the record is too short or the combs do not stand out.

    Parameters
    ----------
    samples : (n,) floats
    rate : float
        Samples per second.
    frequency : float
        Mean spindle frequency, Hz.
    teeth : int

    Returns
    -------
    SpeedCourse
        A polynomial of time through the speeds of half-overlapping frames.
    """
    size = int(max(MIN_SPEED_FRAME_SECONDS, MIN_FRAME_TURNS / frequency) * rate)
    starts = np.arange(0, samples.size - size + 1, size // 2)
    constant = SpeedCourse(np.full(samples.size, frequency), 0.0)
    if starts.size < MIN_FRAME_COUNT:
        return constant
    times, values, weights = [], [], []
    grid = frequency * (1 + np.linspace(-SEARCH_RANGE, SEARCH_RANGE, 97))
    for start in starts:
        spectrum = line_spectrum(samples[start:start + size], rate)
        score = score_speeds(mark_lines(spectrum), float(spectrum.frequency[1]), grid, teeth=teeth)
        is_top = score > score.max() - 0.5
        if score.max() > MIN_SCORE:
            times.append((start + size / 2) / rate)
            values.append(float(np.mean(grid[is_top])))
            weights.append(float(score.max()))
    if len(times) < MIN_FRAME_COUNT:
        return constant
    return _fit(np.array(times), np.array(values), np.array(weights), np.arange(samples.size) / rate, frequency)


def _fit(time: FloatArray, value: FloatArray, weight: FloatArray, sample_time: FloatArray, frequency: float) -> SpeedCourse:
    """Return the polynomial through the frames, those far off left out once; constant where it explains no more than chance."""
    degree = min(MAX_DEGREE, time.size // 3)
    kept = np.ones(time.size, bool)
    for _ in range(2):
        shape = np.polynomial.Polynomial.fit(time[kept], value[kept], degree, w=weight[kept])
        residual = value - shape(time)
        scatter = 1.48 * float(np.median(np.abs(residual[kept]))) + 1e-6 * frequency
        kept = np.abs(residual) < KNEE_SCATTERS * scatter
        if kept.sum() <= degree + 2:
            return SpeedCourse(np.full(sample_time.size, frequency), 0.0)
    course = shape(np.clip(sample_time, time[0], time[-1]))
    spread = float(np.std(shape(time[kept])))
    if spread < 2 * scatter / np.sqrt(max(kept.sum() - degree - 1, 1)) or not np.isfinite(course).all():
        return SpeedCourse(np.full(sample_time.size, frequency), 0.0)
    course = course * (frequency / course.mean())
    return SpeedCourse(course, float(np.abs(course / frequency - 1).max()))


def resample_by_angle(samples: FloatArray, rate: float, course: SpeedCourse) -> FloatArray:
    """Return the record at equal steps of angle, as many as it had: its lines are those of a spindle at the mean speed.

    Cubic interpolation on a four times finer grid would cost more than it gives: the record is oversampled by the caller.
    """
    from scipy.interpolate import CubicSpline

    if course.variation == 0:
        return samples
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (course.frequency[1:] + course.frequency[:-1]) / rate)])
    even_turns = np.linspace(0, turns[-1], samples.size)
    time = np.interp(even_turns, turns, np.arange(samples.size, dtype=float))
    return np.asarray(CubicSpline(np.arange(samples.size), samples)(time))
