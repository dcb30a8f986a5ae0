"""Stretches of a record in which an axis keeps its speed: means of load and following error, and how well they are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import find_objects, label, maximum_filter1d, minimum_filter1d, uniform_filter1d

from toolpoint._check import FloatArray

# A run: at least this long (s), speed within this share of the largest and of itself, first part left out while it settles.
SHORTEST, _CONSTANT, _ITSELF, _SETTLES = 0.1, 0.005, 0.1, 0.3
# The error of a mean is that of the means of so many equal parts: samples of a filtered record are not independent.
BATCHES = 8


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
    runs = _stretches(speed, step, usable, measured=measured)
    if not runs:
        return ConstantRuns(*np.zeros((10, 0)))
    v = np.array([speed[at].mean() for at in runs])
    loads, errors = (np.array([_parts(values, at) for at in runs]) for values in (load, error))
    half = BATCHES // 2  # the error still settles: what is left of it is of the size of what it changed by
    settling = np.maximum(errors.std(axis=1, ddof=1), np.abs(errors[:, :half].mean(axis=1) - errors[:, half:].mean(axis=1)))
    duration, scatter = (np.array(column) for column in zip(*((at.size * step, load[at].std()) for at in runs), strict=True))
    return ConstantRuns(v, duration, loads.mean(axis=1), scatter, errors.mean(axis=1), *_spread_of_parts(loads),
                        _spread_of_parts(errors)[0], settling, np.array([time[at[0]] for at in runs]))


def _stretches(speed: FloatArray, step: float, usable: np.ndarray, *, measured: bool) -> list[np.ndarray]:
    """Return the samples of every run, without its beginning."""
    width = max(3, round(SHORTEST / step / 2) * 2 + 1)
    smooth = uniform_filter1d(speed, max(width // 2, 1)) if measured else speed
    top = float(np.abs(smooth).max())
    spread = maximum_filter1d(smooth, width) - minimum_filter1d(smooth, width)
    same = (spread <= 2 * _CONSTANT * top) & (spread <= _ITSELF * np.abs(smooth)) & usable
    stretch, _ = label(same & (np.abs(smooth) > 2 * _CONSTANT * top))
    runs = [np.arange(place[0].start, place[0].stop) for place in find_objects(stretch)]
    runs = [at[round(_SETTLES * at.size):] for at in runs]
    return [at for at in runs if at.size * step >= SHORTEST / 2 and at.size >= BATCHES]


def _parts(values: FloatArray, at: np.ndarray) -> FloatArray:
    """Return the means of equal parts of a run."""
    return np.array([part.mean() for part in np.array_split(values[at], BATCHES)])


def _spread_of_parts(parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the standard error of the mean of samples that hang together, from the means of equal parts, and the standard
    deviation of what wanders through the run: no average takes that away."""
    rough = (np.diff(parts, axis=1)**2).mean(axis=1) / 2  # of neighbours: what wanders is left out (von Neumann)
    slow = np.maximum(parts.var(axis=1, ddof=1) - rough, 0.0)
    return np.sqrt(rough / BATCHES), np.sqrt(slow)
