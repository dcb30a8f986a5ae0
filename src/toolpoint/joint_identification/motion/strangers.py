r"""Points that do not move with their component: wrongly grouped, wrongly placed, or with a faulty channel.

The rigid motion is fitted again with the sum of the points' residual lengths as aim (iteratively reweighted least squares,
one weight a point for all modes), which a minority of wrong points cannot bend; a point is a stranger where its residual,
measured by the median residual of each mode, is too large for noise (chi-squared, divided among all points).
Points at the ends of a body that bends stand out in the same way: where smooth deformations of the whole component leave no
point that stands out, there is no stranger, and where they leave some, these are; but only where the other points bend too.
Source: Huber, Ronchetti, Robust Statistics, 2nd ed., chapter 7.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import stats

from toolpoint._check import BoolArray, FloatArray
from toolpoint.joint_identification.motion.body_misfit import find_suspect, without_points
from toolpoint.joint_identification.motion.measured import Component, Point, about
from toolpoint.joint_identification.motion.rigid_motion import beam_deformations, deformations, rigid_motion
from toolpoint.joint_identification.motion.wrong_channels import faulty_points

_NORMAL_ABSOLUTE_MEDIAN = 0.6744898  # of a standard normal variable
MIN_OUTLIER_MISFIT_RATIO = 50.0  # mean square misfit with an unexplained point over that without it
_DEFORMATION_ORDER, _MIN_ROWS_PER_DEFORMATION = 3, 2.5  # of smooth deformations; rows for each of them, to test them


def strangers(part: Component, significance: float = 1e-6, floor: float = 0.03) -> tuple[Point, ...]:
    """Return the points that move unlike the rest of their component, be that rigid or bending smoothly as a whole.

    `significance` is the probability of naming any point of a rigid component; a residual below `floor` of the
    component's rms motion never counts (gains of sensors agree within a few per cent, not better).
    """
    if len(part.points) < 5:
        return ()
    rigid = part.rows @ about(part.centre, part.size)
    outside = _is_outlier(part, rigid, significance, floor)
    if outside.any() and len(rigid) >= _MIN_ROWS_PER_DEFORMATION * 6 * (_DEFORMATION_ORDER + 2) and _others_bend(part, outside,
                                                                                                                 significance):
        basis, size, _ = np.linalg.svd(np.concatenate([rigid, deformations(part), beam_deformations(part, _DEFORMATION_ORDER)],
                                                      axis=1),
                                       full_matrices=False)
        smooth = basis[:, size > 1e-6 * size[0]]
        outside &= _is_outlier(part, smooth, significance, floor)
    return tuple(part.points[i] for i in np.flatnonzero(outside))


def sure_strangers(parts: Mapping[str, Component]) -> dict[str, tuple[Point, ...]]:
    """Return the points, by component, without which few others still determine its motion as one body.

    They have a channel or all channels of one wrong factor (`faulty_points`), or nothing explains them and the component moves
    far better without them. The ends of a component that bends do not: bending moves several points.
    """
    faulty = faulty_points(parts)
    result = dict[str, tuple[Point, ...]]()
    for name, part in parts.items():
        suspect = find_suspect(part)
        point = None if suspect is None else part.points[suspect.point]
        is_sure = suspect is not None and (faulty.get(name) == point or suspect.ratio >= MIN_OUTLIER_MISFIT_RATIO)
        result[name] = (point,) if point is not None and is_sure else ()
    return result


def _others_bend(part: Component, outside: BoolArray, significance: float) -> bool:
    """Whether the component bends without these points too: points of another component leave a rigid one behind."""
    others = without_points(part, np.flatnonzero(outside).tolist())
    return bool(rigid_motion(others).bends(significance).any())


def _is_outlier(part: Component, rows: FloatArray, significance: float, floor: float) -> BoolArray:
    """Whether each point stands out of the robust fit of these rows."""
    weights = np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)
    error = _robust_error(part, rows, weights)
    scale = np.median(np.abs(error), axis=0) / _NORMAL_ABSOLUTE_MEDIAN
    scale = np.where(scale > 0, scale, 1.0)
    square = _per_point(part, (error / scale) ** 2)
    rows_of_point = _per_point(part, np.ones_like(error))
    motion = np.where(part.motion > 0, part.motion, 1.0)
    size = np.sqrt(_per_point(part, (error / weights / motion) ** 2) / rows_of_point)
    # The scale itself is uncertain: an F-distribution with the rows of one column as its degrees of freedom.
    chance = stats.f.sf(square / rows_of_point, rows_of_point, max(0.37 * (len(error) - rows.shape[1]), 1))
    return np.asarray((chance < significance / len(part.points)) & (size > floor))


def _robust_error(part: Component, rows: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the weighted residuals (n_rows, n_columns) of the robust fit of these rows, less their pull on the fit."""
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
    # A point that determines the motion alone fits itself: its error is raised by what it takes, but not without bound.
    return error / np.sqrt(np.clip(1 - leverage, 0.05, 1))


def _per_point(part: Component, values: FloatArray) -> FloatArray:
    """Return sums over the rows of each point."""
    return np.asarray(np.bincount(part.owner, values.sum(axis=1), len(part.points)), float)
