"""Grids of poses: any quantity over them, poses that failed with their reason, places of the extremes in words."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint._rounding import number_text
from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.execute import Engine, Progress, execute

_BLOCK_POSES = 256  # poses computed at once
AtPoses = Callable[[Mapping[str, FloatArray]], FloatArray]


@dataclass(frozen=True, eq=False)
class Grid:
    """Axis name to its positions, m or rad; angles : the axes in rad."""

    axes: Mapping[str, FloatArray]
    angles: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of positions of every axis."""
        return tuple(len(positions) for positions in self.axes.values())

    def unit(self, name: str) -> str:
        """Return the unit in which an axis is printed."""
        return "°" if name in self.angles else "mm"

    def shown(self, name: str) -> FloatArray:
        """Return the positions of an axis in the unit in which it is printed."""
        return np.degrees(self.axes[name]) if name in self.angles else 1e3 * np.asarray(self.axes[name])

    def words(self, index: Sequence[int]) -> str:
        """Return a place of the grid in words."""
        return ", ".join(f"{name} {round(float(self.shown(name)[i]), 9) + 0.0:.6g}"  # no rounding about zero
                         + ("°" if name in self.angles else " mm") for name, i in zip(self.axes, index, strict=True))

    def failure_lines(self, failures: Mapping[tuple[int, ...], str]) -> list[str]:
        """Return a line on every pose that failed."""
        return [f"{self.words(index)}: {reason}" for index, reason in failures.items()]

    def extreme_lines(self, values: FloatArray, names: Sequence[str], unit: str) -> list[str]:
        """Return a line on every column of values (n_1, ..., n_columns): where it is lowest and highest."""
        lines, spaced_unit = [], unit if unit in ("", "°") else f" {unit}"
        for k, name in enumerate(names):
            column = values[..., k]
            if np.isnan(column).all():
                lines.append(f"{name}: no pose could be computed")
                continue
            lowest, highest = (np.unravel_index(int(pick(column)), column.shape) for pick in (np.nanargmin, np.nanargmax))
            span = float(column[highest] - column[lowest])
            # Poses that are alike but for rounding have no best and no worst among them.
            if span <= 1e-9 * abs(float(column[highest])):
                lines.append(f"{name}: {number_text(float(column[lowest]))}{spaced_unit} at every pose")
                continue
            # To the digits by which both ends differ.
            lowest_text, highest_text = (number_text(float(column[index]), span / 20) for index in (lowest, highest))
            lines.append(f"{name}: lowest {lowest_text}{spaced_unit} at {self.words([int(i) for i in lowest])}; "
                         f"highest {highest_text}{spaced_unit} at {self.words([int(i) for i in highest])}")
        return lines

    def path_lines(self, values: FloatArray, names: Sequence[str]) -> list[str]:
        """Return a line on every column of values over two axes: where along the second its greatest value runs over the first.

        Further axes stand at their first position; without two axes of several positions there is no path.
        """
        drawn = [k for k, positions in enumerate(self.axes.values()) if len(positions) > 1][:2]
        if len(drawn) < 2:
            return []
        flat = values[tuple(slice(None) if k in drawn else 0 for k in range(len(self.axes)))]
        first, second = (list(self.axes)[k] for k in drawn)
        return [f"{name}: over {first} the greatest runs along {second} {self._runs(flat[..., k], first, second)}"
                for k, name in enumerate(names) if not np.isnan(flat[..., k]).all(axis=1).any()]

    def _runs(self, column: FloatArray, first: str, second: str) -> str:
        """Return the positions of the second axis at which each row is greatest, equal ones together, in words."""
        greatest = np.nanargmax(column, axis=1)
        ends = np.flatnonzero(np.append(np.diff(greatest) != 0, True))
        begins = np.concatenate([[0], ends[:-1] + 1])
        parts = []
        for begin, end in zip(begins, ends, strict=True):
            place = f"{self.shown(second)[greatest[end]]:.4g} {self.unit(second)}".replace(" °", "°")
            span = [f"{self.shown(first)[i]:.4g} {self.unit(first)}".replace(" °", "°") for i in (begin, end)]
            parts.append(f"{place} at {span[0]}" + ("" if begin == end else f" to {span[1]}"))
        return ", ".join(parts)

    def __str__(self) -> str:
        return " x ".join(f"{name} {len(positions)}" for name, positions in self.axes.items())


