"""Runs of constant speed in a record: means of load and following error, with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects, label, maximum_filter1d, minimum_filter1d, uniform_filter1d

from toolpoint._check import FloatArray

MIN_RUN_DURATION = 0.1  # s of a run of constant speed
_MAX_SPEED_CHANGE, _MAX_OWN_SPEED_CHANGE = 0.005, 0.1  # within a run: of the largest speed, and of its own
_SETTLING_FRACTION = 0.3  # of a run: its first part, left out while the axis settles
# Equal parts of a run whose means give the error of its mean: samples of a filtered record are not independent.
BATCH_COUNT = 8


@dataclass(frozen=True, eq=False)
class ConstantRuns:
    """Runs of constant speed of an axis, (n_runs,) each, not-a-number where there is no such signal.

    velocity (m/s or rad/s), duration (s), means of current (A; or torque) and following error (m or rad), the standard
    deviation of the current's samples, and standard errors of the two means, each with what wanders
    through the run; time of the first sample that counts, s.
    """

    velocity: FloatArray
    duration: FloatArray
    current: FloatArray
    scatter: FloatArray
    following_error: FloatArray
    current_error: FloatArray
    current_wander: FloatArray
    following_scatter: FloatArray
    following_wander: FloatArray
    start: FloatArray


def find_constant_runs(time: FloatArray, speed: FloatArray, load: FloatArray, *, error: FloatArray, usable: np.ndarray,
                       measured: bool) -> ConstantRuns:
    """Return the means over every stretch in which the speed stays the same and is not zero.

    Parameters
    ----------
    time, speed, load, error : (n,) floats
        On one even grid: s, m/s, load, following error.
    usable : (n,) bools
        False in gaps of the record; no run reaches into one.
    measured : bool
        Whether the speed is an actual one (or differenced from positions): its noise is averaged over half a shortest run.
    """
    step = float(time[1] - time[0])
    runs = _constant_stretches(speed, step, usable, measured=measured)
    if not runs:
        return ConstantRuns(*np.zeros((10, 0)))
    v = np.array([speed[run].mean() for run in runs])
    loads, errors = (np.array([_batch_means(values, run) for run in runs]) for values in (load, error))
    half = BATCH_COUNT // 2  # the error still settles: what is left of it is of the size of what it changed by
    settling = np.maximum(errors.std(axis=1, ddof=1), np.abs(errors[:, :half].mean(axis=1) - errors[:, half:].mean(axis=1)))
    duration, scatter = (np.array(column) for column in zip(*((run.size * step, load[run].std()) for run in runs), strict=True))
    return ConstantRuns(v, duration, loads.mean(axis=1), scatter, errors.mean(axis=1), *_batch_spread(loads),
                        _batch_spread(errors)[0], settling, np.array([time[run[0]] for run in runs]))


def _constant_stretches(speed: FloatArray, step: float, usable: np.ndarray, *, measured: bool) -> list[np.ndarray]:
    """Return the samples of every run, without its beginning."""
    width = max(3, round(MIN_RUN_DURATION / step / 2) * 2 + 1)
    smooth = uniform_filter1d(speed, max(width // 2, 1)) if measured else speed
    speed_max = float(np.abs(smooth).max())
    spread = maximum_filter1d(smooth, width) - minimum_filter1d(smooth, width)
    is_constant = (spread <= 2 * _MAX_SPEED_CHANGE * speed_max) & (spread <= _MAX_OWN_SPEED_CHANGE * np.abs(smooth)) & usable
    stretch, _ = label(is_constant & (np.abs(smooth) > 2 * _MAX_SPEED_CHANGE * speed_max))
    runs = [np.arange(place[0].start, place[0].stop) for place in find_objects(stretch)]
    runs = [run[round(_SETTLING_FRACTION * run.size):] for run in runs]
    return [run for run in runs if run.size * step >= MIN_RUN_DURATION / 2 and run.size >= BATCH_COUNT]


def _batch_means(values: FloatArray, run: np.ndarray) -> FloatArray:
    """Return the means of equal parts of a run."""
    return np.array([part.mean() for part in np.array_split(values[run], BATCH_COUNT)])


def _batch_spread(parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the standard error of the mean of correlated samples, from the means of equal parts, and the standard deviation of
    the drift through the run, which no average removes."""
    rough = (np.diff(parts, axis=1)**2).mean(axis=1) / 2  # of neighbours: what wanders is left out (von Neumann)
    slow = np.maximum(parts.var(axis=1, ddof=1) - rough, 0.0)
    return np.sqrt(rough / BATCH_COUNT), np.sqrt(slow)
