"""Growth of lines over time: power of a set of frequencies in short frames, when it sets in and how fast it grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray

MIN_POWER_FRAME_SECONDS = 0.05
FRAME_CELLS = 4.0  # over the distance to the nearest order: frame in which a Hann window tells both
MAX_FRAME_FRACTION = 0.2  # of the record
ONSET_FRACTION = 0.1  # of the upper level of the power, at which a line has set in
PERSISTENT_FRAMES = 4  # frames in a row above it
MIN_GROWTH_RATIO = 4.0  # of the power from the first frames to the upper level: less is there from the start


@dataclass(frozen=True, eq=False)
class PowerCourse:
    """Power over time: middle of each frame (s), power of the chosen lines and of all else (square of the record's unit)."""

    time: FloatArray
    power: FloatArray
    other_power: FloatArray
    frame: float


@dataclass(frozen=True)
class Onset:
    """Time at which lines set in, s, half a frame as its uncertainty; None where they are there from the first frame;
    growth : of the amplitude, 1/s, NaN where they are there from the start."""

    time: float | None
    uncertainty: float
    growth: float


def follow_power(samples: FloatArray, rate: float, frequencies: FloatArray, *, spacing: float) -> PowerCourse:
    """Return the power of lines in half-overlapping Hann frames.

    Parameters
    ----------
    samples : (n,) floats
    rate : float
        Samples per second.
    frequencies : (n_lines,) floats
        Hz.
    spacing : float
        Distance of the lines to the nearest line that is not theirs, Hz: it sets the length of the frames.
    """
    length = min(max(FRAME_CELLS / max(spacing, 1e-9), MIN_POWER_FRAME_SECONDS), MAX_FRAME_FRACTION * samples.size / rate)
    size = max(int(length * rate), 16)
    window = np.hanning(size + 1)[:-1]
    starts = np.arange(0, max(samples.size - size, 0) + 1, max(size // 2, 1))
    basis = np.exp(-2j * np.pi * np.outer(np.arange(size) / rate, frequencies)) * window[:, None]
    frames = samples[starts[:, None] + np.arange(size)]
    amplitude = 2 * np.abs(frames @ basis) / window.sum()
    power = 0.5 * np.sum(amplitude**2, axis=1)
    total = np.sum((frames * window) ** 2, axis=1) / np.sum(window**2)
    return PowerCourse((starts + size / 2) / rate, power, np.maximum(total - power, 0.0), size / rate)


def find_onset(course: PowerCourse) -> Onset:
    """Return when the power has come to a tenth of its upper level for good, and the growth of the amplitude until then."""
    upper = float(np.quantile(course.power, 0.8))
    above = course.power > ONSET_FRACTION * upper
    runs = np.convolve(above, np.ones(PERSISTENT_FRAMES), mode="valid") >= PERSISTENT_FRAMES
    first = int(np.argmax(runs)) if runs.any() else 0
    early = float(np.median(course.power[:max(first, 1)]))
    if first == 0 or upper < MIN_GROWTH_RATIO * early:
        return Onset(None, 0.5 * course.frame, float("nan"))
    rising = slice(max(first - 3, 0), min(first + 4, course.power.size))
    growth = float("nan")
    if course.time[rising].size >= 3:
        growth = 0.5 * float(np.polyfit(course.time[rising], np.log(np.maximum(course.power[rising], 1e-300)), 1)[0])
    return Onset(float(course.time[first]), 0.5 * course.frame, growth)


def sample_each_turn(samples: FloatArray, rate: float, spindle: float) -> FloatArray:
    """Return a record at one angle of every revolution, at two angles a quarter turn apart, shape (turns, 2).

    A stable cut gives a cluster, Hopf chatter a closed curve, a flip two clusters.
    """
    turns = int(samples.size / rate * spindle) - 1
    index = (np.arange(turns)[:, None] + np.array([0.0, 0.25])) / spindle * rate
    return np.asarray(np.interp(index, np.arange(samples.size), samples))
