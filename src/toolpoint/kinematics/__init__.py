"""Kinematics: where every link of a chain is at a pose, and how it moves."""

from toolpoint.kinematics.axis import Axis
from toolpoint.kinematics.cartesian import cartesian
from toolpoint.kinematics.chain import Chain, Pose
from toolpoint.kinematics.tree import TreeChain

__all__ = ["Axis", "Chain", "Pose", "TreeChain", "cartesian"]
