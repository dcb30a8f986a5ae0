r"""Motion of a component relative to the one before it, and the screw axis of every mode, with their uncertainty.

For finite motions the motion of the component before is undone, :math:`E_{rel} = E_{i-1}'^{-1} E_i'` (with the rest
position as reference, :math:`E_{GG'} = E'_{0(i-1)} E_{0(i-1)}^{-1}`); for small ones the twists are subtracted.
Source: Machines 2022, 10(11), 1102, eqs. 1-6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.joint_identification.motion.rigid_motion import RigidMotion
from toolpoint.spatial.screw import Screw, screw


@dataclass(frozen=True, eq=False)
class RelativeMotion(NotebookText):
    """Twists (6, n_columns) about the origin of `child` relative to `parent`, their covariance, and the scale of both.

    `motion` (n_columns,) is the larger of the two components' rms motions; `centre` (3,) a point between the two (m),
    `size` (m) the extent of the larger one; `freedom` the degrees of freedom behind the covariance; `full_covariance`
    (n_columns, 6, n_columns, 6) is the covariance of all columns together.
    """

    parent: str
    child: str
    twist: FloatArray
    covariance: FloatArray
    motion: FloatArray
    centre: FloatArray
    size: float
    freedom: int
    full_covariance: FloatArray

    @property
    def axes(self) -> tuple[ScrewAxis, ...]:
        """Screw axis of every column."""
        return tuple(screw_axis(self.twist[:, i], self.covariance[i]) for i in range(self.twist.shape[1]))

    def __repr__(self) -> str:
        return f"RelativeMotion({self.child!r} on {self.parent!r}, {self.twist.shape[1]} columns)"


@dataclass(frozen=True, eq=False)
class ScrewAxis(NotebookText):
    """Axis of one relative motion.

    `screw` has direction, point and pitch; `direction_deviation` (3,), `point_deviation` (3,) m and `pitch_deviation`
    m/rad are standard deviations; `rotation_p` is the probability of so large a rotation by noise alone: above a few
    per cent the axis is not determined.
    """

    screw: Screw
    direction_deviation: FloatArray
    point_deviation: FloatArray
    pitch_deviation: float
    rotation_p: float

    def __repr__(self) -> str:
        angle = np.degrees(np.linalg.norm(self.direction_deviation))
        return f"ScrewAxis({self.screw!r}, ± {angle:.2g} deg, ± {np.linalg.norm(self.point_deviation):.2g} m)"


def screw_axis(twist: FloatArray, covariance: FloatArray) -> ScrewAxis:
    r"""Return the screw axis of a twist (v, w) about the origin, with first-order uncertainty.

    :math:`u = w/|w|,\ p = w \times v/|w|^2,\ h = w \cdot v/|w|^2`.
    """
    axis = screw(twist)
    v, w = twist[:3], twist[3:]
    rotation_square = float(w @ w)
    statistic = float(w @ np.linalg.lstsq(covariance[3:, 3:], w, rcond=None)[0])
    chance = float(stats.chi2.sf(statistic, 3))
    if np.isinf(axis.pitch):
        spread = np.sqrt(np.diag(covariance)[:3]) / max(axis.magnitude, 1e-300)
        return ScrewAxis(axis, spread, np.full(3, np.inf), np.inf, chance)
    size = np.sqrt(rotation_square)
    direction = np.hstack([np.zeros((3, 3)), (np.eye(3) - np.outer(w, w) / rotation_square) / size])
    point = np.empty((3, 6))
    point[:, :3] = _skew(w) / rotation_square
    point[:, 3:] = -_skew(v) / rotation_square - 2 * np.outer(axis.point, w) / rotation_square
    pitch = np.concatenate([w, v - 2 * axis.pitch * w]) / rotation_square
    turned, shifted = (np.sqrt(np.clip(np.diag(j @ covariance @ j.T), 0, None)) for j in (direction, point))
    return ScrewAxis(axis, turned, shifted, float(np.sqrt(np.clip(pitch @ covariance @ pitch, 0, None))), chance)


def _skew(v: FloatArray) -> FloatArray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def relative(parent: RigidMotion | None, child: RigidMotion, parent_name: str, *, scale: tuple[FloatArray, FloatArray, float]
             ) -> RelativeMotion:
    """Return the motion of `child` relative to `parent` (None: ground, at rest).

    `scale` is (motion, centre, size) of the pair. The errors of two components are taken as independent, but for those of the
    sensor's gains, which are common to both.
    """
    if parent is None:
        return _with_gain_errors(parent_name, child.component, child.twist, child.full_covariance + 0.0, child.gain_errors,
                                 scale=scale, freedom=child.freedom * child.twist.shape[1])
    return _with_gain_errors(parent_name, child.component, child.twist - parent.twist, child.full_covariance
                             + parent.full_covariance, child.gain_errors - parent.gain_errors, scale=scale,
                             freedom=(child.freedom + parent.freedom) * child.twist.shape[1])


def _with_gain_errors(parent: str, child: str, twist: FloatArray, full: FloatArray, gains: FloatArray, *,
                      scale: tuple[FloatArray, FloatArray, float], freedom: int) -> RelativeMotion:
    motion, centre, size = scale
    full += np.einsum("rin,sjn->risj", gains, gains)
    columns = np.arange(len(full))
    return RelativeMotion(parent, child, twist, full[columns, :, columns], motion, centre, size, freedom, full)
