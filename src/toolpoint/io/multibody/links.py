"""A machine at a pose as bodies on elastic joints in a tree: what multibody programs take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.bodies import MassProperties
from toolpoint.kinematics import Pose
from toolpoint.machine import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf


@dataclass(frozen=True, eq=False)
class TreeLink:
    """A body in the frame of its joint: parent's number (-1 the ground), place (4, 4) in the parent's frame, elastic directions
    (0 .. 5 for x .. rz) with stiffness and damping, mass properties."""

    name: str
    parent: int
    place: FloatArray
    ways: tuple[int, ...]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    properties: MassProperties


def tree_links(machine: Machine, pose: Pose | None = None) -> tuple[TreeLink, ...]:
    """Return the links of a machine at a pose; axes are held there.

    Raises ToolpointError for loops, elastic bodies, gravity or loads, and joints whose matrices couple directions.
    """
    if machine.loops or any(body.modal_count for body in machine.bodies):
        fail("machine", "loops or elastic bodies", "must be a tree of rigid bodies to be written",
             remedy="give members springs instead")
    if machine.description.gravity is not None or machine.description.loads:
        fail("machine", "gravity or loads", "cannot be written: springs would have to carry them as preload",
             remedy="remove gravity: and loads: from the file")
    place = place_machine(machine, pose)
    if place.poses != 1:
        fail("pose", f"{place.poses} poses", "must be one")
    links = []
    for i, law in enumerate(machine.joints):
        for name, matrix in (("stiffness", law.stiffness), ("damping", law.damping)):
            if np.abs(matrix - np.diag(np.diag(matrix))).max() > 1e-12 * max(float(np.abs(matrix).max()), 1e-300):
                fail(f"joints.{machine.joint_names[i]}.{name}", "couples directions",
                     "must be one spring a direction to be written")
        if not law.is_of_directions:
            fail(f"joints.{machine.joint_names[i]}", "has screws", "must have directions to be written")
        joint_frame, parent = place.joint_frames[0, i], machine.chain.parents[i]
        parent_frame = np.eye(4) if parent < 0 else place.joint_frames[0, parent]
        ways = law.freedoms
        links.append(TreeLink(
            machine.body_names[i], parent, tf.inverse(parent_frame) @ joint_frame, ways,
            tuple(float(law.stiffness[w, w]) for w in ways),
            tuple(float(law.damping[w, w]) for w in ways),
            _properties(machine.bodies[i].mass).moved(tf.inverse(joint_frame) @ place.frames[0, i])))
    return tuple(links)


def _properties(spatial: FloatArray) -> MassProperties:
    mass = float(spatial[0, 0])
    first = spatial[3:, :3] / mass
    centre = np.array([first[2, 1], first[0, 2], first[1, 0]])
    arm = np.array([[0, -centre[2], centre[1]], [centre[2], 0, -centre[0]], [-centre[1], centre[0], 0]])
    return MassProperties(mass, centre, spatial[3:, 3:] + mass * arm @ arm)
