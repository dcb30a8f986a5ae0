r"""Errors of a component's rigid motions over all modes at once: between modes, and from the points' coordinates.

Shapes of different modes come from the same responses, so their errors are correlated between modes; the correlation
:math:`\rho_{rs}` shows in what the rigid motions leave, pooled over all components. With the least-squares maps :math:`A_r`
from displacements to twists and S the standard deviations of the displacements,

.. math:: C_{rs} = \rho_{rs} A_r S_r S_s A_s^T

Where coordinates are stated with a deviation, the maps are those of `point_places`, which lead from the noise of one mode to
the twists of all, and the errors of the coordinates that no motion tells are added.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint.joint_identification.motion.measured import Component, about
from toolpoint.joint_identification.motion.point_places import PlacedComponent
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion
from toolpoint.joint_identification.motion.sensor_gains import SensorGains

_MIN_FREEDOM_PER_COLUMN = 10  # degrees of freedom of the residuals, below which columns count as independent
_CORRELATION_DEVIATIONS = 2.0  # standard errors below which a correlation counts as zero
_MAX_CORRELATION = 0.95
_MAX_POOLED_PVALUE = 0.01  # of an F-test, below which a component keeps its own noise
_MIN_VARIANCE_FACTOR = 0.5  # on a stated variance


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
    with_variance = [name for name, part in parts.items() if part.variance is not None]
    if not with_variance:
        return dict(motions)
    total = sum(motions[name].freedom for name in with_variance)
    pooled = np.sum([motions[name].freedom * motions[name].excess for name in with_variance], axis=0) / total
    result = dict(motions)
    for name in with_variance:
        motion = motions[name]
        ratio = motion.excess / np.maximum(pooled, 1e-300)
        unlike = stats.f.sf(ratio, motion.freedom, max(total - motion.freedom, 1)) < _MAX_POOLED_PVALUE
        factor = np.maximum(np.where(unlike, motion.excess, pooled), _MIN_VARIANCE_FACTOR)
        change = factor / np.maximum(motion.excess, 1.0)
        root = np.sqrt(change)
        result[name] = replace(motion, variance=motion.variance * change, covariance=motion.covariance * change[:, None, None],
                               full_covariance=motion.full_covariance * root[:, None, None, None] * root[:, None])
    return result


def column_correlation(parts: Mapping[str, Component], motions: Mapping[str, RigidMotion]) -> FloatArray:
    """Return the correlation (n_columns, n_columns) of the noise of different columns, from all components' residuals.

    Values within two standard errors of zero count as zero; with few residuals all do. `variance` of the motions is that of
    the noise.
    """
    columns = next(iter(motions.values())).twist.shape[1]
    cross, auto, freedom = np.zeros((columns, columns)), np.zeros((columns, columns)), 0
    for name, part in parts.items():
        motion = motions[name]
        noise = np.sqrt(motion.variance)
        scale = np.where(noise > 0, noise, 1.0)
        error, noise = (part.values - part.rows @ motion.twist) / scale, noise / scale
        cross += error.T @ error
        auto += motion.freedom / len(error) * noise.T @ noise
        freedom += motion.freedom
    if freedom < _MIN_FREEDOM_PER_COLUMN * columns:
        return np.eye(columns)
    cross[np.abs(cross) < _CORRELATION_DEVIATIONS * np.sqrt(freedom)] = 0.0
    result = np.clip(cross / np.where(auto > 0, auto, 1.0), -_MAX_CORRELATION, _MAX_CORRELATION)
    np.fill_diagonal(result, 1.0)
    smallest = float(np.linalg.eigvalsh(result)[0])
    # Cutting small values may leave the matrix indefinite; it is drawn towards the identity as far as it takes.
    share = max(0.0, (1e-3 - smallest) / (1 - smallest)) if smallest < 1e-3 else 0.0
    return np.asarray((1 - share) * result + share * np.eye(columns))


def with_errors(part: Component, motion: RigidMotion, correlation: FloatArray, *, gains: SensorGains | None = None
                ) -> RigidMotion:
    """Return the motion with the covariance of all its columns: `full_covariance`, and `covariance`, its diagonal blocks."""
    maps = _maps(part)
    noise = maps * np.sqrt(motion.variance).T[:, None, :]
    if gains is not None:
        # Without offsets of points a mode's twist follows from its own displacements alone.
        motion = replace(motion, gain_errors=np.einsum("rin,npr->rip", maps, gains.errors_of(part)))
    return _set_covariance(motion, np.einsum("rs,rin,sjn->risj", correlation, noise, noise))


def with_placed_errors(placed: PlacedComponent, motion: RigidMotion, correlation: FloatArray, *,
                       gains: SensorGains | None = None) -> RigidMotion:
    """Return the motion of a placed component with the covariance of all its columns, from noise and from coordinates.

    `motion` is that of the placed component with its variance as all components together tell it.
    """
    noise = placed.noise_maps * np.sqrt(motion.variance)
    covariance = np.einsum("riat,tu,sjau->risj", noise, correlation, noise, optimize=True)
    place = placed.deviation * placed.place_maps
    if gains is not None:
        errors = np.einsum("riat,apt->rip", placed.noise_maps, gains.errors_of(placed.part), optimize=True)
        motion = replace(motion, gain_errors=errors)
    return _set_covariance(motion, covariance + np.einsum("rip,sjp->risj", place, place))


def _set_covariance(motion: RigidMotion, covariance: FloatArray) -> RigidMotion:
    columns = np.arange(len(covariance))
    return replace(motion, full_covariance=covariance, covariance=covariance[columns, :, columns])


def with_bending(part: Component, motion: RigidMotion, significance: float, *, floor: float) -> RigidMotion:
    """Return the motion of a component that bends, known no better than it bends: in those columns only.

    What it bends by counts as a motion of its own, of that share of its displacements, in any way.
    """
    bends = np.flatnonzero(motion.bends(significance, floor))
    if not bends.size:
        return motion
    covariance = motion.full_covariance.copy()
    motion_covariance = np.linalg.inv(part.rows.T @ part.rows)
    for column in bends:
        covariance[column, :,
                   column] += motion.bending[column] ** 2 * float((part.values[:, column] ** 2).sum()) * motion_covariance
    return _set_covariance(motion, covariance)


def _maps(part: Component) -> FloatArray:
    """Return A_r, (n_columns, 6, n_rows), of the weighted least squares of every column."""
    to_origin = about(part.centre, part.size)
    local = part.rows @ to_origin
    weights = np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)
    q, r = np.linalg.qr(local[None] * weights.T[:, :, None])
    return np.asarray(to_origin @ np.linalg.solve(r, np.swapaxes(q, 1, 2)) * weights.T[:, None, :])
