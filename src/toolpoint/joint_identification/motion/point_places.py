r"""Places of the points of a component by its motions: coordinates with a stated standard deviation are corrected.

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

# Steps end by `_OFFSET_TOLERANCE`, rounds by `_VARIANCE_TOLERANCE`; these bound what noise alone would keep moving.
_MAX_GAUSS_NEWTON_STEPS, _MAX_VARIANCE_ROUNDS = 20, 6
_OFFSET_TOLERANCE = 1e-4  # of the stated deviation: a step below it is the last
_VARIANCE_TOLERANCE = 0.02  # change of the logarithm of the noise between rounds
_FIRST_VARIANCE_FRACTION = 1e-3  # of the residual's variance, at the start where none is stated
_MIN_DEVIATION = 1e-9  # m, in place of none: points at their stated coordinates
_MIN_OFFSET_PVALUE = 1e-3  # below, offsets are larger than the stated deviation


@dataclass(frozen=True, eq=False)
class PlacedComponent:
    """Component with its points at the places that its motions determine.

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
    """Normal equations of twists (about the centre: `to_origin` leads to the origin) and offsets.

    weight : (n_rows, m); local : (n_rows, 6), offset_slopes : (n_rows, m, 3), slopes to twists and to offsets;
    offset_covariance : (n, 3, 3), of a point's offset where the twists are known; coupling : (6 m, n, 3), of twists and
    offsets, times it; information : (6 m, 6 m), of the twists once every point may shift.
    """

    to_origin: FloatArray
    weight: FloatArray
    local: FloatArray
    offset_slopes: FloatArray
    offset_covariance: FloatArray
    coupling: FloatArray
    information: FloatArray

    def displacements(self, owner: FloatArray, twist: FloatArray, offset: FloatArray) -> FloatArray:
        """Return the displacements (n_rows, m) by twists (m, 6) about the centre and offsets (n_points, 3)."""
        return np.asarray(self.local @ twist.T + np.einsum("isx,ix->is", self.offset_slopes, offset[owner]))


@dataclass(frozen=True, eq=False)
class MotionWeights:
    """Weights of displacements beside all twists and offsets of a component.

    normal : the normal equations; rigid : (n_rows, m), displacements by the twists at the stated coordinates; excess : mean
    square of what twists and offsets leave, over its noise.
    """

    normal: _Normal
    owner: FloatArray
    rigid: FloatArray
    excess: float

    def weigh(self, values: FloatArray) -> FloatArray:
        """Return Q times displacements (n_rows, m): what twists and offsets leave of them, over the variance."""
        twist, offset = _solve(self.normal, self.owner, self.normal.weight * values)
        return np.asarray(self.normal.weight * (values - self.normal.displacements(self.owner, twist, offset)))


def weigh_motions(part: Component, deviation: float, noise: float) -> MotionWeights:
    """Return the weights of a component's displacements, offsets linear about the stated coordinates.

    deviation : standard deviation of each coordinate, m; noise : factor of the variance (of the first guess of it where none is
    stated).
    """
    first = _first_variance(part) if part.variance is None else part.variance
    variance = np.maximum(noise * first, part.min_variance)
    twist = SmallMotion().twists(replace(part, variance=variance))
    normal = _normal(part, twist, variance, deviation=deviation)
    rigid, offset = _solve(normal, part.owner, normal.weight * part.values)
    # A sum of squares: the product of what is left with the displacements is the same in exact numbers, and negative by
    # rounding where the noise is that of rounding.
    left = float((normal.weight * (part.values - normal.displacements(part.owner, rigid, offset))**2).sum())
    left += float((offset**2).sum()) / max(deviation, _MIN_DEVIATION) ** 2
    freedom = part.values.size - 6 * part.values.shape[1] - _count_determined_offsets(normal, deviation)
    return MotionWeights(normal, part.owner, normal.local @ rigid.T, left / max(freedom, 1.0))


