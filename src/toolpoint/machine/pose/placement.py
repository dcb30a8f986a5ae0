r"""Placement of a machine at a pose: joint frames, and the Jacobian of every body in minimal coordinates.

All twists are (v, w) in machine axes about the machine's origin: :math:`V_b = J_b \dot q`.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, fail, suggestion
from toolpoint.kinematics import Pose, Step
from toolpoint.machine.description.machine import PointDescription
from toolpoint.machine.parts.model import Machine
from toolpoint.spatial import transform as tf


@dataclass(frozen=True, eq=False)
class Placement:
    """A machine at a batch of poses.

    frames : (P, n_links, 4, 4), every body's frame; displacements : the same from the reference pose;
    joint_frames : (P, n_links, 4, 4), where each tree joint's springs are; jacobians : (P, n_links, 6, n);
    notes : what a person must know of these poses; values : (P, n_steps), how far every step of the chain has moved, m or rad.
    """

    machine: Machine
    displacements: FloatArray
    frames: FloatArray
    joint_frames: FloatArray
    jacobians: FloatArray
    notes: tuple[str, ...] = ()
    values: FloatArray = field(default_factory=lambda: np.zeros((1, 0)))

    @property
    def poses(self) -> int:
        """Number of poses."""
        return int(self.frames.shape[0])

    def jacobian(self, link: int, interface: str | None = None, joint_place: FloatArray | None = None) -> FloatArray:
        """Return the Jacobian of a body, or of an interface of an elastic one, shape (P, 6, n); zero for the ground.

        joint_place : (P, 3), place of the joint that holds a sliding interface, machine frame.
        """
        n = self.machine.size
        if link < 0:
            return np.zeros((self.poses, 6, n))
        body = self.machine.bodies[link]
        if body.modal_count == 0:
            return self.jacobians[:, link]
        result = self.jacobians[:, link].copy()
        result[:, :, list(self.machine.modal_columns[link])] += self._participation(link, interface, joint_place)
        return result

    def _participation(self, link: int, interface: str | None, joint_place: FloatArray | None = None) -> FloatArray:
        body = self.machine.bodies[link]
        if (interface is not None and joint_place is not None and interface in body.interfaces
                and body.interfaces[interface].slide):
            return self._sliding(link, interface, joint_place)
        columns = body.participation(interface)
        place = np.zeros(3) if interface is None else body.interfaces[interface].position
        return tf.adjoint(self.frames[:, link] @ tf.transform(None, place)) @ columns

    def _sliding(self, link: int, interface: str, joint_place: FloatArray) -> FloatArray:
        """Return the motion of a sliding interface at the joint's place, per modal coordinate of its body, machine axes."""
        place = tf.move(tf.inverse(self.frames[:, link]), joint_place[:, None])[:, 0]
        try:
            position, columns = self.machine.bodies[link].interfaces[interface].slid_to(place)
        except ToolpointError as error:
            raise ToolpointError(f"body {self.machine.body_names[link]}, interface {interface}: {error}") from None
        local = np.zeros((self.poses, 4, 4))
        local[:], local[:, :3, 3] = np.eye(4), position
        return tf.adjoint(self.frames[:, link] @ local) @ columns

    def travel(self, link: int, way: int) -> FloatArray:
        """Return the travel of a tree joint along or about a direction of its frame from the reference pose, (P,)."""
        step, steps = Step(link, way), self.machine.chain.steps
        return self.values[:, steps.index(step)] if step in steps else np.zeros(self.poses)

    def position(self, point: PointDescription) -> FloatArray:
        """Return the place of a point, machine frame, m, shape (P, 3)."""
        link = self.machine.link(point.body)
        point_place = np.asarray(point.at, float)
        if link >= 0 and self.machine.bodies[link].modal_count and point.interface is not None:
            point_place = self.machine.bodies[link].interfaces[point.interface].position
        if link < 0:
            return np.broadcast_to(point_place, (self.poses, 3))
        return tf.move(self.frames[:, link], point_place[None])[:, 0]

    def point_jacobian(self, name: str) -> FloatArray:
        """Return the motion (v, w) of a named point about itself per coordinate, machine axes, shape (P, 6, n)."""
        points = self.machine.description.points
        if name not in points:
            fail("point", f"no {name!r}", f"must be of {', '.join(points) or 'none'}", remedy=suggestion(name, points))
        point = points[name]
        body = self.jacobian(self.machine.link(point.body), point.interface)
        result = body.copy()
        result[:, :3] = tf.point_velocity(self.position(point)) @ body
        return result


def frame_motion(place: Placement, link: int) -> FloatArray:
    """Return the twist of a body's frame, in its axes and about itself, per coordinate, (P, 6, n)."""
    return tf.adjoint(tf.inverse(place.frames[:, link])) @ place.jacobians[:, link]


def body_coordinates(place: Placement, link: int) -> FloatArray:
    """Return B: a body's own coordinates (twist in its axes about its frame, modal amplitudes) per coordinate, (P, 6+m, n)."""
    machine = place.machine
    twists = frame_motion(place, link)
    modal = list(machine.modal_columns[link])
    if not modal:
        return twists
    # Modal amplitudes are coordinates of the machine themselves.
    unit = np.zeros((place.poses, len(modal), machine.size))
    unit[:, range(len(modal)), modal] = 1.0
    return np.concatenate([twists, unit], axis=1)


def place_machine(machine: Machine, pose: Pose | None = None) -> Placement:
    """Return the machine at a pose or a batch of poses (axis name to position or array of positions, m or rad)."""
    chain = machine.chain
    values, notes = chain.settled(pose or {})
    for note in notes:
        warnings.warn(note, ToolpointWarning, stacklevel=3)
    motions = chain.motions_of(values)
    displacements = chain.displacements_of(motions)
    count, links = displacements.shape[:2]
    frames = displacements @ machine.body_frames
    joint_frames = np.empty_like(displacements)
    jacobians = np.zeros((count, links, 6, machine.size))
    joint_columns, modal_columns = machine.joint_columns, machine.modal_columns
    result = Placement(machine, displacements, frames, joint_frames, jacobians, notes, values)
    passive_twists = chain.twists_of(values, displacements) if any(machine.passive_turns) else None
    for i, parent in enumerate(chain.parents):
        joint_base = np.broadcast_to(chain.frames[i],
                                     (count, 4, 4)) if parent < 0 else displacements[:, parent] @ chain.frames[i]
        joint_frames[:, i] = joint_base
        if machine.elastic_at_child[i]:
            # The springs ride with the child: place after the axis motion, orientation still the parent's.
            joint_frames[:, i, :3, 3] = (joint_base @ motions[:, i])[:, :3, 3]
        above, below = machine.interfaces[i]
        if parent >= 0:
            jacobians[:, i] = result.jacobian(parent, above, joint_frames[:, i, :3, 3])
        if machine.joints[i].freedoms:
            twists = tf.adjoint(joint_frames[:, i]) @ machine.joints[i].basis
            for way in machine.passive_turns[i]:
                assert passive_twists is not None
                # A passive rotation turns about its moved axis, which the joint's frame at rest does not show.
                twists[:, :, machine.joints[i].freedoms.index(way)] = passive_twists[:, chain.steps.index(Step(i, way))]
            jacobians[:, i][:, :, list(joint_columns[i])] += twists
        if machine.bodies[i].modal_count:
            # The joint holds the interface; the body's own frame moves back by what the interface moves in the body.
            jacobians[:, i][:, :, list(modal_columns[i])] -= result._participation(i, below, joint_frames[:, i, :3, 3])
    return result
