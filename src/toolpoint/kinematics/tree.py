"""TreeChain: bodies on joints in a tree, some joints driven by linear or rotary axes; forward, Jacobian, inverse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, suggestion
from toolpoint.kinematics.axis import Axis
from toolpoint.kinematics.chain import Pose, check_pose
from toolpoint.spatial import transform as tf


@dataclass(frozen=True, eq=False)
class TreeChain:
    """A tree of links; link i hangs by joint i on its parent (a smaller index, or -1 for the ground).

    Parameters
    ----------
    parents : (n,) ints
    frames : (n, 4, 4) floats
        Frame of every joint in the machine frame at the reference pose (all axes at zero).
    axes : sequence of Axis
        Several axes may move one joint; they act in the order given, the first nearest to the parent.
    """

    parents: tuple[int, ...]
    frames: FloatArray
    axes: tuple[Axis, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "parents", tuple(int(p) for p in self.parents))
        object.__setattr__(self, "frames", floats("frames", self.frames, (len(self.parents), 4, 4)))
        for i, parent in enumerate(self.parents):
            if not -1 <= parent < i:
                fail("parents", f"link {i} hangs on {parent}", "must hang on the ground (-1) or an earlier link")

    def positions(self, pose: Pose) -> FloatArray:
        """Return axis positions as an array (n_poses, n_axes), checked against names and limits; absent axes are at 0."""
        names = [axis.name for axis in self.axes]
        for name in check_pose(pose):
            if name not in names:
                fail("pose", f"no axis {name!r}", f"must be of {', '.join(names) or 'none'}", suggestion(name, names))
        values = [axis.checked(floats(f"pose {axis.name}", np.atleast_1d(pose.get(axis.name, 0.0)))) for axis in self.axes]
        lengths = {v.size for v in values if v.size != 1} or {1}
        if len(lengths) > 1 or any(v.ndim != 1 for v in values):
            fail("pose", f"axes with {sorted(lengths)} positions", "must all have one position or the same number")
        count = lengths.pop()
        return np.stack([np.broadcast_to(v, (count,)) for v in values], axis=-1) if values else np.zeros((1, 0))

    def joint_motions(self, pose: Pose) -> FloatArray:
        """Return the motion of every joint in its own frame, shape (n_poses, n_joints, 4, 4)."""
        at = self.positions(pose)
        result = np.broadcast_to(np.eye(4), (len(at), len(self.parents), 4, 4)).copy()
        for k, axis in enumerate(self.axes):
            step = tf.exponential(at[:, k, None] * axis.twist)
            result[:, axis.joint] = result[:, axis.joint] @ step
        return result

    def displacements(self, pose: Pose) -> FloatArray:
        """Return the displacement of every link from its reference place, shape (n_poses, n_links, 4, 4)."""
        motions = self.joint_motions(pose)
        result = np.empty_like(motions)
        for i, parent in enumerate(self.parents):
            step = self.frames[i] @ motions[:, i] @ tf.inverse(self.frames[i])
            result[:, i] = step if parent < 0 else result[:, parent] @ step
        return result

    def axis_twists(self, pose: Pose) -> FloatArray:
        """Return the unit twist of every axis in the machine frame about its origin, shape (n_poses, n_axes, 6)."""
        moved = self.displacements(pose)
        at = self.positions(pose)
        result = np.empty((len(at), len(self.axes), 6))
        inner: dict[int, FloatArray] = {}
        for k, axis in enumerate(self.axes):
            parent = self.parents[axis.joint]
            base = self.frames[axis.joint] if parent < 0 else moved[:, parent] @ self.frames[axis.joint]
            frame = base @ inner.get(axis.joint, np.eye(4))
            result[:, k] = tf.adjoint(np.broadcast_to(frame, (len(at), 4, 4))) @ axis.twist
            inner[axis.joint] = inner.get(axis.joint, np.eye(4)) @ tf.exponential(at[:, k, None] * axis.twist)
        return result

    def path(self, link: int) -> tuple[int, ...]:
        """Return the links from the ground to a link, itself included."""
        chain = []
        while link >= 0:
            chain.append(link)
            link = self.parents[link]
        return tuple(reversed(chain))

    def jacobian(self, pose: Pose, link: int, point: ArrayLike) -> FloatArray:
        """Return the twist (v, w) of a link about one of its points (reference coordinates, m), (n_poses, 6, n_axes)."""
        twists = self.axis_twists(pose)
        place = tf.move(self.displacements(pose)[:, link], floats("point", point, (3,))[None])[:, 0]
        on_path = np.isin([axis.joint for axis in self.axes], self.path(link)) if self.axes else np.zeros(0, bool)
        shift = tf.adjoint(tf.transform(None, -place))
        return (shift @ np.swapaxes(twists * on_path[:, None], -1, -2))

    def relative_position(self, pose: Pose, tool: tuple[int, ArrayLike], table: tuple[int, ArrayLike]) -> FloatArray:
        """Return the tool point in the axes of the table, from the table point, m, shape (n_poses, 3)."""
        moved = self.displacements(pose)
        link_t, link_w = moved[:, tool[0]], moved[:, table[0]]
        p = tf.move(link_t, np.asarray(tool[1], float)[None])[:, 0]
        q = tf.move(link_w, np.asarray(table[1], float)[None])[:, 0]
        return ((p - q)[:, None, :] @ link_w[:, :3, :3])[:, 0]

    def inverse(self, position: ArrayLike, tool: tuple[int, ArrayLike], table: tuple[int, ArrayLike]) -> dict[str, float]:
        """Return the pose that brings the tool point to `position` (m) in the table's axes, by linear axes in closed form.

        Needs linear axes only that span the directions asked for; the axis limits are checked.
        """
        target = floats("position", position, (3,))
        if any(axis.is_rotary for axis in self.axes):
            fail("inverse", "a rotary axis", "this closed form needs linear axes only")
        start = self.relative_position({}, tool, table)[0]
        columns = np.stack([
            self._linear_step(k, tool[0]) - self._linear_step(k, table[0]) for k in range(len(self.axes))], axis=1)
        values, *_ = np.linalg.lstsq(columns, target - start, rcond=None)
        error = float(np.linalg.norm(start + columns @ values - target))
        if error > 1e-9:
            fail("position", f"{target}", "cannot be reached with these axes", f"nearest is {error:.3g} m away")
        return {axis.name: float(axis.checked(np.atleast_1d(v))[0]) for axis, v in zip(self.axes, values, strict=True)}

    def _linear_step(self, axis: int, link: int) -> FloatArray:
        joint = self.axes[axis].joint
        if joint not in self.path(link):
            return np.zeros(3)
        return self.frames[joint][:3, :3] @ self.axes[axis].twist[:3]

    def __repr__(self) -> str:
        return f"TreeChain({len(self.parents)} links, axes {', '.join(a.name for a in self.axes) or 'none'})"