def _first_variance(part: Component) -> FloatArray:
    """Return the noise that is begun with where none is stated, (n_rows, m)."""
    return np.maximum(_FIRST_VARIANCE_FRACTION * rigid_motion(part).variance, part.min_variance)


def place_points(part: Component, deviation: float) -> PlacedComponent:
    """Return the component with its points placed by its motions.

    Parameters
    ----------
    part : Component
        With the stated coordinates; its variance is that of the noise alone (None: taken from what is left).
    deviation : float
        Standard deviation of each stated coordinate, m. Where the offsets are larger beyond chance (0.1 %), theirs is used.
    """
    placed, absorbed = _place_with_noise(part, deviation)
    for _ in range(_MAX_VARIANCE_ROUNDS):
        offset = float(((placed.part.at - part.at) ** 2).sum())
        if absorbed <= 1 or stats.chi2.sf(offset / placed.deviation**2, absorbed) >= _MIN_OFFSET_PVALUE:
            break
        placed, absorbed = _place_with_noise(part, float(np.sqrt(offset / absorbed)))
    return placed


def _place_with_noise(part: Component, deviation: float) -> tuple[PlacedComponent, float]:
    """Return the placed component and the number of offsets that its motions determine."""
    # Begun with no more noise than is stated, or next to none: with what wrong places leave counted as noise, no motion would
    # outweigh the stated coordinates, and the points would stay there.
    variance = _first_variance(part) if part.variance is None else part.variance
    offset = np.zeros_like(part.at)
    for _ in range(_MAX_VARIANCE_ROUNDS):
        offset, normal = _solve_offsets(part, variance, offset, deviation=deviation)
        shifted, absorbed = _shift_points(part, offset), _count_determined_offsets(normal, deviation)
        motion = _equalise_noise(shifted, rigid_motion(shifted, absorbed=absorbed / part.values.shape[1]))
        change = float(np.abs(np.log(motion.variance.sum(axis=0) / variance.sum(axis=0))).max())
        variance = motion.variance
        if change < _VARIANCE_TOLERANCE:
            break
    return PlacedComponent(shifted, motion, deviation, *_maps(normal, shifted, deviation)), absorbed


def _solve_offsets(part: Component, variance: FloatArray, offset: FloatArray, *, deviation: float) -> tuple[FloatArray,
                                                                                                            _Normal]:
    """Return the offsets (n, 3) of a given noise and the normal equations there."""
    shifted = _shift_points(part, offset)
    for _ in range(_MAX_GAUSS_NEWTON_STEPS):
        twist = SmallMotion().twists(replace(shifted, variance=variance))
        normal = _normal(shifted, twist, variance, deviation=deviation)
        step = _step(normal, shifted, twist, pull=-offset / deviation**2)
        offset = offset + step
        shifted = _shift_points(part, offset)
        if np.abs(step).max() < _OFFSET_TOLERANCE * deviation:
            break
    return offset, normal


def _equalise_noise(part: Component, motion: RigidMotion) -> RigidMotion:
    """Return the motion with every mode as noisy, relative to its size, as all are together, where no noise was stated.

    Few rows tell the noise of a single mode poorly, and the offsets would follow the mode that seems the quietest.
    """
    if part.variance is not None:
        return motion
    power = part.motion**2
    min_variance = power * (motion.variance[0].sum() / max(float(power.sum()), 1e-300))
    return replace(motion, variance=np.maximum(motion.variance, min_variance))


def _shift_points(part: Component, offset: FloatArray) -> Component:
    """Return the component with its points shifted."""
    positions = part.at + offset
    places = positions[part.owner]
    return replace(part, at=positions, places=places, rows=np.einsum("ni,nij->nj", part.ways, tf.point_velocity(places)))


