r"""Rigid motion of a component in every mode: the closed-form small-motion fit, and how rigid the component is.

A point p of a rigid component moves by :math:`u = v + w \times p`, so a shape is linear in the twist (v, w). The
weighted least-squares twist and its covariance are those of linear regression (Gauss-Markov); the mean square of the
weighted residual rescales the covariance (Birge, Phys. Rev. 40 (1932) 207).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from toolpoint._check import BoolArray, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.motion.measured import Component, about


@dataclass(frozen=True, eq=False)
class RigidMotion(NotebookText):
    """Rigid motion of one component in every mode.

    Parameters
    ----------
    component : str
    twist : (6, n_columns) floats
        (v, w) about the origin, in the unit of the shapes and that per m; columns as in `Component.values`.
    covariance : (n_columns, 6, 6) floats
        Of the twists.
    residual : (n_columns,) floats
        Rigidity residual: rms of what a rigid motion leaves, as share of the rms motion.
    excess : (n_columns,) floats
        Mean square of the residual weighted by the known variance (1 where the variance is right); 1 without variance.
    bending : (n_columns,) floats
        Share of the rms motion that a smooth deformation (strain, bending along the longest axis) explains.
    bending_p : (n_columns,) floats
        Probability of so large a share by chance in a rigid component (F-test; free of the level of the noise). With too
        few points for it the whole residual is tested against the known variance; NaN where that is not known either.
    freedom : int
        Degrees of freedom of the residual of one column.
    variance : (n_rows, n_columns) floats
        Of the measured displacements by noise, as they are judged: known or taken from the residual, times the excess.
    whole : (n_columns, 6, n_columns, 6) floats
        Covariance of all twists together, see `motion_errors`; its diagonal blocks are `covariance`.
    """

    component: str
    twist: FloatArray
    covariance: FloatArray
    residual: FloatArray
    excess: FloatArray
    bending: FloatArray
    bending_p: FloatArray
    freedom: int
    variance: FloatArray
    whole: FloatArray

    def bends(self, significance: float = 1e-4, floor: float = 1e-3) -> BoolArray:
        """Return for every column whether the component bends: bending_p < significance and bending > floor."""
        return (self.bending_p < significance) & (self.bending > floor)

    def __repr__(self) -> str:
        return (f"RigidMotion({self.component!r}, {self.twist.shape[1]} columns, residual up to "
                f"{100 * self.residual.max():.2g} %)")


@dataclass(frozen=True)
class SmallMotion:
    """Closed-form weighted least-squares twist of small motions: the default."""

    def twists(self, part: Component) -> FloatArray:
        """Return the twists (6, n_columns) about the origin."""
        return _solved(part)[0]


def rigid_motion(part: Component, twist: FloatArray | None = None, *, absorbed: float = 0.0) -> RigidMotion:
    """Return the rigid motion of a component with its covariance and its rigidity.

    Parameters
    ----------
    part : Component
    twist : (6, n_columns) floats, optional
        Twists of another method, to be judged in the same way; the covariance stays that of the least-squares fit.
    absorbed : float
        Degrees of freedom of every column that were spent before, on the places of the points.
    """
    best, covariance, weights = _solved(part)
    twist = best if twist is None else twist
    error = (part.values - part.rows @ twist) * weights
    freedom = max(len(part.rows) - 6 - round(absorbed), 1)
    excess = (error**2).sum(axis=0) / freedom
    known = part.variance is not None
    factor = np.maximum(excess, 1.0) if known else excess
    power = (part.values**2).sum(axis=0)
    power = np.where(power > 0, power, 1.0)
    rest = ((part.values - part.rows @ twist) ** 2).sum(axis=0)
    share, chance = _bending(part, weights)
    blind, residual = np.isnan(share), np.sqrt(rest / power)
    share = np.where(blind, residual, share)
    chance = np.where(blind, stats.chi2.sf(excess * freedom, freedom) if known else np.nan, chance)
    covariance = covariance * factor[:, None, None]
    whole, each = np.zeros((len(factor), 6, len(factor), 6)), np.arange(len(factor))
    whole[each, :, each] = covariance
    return RigidMotion(part.name, twist, covariance, residual, excess if known else np.ones_like(excess), share, chance,
                       freedom, factor / weights**2, whole)


def _weights(part: Component) -> FloatArray:
    return np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)


def _solved(part: Component) -> tuple[FloatArray, FloatArray, FloatArray]:
    weights = _weights(part)
    back = about(part.centre, part.size)
    local = part.rows @ back
    count = part.values.shape[1]
    twist, covariance = np.empty((6, count)), np.empty((count, 6, 6))
    for i in range(count):
        q, r = np.linalg.qr(local * weights[:, i, None])
        root = np.linalg.solve(r, np.eye(6))
        twist[:, i] = back @ (root @ (q.T @ (part.values[:, i] * weights[:, i])))
        covariance[i] = back @ root @ root.T @ back.T
    return twist, covariance, weights


def _bending(part: Component, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (share of the motion, p-value) of the smooth deformation of every column; NaN with too few rows."""
    count = part.values.shape[1]
    share, chance = np.zeros(count), np.ones(count)
    shapes = deformations(part)
    for i in range(count):
        w = weights[:, i, None]
        y = part.values[:, i] * w[:, 0]
        rigid = np.linalg.qr(part.rows * w / np.abs(part.rows * w).max(axis=0).clip(1e-300))[0]
        rest, extra = y - rigid @ (rigid.T @ y), shapes * w
        left, values, _ = np.linalg.svd(extra - rigid @ (rigid.T @ extra), full_matrices=False)
        left = left[:, values > 1e-6 * values.max(initial=0.0)] if values.size else left[:, :0]
        free = len(y) - 6 - left.shape[1]
        if left.shape[1] == 0 or free < 3:
            share[i] = np.nan
            continue
        explained = left @ (left.T @ rest)
        inside, outside = float(explained @ explained), float(((rest - explained) ** 2).sum())
        power = float((part.values[:, i] ** 2).sum())
        if power <= 0 or inside + outside <= 1e-24 * float(y @ y):
            continue
        # In the unit of the motion, without the share that noise alone would explain.
        net = max(float(((explained / w[:, 0]) ** 2).sum()) * (1 - left.shape[1] * outside / free / max(inside, 1e-300)), 0)
        share[i] = np.sqrt(net / power)
        ratio = inside / left.shape[1] / max(outside / free, 1e-300)
        chance[i] = stats.f.sf(ratio, left.shape[1], free)
    return share, chance


