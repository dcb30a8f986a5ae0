"""Kinematics: displacements of the links of a chain at a pose, and their derivatives. Names below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.kinematics.axis import Axis, Drive
    from toolpoint.kinematics.cartesian_axes import cartesian
    from toolpoint.kinematics.chain import Pose
    from toolpoint.kinematics.closed import ClosedChain
    from toolpoint.kinematics.loops import LoopClosure
    from toolpoint.kinematics.steps import Step
    from toolpoint.kinematics.task import Task
    from toolpoint.kinematics.tree import TreeChain

__all__ = ["Axis", "ClosedChain", "Drive", "LoopClosure", "Pose", "Step", "Task", "TreeChain", "cartesian"]

__getattr__, __dir__ = export_lazily(__name__, {
    "axis": ("Axis", "Drive"),
    "cartesian_axes": ("cartesian",),
    "chain": ("Pose",),
    "closed": ("ClosedChain",),
    "loops": ("LoopClosure",),
    "steps": ("Step",),
    "task": ("Task",),
    "tree": ("TreeChain",),
})
