"""Joints: stiffness and damping of an interface in its own frame."""

from toolpoint.joints.linear import DIRECTIONS, LinearJoint, linear, screws
from toolpoint.joints.reducer import LinearTorsion, Reducer, choose_reducer, next_ratio, reducer_of, reflect_inertia

__all__ = ["DIRECTIONS", "LinearJoint", "LinearTorsion", "Reducer", "choose_reducer", "linear", "next_ratio", "reducer_of",
           "reflect_inertia", "screws"]