def _normal(part: Component, twist: FloatArray, variance: FloatArray, *, deviation: float) -> _Normal:
    """Return the normal equations at these twists and offsets."""
    to_origin = about(part.centre, part.size)
    local, weight = part.rows @ to_origin, 1 / variance
    offset_slopes = np.cross(part.ways[:, None], twist[3:].T[None])
    count, n_points = part.values.shape[1], len(part.points)
    offset_covariance, cross = np.zeros((n_points, 3, 3)), np.zeros((count, 6, n_points, 3))
    for p in range(n_points):
        rows = part.owner == p
        offset_covariance[p] = np.linalg.inv(np.einsum("ir,irx,iry->xy", weight[rows], offset_slopes[rows],
                                                       offset_slopes[rows]) + np.eye(3) / max(deviation, _MIN_DEVIATION) ** 2)
        cross[:, :, p] = np.einsum("ir,ij,irx->rjx", weight[rows], local[rows], offset_slopes[rows])
    coupling = np.einsum("rjpx,pxy->rjpy", cross, offset_covariance).reshape(6 * count, n_points, 3)
    information = -coupling.reshape(6 * count, -1) @ cross.reshape(6 * count, -1).T
    columns = np.arange(count)
    information.reshape(count, 6, count, 6)[columns, :, columns] += np.einsum("ir,ij,ik->rjk", weight, local, local)
    return _Normal(to_origin, weight, local, offset_slopes, offset_covariance, coupling, information)


def _step(normal: _Normal, part: Component, twist: FloatArray, *, pull: FloatArray) -> FloatArray:
    """Return the change (n, 3) of the offsets; `pull` is what draws them back to the stated coordinates."""
    return _solve(normal, part.owner, normal.weight * (part.values - part.rows @ twist), pull=pull)[1]


def _solve(normal: _Normal, owner: FloatArray, force: FloatArray, *, pull: FloatArray | float = 0.0
           ) -> tuple[FloatArray, FloatArray]:
    """Return the twists (m, 6) about the centre and the offsets (n_points, 3) by weighted displacements (n_rows, m)."""
    pulled = np.zeros((len(normal.offset_covariance), 3)) + pull
    np.add.at(pulled, owner.astype(int), np.einsum("ir,irx->ix", force, normal.offset_slopes))
    flat = normal.coupling.reshape(len(normal.information), -1)
    twist = np.linalg.solve(normal.information, np.einsum("ir,ij->rj", force, normal.local).ravel() - flat @ pulled.ravel())
    offset = np.einsum("pxy,py->px", normal.offset_covariance, pulled) - (flat.T @ twist).reshape(pulled.shape)
    return twist.reshape(-1, 6), np.asarray(offset)


def _count_determined_offsets(normal: _Normal, deviation: float) -> float:
    """Return the number of offsets that the motions determine: three a point, less those of the prior."""
    flat = normal.coupling.reshape(len(normal.information), -1)
    through = float((flat * np.linalg.solve(normal.information, flat)).sum())
    return 3 * len(normal.offset_covariance) - (float(np.trace(normal.offset_covariance, axis1=1, axis2=2).sum())
                                                + through) / max(deviation, _MIN_DEVIATION) ** 2


def _maps(normal: _Normal, part: Component, deviation: float) -> tuple[FloatArray, FloatArray]:
    """Return `noise_maps` and `place_maps`: the estimate is linear in both errors near the solution."""
    count = normal.weight.shape[1]
    slopes = -np.einsum("kix,isx->kis", normal.coupling[:, part.owner], normal.offset_slopes)
    each = np.arange(count)
    slopes.reshape(count, 6, -1, count)[each, :, :, each] += normal.local.T
    root = np.linalg.inv(normal.information)
    noise = root @ (slopes * normal.weight).reshape(6 * count, -1)
    place = root @ normal.coupling.reshape(6 * count, -1) / deviation**2
    return (np.einsum("kj,rjis->rkis", normal.to_origin, noise.reshape(count, 6, -1, count), optimize=True),
            np.einsum("kj,rjp->rkp", normal.to_origin, place.reshape(count, 6, -1)))
