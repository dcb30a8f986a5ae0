"""LoopedTree: the data of a tree whose passive joints loops and a task determine, before anything is solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics.axis import AXES, Axis
from toolpoint.kinematics.loops import LoopClosure
from toolpoint.kinematics.task import Task
from toolpoint.kinematics.tree import TreeChain


@dataclass(frozen=True, eq=False)
class LoopedTree(TreeChain):
    """Tree of links with loops and a task: the equations of `Closure` and the reasons of `reach` are asked of it.

    Its parameters are those of `ClosedChain`, which solves it.
    """

    loops: tuple[LoopClosure, ...] = ()
    task: Task | None = None
    names: tuple[str, ...] = ()
    limits: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    modes: Mapping[str, Mapping[int, float]] = field(default_factory=dict)
    mode: str = ""
    length: float = 1.0

    @cached_property
    def passive_steps(self) -> tuple[int, ...]:
        """Indices of the passive steps."""
        return tuple(range(len(self.steps) - len(self.passive), len(self.steps)))

    @cached_property
    def balls(self) -> tuple[tuple[int, ...], ...]:
        """Steps of every ball."""
        return tuple(group for sequence in self.sequences for group in sequence if len(group) == 3)

    def positions_of(self, values: FloatArray) -> FloatArray:
        """Return positions of the driven axes for step values, m or rad, shape (n_poses, n_driven)."""
        reference_positions = np.array([axis.reference_position for axis in self.driven_axes])
        driven = len(self.steps) - len(self.passive)
        return values[:, :driven] @ np.linalg.pinv(self.coupling[:driven]).T + reference_positions

    def step_name(self, step: int) -> str:
        """Return a step in words: ``knuckle.rx``."""
        joint_step = self.steps[step]
        return f"{self.names[joint_step.joint] if self.names else joint_step.joint}.{AXES[joint_step.way]}"

    def axis(self, name: str) -> Axis:
        """Return an axis by name."""
        return next(axis for axis in self.axes if axis.name == name)
