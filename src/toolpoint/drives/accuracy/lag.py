"""Lag of simulated or recorded axes behind their set points, and the place on the path that it gives their points."""

from __future__ import annotations

import numpy as np
import scipy

from toolpoint._check import FloatArray, floats

_MAX_LAG_INSTANTS = 20_000  # instants from which the lag is estimated
_WINDOW_RATIO, _MIN_WINDOW = 3.0, 1e-4  # of the deviation from the expected place; m


def estimate_lag(time: FloatArray, command: FloatArray, actual: FloatArray) -> float:
    """Return the delay that brings the command closest to the actual motion, s, at least zero.

    Parameters
    ----------
    time : (n,) floats
        s, increasing.
    command, actual : (n, n_axes) floats
        m. Least squares over all axes; with a position loop of gain K_v and no feed-forward the lag is 1/K_v.
    """
    t = floats("time", time, (None,))
    c, a = floats("command", command, (t.size, None)), floats("actual", actual, (t.size, None))
    if t.size < 3:
        return 0.0
    velocity = np.gradient(c, t, axis=0)
    power = float((velocity**2).sum())
    if power == 0:
        return 0.0
    first = float(((c - a) * velocity).sum()) / power  # to first order the following error is the lag times the velocity
    sampled = slice(None, None, max(1, t.size // _MAX_LAG_INSTANTS))

    def miss(lag: float) -> float:
        return float(((a[sampled] - delay(t, c, lag)[sampled]) ** 2).sum())

    lag_max = max(3 * first, 10 * float(t[1] - t[0]))
    best = scipy.optimize.minimize_scalar(miss, bounds=(0.0, lag_max), method="bounded",
                                          options={"xatol": 1e-9 * lag_max + 1e-9})
    return float(best.x) if miss(float(best.x)) < miss(0.0) else 0.0


def delay(time: FloatArray, values: FloatArray, lag: float) -> FloatArray:
    """Return values (n, n_columns) as they were `lag` s before; the first one before the start."""
    return np.column_stack([np.interp(time - lag, time, column) for column in values.T])


def window_around(expected: FloatArray, actual: FloatArray) -> FloatArray:
    """Return the largest distance along the path (m) of the foot of each actual point from its expected place, (n,).

    The foot is no farther from the actual point than the expected place is, d; so it is within 2 d of the expected place, and
    along smooth path within pi d. Whatever the path, the contour error is then at most d.
    """
    return _WINDOW_RATIO * np.linalg.norm(actual - expected, axis=1) + _MIN_WINDOW
