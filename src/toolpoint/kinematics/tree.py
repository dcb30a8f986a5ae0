"""TreeChain: links on joints in a tree, some joint directions driven by axes, some passive; forward, Jacobian, inverse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import BoolArray, FloatArray, fail, floats, suggestion
from toolpoint._notebook import NotebookText
from toolpoint.kinematics.axis import AXES, Axis
from toolpoint.kinematics.chain import Pose, check_pose
from toolpoint.kinematics.steps import Step, step_motion, step_sequence
from toolpoint.spatial import transform as tf


@dataclass(frozen=True, eq=False)
class TreeChain(NotebookText):
    """Tree of links; link i hangs by joint i on its parent (a smaller index, or -1 for the ground).

    Every joint moves by steps, motions along or about one of its directions: first those that axes drive, in the order of the
    axes (the first nearest to the parent), then the passive ones, which stand still unless a loop moves them.

    Parameters
    ----------
    parents : (n,) ints
    frames : (n, 4, 4) floats
        Frame of every joint in the machine frame at the reference pose (all axes at rest).
    axes : sequence of Axis
    passive : sequence of Step
        Passive steps; those of one joint together, translations before rotations. Three rotations of one joint are a ball.

    Raises
    ------
    ToolpointError
        For a parent that is no earlier link, and axes that drive the same joint directions alike.

    Examples
    --------
    A rotary table on a slide; a point 0.1 m off its axis, after a quarter turn:

    >>> from toolpoint.kinematics import Axis, Drive
    >>> axes = (Axis("X", (Drive(0, "x"),)), Axis("C", (Drive(1, "rz"),)))
    >>> chain = TreeChain((-1, 0), [np.eye(4), np.eye(4)], axes)
    >>> moved = chain.displacements({"X": 0.5, "C": np.pi / 2})[0, 1]
    >>> (moved @ [0.1, 0, 0, 1])[:3].round(9).tolist()
    [0.5, 0.1, 0.0]
    """

    parents: tuple[int, ...]
    frames: FloatArray
    axes: tuple[Axis, ...] = ()
    passive: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "parents", tuple(int(p) for p in self.parents))
        object.__setattr__(self, "frames", floats("frames", self.frames, (len(self.parents), 4, 4)))
        for i, parent in enumerate(self.parents):
            if not -1 <= parent < i:
                fail("parents", f"link {i} hangs on {parent}", "must hang on the ground (-1) or an earlier link")
        # By rank and not pair by pair: three axes may depend on each other of which no two do.
        if self.driven_axes and np.linalg.matrix_rank(self.coupling) < len(self.driven_axes):
            fail("axes", _clash_words(self.driven_axes), "must not move the same joint directions alike",
                 remedy="remove one of the axes, or let each drive a direction of its own")

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """The steps of all joints: driven ones in the order of the axes, then passive ones."""
        driven = dict.fromkeys(Step(drive.joint, drive.way) for axis in self.axes for drive in axis.drives)
        return (*driven, *self.passive)

    @cached_property
    def driven_axes(self) -> tuple[Axis, ...]:
        """The axes that drive joints; the others are coordinates of the tool."""
        return tuple(axis for axis in self.axes if axis.drives)

    @cached_property
    def coupling(self) -> FloatArray:
        """Motion of every step per m or rad of every driven axis, shape (n_steps, n_driven)."""
        matrix = np.zeros((len(self.steps), len(self.driven_axes)))
        for k, axis in enumerate(self.driven_axes):
            for drive in axis.drives:
                matrix[self.steps.index(Step(drive.joint, drive.way)), k] += drive.rate
        return matrix

    @cached_property
    def sequences(self) -> tuple[tuple[tuple[int, ...], ...], ...]:
        """Steps of every joint in their order: single ones, and the three of a ball together."""
        return tuple(step_sequence(self.steps, joint) for joint in range(len(self.parents)))

    @cached_property
    def on_path(self) -> BoolArray:
        """Whether a step moves a link, shape (n_links, n_steps)."""
        joints = np.array([step.joint for step in self.steps], int)
        links = range(len(self.parents))
        return np.array([np.isin(joints, self.path(link)) for link in links]).reshape(len(links), joints.size)

    def batch(self, pose: Pose) -> dict[str, FloatArray]:
        """Return the positions that a pose names, all arrays of one length, checked against names and limits."""
        axes_by_name = {axis.name: axis for axis in self.axes}
        for name in check_pose(pose):
            if name not in axes_by_name:
                fail("pose", f"no axis {name!r}", f"must be of {', '.join(axes_by_name) or 'none'}",
                     remedy=suggestion(name, axes_by_name))
        values = {name: axes_by_name[name].checked(floats(f"pose {name}", np.atleast_1d(value))) for name,
                  value in pose.items()}
        lengths = {v.size for v in values.values() if v.size != 1} or {1}
        if len(lengths) > 1 or any(v.ndim != 1 for v in values.values()):
            fail("pose", f"axes with {sorted(lengths)} positions", "must all have one position or the same number")
        count = lengths.pop()
        return {name: np.broadcast_to(v, (count,)) for name, v in values.items()}

    def chunks(self, pose: Pose, size: int) -> Iterator[dict[str, FloatArray]]:
        """Yield a batch of poses in parts of at most `size`."""
        batch = self.batch(pose)
        count = len(next(iter(batch.values()))) if batch else 1
        for start in range(0, count, size):
            yield {name: positions[start:start + size] for name, positions in batch.items()}

    def positions(self, pose: Pose) -> FloatArray:
        """Return the positions of the driven axes, m or rad, shape (n_poses, n_driven); absent axes are at rest."""
        batch = self.batch(pose)
        count = len(next(iter(batch.values()))) if batch else 1
        values = [batch[axis.name] if axis.name in batch else axis.checked(np.array([axis.reference_position]))
                  for axis in self.driven_axes]
        return np.stack([np.broadcast_to(v, (count,)) for v in values], axis=-1) if values else np.zeros((count, 0))

    def step_values(self, pose: Pose) -> FloatArray:
        """Return the value of every step, m or rad, shape (n_poses, n_steps); a ball's three are a rotation vector."""
        return self.driven_values(self.positions(pose))

    def settled(self, pose: Pose) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the step values of a batch of poses, and remarks on them."""
        return self.step_values(pose), ()

    def driven_values(self, positions: FloatArray) -> FloatArray:
        """Return the values of all steps for positions of the driven axes (n_poses, n_driven), passive ones at zero."""
        reference_positions = np.array([axis.reference_position for axis in self.driven_axes])
        return (positions - reference_positions) @ self.coupling.T

    def motions_of(self, values: FloatArray) -> FloatArray:
        """Return the motion of every joint in its own frame for step values, shape (n_poses, n_joints, 4, 4)."""
        result = np.broadcast_to(np.eye(4), (len(values), len(self.parents), 4, 4)).copy()
        for joint, sequence in enumerate(self.sequences):
            for k, group in enumerate(sequence):
                step = step_motion(self.steps, group, values)
                result[:, joint] = step if k == 0 else result[:, joint] @ step
        return result

    def displacements_of(self, motions: FloatArray) -> FloatArray:
        """Return the displacement of every link for joint motions, shape (n_poses, n_links, 4, 4)."""
        result = np.empty_like(motions)
        for i, parent in enumerate(self.parents):
            # F m F^-1 is the joint's motion in the machine frame; a link without steps moves as its parent, and costs no
            # product.
            step = self.frames[i] @ motions[:, i] @ tf.inverse(self.frames[i]) if self.sequences[i] else None
            if parent < 0:
                result[:, i] = np.eye(4) if step is None else step
            else:
                result[:, i] = result[:, parent] if step is None else result[:, parent] @ step
        return result

    def joint_motions(self, pose: Pose) -> FloatArray:
        """Return the motion of every joint in its own frame, shape (n_poses, n_joints, 4, 4)."""
        return self.motions_of(self.step_values(pose))

    def displacements(self, pose: Pose) -> FloatArray:
        """Return the displacement of every link from its reference place, shape (n_poses, n_links, 4, 4)."""
        return self.displacements_of(self.joint_motions(pose))

    def twists_of(self, values: FloatArray, moved: FloatArray) -> FloatArray:
        """Return the unit twist of every step about the machine's origin for step values and displacements, (P, n_steps, 6).

        Those of a ball are about its moved directions: its rotation vector grows by a turn about them.
        """
        result = np.empty((len(values), len(self.steps), 6))
        for joint, sequence in enumerate(self.sequences):
            parent = self.parents[joint]
            frame = np.broadcast_to(self.frames[joint], (len(values), 4, 4)) if parent < 0 else moved[:, parent] @ self.frames[
                joint]
            for group in sequence:
                after = frame @ step_motion(self.steps, group, values)
                for k in group:
                    way = self.steps[k].way
                    # A step leaves its own direction as it is, so the frame after it serves as well as the frame before.
                    unit = after[:, :3, way % 3]
                    if way < 3:
                        result[:, k, :3], result[:, k, 3:] = unit, 0.0
                    else:
                        result[:, k, :3], result[:, k, 3:] = np.cross(after[:, :3, 3], unit), unit
                frame = after
        return result

    def rates_at(self, values: FloatArray) -> FloatArray:
        """Return the rate of every step per rate of every driven axis for step values, (n_poses or 1, n_steps, n_driven)."""
        return self.coupling[None]

    def axis_twists(self, pose: Pose, link: int) -> FloatArray:
        """Return the twist of a link per rate of every driven axis, machine frame and origin, shape (n_poses, n_driven, 6)."""
        values = self.step_values(pose)
        twists = self.twists_of(values, self.displacements_of(self.motions_of(values))) * self.on_path[link][:, None]
        return np.swapaxes(self.rates_at(values), -1, -2) @ twists

    def path(self, link: int) -> tuple[int, ...]:
        """Return the links from the ground to a link, itself included."""
        chain = []
        while link >= 0:
            chain.append(link)
            link = self.parents[link]
        return tuple(reversed(chain))

    def jacobian(self, pose: Pose, link: int, point: ArrayLike) -> FloatArray:
        """Return the twist (v, w) of a link about one of its points (reference coordinates, m), (n_poses, 6, n_driven)."""
        place = tf.move(self.displacements(pose)[:, link], floats("point", point, (3,))[None])[:, 0]
        # A twist about the origin becomes one about p by v + w x p, the adjoint of a shift by -p.
        shift = tf.adjoint(tf.transform(None, -place))
        return shift @ np.swapaxes(self.axis_twists(pose, link), -1, -2)

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
        if any(axis.is_rotary for axis in self.axes) or self.passive:
            fail("inverse", "a rotary axis or a passive joint", "this closed form needs linear axes only",
                 remedy="use kinematics.arms.inverse.solve_inverse")
        reference_pose: Mapping[str, float] = {}
        start = self.relative_position(reference_pose, tool, table)[0]
        columns = (self.axis_twists(reference_pose, tool[0]) - self.axis_twists(reference_pose, table[0]))[0, :, :3].T
        # Axes may be more than the directions, or fewer where the target lies within what they span: the error says whether
        # it does.
        values, *_ = np.linalg.lstsq(columns, target - start, rcond=None)
        error = float(np.linalg.norm(start + columns @ values - target))
        if error > 1e-9:
            fail("position", f"{target}", "cannot be reached with these axes", remedy=f"nearest is {error:.3g} m away")
        return {axis.name: float(axis.checked(np.atleast_1d(v + axis.reference_position))[0])
                for axis, v in zip(self.driven_axes, values, strict=True)}

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self.parents)} links, axes {', '.join(a.name for a in self.axes) or 'none'})"


def _clash_words(axes: tuple[Axis, ...]) -> str:
    """Name two axes that drive one joint direction."""
    users: dict[Step, str] = {}
    for axis in axes:
        for drive in axis.drives:
            step = Step(drive.joint, drive.way)
            if step in users and users[step] != axis.name:
                return f"{users[step]} and {axis.name} both drive direction {AXES[step.way]} of joint {step.joint}"
            users[step] = axis.name
    return f"{', '.join(axis.name for axis in axes)} depend on each other"
