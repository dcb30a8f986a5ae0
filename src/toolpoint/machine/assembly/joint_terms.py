"""Stiffness and damping of the joints in the equations of motion, and the relative motion in loop joints."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail, within
from toolpoint.kinematics.loops import joint_directions
from toolpoint.machine.parts.model import LoopJoint, Machine
from toolpoint.machine.pose.placement import Placement
from toolpoint.spatial import transform as tf


def joint_matrices(place: Placement) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stiffness, damping and structural damping of all joints and elastic bodies, shape (P or 1, n, n) each."""
    machine = place.machine
    n = machine.size
    matrices = np.zeros((3, 1, n, n))
    for i, law in enumerate(machine.joints):
        free, columns = list(law.freedoms), list(machine.joint_columns[i])
        entries = np.ix_(columns, columns)
        for term, matrix in enumerate((law.stiffness, law.damping, law.structural_damping)):
            matrices[term, 0][entries] += matrix[np.ix_(free, free)]
        modal = list(machine.modal_columns[i])
        if modal:
            matrices[0, 0][np.ix_(modal, modal)] += machine.bodies[i].stiffness
            matrices[1, 0][np.ix_(modal, modal)] += machine.bodies[i].damping
            matrices[2, 0][np.ix_(modal, modal)] += machine.bodies[i].structural_damping
    if has_travelling_stiffness(machine):
        matrices = np.repeat(matrices, place.poses, axis=1)
        for i, law in enumerate(machine.joints):
            if law.travel is not None:
                column = machine.joint_columns[i][law.freedoms.index(law.travel.way)]
                gain = law.travel.gain(joint_travel(place, i))
                matrices[0, :, column, column] += gain
                matrices[2, :, column, column] += law.travel.loss_factor * gain
    if not machine.loops:
        k, c, d = matrices
        # One matrix stands for all poses, without a copy: joints of a tree have their springs in their own coordinates.
        shape = (place.poses, n, n)
        return np.broadcast_to(k, shape), np.broadcast_to(c, shape), np.broadcast_to(d, shape)
    matrices = np.repeat(matrices, place.poses, axis=1) if matrices.shape[1] == 1 else matrices
    for loop in machine.loops:
        relative = loop_motion(place, loop)
        for term, matrix in enumerate((loop.law.stiffness, loop.law.damping, loop.law.structural_damping)):
            matrices[term] += np.swapaxes(relative, -1, -2) @ matrix @ relative
    return matrices[0], matrices[1], matrices[2]


def stiffness_of_joint(place: Placement, name: str, direction: int | None = None) -> FloatArray:
    """Return what a joint, or one of its directions alone, adds to the stiffness at the first pose, (n, n), N/m and N m/rad.

    direction : 0 .. 5, the row of its 6x6 matrix; the whole matrix where left out. A locked direction adds nothing.

    Raises ToolpointError for a joint that the machine does not have.
    """
    machine = place.machine
    if name in machine.joint_names:
        link = machine.joint_names.index(name)
        law, columns = machine.joints[link], list(machine.joint_columns[link])
        total = np.zeros((machine.size, machine.size))
        total[np.ix_(columns, columns)] = _masked(law.stiffness, direction)[np.ix_(list(law.freedoms), list(law.freedoms))]
        if law.travel is not None and direction in (None, law.travel.way):
            column = columns[law.freedoms.index(law.travel.way)]
            total[column, column] += law.travel.gain(joint_travel(place, link))[0]
        return total
    loop = next((each for each in machine.loops if each.name == name), None)
    if loop is None:
        fail("name", repr(name), "must be a joint of the machine", remedy=", ".join(machine.joint_names))
    relative = loop_motion(place, loop)[0]
    return np.asarray(relative.T @ _masked(loop.law.stiffness, direction) @ relative)


def _masked(stiffness: FloatArray, direction: int | None) -> FloatArray:
    if direction is None:
        return stiffness
    single = np.zeros((6, 6))
    single[direction, direction] = stiffness[direction, direction]
    return single


def has_travelling_stiffness(machine: Machine) -> bool:
    """Return whether the stiffness of a joint changes as an axis moves."""
    return any(law.travel is not None for law in machine.joints)


def joint_travel(place: Placement, link: int) -> FloatArray:
    """Return the travel of a joint along its travel law, (P,); faults of its law there name the joint."""
    travel = place.machine.joints[link].travel
    assert travel is not None
    travel_now = place.travel(link, travel.way)
    within(f"joints.{place.machine.joint_names[link]}.law", travel.law, travel_now)
    return travel_now


def loop_frame(place: Placement, loop: LoopJoint) -> FloatArray:
    """Return the frame of a loop joint, riding on its parent, shape (P, 4, 4)."""
    if loop.parent < 0:
        return np.broadcast_to(loop.frame, (place.poses, 4, 4))
    return place.displacements[:, loop.parent] @ loop.frame


def loop_motion(place: Placement, loop: LoopJoint) -> FloatArray:
    """Return the motion of child relative to parent in a loop joint's frame per coordinate, shape (P, 6, n)."""
    joint_place = loop_frame(place, loop)[:, :3, 3]
    difference = place.jacobian(loop.child, loop.child_interface,
                                joint_place) - place.jacobian(loop.parent, loop.parent_interface, joint_place)
    motion = tf.adjoint(tf.inverse(loop_frame(place, loop))) @ difference
    directions = loop_directions(place, loop)
    # Directions that turn with the joint are no axes of its frame: their amounts solve for the twist.
    return motion if directions is None else np.linalg.solve(directions, motion)


def loop_directions(place: Placement, loop: LoopJoint) -> FloatArray | None:
    """Return the twists (P, 6, 6) of a loop joint's directions in its frame; None where they are those of the frame itself."""
    turns = [way for way in loop.free if way > 2]
    if not (len(turns) == 2 or (turns and len(loop.free) > len(turns))):
        return None
    end = loop.frame[None] if loop.child < 0 else place.displacements[:, loop.child] @ loop.frame
    return joint_directions(loop.free, tf.inverse(loop_frame(place, loop)) @ end)
