"""Frequency responses of the tool against the work over a grid of axis positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import ComplexArray, FloatArray, fail, increasing
from toolpoint._notebook import NotebookText
from toolpoint.machine import Machine
from toolpoint.studies.execute import Engine, Progress
from toolpoint.studies.machines.pose_grid import Grid, check_grid, evaluate_block, map_over, plain_cells
from toolpoint.studies.machines.pose_map import pose_map
from toolpoint.studies.machines.tool_point import tool_point
from toolpoint.studies.text_table import text_table

NAMES = ("along x", "along y", "along z")
_MICRONS_PER_METRE = 1e6
_RESPONSE_MAP_LINES = 400  # frequency lines where none are given
_LINE_CHOICE_POSITIONS = 3  # positions of every axis at which modes are computed to choose the lines
_LINE_CHOICE_MODES, _MIN_VIBRATION_FREQUENCY = 12, 1e-6  # modes of the choice; Hz: below, a mode does not vibrate
_MIN_SIDE_LINE_RATIO = 0.7  # of a peak, on the lines next to it: half the power


@dataclass(frozen=True, eq=False)
class ResponseMap(NotebookText):
    """Receptances of the tool against the work over a grid.

    axes : axis name to its positions, m or rad; frequency : (n_f,) Hz; values : (n_1, ..., n_f, 3) complex, m/N, along the
    tool's x, y and z (force and motion in the same direction), not a number where a pose failed; notes : whether the lines
    carry the peaks.
    """

    axes: Mapping[str, FloatArray]
    frequency: FloatArray
    values: ComplexArray
    failures: Mapping[tuple[int, ...], str] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def grid(self) -> Grid:
        """The axes with their positions."""
        return Grid(self.axes, self.angles)

    def greatest(self) -> FloatArray:
        """Return the greatest receptance over the lines, (n_1, ..., 3), m/N."""
        return np.asarray(np.abs(self.values).max(axis=-2))

    def failed(self) -> list[str]:
        """Return a line on every pose that failed: where it is, and why."""
        return self.grid.failure_lines(self.failures)

    def extremes(self) -> list[str]:
        """Return a line on every direction: where its greatest receptance is lowest and highest; its path over two axes."""
        greatest = _MICRONS_PER_METRE * self.greatest()
        return [*self.grid.extreme_lines(greatest, NAMES, "µm/N"), *self.grid.path_lines(greatest, NAMES)]

    def table(self) -> str:
        """Return each direction's greatest receptance with its place and frequency as text."""
        rows = []
        for k, name in enumerate(NAMES):
            size = np.abs(self.values[..., k])
            if not np.isnan(size).all():
                place = np.unravel_index(int(np.nanargmax(size)), size.shape)
                rows.append([name, f"{_MICRONS_PER_METRE * size[place]:.4g}", f"{self.frequency[place[-1]]:.5g}",
                             self.grid.words([int(i) for i in place[:-1]])])
        title = f"Responses over {self.grid}, {len(self.failures)} poses failed"
        return "\n".join([text_table(title, ["direction", "greatest µm/N", "at Hz", "at"], rows), *self.extremes()])

    def to_dict(self) -> dict[str, Any]:
        """Return the map as plain numbers and text, None where a pose failed; positions in m or rad, m/N."""
        return {"axes": {name: positions.tolist() for name, positions in self.axes.items()}, "directions": list(NAMES),
                "frequency_hz": self.frequency.tolist(), "real_m_per_n": plain_cells(self.values.real),
                "imaginary_m_per_n": plain_cells(self.values.imag), "failures": self.failed(), "extremes": self.extremes(),
                "notes": list(self.notes)}

    def __repr__(self) -> str:
        lines = (f"{self.frequency.size} lines, {self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if self.frequency.size > 1
                 else f"at {self.frequency[0]:.4g} Hz")
        return f"ResponseMap({self.grid}, {lines}, {len(self.failures)} poses failed)"


