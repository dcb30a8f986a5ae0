"""Motion of a machine over a grid of poses: driven axes, passive joints, parasitic shift, determinant and condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.kinematics.task import ANGLES, Task
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import tool_pair
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.machines.pose_grid import Grid, check_grid, evaluate_block, map_over, plain_cells
from toolpoint.studies.robots.own_coordinates import free_coordinates
from toolpoint.studies.text_table import text_table

_POSITION_DECIMALS = 10  # of m and rad: what is smaller the closure of the loops leaves


@dataclass(frozen=True)
class MotionColumn:
    """A quantity of the map: its name and the unit in which it is shown; `factor` turns SI into it."""

    name: str
    unit: str
    factor: float = 1.0

    @classmethod
    def of_position(cls, name: str, turns: bool) -> MotionColumn:
        """Return the column of a position, m or rad."""
        return cls(name, "°" if turns else "mm", 180 / np.pi if turns else 1e3)


@dataclass(frozen=True, eq=False)
class MotionMap(NotebookText):
    """Motion of a machine over a grid.

    axes : axis name to its positions, m or rad; values : (n_1, ..., n_columns) SI, not a number where a pose failed; columns :
    driven axes (legs), passive joints, parasitic shift of the platform, determinant of the rates of the task over those of its
    axes (place, m, turning across and about the tool's axis, rad), condition numbers; length : that weighs these, m.
    """

    axes: Mapping[str, FloatArray]
    values: FloatArray
    columns: tuple[MotionColumn, ...]
    length: float
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    angles: tuple[str, ...] = ()

    @property
    def grid(self) -> Grid:
        """The axes with their positions."""
        return Grid(self.axes, self.angles)

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of condition numbers and determinant."""
        notes = [f"Condition numbers weigh lengths by {1e3 * self.length:.4g} mm, the size of the machine; 1 is the best."]
        if any(column.name == "condition of the loops" for column in self.columns):
            notes.append("Conditions of drives and loops depend on which joints close the loops in the file; that of the tool "
                         "and the determinant do not.")
        return tuple(notes)

    @property
    def shown(self) -> FloatArray:
        """Values in the units in which they are shown, (n_1, ..., n_columns)."""
        return np.asarray(self.values * np.array([column.factor for column in self.columns]))

    def of(self, name: str) -> FloatArray:
        """Return a column by its name, (n_1, ...), SI."""
        return np.asarray(self.values[..., [column.name for column in self.columns].index(name)])

    def failed(self) -> list[str]:
        """Return a line on every pose that failed: where it is, and why."""
        return self.grid.failure_lines(self.failures)

    def extremes(self) -> list[str]:
        """Return a line on every column: where it is lowest and highest."""
        return [line for k, column in enumerate(self.columns)
                for line in self.grid.extreme_lines(self.shown[..., k:k + 1], [column.name], column.unit)]

    def table(self) -> str:
        """Return the range of every column as text, then where the ends lie."""
        rows = []
        for k, column in enumerate(self.columns):
            part = self.shown[..., k]
            if not np.isnan(part).all():
                rows.append([column.name, f"{np.nanmin(part):.6g}", f"{np.nanmax(part):.6g}", column.unit])
        title = f"Motion over {self.grid}, {len(self.failures)} poses failed"
        return "\n".join([text_table(title, ["quantity", "least", "greatest", "unit"], rows), *self.extremes()])

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, SI, None where a pose failed."""
        return {"axes": {name: positions.tolist() for name, positions in self.axes.items()},
                "columns": [column.name for column in self.columns], "values": plain_cells(self.values),
                "failures": self.failed(), "extremes": self.extremes(), "notes": list(self.notes)}

    def __repr__(self) -> str:
        return f"MotionMap({self.grid}, {len(self.columns)} quantities, {len(self.failures)} poses failed)"


@dataclass(frozen=True)
class _Motion:
    """Motion of a block of poses."""

    machine: Machine
    names: tuple[str, ...]

    @property
    def identity(self) -> str:
        """Key of this study among others on the same grid."""
        return repr((self.machine.description, "motion"))

    @property
    def columns(self) -> tuple[MotionColumn, ...]:
        """Quantities of this machine."""
        chain = self.machine.chain
        columns = [MotionColumn.of_position(axis.name, axis.is_rotary) for axis in chain.driven_axes]
        if isinstance(chain, ClosedChain):
            columns += [MotionColumn.of_position(chain.step_name(step), chain.steps[step].turns)
                        for step in chain.passive_steps]
            if chain.task is not None:
                columns += [MotionColumn.of_position(f"parasitic {kind}", kind in ANGLES)
                            for kind in free_coordinates(chain.task)]
                columns.append(MotionColumn("determinant", ""))
            columns += [MotionColumn("condition of the drives", ""), MotionColumn("condition of the loops", "")]
        return (*columns, MotionColumn("condition of the tool", ""))

    def __call__(self, block: Sequence[Sequence[float]]) -> dict[str, Any]:
        return evaluate_block(self._evaluate, self.machine, self.names, block=block, columns=len(self.columns))

    def _evaluate(self, poses: Mapping[str, FloatArray]) -> FloatArray:
        chain = self.machine.chain
        condition = pose_condition(chain, poses, tool_pair(self.machine).tool)
        parts = [chain.positions(poses)]
        if isinstance(chain, ClosedChain):
            values = chain.step_values(poses)
            parts.append(_rounded(values[:, list(chain.passive_steps)]))
            if chain.task is not None:
                parts.append(_parasitic_shift(chain, chain.task, values))
                parts.append(np.linalg.det(chain.task_rates(poses))[:, None])
            parts += [condition.actuation[:, None], condition.constraint[:, None]]
        parts.append(condition.lost_motion[:, None])
        return np.concatenate(parts, axis=1)


def _parasitic_shift(chain: ClosedChain, task: Task, values: FloatArray) -> FloatArray:
    """Return the parasitic shift (n, k) of a task's point against the reference pose, m and rad."""
    current, reference = (task.read(chain.displacements_of(chain.motions_of(steps)))
                          for steps in (values, chain.step_values({})))
    kinds = free_coordinates(task)
    shifts = [_rounded(current[kind] - reference[kind]) for kind in kinds]
    return np.stack(shifts, axis=1) if kinds else np.zeros((len(values), 0))


def map_motion(machine: Machine, axes: Mapping[str, ArrayLike], *, engine: Engine | None = None,
               folder: str | Path | None = None, progress: Progress | None = None) -> MotionMap:
    """Return the motion of a machine over the grid of all combinations of axis positions, or of its task's coordinates.

    Parameters
    ----------
    machine : Machine
        Names its tool point.
    axes : mapping of axis name (or coordinate of the task) to positions
        m or rad; those left out are at rest.
    engine, folder, progress : see `execute.execute`

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     AxisDescription,
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": AxisDescription("slide", "x")},
    ...                                    {"tip": PointDescription("head")}, tool="tip"))
    >>> map_motion(machine, {"X": [0.0, 0.1]}).of("X").tolist()
    [0.0, 0.1]
    """
    grid = check_grid(machine, axes)
    function = _Motion(machine, tuple(grid.axes))
    values, failures = map_over(function, grid, len(function.columns), engine=engine, folder=folder, progress=progress)
    length = float(getattr(machine.chain, "length", 1.0))
    return MotionMap(grid.axes, values, function.columns, length, failures, grid.angles)


def _rounded(positions: FloatArray) -> FloatArray:
    """Return positions without what closing the loops leaves of them; zero has no sign."""
    return np.asarray(np.round(positions, _POSITION_DECIMALS) + 0.0)
