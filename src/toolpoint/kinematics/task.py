r"""Task: coordinates of the tool (place, tilt, azimuth, torsion) in which a chain is commanded in place of its own axes.

The tool's axis is :math:`d = R_z(\varphi) R_y(\theta) e_z`, azimuth :math:`\varphi`, tilt :math:`\theta`; with torsion
:math:`\sigma` the whole orientation is :math:`R_z(\varphi) R_y(\theta) R_z(\sigma - \varphi)` (tilt and torsion angles: Bonev,
Zlatanov, Gosselin, Proc. Parallel Kinematic Machines, Chemnitz 2002).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray, fail, floats, one_of
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew

PLACES, ANGLES = ("x", "y", "z"), ("tilt", "azimuth", "torsion")
COORDINATES = PLACES + ANGLES


@dataclass(frozen=True, eq=False)
class Task:
    """Coordinates of a point and a direction of a link, and the driven axes that are solved for them.

    Parameters
    ----------
    link : int
    point : (3,) floats
        Reference coordinates in the machine frame, m.
    direction : (3,) floats
        Unit direction of the tool at the reference pose, machine frame.
    axes : names of the driven axes that the coordinates stand in place of
    coordinates : mapping of name (``Z``) to coordinate (``x y z tilt azimuth torsion``)

    Raises
    ------
    ToolpointError
        For other coordinates than axes in number, azimuth without tilt, torsion without azimuth.

    Examples
    --------
    A tool of a link that has turned by 0.2 rad about y is tilted by 0.2 rad:

    >>> from toolpoint.spatial.transform import transform
    >>> task = Task(0, [0, 0, 0.1], [0, 0, 1], ("A",), {"tilt": "tilt"})
    >>> read = task.read(transform(rot.about("y", 0.2))[None, None])
    >>> round(float(read["tilt"][0]), 9)
    0.2
    """

    link: int
    point: FloatArray
    direction: FloatArray
    axes: tuple[str, ...]
    coordinates: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", floats("Task.point", self.point, (3,)))
        direction = floats("Task.direction", self.direction, (3,))
        length = float(np.linalg.norm(direction))
        if length == 0:
            fail("Task.direction", "length 0", "must not be zero")
        object.__setattr__(self, "direction", direction / length)
        for name, kind in self.coordinates.items():
            one_of(f"task.{name}", kind, COORDINATES)
        kinds = list(self.coordinates.values())
        if ("azimuth" in kinds and "tilt" not in kinds) or ("torsion" in kinds and "azimuth" not in kinds):
            fail("task", "azimuth without tilt, or torsion without azimuth",
                 "an orientation is tilt, azimuth, torsion in turn")
        if len(set(kinds)) < len(kinds):
            fail("task", f"coordinates {', '.join(kinds)}", "must differ")
        if self.equations != len(self.axes):
            fail("task", f"{self.equations} coordinates for {len(self.axes)} axes", "must be as many as axes",
                 remedy="name the axes that are solved under `axes`, and a coordinate for each")

    @cached_property
    def kinds(self) -> frozenset[str]:
        """The coordinates in use."""
        return frozenset(self.coordinates.values())

    @property
    def equations(self) -> int:
        """Number of equations."""
        return len(self.kinds)

    @cached_property
    def rest_turn(self) -> FloatArray:
        """The smallest turn that brings z onto the tool's direction at the reference pose, (3, 3)."""
        return smallest_turn(self.direction)

    def read(self, moved: FloatArray) -> dict[str, FloatArray]:
        """Return all six coordinates by kind, (P,) each, for displacements of the links (P, n_links, 4, 4), m and rad."""
        place = tf.move(moved[:, self.link], self.point[None])[:, 0]
        turn = moved[:, self.link, :3, :3] @ self.rest_turn
        d = turn[:, :, 2]
        # An upright tool has no azimuth: zero, where rounding would give any.
        azimuth = np.where(np.hypot(d[:, 0], d[:, 1]) > 1e-12, np.arctan2(d[:, 1], d[:, 0]), 0.0)
        untilted = np.swapaxes(orientation(np.arccos(np.clip(d[:, 2], -1, 1)), azimuth, np.zeros_like(azimuth)), -1, -2) @ turn
        values = {name: place[:, i] for i, name in enumerate(PLACES)}
        # The angle of the tool from its horizontal part, accurate near zero where the cosine is not.
        values["tilt"] = np.arctan2(np.hypot(d[:, 0], d[:, 1]), d[:, 2])
        return values | {"azimuth": azimuth, "torsion": np.arctan2(untilted[:, 1, 0], untilted[:, 0, 0])}

    def residual(self, moved: FloatArray, target: Mapping[str, FloatArray]) -> FloatArray:
        """Return the residual of the tool against target coordinates (by kind, (P,) each), shape (P, n_equations)."""
        place = tf.move(moved[:, self.link], self.point[None])[:, 0]
        rows = [place[:, i] - target[name] for i, name in enumerate(PLACES) if name in self.kinds]
        if "tilt" in self.kinds:
            rows += list(self._orientation_rows(moved, target).T)
        return np.stack(rows, axis=-1)

    def _orientation_rows(self, moved: FloatArray, target: Mapping[str, FloatArray]) -> FloatArray:
        goal = self._goal(target)
        turn = moved[:, self.link, :3, :3] @ self.rest_turn
        if "torsion" in self.kinds:
            e = turn @ np.swapaxes(goal, -1, -2)
            return 0.5 * np.stack([e[:, 2, 1] - e[:, 1, 2], e[:, 0, 2] - e[:, 2, 0], e[:, 1, 0] - e[:, 0, 1]], axis=-1)
        # The tool has no part along the two axes across its goal: smooth also upright, where azimuth itself is not.
        across = np.swapaxes(goal[:, :, :2], -1, -2) @ turn[:, :, 2, None]
        return across[:, :len(self.kinds & {"tilt", "azimuth"}), 0]

    def _goal(self, target: Mapping[str, FloatArray]) -> FloatArray:
        zero = np.zeros_like(target["tilt"])
        return orientation(target["tilt"], target.get("azimuth", zero), target.get("torsion", zero))

    def rate(self, moved: FloatArray, twists: FloatArray, target: Mapping[str, FloatArray]) -> FloatArray:
        """Return the rate of the residual for twists of the link (P, k, 6) about the machine's origin, (P, n_equations, k)."""
        place = tf.move(moved[:, self.link], self.point[None])[:, 0]
        velocity = np.swapaxes(twists[:, :, :3] - np.cross(place[:, None], twists[:, :, 3:]), -1, -2)
        turning = np.swapaxes(twists[:, :, 3:], -1, -2)
        rows = [velocity[:, [i]] for i, name in enumerate(PLACES) if name in self.kinds]
        if "tilt" in self.kinds:
            rows.append(self._orientation_rate(moved, turning, target))
        return np.concatenate(rows, axis=1)

    def _orientation_rate(self, moved: FloatArray, turning: FloatArray, target: Mapping[str, FloatArray]) -> FloatArray:
        goal = self._goal(target)
        turn = moved[:, self.link, :3, :3] @ self.rest_turn
        if "torsion" in self.kinds:
            e = turn @ np.swapaxes(goal, -1, -2)
            trace = np.trace(e, axis1=-2, axis2=-1)[:, None, None]
            return 0.5 * (trace * np.eye(3) - e) @ turning
        rate = np.swapaxes(goal[:, :, :2], -1, -2) @ -skew(turn[:, :, 2]) @ turning
        return rate[:, :len(self.kinds & {"tilt", "azimuth"})]


def orientation(tilt: FloatArray, azimuth: FloatArray, torsion: FloatArray) -> FloatArray:
    """Return Rz(azimuth) Ry(tilt) Rz(torsion - azimuth) for angles in rad, shape (..., 3, 3)."""
    return rot.about("z", azimuth) @ rot.about("y", tilt) @ rot.about("z", np.asarray(torsion) - azimuth)