def deformations(part: Component) -> FloatArray:
    """Return the smooth deformations seen by the measured displacements: six strains, bending along the longest axis."""
    centred, along = _lengthwise(part)
    strains = []
    for i in range(3):
        for j in range(i, 3):
            strains.append(part.ways[:, i] * centred[:, j] + (part.ways[:, j] * centred[:, i] if j > i else 0))
    bends = [part.ways[:, i] * along**2 for i in range(3)]
    return np.stack(strains + bends, axis=1)


def beam_deformations(part: Component, order: int) -> FloatArray:
    """Return what the measured displacements see of a beam along the longest axis, (n_rows, 6 order): its sections shift and
    turn by powers of the place, shifts to one power above that of the turns, as those of a slender beam do."""
    centred, along = _lengthwise(part)
    shifts = [part.ways[:, i] * along**power for power in range(2, order + 2) for i in range(3)]
    turned = np.cross(centred, part.ways)
    turns = [turned[:, i] * along**power for power in range(1, order + 1) for i in range(3)]
    return np.stack(shifts + turns, axis=1)


def _lengthwise(part: Component) -> tuple[FloatArray, FloatArray]:
    """Places from the centre, and along the longest axis, in units of the component's size."""
    centred = (part.places - part.centre) / part.size
    return centred, centred @ np.linalg.svd(part.at - part.centre, full_matrices=False)[2][0]
