"""Course of a run along a side: where it is, how fast and under which loads, computed at the steps that are asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.studies.accuracy.cutting_table import CuttingTable
from toolpoint.studies.accuracy.moving_structure import MovingStructure
from toolpoint.vibration.simulation.varying import CourseArrays, VaryingSystem


@dataclass(frozen=True, eq=False)
class SideCourse:
    """Course of a block of `size` steps with one table, computed where it is asked for; `begin`, `step`: s."""

    structure: MovingStructure
    system: VaryingSystem
    table: CuttingTable
    begin: float
    step: float
    size: int

    def motion(self, steps: IndexArray) -> FloatArray:
        """Return the motion (n, 4: length, speed, acceleration, jerk) in the middle of steps, where their loads are taken."""
        return self.structure.side.law.sample(self.begin + (steps + 0.5) * self.step)

    def motion_in_periods(self) -> FloatArray:
        """Return the motion at one step of every period, and at the last."""
        return self.motion(np.append(np.arange(0, self.size, self.table.table.shape[1]), self.size - 1))

    def at(self, steps: slice | IndexArray) -> CourseArrays:
        """Return some of the steps."""
        numbers = np.arange(*steps.indices(self.size)) if isinstance(steps, slice) else steps
        return self.of(self.motion(numbers))

    def of(self, motion: FloatArray) -> CourseArrays:
        """Return the course at motions (n, 4)."""
        node, share = between_nodes(self.system.length, motion[:, 0])
        return CourseArrays(node, share, self.table.feed_shares(motion[:, 1]), self.structure.load_factors(motion))


def between_nodes(length: FloatArray, places: FloatArray) -> tuple[IndexArray, FloatArray]:
    """Return the node before every length, and the share of the way to the next."""
    node = np.clip(np.searchsorted(length, places, side="right") - 1, 0, len(length) - 2)
    return node, (places - length[node]) / (length[node + 1] - length[node])