def plain_cells(values: FloatArray) -> Any:
    """Return values as nested lists for JSON, None where a pose failed."""
    cells = values.astype(object)
    cells[np.isnan(values)] = None
    return cells.tolist()


def check_grid(machine: Machine, axes: Mapping[str, ArrayLike]) -> Grid:
    """Return a grid of axis positions after checking names and limits of travel."""
    if not axes:
        fail("axes", "none", "must be at least one axis with its positions")
    grid = {name: np.atleast_1d(floats(f"axes[{name!r}]", axis_positions)) for name, axis_positions in axes.items()}
    for name, axis_positions in grid.items():
        machine.chain.batch({name: axis_positions[:1]})
    if isinstance(machine.chain, ClosedChain):
        machine.chain.is_task_pose(grid)
    return Grid(grid, tuple(axis.name for axis in machine.chain.axes if axis.is_rotary))


def evaluate_block(at_poses: AtPoses, machine: Machine, names: Sequence[str], *, block: Sequence[Sequence[float]], columns: int
                   ) -> dict[str, Any]:
    """Return the values of a block of poses and the reason of each that failed; only poses within reach are computed."""
    positions = np.array(block)
    poses = dict(zip(names, positions.T, strict=True))
    values, reasons = np.full((len(block), columns), np.nan), _failure_reasons(machine, poses, len(block))
    good = np.array([not reason for reason in reasons])
    if good.any():
        try:
            values[good] = at_poses({name: axis_positions[good] for name, axis_positions in poses.items()})
        except ToolpointError:
            # One pose that fails fails its batch: the poses are computed one by one to find it.
            for i in np.flatnonzero(good):
                try:
                    values[i] = at_poses({name: axis_positions[i:i + 1] for name, axis_positions in poses.items()})[0]
                except ToolpointError as error:
                    reasons[i] = str(error)
    return {"values": values, "reasons": np.array(reasons)}


def _failure_reasons(machine: Machine, poses: Mapping[str, FloatArray], count: int) -> list[str]:
    """Return why poses cannot be computed: out of reach, beyond limits, torn or singular; empty texts elsewhere."""
    chain = machine.chain
    if not isinstance(chain, ClosedChain):
        return [""] * count
    try:
        can_be, reasons = chain.reachable(poses)
    except ToolpointError as error:  # one position beyond its travel refuses the batch: the poses are asked one by one
        if count == 1:
            return [str(error)]
        return [_failure_reasons(machine, {name: column[i:i + 1] for name, column in poses.items()}, 1)[0]
                for i in range(count)]
    if can_be.any() and chain.loops:
        reached = {name: axis_positions[can_be] for name, axis_positions in poses.items()}
        singular = pose_condition(chain, reached).reasons()
        for i, reason in zip(np.flatnonzero(can_be), singular, strict=True):
            reasons[i] = reason
    return reasons


def map_over(function: Any, grid: Grid, columns: int, *, engine: Engine | None = None, folder: str | Path | None = None,
             progress: Progress | None = None) -> tuple[FloatArray, dict[tuple[int, ...], str]]:
    """Run a function of blocks of poses (see `evaluate_block`) over a grid.

    Returns values (n_1, ..., n_columns) and failures.
    """
    poses = [list(map(float, pose)) for pose in itertools.product(*grid.axes.values())]
    blocks = [poses[i:i + _BLOCK_POSES] for i in range(0, len(poses), _BLOCK_POSES)]
    run = execute(function, blocks, engine, folder=folder, progress=progress)
    values, reasons = [], []
    for block, outcome in zip(blocks, run.outcomes, strict=True):
        parts = outcome.values
        values.append(np.full((len(block), columns), np.nan) if parts is None else parts["values"])
        reasons += [outcome.failure] * len(block) if parts is None else list(map(str, parts["reasons"]))
    failures = {tuple(int(k) for k in np.unravel_index(i, grid.shape)): reason for i, reason in enumerate(reasons) if reason}
    return np.concatenate(values).reshape(*grid.shape, columns), failures
