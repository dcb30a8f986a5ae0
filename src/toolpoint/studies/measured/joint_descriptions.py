"""Identified joints as a machine file holds them: directions of a frame where possible, else screws; and their axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from toolpoint._check import FloatArray, fail
from toolpoint.joint_identification.machine.rigid_machine import ElasticJoint
from toolpoint.machine.components import DrivenAxis
from toolpoint.machine.description import AxisDescription, FrameDescription, JointDescription
from toolpoint.spatial import transform as tf

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
# Sine of the angle, and length (m), up to which an axis as given and a direction as identified count as one.
_AXIS_ANGLE_TOLERANCE, _AXIS_PLACE_TOLERANCE = 4e-3, 2e-3


@dataclass(frozen=True, eq=False)
class JointLayout:
    """Layout of a joint in a file.

    ways : the directions, empty for screws; turn : fixed motion (4, 4) from the identified frame to the written one; axes :
    axes of the joint with their direction in the written frame.
    """

    ways: tuple[str, ...]
    turn: FloatArray
    axes: Mapping[str, str]


def plan_layout(joint: ElasticJoint, ways: tuple[str, ...], axes: Mapping[str, DrivenAxis]) -> JointLayout:
    """Return how to write a joint that these axes move.

    An axis moves its joint along or about a direction of the joint's frame. Where the identified frame (or one turned about
    the only direction that a slide or hinge has) has that direction, the joint is written in directions; else the frame is the
    axis' own and the free motions are screws in it.
    """
    if not axes:
        return JointLayout(ways, np.eye(4), {})
    for frame in _frames_of(joint.frame, ways, [np.asarray(axis.direction) for axis in axes.values()]):
        names = {name: _direction_in(frame, axis) for name, axis in axes.items()}
        if all(names.values()):
            return JointLayout(ways, tf.inverse(joint.frame) @ frame, {name: str(way) for name, way in names.items()})
    frame = _axis_frame(list(axes.values()), joint.frame[:3, 3])
    return JointLayout((), tf.inverse(joint.frame) @ frame, _names_in(frame, axes))


def _names_in(frame: FloatArray, axes: Mapping[str, DrivenAxis]) -> dict[str, str]:
    result = {}
    for name, axis in axes.items():
        way = _direction_in(frame, axis)
        if way is None:
            fail(f"axes.{name}", "neither along nor square to the other axis of its joint",
                 "must be for one joint to hold both",
                 remedy="leave one of them out, or give it a component of its own")
        result[name] = way
    return result


def _frames_of(frame: FloatArray, ways: tuple[str, ...], directions: Sequence[FloatArray]) -> list[FloatArray]:
    """Return the frame, and where all its ways lie on one axis those turned about it that have a given direction."""
    result, letters = [frame], {way[-1] for way in ways}
    # Springs along several axes fix the frame; about a single axis it may be turned.
    if len(letters) > 1:
        return result
    i = "xyz".index(letters.pop()) if letters else 0
    for direction in directions:
        axis = frame[:3, i]
        across = direction - axis * (axis @ direction)
        # Only a direction square to that axis can be reached by turning about it.
        if abs(axis @ direction) > _AXIS_ANGLE_TOLERANCE:
            continue
        axes = np.zeros((3, 3))
        axes[:, i], axes[:, (i + 1) % 3] = axis, across / np.linalg.norm(across)
        axes[:, (i + 2) % 3] = np.cross(axes[:, i], axes[:, (i + 1) % 3])
        result.append(tf.transform(axes, frame[:3, 3]))
    return result


def _direction_in(frame: FloatArray, axis: DrivenAxis) -> str | None:
    """Return the direction of a frame that an axis goes along or about, None where it has none."""
    components = frame[:3, :3].T @ np.asarray(axis.direction)
    i = int(np.argmax(np.abs(components)))
    if np.linalg.norm(np.delete(components, i)) > _AXIS_ANGLE_TOLERANCE:
        return None
    if axis.turns and axis.at is not None:
        # Distance of the frame's origin from the line that the axis turns about.
        offset = np.cross(np.asarray(axis.at) - frame[:3, 3], np.asarray(axis.direction))
        if np.linalg.norm(offset) > _AXIS_PLACE_TOLERANCE:
            return None
    return ("-" if components[i] < 0 else "") + ("r" if axis.turns else "") + "xyz"[i]


def _axis_frame(axes: Sequence[DrivenAxis], place: FloatArray) -> FloatArray:
    """Return a frame whose directions are those of the axes, nearest to the machine's; at an axis that turns."""
    i = int(np.argmax(np.abs(axes[0].direction)))
    first = np.asarray(axes[0].direction) * np.sign(axes[0].direction[i])
    others = [np.asarray(axis.direction) for axis in axes[1:]] + [np.eye(3)[(i + 1) % 3]]
    # Any direction that is clearly not along the first: the third follows from both.
    second = next(o for o in others if np.linalg.norm(np.cross(first, o)) > 0.1)
    j = next(k for k in ((i + 1) % 3, (i + 2) % 3) if k != i and abs(second[k]) == np.abs(np.delete(second, i)).max())
    second = second - first * (first @ second)
    second = second / np.linalg.norm(second) * (np.sign(second[j]) or 1.0)
    result = np.zeros((3, 3))
    result[:, i], result[:, j] = first, second
    k = 3 - i - j
    result[:, k] = np.cross(result[:, (k + 1) % 3], result[:, (k + 2) % 3])
    turning = [axis.at for axis in axes if axis.turns and axis.at is not None]
    return tf.transform(result, np.asarray(turning[0]) if turning else place)


