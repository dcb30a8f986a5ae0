r"""Points that do not move with their component: wrongly grouped, wrongly placed, or with a faulty channel.

The rigid motion is fitted again with the sum of the points' residual lengths as aim (iteratively reweighted least squares,
one weight a point for all modes), which a minority of wrong points cannot bend; a point is a stranger where its residual,
measured by the median residual of each mode, is too large for noise (chi-squared, divided among all points).
Source: Huber, Ronchetti, Robust Statistics, 2nd ed., chapter 7.
"""

from __future__ import annotations

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint.joint_identification.measured import Component, Point, about

# Median of the absolute value of a standard normal variable.
_MEDIAN = 0.6744898


def strangers(part: Component, significance: float = 1e-6, floor: float = 0.03) -> tuple[Point, ...]:
    """Return the points that move unlike the rest of their component.

    `significance` is the probability of naming any point of a rigid component; a residual below `floor` of the
    component's rms motion never counts (gains of sensors agree within a few per cent, not better).
    """
    if len(part.points) < 5:
        return ()
    weights = np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)
    error = _robust_error(part, weights)
    scale = np.median(np.abs(error), axis=0) / _MEDIAN
    scale = np.where(scale > 0, scale, 1.0)
    square = _per_point(part, (error / scale) ** 2)
    many = _per_point(part, np.ones_like(error))
    motion = np.where(part.motion > 0, part.motion, 1.0)
    size = np.sqrt(_per_point(part, (error / weights / motion) ** 2) / many)
    # The scale itself is uncertain: an F-distribution with the rows of one column as its degrees of freedom.
    chance = stats.f.sf(square / many, many, max(0.37 * (len(error) - 6), 1))
    return tuple(part.points[i] for i in np.flatnonzero((chance < significance / len(part.points)) & (size > floor)))


def _robust_error(part: Component, weights: FloatArray) -> FloatArray:
    """Return the weighted residuals (n_rows, n_columns) of the robust rigid motion, less their pull on the fit."""
    rows = part.rows @ about(part.centre, part.size)
    trust = np.ones(len(part.points))
    error = np.zeros_like(part.values)
    for _ in range(30):
        leverage = np.zeros_like(error)
        root = np.sqrt(trust[part.owner])
        for i in range(error.shape[1]):
            column = rows * weights[:, i, None]
            q, r = np.linalg.qr(column * root[:, None])
            error[:, i] = part.values[:, i] * weights[:, i] - column @ np.linalg.solve(
                r, q.T @ (part.values[:, i] * weights[:, i] * root))
            leverage[:, i] = (q**2).sum(axis=1)
        scale = np.median(np.abs(error), axis=0)
        length = np.sqrt(_per_point(part, (error / np.where(scale > 0, scale, 1.0)) ** 2))
        new = 1 / np.maximum(length, 1e-3 * max(float(length.max()), 1e-300))
        new /= new.max()
        if np.abs(new - trust).max() < 1e-3:
            break
        trust = new
    return error / np.sqrt(np.clip(1 - leverage, 0.05, 1))


def _per_point(part: Component, values: FloatArray) -> FloatArray:
    return np.asarray(np.bincount(part.owner, values.sum(axis=1), len(part.points)), float)
