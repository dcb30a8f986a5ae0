"""Natural frequencies over a grid of axis positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, count
from toolpoint._doubt import doubts_among, place_note, with_notes
from toolpoint._notebook import NotebookText
from toolpoint.machine.assembly.gyroscopics import fastest_spin
from toolpoint.machine.assembly.reduction_error import estimate_note
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate, can_estimate, estimate_reduction
from toolpoint.machine.assembly.system import freedoms
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.machines.branch_words import branch_lines, name_branches
from toolpoint.studies.machines.machine_uncertainty import AnswerSpread, machine_uncertainty
from toolpoint.studies.machines.pose_grid import Grid, check_grid, evaluate_block, map_over, plain_cells
from toolpoint.studies.text_table import text_table

MAX_CORNER_AXES = 3  # axes whose ends are combined where the reduction is estimated


@dataclass(frozen=True, eq=False)
class PoseMap(NotebookText):
    """Frequencies over a grid.

    axes : axis name to its positions, m or rad; frequency : (n_1, n_2, ..., n_modes), Hz, not a number where a pose failed;
    failures : grid index to reason; angles : axes in rad; uncertainty : of the frequencies, Hz, where the machine was
    identified; reduction : what the reduction of elastic bodies does at the corners and the middle of the grid, in words;
    branches : of an arm, of every pose.
    """

    axes: Mapping[str, FloatArray]
    frequency: FloatArray
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    uncertainty: AnswerSpread | None = None
    reduction: tuple[str, ...] = ()
    branches: tuple[str, ...] = ()

    @property
    def grid(self) -> Grid:
        """The axes with their positions."""
        return Grid(self.axes, self.angles)

    def spread(self) -> FloatArray:
        """Return highest minus lowest frequency of every mode over the grid, Hz, shape (n_modes,)."""
        flat = self.frequency.reshape(-1, self.frequency.shape[-1])
        return np.nanmax(flat, axis=0) - np.nanmin(flat, axis=0)

    def failed(self) -> list[str]:
        """Return a line on every pose that failed: where it is, and why."""
        return self.grid.failure_lines(self.failures)

    def extremes(self) -> list[str]:
        """Return a line on every mode: where its frequency is lowest and highest."""
        names = [f"mode {i + 1}" for i in range(self.frequency.shape[-1])]
        return self.grid.extreme_lines(self.frequency, names, "Hz")

    def table(self) -> str:
        """Return how far every mode moves over the grid, and where the ends lie, as text."""
        rows = [[str(i + 1), f"{s:.4f}"] for i, s in enumerate(self.spread())]
        title = f"Natural frequencies over {self.grid}, {len(self.failures)} poses failed"
        lines = [text_table(title, ["mode", "spread Hz"], rows), *self.extremes(), *branch_lines(self.branches),
                 *self.uncertain()]
        return "\n".join(with_notes(lines, self.reduction))

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, None where a pose failed; positions in m or rad."""
        return {"axes": {name: positions.tolist() for name, positions in self.axes.items()},
                "frequency_hz": plain_cells(self.frequency), "branches": list(self.branches), "failures": self.failed(),
                "extremes": self.extremes(),
                "interval_hz": None if self.uncertainty is None else self.uncertainty.interval.tolist(),
                "uncertain": self.uncertain(), "reduction": list(self.reduction),
                "doubts": doubts_among(self.reduction)}

    def interval(self) -> FloatArray | None:
        """Half widths of the 95 % intervals, shape as `frequency`, Hz; None where nothing was identified with a covariance."""
        return None if self.uncertainty is None else self.uncertainty.interval

    def uncertain(self) -> list[str]:
        """Return a line on every mode: its widest 95 % interval, where, and the joint that it mostly comes from."""
        if self.uncertainty is None:
            return []
        lines = []
        for mode in range(self.frequency.shape[-1]):
            half_width = self.uncertainty.interval[..., mode]
            place = tuple(int(i) for i in np.unravel_index(int(np.argmax(half_width)), half_width.shape))
            lines.append(f"mode {mode + 1}: at most ± {float(half_width.max()):.2g} Hz (95 %), at {self.grid.words(place)}, "
                         f"mostly "
                         f"of {self.uncertainty.main_part(*place, mode)}")
        return lines

    def __repr__(self) -> str:
        return f"PoseMap({self.grid}, {self.frequency.shape[-1]} modes, {len(self.failures)} poses failed)"