def describe_joint(parent: str, child: str, joint: ElasticJoint, *, layout: JointLayout, elastic_at: str = "child",
                   is_viscous: bool = False) -> JointDescription:
    """Return the description of a joint in its layout."""
    frame = joint.frame @ layout.turn
    origin, rotation = frame[:3, 3].tolist(), Rotation.from_matrix(frame[:3, :3]).as_euler("ZYX").tolist()
    base = JointDescription(parent, child, FrameDescription((origin[0], origin[1], origin[2]),
                                                            (rotation[0], rotation[1], rotation[2])),
                            loss_factor=joint.loss_factor, elastic_at=elastic_at, source="measured")
    relaxation = joint.relaxation
    # A joint without free directions dissipates nothing.
    if not joint.twists.shape[1]:
        return replace(base, loss_factor=0.0)
    stiffness = (joint.stiffness + joint.stiffness.T) / 2
    if not layout.ways:
        twists = tf.adjoint(tf.inverse(layout.turn)) @ joint.twists
        damping = _rows(relaxation * stiffness) if is_viscous else None
        return replace(base, screws=_rows(twists.T), stiffness_matrix=_rows(stiffness), damping_matrix=damping)
    if (stiffness == np.diag(np.diag(stiffness))).all():
        values = dict(zip(layout.ways, np.diag(stiffness).tolist(), strict=True))
        return replace(base, stiffness=values, damping={w: relaxation * k for w, k in values.items()} if is_viscous else {})
    matrix = np.zeros((6, 6))
    indices = [DIRECTIONS.index(way) for way in layout.ways]
    matrix[np.ix_(indices, indices)] = stiffness
    return replace(base, stiffness_matrix=_rows(matrix), damping_matrix=_rows(relaxation * matrix) if is_viscous else None)


def describe_axes(joint: str, axes: Mapping[str, DrivenAxis], layout: JointLayout) -> dict[str, AxisDescription]:
    """Return the axes of a joint in its written frame."""
    return {name: AxisDescription(joint, layout.axes[name], axis.limits, at_reference=axis.at_reference) for name, axis in
    axes.items()}


def _rows(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in row) for row in matrix)
