r"""Rigid motion of a component in every mode: the closed-form small-motion fit, and how rigid the component is.

A point p of a rigid component moves by :math:`u = v + w \times p`, so a shape is linear in the twist (v, w). The
weighted least-squares twist and its covariance are those of linear regression (Gauss-Markov); the mean square of the
weighted residual rescales the covariance (Birge, Phys. Rev. 40 (1932) 207).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from toolpoint._check import LEFT_OUT, BoolArray, FloatArray
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
    full_covariance : (n_columns, 6, n_columns, 6) floats
        Covariance of all twists together, see `motion_errors`; its diagonal blocks are `covariance`.
    gain_errors : (n_columns, 6, n) floats
        Change of all twists by one standard deviation of each independent combination of the gains of the sensor's directions
        (`sensor_gains`), common to all components and not in the covariances.

    >>> from toolpoint.joint_identification.motion.measured import component
    >>> from toolpoint.vibration import Modes
    >>> points = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (0.0, 1.0, 0.0)}
    >>> dofs = [f"{name}:+{axis}" for name in points for axis in "xyz"]
    >>> turn = [np.cross((0.0, 0.0, 1.0), place) for place in points.values()]
    >>> part = component("head", Modes([50.0], [0.02], np.ravel(turn)[:, None], dofs), points, labels=list(points))
    >>> bool(rigid_motion(part).residual[0] < 1e-12)  # a turn leaves nothing that bends
    True
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
    full_covariance: FloatArray
    gain_errors: FloatArray = LEFT_OUT

    def bends(self, significance: float = 1e-4, floor: float = 1e-3) -> BoolArray:
        """Whether the component bends in each column: bending_p < significance and bending > floor."""
        return (self.bending_p < significance) & (self.bending > floor)

    def __repr__(self) -> str:
        return (f"RigidMotion({self.component!r}, {self.twist.shape[1]} columns, residual up to "
                f"{100 * self.residual.max():.2g} %)")


@dataclass(frozen=True)
class SmallMotion:
    """Closed-form weighted least-squares twist of small motions: the default.

    >>> from toolpoint.joint_identification.motion.measured import component
    >>> from toolpoint.vibration import Modes
    >>> points = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (0.0, 1.0, 0.0)}
    >>> dofs = [f"{name}:+{axis}" for name in points for axis in "xyz"]
    >>> turn = [np.cross((0.0, 0.0, 1.0), place) for place in points.values()]  # about z, through the origin
    >>> part = component("head", Modes([50.0], [0.02], np.ravel(turn)[:, None], dofs), points, labels=list(points))
    >>> bool(np.allclose(SmallMotion().twists(part)[:, 0], [0, 0, 0, 0, 0, 1]))
    True
    """

    def twists(self, part: Component) -> FloatArray:
        """Return the twists (6, n_columns) about the origin."""
        return _solve_twists(part)[0]


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
    least_squares, covariance, weights = _solve_twists(part)
    twist = least_squares if twist is None else twist
    error = (part.values - part.rows @ twist) * weights
    freedom = max(len(part.rows) - 6 - round(absorbed), 1)
    excess = (error**2).sum(axis=0) / freedom
    is_known = part.variance is not None
    # The scale factor only widens: a residual that is small by chance does not make the known noise smaller.
    factor = np.maximum(excess, 1.0 if is_known else part.min_variance)
    power = (part.values**2).sum(axis=0)
    power = np.where(power > 0, power, 1.0)
    misfit = ((part.values - part.rows @ twist) ** 2).sum(axis=0)
    share, chance = _bending(part, weights)
    has_no_share, residual = np.isnan(share), np.sqrt(misfit / power)
    share = np.where(has_no_share, residual, share)
    chance = np.where(has_no_share, stats.chi2.sf(excess * freedom, freedom) if is_known else np.nan, chance)
    covariance = covariance * factor[:, None, None]
    full, columns = np.zeros((len(factor), 6, len(factor), 6)), np.arange(len(factor))
    full[columns, :, columns] = covariance
    return RigidMotion(part.name, twist, covariance, residual, excess if is_known else np.ones_like(excess), share, chance,
                       freedom, factor / weights**2, full, np.zeros((len(factor), 6, 0)))


def _weights(part: Component) -> FloatArray:
    """Return one over the standard deviation of every displacement."""
    return np.ones_like(part.values) if part.variance is None else 1 / np.sqrt(part.variance)


def _solve_twists(part: Component) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return twists, covariances and weights of the least-squares fits of all columns."""
    weights = _weights(part)
    to_origin = about(part.centre, part.size)
    local = part.rows @ to_origin
    count = part.values.shape[1]
    twist, covariance = np.empty((6, count)), np.empty((count, 6, 6))
    for i in range(count):
        q, r = np.linalg.qr(local * weights[:, i, None])
        root = np.linalg.solve(r, np.eye(6))
        twist[:, i] = to_origin @ (root @ (q.T @ (part.values[:, i] * weights[:, i])))
        covariance[i] = to_origin @ root @ root.T @ to_origin.T
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
        residual, extra = y - rigid @ (rigid.T @ y), shapes * w
        directions, values, _ = np.linalg.svd(extra - rigid @ (rigid.T @ extra), full_matrices=False)
        directions = directions[:, values > 1e-6 * values.max(initial=0.0)] if values.size else directions[:, :0]
        free = len(y) - 6 - directions.shape[1]
        if directions.shape[1] == 0 or free < 3:
            share[i] = np.nan
            continue
        explained = directions @ (directions.T @ residual)
        explained_power, remaining_power = float(explained @ explained), float(((residual - explained) ** 2).sum())
        power = float((part.values[:, i] ** 2).sum())
        if power <= 0 or explained_power + remaining_power <= 1e-24 * float(y @ y):
            continue
        # In the unit of the motion, without the share that noise alone would explain.
        net = max(float(((explained / w[:, 0]) ** 2).sum())
                  * (1 - directions.shape[1] * remaining_power / free / max(explained_power, 1e-300)), 0)
        share[i] = np.sqrt(net / power)
        ratio = explained_power / directions.shape[1] / max(remaining_power / free, 1e-300)
        chance[i] = stats.f.sf(ratio, directions.shape[1], free)
    return share, chance


def deformations(part: Component) -> FloatArray:
    """Return the smooth deformations seen by the measured displacements: six strains, bending along the longest axis."""
    centred, along = _places_along(part)
    strains = []
    for i in range(3):
        for j in range(i, 3):
            strains.append(part.ways[:, i] * centred[:, j] + (part.ways[:, j] * centred[:, i] if j > i else 0))
    bends = [part.ways[:, i] * along**2 for i in range(3)]
    return np.stack(strains + bends, axis=1)


def beam_deformations(part: Component, order: int) -> FloatArray:
    """Return the displacements by beam deformations along the longest axis, (n_rows, 6 order).

    Sections shift and rotate by powers of the place, shifts to one power above that of the rotations, as in a slender beam.
    """
    centred, along = _places_along(part)
    shifts = [part.ways[:, i] * along**power for power in range(2, order + 2) for i in range(3)]
    turned = np.cross(centred, part.ways)
    turns = [turned[:, i] * along**power for power in range(1, order + 1) for i in range(3)]
    return np.stack(shifts + turns, axis=1)


def _places_along(part: Component) -> tuple[FloatArray, FloatArray]:
    """Places from the centre, and along the longest axis, in units of the component's size."""
    centred = (part.places - part.centre) / part.size
    return centred, centred @ np.linalg.svd(part.at - part.centre, full_matrices=False)[2][0]
