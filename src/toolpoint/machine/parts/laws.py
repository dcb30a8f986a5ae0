"""Described joints -> laws: stiffness and damping by directions, by screws, or from guideways, screws, bearings, contacts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from toolpoint._check import fail, within
from toolpoint.joints import LinearJoint, linear, screws
from toolpoint.joints.law import LawDescription
from toolpoint.joints.linear import DIRECTIONS
from toolpoint.joints.travel import AxialTravel
from toolpoint.machine.description.machine import JointDescription, MachineDescription


def joint_law(joint: JointDescription) -> LinearJoint:
    """Return the stiffness and damping law of a described joint."""
    if joint.screws:
        return _screw_law(joint)
    if joint.law is not None:
        return _law_of_parts(joint, joint.law)
    stiffness = joint.stiffness if joint.stiffness_matrix is None else np.array(joint.stiffness_matrix)
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    if joint.stiffness_matrix is not None and joint.stiffness:
        fail("stiffness_matrix", "given beside stiffness", "must come from one source", remedy="remove one of them")
    if joint.damping_matrix is not None and joint.damping:
        fail("damping_matrix", "given beside damping", "must come from one source", remedy="remove one of them")
    return linear(stiffness, damping, joint.loss_factor, free=joint.free)


def _law_of_parts(joint: JointDescription, law: LawDescription) -> LinearJoint:
    """Return the law of a joint from its guideways, screws, bearings and contacts, and stiffness named beside them."""
    if joint.stiffness_matrix is not None:
        fail("stiffness_matrix", "given beside law", "must come from one source", remedy="remove one of them")
    if joint.loss_factor and law.loss_factor:
        fail("loss_factor", "given in the joint and in its law", "must come from one source", remedy="remove one of them")
    named_stiffness = linear(joint.stiffness).stiffness
    total = law.stiffness + named_stiffness
    unheld = [way for i, way in enumerate(DIRECTIONS) if not total[i].any() and way not in joint.free]
    if unheld:
        fail("law", f"no stiffness along {', '.join(unheld)}", "every direction must be held, free, or have stiffness",
             remedy=f"add what holds it (a ball_screw?), stiffness: {{{unheld[0]}: ...}}, or free: [{', '.join(unheld)}]")
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    result = linear(total, damping, joint.loss_factor or law.loss_factor, free=joint.free)
    if law.bearing is not None and law.bearing.follows and law.bearing.speed:
        fail("law.bearing.speed", f"{law.bearing.speed:g} rev/min beside follows: spin", "must be left out",
             remedy="the speed is that of the body that spins")
    return _with_travel(result, joint, law)


def _with_travel(result: LinearJoint, joint: JointDescription, law: LawDescription) -> LinearJoint:
    """Return the joint with a stiffness that follows the nut of its screw, where it is told to."""
    screw = law.ball_screw
    if screw is None or not screw.follows:
        return result
    if joint.closes_loop:
        fail("law.ball_screw.follows", "in a joint that closes a loop", "must be in a joint of the tree that an axis drives")
    loss = joint.loss_factor or law.loss_factor
    share = loss.get(screw.along, 0.0) if isinstance(loss, Mapping) else float(loss)
    return replace(result, travel=AxialTravel(DIRECTIONS.index(screw.along), screw.along_travel, share))


def laws_of(description: MachineDescription) -> dict[str, LinearJoint]:
    """Return the law of every joint of a machine, bearings that follow a spin at its speed."""
    return {name: within(f"joints.{name}", partial(law_in, description), name) for name in description.joints}


def law_in(description: MachineDescription, name: str) -> LinearJoint:
    """Return the law of a joint of a machine.

    Raises ToolpointError for a bearing that follows a spin where neither body spins, and for a screw that follows no axis.
    """
    joint = description.joints[name]
    law = joint.law
    if law is not None and law.ball_screw is not None and law.ball_screw.follows:
        along = law.ball_screw.along
        if along not in (*driven_ways(description, name), *joint.passive):
            fail("law.ball_screw.follows", f"{law.ball_screw.follows!r}, but no axis drives {name} along {along}",
                 "must be driven along the screw", remedy="name the axis's direction in `along`, or remove follows")
    if law is None or law.bearing is None or not law.bearing.follows:
        return joint_law(joint)
    joint_law(joint)  # its own faults
    speed = abs(_spin(description, joint.child) - _spin(description, joint.parent)) * 30 / np.pi
    ends = [description.bodies[body] for body in (joint.parent, joint.child) if body in description.bodies]
    if all(body.spin is None for body in ends):
        fail("law.bearing.follows", "'spin', but neither body spins", "must join a spinning body",
             remedy=f"give {joint.child} spin: {{speed: 12000 rpm}}, or give the bearing its speed")
    return joint_law(replace(joint, law=replace(law, bearing=replace(law.bearing, speed=speed, follows=""))))


def driven_ways(description: MachineDescription, name: str) -> list[str]:
    """Return the directions in which axes drive a joint."""
    return [drive.direction.lstrip("-") for axis in description.axes.values() for drive in axis.moved if drive.joint == name]


def _spin(description: MachineDescription, name: str) -> float:
    spin = description.bodies[name].spin if name in description.bodies else None
    return 0.0 if spin is None else spin.speed


def _screw_law(joint: JointDescription) -> LinearJoint:
    for name in ("stiffness", "damping", "free"):
        if getattr(joint, name):
            fail(name, "given beside screws", "speaks of directions, which a joint of screws has not",
                 remedy="give stiffness_matrix and damping_matrix over the screws")
    if joint.stiffness_matrix is None:
        fail("stiffness_matrix", "missing", "a joint of screws needs it, one row and column a screw")
    if isinstance(joint.loss_factor, Mapping):
        fail("loss_factor", "values by direction", "a joint of screws has one for all")
    if joint.closes_loop:
        fail("screws", "in a joint that closes a loop", "must be a joint of the tree",
             remedy="close the loop at a joint of directions")
    return screws(np.array(joint.screws), np.array(joint.stiffness_matrix),
                  None if joint.damping_matrix is None else np.array(joint.damping_matrix), loss_factor=joint.loss_factor)
