"""Kinematics: where every link of a chain is at a pose, and how it moves."""

from toolpoint.kinematics.axis import Axis, Drive
from toolpoint.kinematics.cartesian import cartesian
from toolpoint.kinematics.chain import Chain, Pose
from toolpoint.kinematics.closed import ClosedChain
from toolpoint.kinematics.loops import LoopClosure
from toolpoint.kinematics.steps import Step
from toolpoint.kinematics.task import Task
from toolpoint.kinematics.tree import TreeChain

__all__ = ["Axis", "Chain", "ClosedChain", "Drive", "LoopClosure", "Pose", "Step", "Task", "TreeChain", "cartesian"]
