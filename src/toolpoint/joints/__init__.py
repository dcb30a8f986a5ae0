"""Joints: stiffness and damping of an interface in its own frame."""

from toolpoint.joints.linear import DIRECTIONS, LinearJoint, linear, screws

__all__ = ["DIRECTIONS", "LinearJoint", "linear", "screws"]