@dataclass(frozen=True)
class _Frequencies:
    """Frequencies of a block of poses; a pose that fails leaves its reason."""

    machine: Machine
    names: tuple[str, ...]
    modes: int
    path: str

    @property
    def identity(self) -> str:
        """Key of this study among others on the same grid."""
        return repr((self.machine.description, self.modes, self.path))

    def __call__(self, block: Sequence[Sequence[float]]) -> dict[str, Any]:
        return evaluate_block(self._evaluate, self.machine, self.names, block=block, columns=self.modes)

    def _evaluate(self, poses: Mapping[str, FloatArray]) -> FloatArray:
        return natural_frequencies(self.machine, poses, self.modes, path=self.path)


def pose_map(
    machine: Machine, axes: Mapping[str, ArrayLike], modes: int = 6, *, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None, path: str = "numpy",
) -> PoseMap:
    """Return the lowest natural frequencies over the grid of all combinations of axis positions.

    Parameters
    ----------
    machine : Machine
    axes : mapping of axis name to positions
        m or rad; axes left out are at zero.
    modes : int
    engine, folder, progress : see `execute.execute`
    path : str
        ``numpy`` or ``compiled``, see `machine.frequencies.natural_frequencies`.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     AxisDescription,
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7, "z": 4e7})
    >>> axis = AxisDescription("slide", "x", (-0.3, 0.3))
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": axis}))
    >>> pose_map(machine, {"X": [0.0, 0.1]}, modes=2).frequency.round(2).tolist()
    [[71.18, 100.66], [71.18, 100.66]]
    """
    modes = min(count("modes", modes), freedoms(machine))
    grid = check_grid(machine, axes)
    values, failures = map_over(_Frequencies(machine, tuple(grid.axes), modes, path), grid, modes, engine=engine, folder=folder,
                                progress=progress)
    return PoseMap(grid.axes, values, failures, grid.angles,
                   None if failures else _spread(machine, grid.axes, modes, values.shape),
                   _reduction_notes(machine, grid, modes),
                   name_branches(machine, _all_poses(grid.axes)))


def _reduction_notes(machine: Machine, grid: Grid, modes: int) -> tuple[str, ...]:
    """Return the largest reduction error over corners and middle of a grid, as a note.

    Poses that fail, and corners of more than `MAX_CORNER_AXES` axes, are left out.
    """
    if not can_estimate(machine) or fastest_spin(machine.description):
        return ()
    # Both ends of so many axes, the others at their first position: eight corners at most.
    ends = [sorted({0, len(positions) - 1}) if k < MAX_CORNER_AXES else [0] for k, positions in enumerate(grid.axes.values())]
    middle = tuple(len(positions) // 2 for positions in grid.axes.values())
    worst_estimate: tuple[float, str, ReductionEstimate] | None = None
    pose_count = 0
    for place in dict.fromkeys([*product(*ends), middle]):
        try:
            estimate = estimate_reduction(machine, {name: float(positions[i]) for (name, positions), i in zip(
                grid.axes.items(), place, strict=True)}, modes)
        except ToolpointError:
            continue
        assert estimate is not None
        pose_count += 1
        if worst_estimate is None or estimate.largest > worst_estimate[0]:
            worst_estimate = estimate.largest, grid.words(place), estimate
    if worst_estimate is None:
        return ()
    _, where, estimate = worst_estimate
    return (place_note(estimate_note(estimate), f"{where}, the worst of {pose_count} poses (corners and middle)"),)


def _all_poses(axes: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return {name: positions.ravel() for name, positions in zip(axes, mesh, strict=True)}


def _spread(machine: Machine, axes: Mapping[str, FloatArray], modes: int, shape: tuple[int, ...]) -> AnswerSpread | None:
    """Return the spread of the frequencies over a grid, None where the machine holds no identified numbers."""
    uncertainty = machine_uncertainty(machine)
    if uncertainty is None:
        return None
    poses = _all_poses(axes)
    return uncertainty.spread(lambda machine: natural_frequencies(machine, poses, modes).reshape(shape))
