"""Joints: stiffness and damping of an interface in its own frame."""

from toolpoint.joints.linear import DIRECTIONS, LinearJoint, linear

__all__ = ["DIRECTIONS", "LinearJoint", "linear"]
