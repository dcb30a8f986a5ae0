r"""Errors of a component's rigid motions over all modes at once: between modes, and from the points' coordinates.

Shapes of different modes come from the same responses, so their errors are correlated between modes; the correlation
:math:`\rho_{rs}` shows in what the rigid motions leave, pooled over all components. A point that is really at
:math:`p + \delta` adds :math:`w_r \times \delta` to its displacement in every mode r, the same :math:`\delta` in all of them.
With the least-squares maps :math:`A_r` from displacements to twists,

.. math:: C_{rs} = \rho_{rs} A_r S_r S_s A_s^T + s^2 \sum_p (A_r D_r^p) (A_s D_s^p)^T

where S holds the standard deviations of the displacements and :math:`D_r^p` the rows :math:`(d_i \times w_r)^T` of point p.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint.joint_identification.measured import Component, about
from toolpoint.joint_identification.rigid_motion import RigidMotion

_ROWS_PER_COLUMN = 10
_SIGNIFICANT = 2.0
_LARGEST = 0.95
_UNLIKE = 0.01
_LEAST = 0.5


def coordinate_variance(part: Component, twist: FloatArray, deviation: float) -> FloatArray:
    """Return the variance (n_rows, n_columns) that coordinates wrong by `deviation` (m, each) bring into displacements."""
    across = np.cross(part.ways[:, None, :], twist[3:].T[None])
    return np.asarray(deviation**2 * (across**2).sum(axis=-1))


def with_common_noise(parts: Mapping[str, Component], motions: Mapping[str, RigidMotion]) -> dict[str, RigidMotion]:
    """Return the motions with the noise of every column as all components' residuals together tell it, in both directions.

    A stated variance that is too large or too small shows alike in all components; a component whose own residual is larger
    beyond chance (F-test, 1 %) keeps its own. Less than half of a stated variance is not believed. Motions of components
    without a stated variance stay as they are.
    """
    known = [name for name, part in parts.items() if part.variance is not None]
    if not known:
        return dict(motions)
    total = sum(motions[name].freedom for name in known)
    pooled = np.sum([motions[name].freedom * motions[name].excess for name in known], axis=0) / total
    result = dict(motions)
    for name in known:
        motion = motions[name]
        ratio = motion.excess / np.maximum(pooled, 1e-300)
        unlike = stats.f.sf(ratio, motion.freedom, max(total - motion.freedom, 1)) < _UNLIKE
        factor = np.maximum(np.where(unlike, motion.excess, pooled), _LEAST)
        change = factor / np.maximum(motion.excess, 1.0)
        root = np.sqrt(change)
        result[name] = replace(motion, variance=motion.variance * change, covariance=motion.covariance * change[:, None, None],
                               whole=motion.whole * root[:, None, None, None] * root[:, None])
    return result


def column_correlation(parts: Mapping[str, Component], motions: Mapping[str, RigidMotion], deviation: float) -> FloatArray:
    """Return the correlation (n_columns, n_columns) of the noise of different columns, from all components' residuals.

    What wrong coordinates explain is taken off first. Values within two standard errors of zero count as zero; with few
    residuals all do. `variance` of the motions is that of the noise alone.
    """
    columns = next(iter(motions.values())).twist.shape[1]
    cross, auto, freedom = np.zeros((columns, columns)), np.zeros((columns, columns)), 0
    for name, part in parts.items():
        motion = motions[name]
        turned = deviation * np.cross(part.ways[None], motion.twist[3:].T[:, None, :])
        noise = np.sqrt(motion.variance)
        total = np.sqrt(motion.variance + (turned**2).sum(axis=-1).T)
        total = np.where(total > 0, total, 1.0)
        error, turned, noise = (part.values - part.rows @ motion.twist) / total, turned / total.T[:, :, None], noise / total
        share = 1 - 6 / len(error)
        cross += error.T @ error - share * np.einsum("rix,six->rs", turned, turned)
        auto += share * noise.T @ noise
        freedom += len(error) - 6
    if freedom < _ROWS_PER_COLUMN * columns:
        return np.eye(columns)
    cross[np.abs(cross) < _SIGNIFICANT * np.sqrt(freedom)] = 0.0
    result = np.clip(cross / np.where(auto > 0, auto, 1.0), -_LARGEST, _LARGEST)
    np.fill_diagonal(result, 1.0)
    least = float(np.linalg.eigvalsh(result)[0])
    # Cutting small values may leave the matrix indefinite; it is drawn towards the identity as far as it takes.
    share = max(0.0, (1e-3 - least) / (1 - least)) if least < 1e-3 else 0.0
    return np.asarray((1 - share) * result + share * np.eye(columns))


def with_errors(part: Component, motion: RigidMotion, correlation: FloatArray, *, deviation: float) -> RigidMotion:
    """Return the motion with the covariance of all its columns: `whole`, and `covariance` as its diagonal blocks."""
    maps, sd = _maps(part), np.sqrt(motion.variance)
    noise = maps * sd.T[:, None, :]
    whole = np.einsum("rs,rin,sjn->risj", correlation, noise, noise)
    if deviation > 0:
        turned = np.cross(part.ways[None], motion.twist[3:].T[:, None, :])
        # Displacements of one point share its error: their contributions are added before they are squared.
        per_point = np.zeros((motion.twist.shape[1], 6, len(part.points), 3))
        for p in range(len(part.points)):
            at = part.owner == p
            per_point[:, :, p] = maps[:, :, at] @ turned[:, at]
        whole = whole + deviation**2 * np.einsum("ripx,sjpx->risj", per_point, per_point)
    each = np.arange(len(maps))
    return replace(motion, whole=whole, covariance=whole[each, :, each])


def with_bending(part: Component, motion: RigidMotion, significance: float, *, floor: float) -> RigidMotion:
    """Return the motion of a component that bends, known no better than it bends: in those columns only.

    What it bends by counts as a motion of its own, of that share of its displacements, in any way.
    """
    bends = np.flatnonzero(motion.bends(significance, floor))
    if not bends.size:
        return motion
    whole = motion.whole.copy()
    way = np.linalg.inv(part.rows.T @ part.rows)
    for column in bends:
        whole[column, :, column] += motion.bending[column] ** 2 * float((part.values[:, column] ** 2).sum()) * way
    each = np.arange(len(whole))
    return replace(motion, whole=whole, covariance=whole[each, :, each])


def _maps(part: Component) -> FloatArray:
    """Return A_r, (n_columns, 6, n_rows), of the weighted least squares of every column."""
    back = about(part.centre, part.size)
    local = part.rows @ back
    weights = np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)
    q, r = np.linalg.qr(local[None] * weights.T[:, :, None])
    return np.asarray(back @ np.linalg.solve(r, np.swapaxes(q, 1, 2)) * weights.T[:, None, :])
