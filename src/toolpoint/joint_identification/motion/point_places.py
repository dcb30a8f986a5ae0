r"""Where the points of a component really are, as far as its motions tell: coordinates told with a standard deviation.

A point that is really at :math:`p + \delta` moves by :math:`u_r = v_r + w_r \times (p + \delta)` in every mode r, with the
same :math:`\delta` in all of them. Twists and offsets minimise

.. math:: \sum_{i, r} (u_{ir} - d_i \cdot (v_r + w_r \times (p + \delta)))^2 / \sigma_{ir}^2 + |\delta|^2 / s^2

by Gauss-Newton steps, offsets eliminated point by point (Schur complement, as in bundle adjustment: Triggs et al., Vision
Algorithms, LNCS 1883 (2000) 298). Several modes tell most of the offsets; a common offset of all points and a common scale
look like other twists in every mode and keep their prior width, which is what the covariance of the twists then holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint.joint_identification.motion.measured import Component, about
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion, SmallMotion, rigid_motion
from toolpoint.spatial import transform as tf

_ROUNDS, _REPEATS, _SMALL, _LIKE, _QUIET, _IMPROBABLE = 20, 6, 1e-4, 0.02, 1e-3, 1e-3


@dataclass(frozen=True, eq=False)
class PlacedComponent:
    """A component with its points where its motions place them.

    part : at the shifted places; motion : its rigid motion there; deviation : standard deviation of a coordinate that was
    used, m, larger than the stated one where the offsets are; noise_maps : (m, 6, n_rows, m), from the noise of the
    displacements to the twists; place_maps : (m, 6, 3 n_points), from the errors of the stated coordinates.
    """

    part: Component
    motion: RigidMotion
    deviation: float
    noise_maps: FloatArray
    place_maps: FloatArray


@dataclass(frozen=True, eq=False)
class _Normal:
    """Normal equations of twists (about the centre: `back` leads to the origin) and offsets.

    weight : (n_rows, m); local : (n_rows, 6), turned : (n_rows, m, 3), slopes to twists and to offsets; alone : (n, 3, 3),
    covariance of a point's offset where the twists are known; pulled : (6 m, n, 3), the coupling times it; left : (6 m, 6 m),
    information of the twists once every point may shift.
    """

    back: FloatArray
    weight: FloatArray
    local: FloatArray
    turned: FloatArray
    alone: FloatArray
    pulled: FloatArray
    left: FloatArray


def place_points(part: Component, deviation: float) -> PlacedComponent:
    """Return the component with its points placed by its motions.

    Parameters
    ----------
    part : Component
        With the stated coordinates; its variance is that of the noise alone (None: taken from what is left).
    deviation : float
        Standard deviation of each stated coordinate, m. Where the offsets are larger beyond chance (0.1 %), theirs is used.
    """
    placed, absorbed = _settle(part, deviation)
    for _ in range(_REPEATS):
        offset = float(((placed.part.at - part.at) ** 2).sum())
        if absorbed <= 1 or stats.chi2.sf(offset / placed.deviation**2, absorbed) >= _IMPROBABLE:
            break
        placed, absorbed = _settle(part, float(np.sqrt(offset / absorbed)))
    return placed


def _settle(part: Component, deviation: float) -> tuple[PlacedComponent, float]:
    """Return the placed component and how many offsets its motions tell."""
    # Begun with no more noise than is stated, or next to none: with what wrong places leave counted as noise, no motion would
    # outweigh the stated coordinates, and the points would stay there.
    variance = _QUIET * rigid_motion(part).variance if part.variance is None else part.variance
    offset = np.zeros_like(part.at)
    for _ in range(_REPEATS):
        offset, normal = _placed(part, variance, offset, deviation=deviation)
        shifted, absorbed = _shifted(part, offset), _absorbed(normal, deviation)
        motion = _no_quieter(shifted, rigid_motion(shifted, absorbed=absorbed / part.values.shape[1]))
        change = float(np.abs(np.log(motion.variance.sum(axis=0) / variance.sum(axis=0))).max())
        variance = motion.variance
        if change < _LIKE:
            break
    return PlacedComponent(shifted, motion, deviation, *_maps(normal, shifted, deviation)), absorbed


def _placed(part: Component, variance: FloatArray, offset: FloatArray, *, deviation: float) -> tuple[FloatArray, _Normal]:
    """Return the offsets (n, 3) of a given noise and the normal equations there."""
    shifted = _shifted(part, offset)
    for _ in range(_ROUNDS):
        twist = SmallMotion().twists(replace(shifted, variance=variance))
        normal = _normal(shifted, twist, variance, deviation=deviation)
        step = _step(normal, shifted, twist, pull=-offset / deviation**2)
        offset = offset + step
        shifted = _shifted(part, offset)
        if np.abs(step).max() < _SMALL * deviation:
            break
    return offset, normal


def _no_quieter(part: Component, motion: RigidMotion) -> RigidMotion:
    """Return the motion with every mode as noisy, in its own size, as all are together, where nobody stated the noise.

    Few rows tell the noise of a single mode poorly, and the offsets would follow the mode that seems the quietest.
    """
    if part.variance is not None:
        return motion
    power = part.motion**2
    least = power * (motion.variance[0].sum() / max(float(power.sum()), 1e-300))
    return replace(motion, variance=np.maximum(motion.variance, least))


def _shifted(part: Component, offset: FloatArray) -> Component:
    at = part.at + offset
    places = at[part.owner]
    return replace(part, at=at, places=places, rows=np.einsum("ni,nij->nj", part.ways, tf.point_velocity(places)))


def _normal(part: Component, twist: FloatArray, variance: FloatArray, *, deviation: float) -> _Normal:
    back = about(part.centre, part.size)
    local, weight = part.rows @ back, 1 / variance
    turned = np.cross(part.ways[:, None], twist[3:].T[None])
    count, many = part.values.shape[1], len(part.points)
    alone, cross = np.zeros((many, 3, 3)), np.zeros((count, 6, many, 3))
    for p in range(many):
        at = part.owner == p
        alone[p] = np.linalg.inv(np.einsum("ir,irx,iry->xy", weight[at], turned[at], turned[at]) + np.eye(3) / deviation**2)
        cross[:, :, p] = np.einsum("ir,ij,irx->rjx", weight[at], local[at], turned[at])
    pulled = np.einsum("rjpx,pxy->rjpy", cross, alone).reshape(6 * count, many, 3)
    left = -pulled.reshape(6 * count, -1) @ cross.reshape(6 * count, -1).T
    each = np.arange(count)
    left.reshape(count, 6, count, 6)[each, :, each] += np.einsum("ir,ij,ik->rjk", weight, local, local)
    return _Normal(back, weight, local, turned, alone, pulled, left)


def _step(normal: _Normal, part: Component, twist: FloatArray, *, pull: FloatArray) -> FloatArray:
    """Return the change (n, 3) of the offsets; `pull` is what draws them back to the stated coordinates."""
    force = normal.weight * (part.values - part.rows @ twist)
    pull = pull.copy()
    np.add.at(pull, part.owner.astype(int), np.einsum("ir,irx->ix", force, normal.turned))
    flat = normal.pulled.reshape(len(normal.left), -1)
    turn = np.linalg.solve(normal.left, np.einsum("ir,ij->rj", force, normal.local).ravel() - flat @ pull.ravel())
    return np.asarray(np.einsum("pxy,py->px", normal.alone, pull) - (flat.T @ turn).reshape(pull.shape))


def _absorbed(normal: _Normal, deviation: float) -> float:
    """Return how many of the offsets the motions tell: three a point, less what their prior alone tells."""
    flat = normal.pulled.reshape(len(normal.left), -1)
    through = float((flat * np.linalg.solve(normal.left, flat)).sum())
    return 3 * len(normal.alone) - (float(np.trace(normal.alone, axis1=1, axis2=2).sum()) + through) / deviation**2


def _maps(normal: _Normal, part: Component, deviation: float) -> tuple[FloatArray, FloatArray]:
    """Return `noise_maps` and `place_maps`: the estimate is linear in both errors near the solution."""
    count = normal.weight.shape[1]
    slopes = -np.einsum("kix,isx->kis", normal.pulled[:, part.owner], normal.turned)
    each = np.arange(count)
    slopes.reshape(count, 6, -1, count)[each, :, :, each] += normal.local.T
    root = np.linalg.inv(normal.left)
    noise = root @ (slopes * normal.weight).reshape(6 * count, -1)
    place = root @ normal.pulled.reshape(6 * count, -1) / deviation**2
    return (np.einsum("kj,rjis->rkis", normal.back, noise.reshape(count, 6, -1, count), optimize=True),
            np.einsum("kj,rjp->rkp", normal.back, place.reshape(count, 6, -1)))
