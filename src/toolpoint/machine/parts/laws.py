"""Described joints -> laws: stiffness and damping by directions, by screws, or from guideways, screws, bearings, contacts."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import fail
from toolpoint.joints import LinearJoint, linear, screws
from toolpoint.joints.law import LawDescription
from toolpoint.joints.linear import DIRECTIONS
from toolpoint.machine.description.machine import JointDescription


def joint_law(joint: JointDescription) -> LinearJoint:
    """Return the stiffness and damping law of a described joint."""
    if joint.screws:
        return _screw_law(joint)
    if joint.law is not None:
        return _law_of_parts(joint, joint.law)
    stiffness = joint.stiffness if joint.stiffness_matrix is None else np.array(joint.stiffness_matrix)
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    if joint.stiffness_matrix is not None and joint.stiffness:
        fail("stiffness_matrix", "given beside stiffness", "must come from one source", "remove one of them")
    if joint.damping_matrix is not None and joint.damping:
        fail("damping_matrix", "given beside damping", "must come from one source", "remove one of them")
    return linear(stiffness, damping, joint.loss_factor, free=joint.free)


def _law_of_parts(joint: JointDescription, law: LawDescription) -> LinearJoint:
    """Return the law of a joint from its guideways, screws, bearings and contacts, and stiffness named beside them."""
    if joint.stiffness_matrix is not None:
        fail("stiffness_matrix", "given beside law", "must come from one source", "remove one of them")
    if joint.loss_factor and law.loss_factor:
        fail("loss_factor", "given in the joint and in its law", "must come from one source", "remove one of them")
    beside = linear(joint.stiffness).stiffness
    total = law.stiffness + beside
    loose = [way for i, way in enumerate(DIRECTIONS) if not total[i].any() and way not in joint.free]
    if loose:
        fail("law", f"no stiffness along {', '.join(loose)}", "every direction must be held, free, or have stiffness",
             f"add what holds it (a ball_screw?), stiffness: {{{loose[0]}: ...}}, or free: [{', '.join(loose)}]")
    damping = joint.damping if joint.damping_matrix is None else np.array(joint.damping_matrix)
    return linear(total, damping, joint.loss_factor or law.loss_factor, free=joint.free)


def _screw_law(joint: JointDescription) -> LinearJoint:
    for name in ("stiffness", "damping", "free"):
        if getattr(joint, name):
            fail(name, "given beside screws", "speaks of directions, which a joint of screws has not",
                 "give stiffness_matrix and damping_matrix over the screws")
    if joint.stiffness_matrix is None:
        fail("stiffness_matrix", "missing", "a joint of screws needs it, one row and column a screw")
    if isinstance(joint.loss_factor, Mapping):
        fail("loss_factor", "values by direction", "a joint of screws has one for all")
    if joint.closes_loop:
        fail("screws", "in a joint that closes a loop", "must be a joint of the tree",
             "close the loop at a joint of directions")
    return screws(np.array(joint.screws), np.array(joint.stiffness_matrix),
                  None if joint.damping_matrix is None else np.array(joint.damping_matrix), loss_factor=joint.loss_factor)
