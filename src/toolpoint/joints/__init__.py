"""Joints: stiffness and damping of an interface in its own frame, and the laws that they follow."""

from toolpoint.joints.law import LawDescription, join_parallel, join_series
from toolpoint.joints.linear import DIRECTIONS, LinearJoint, linear, screws
from toolpoint.joints.reducer import LinearTorsion, Reducer, choose_reducer, next_ratio, reducer_of, reflect_inertia

__all__ = [
    "DIRECTIONS",
    "LawDescription",
    "LinearJoint",
    "LinearTorsion",
    "Reducer",
    "choose_reducer",
    "join_parallel",
    "join_series",
    "linear",
    "next_ratio",
    "reducer_of",
    "reflect_inertia",
    "screws",
]