@dataclass(frozen=True)
class _Responses:
    """Receptances of a block of poses, real parts and then imaginary ones."""

    machine: Machine
    names: tuple[str, ...]
    lines: tuple[float, ...]

    @property
    def identity(self) -> str:
        """Key of this study among others on the same grid."""
        return repr((self.machine.description, self.lines))

    def __call__(self, block: Sequence[Sequence[float]]) -> dict[str, Any]:
        return evaluate_block(self._evaluate, self.machine, self.names, block=block, columns=6 * len(self.lines))

    def _evaluate(self, poses: Mapping[str, FloatArray]) -> FloatArray:
        count = len(next(iter(poses.values())))
        listed = [{name: float(positions[i]) for name, positions in poses.items()} for i in range(count)]
        values = tool_point(self.machine, listed, np.array(self.lines)).frf.values
        direct = np.diagonal(values, axis1=-2, axis2=-1).reshape(count, -1)
        return np.concatenate([direct.real, direct.imag], axis=1)


def response_map(
    machine: Machine, axes: Mapping[str, ArrayLike], frequency: ArrayLike | None = None, *, engine: Engine | None = None,
    folder: str | Path | None = None, progress: Progress | None = None,
) -> ResponseMap:
    """Return the responses of the tool against the work over the grid of all combinations of axis positions.

    Parameters
    ----------
    machine : Machine
        Names its tool point, and the table where there is one; damped.
    axes : mapping of axis name to positions
        m or rad; axes left out are at rest.
    frequency : (n_f,) floats, optional
        Hz; 400 lines over the lowest twelve modes of some poses of the grid where left out.
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
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7, "z": 4e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": AxisDescription("slide", "x")},
    ...                                    {"tip": PointDescription("head")}, tool="tip", damping_ratio=0.02))
    >>> response_map(machine, {"X": [0.0, 0.1]})
    ResponseMap(X 2, 400 lines, 14.24..130.9 Hz, 0 poses failed)
    """
    grid = check_grid(machine, axes)
    lines = _lines(machine, grid) if frequency is None else increasing("frequency",
                                                                       np.atleast_1d(np.asarray(frequency, float)))
    function = _Responses(machine, tuple(grid.axes), tuple(map(float, lines)))
    rows, failures = map_over(function, grid, 6 * lines.size, engine=engine, folder=folder, progress=progress)
    real, imaginary = np.split(rows, 2, axis=-1)
    values = (real + 1j * imaginary).reshape(*grid.shape, lines.size, 3)
    result = ResponseMap(grid.axes, lines, values, failures, grid.angles)
    return replace(result, notes=_narrow_notes(result))


def _lines(machine: Machine, grid: Grid) -> FloatArray:
    """Return lines over the lowest twelve modes at the ends and the middle of every axis, at the poses within reach."""
    frequency = pose_map(machine, _choice_positions(grid), _LINE_CHOICE_MODES).frequency
    moving = frequency[frequency > _MIN_VIBRATION_FREQUENCY]
    if not moving.size:
        fail("axes", "no pose that can be computed at their ends and middles", "must have one", remedy="give `lines`")
    return np.linspace(0.2 * float(moving.min()), 1.3 * float(moving.max()), _RESPONSE_MAP_LINES)


def _choice_positions(grid: Grid) -> dict[str, FloatArray]:
    ends = {name: np.unique(np.linspace(0, positions.size - 1, min(positions.size, _LINE_CHOICE_POSITIONS)).astype(int))
            for name, positions in grid.axes.items()}
    return {name: grid.axes[name][positions] for name, positions in ends.items()}


def _narrow_notes(result: ResponseMap) -> tuple[str, ...]:
    """Return a note where the lines are too far apart for the highest peak: a peak without three lines is cut off."""
    size = np.abs(result.values)
    if np.isnan(size).all() or result.frequency.size < 3:
        return ()
    place = np.unravel_index(int(np.nanargmax(size)), size.shape)
    line, peak = int(place[-2]), size[place]
    side_lines = [i for i in (line - 1, line + 1) if 0 <= i < result.frequency.size]
    if all(size[(*place[:-2], i, place[-1])] > _MIN_SIDE_LINE_RATIO * peak for i in side_lines):
        return ()
    step = float(np.diff(result.frequency).max())
    return (f"the highest peak stands on a single line (they are up to {step:.3g} Hz apart): it may be higher between them; "
            "give more `lines`, or map the dynamic stiffness, which looks at every resonance",)
