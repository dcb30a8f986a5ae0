"""Servo loops over the workspace: margins, bandwidth and circular deviation at every pose, the structure in the loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives import Servo, Structure, circular_test, compute_loops, simulate
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.loops import LoopLevel, bandwidth
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.command import circle as circle_command
from toolpoint.kinematics.chain import check_poses
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.pose_words import position_words
from toolpoint.studies.servos.drive_structure import free_machine, question_structure, structure_at
from toolpoint.studies.text_table import text_table

_MARGIN_LINES = 800  # frequency lines of margins and bandwidths
Progress = Callable[[int, int], None]
# Field, what it is, factor to the unit in the words.
QUANTITIES = (("velocity_phase_margin", "Phase margin of the velocity loop, °", 1.0),
              ("velocity_gain_margin", "Gain margin of the velocity loop, dB", 1.0),
              ("phase_margin", "Phase margin of the position loop, °", 1.0),
              ("bandwidth", "Bandwidth of the position loop, Hz", 1.0),
              ("circular_deviation", "Circular deviation at the tool point, µm", 1e6))


@dataclass(frozen=True, eq=False)
class ServoMap(NotebookText):
    """Position loops at many poses.

    poses : the poses; axes : names of the drives' axes; gain_margin (dB), phase_margin (deg), bandwidth (Hz, -3 dB) :
    (n_poses, n_axes) of the position loop; velocity_gain_margin (dB), velocity_phase_margin (deg) : of the velocity loop;
    circular_deviation : (n_poses,) deviation G of a circle at the tool point, m, not-a-number where none was run;
    stable : (n_poses,); failures : pose index to reason; failed poses hold not-a-number;
    name : of the drives; grid : axis of the machine to its positions (m or rad), the poses being all their combinations;
    angles : those of these axes that turn; structure_doubts : what loss factors of the machine err by in time, at the corner of
    the grid where they err most.
    """

    poses: tuple[Mapping[str, float], ...]
    axes: tuple[str, ...]
    gain_margin: FloatArray
    phase_margin: FloatArray
    bandwidth: FloatArray
    velocity_gain_margin: FloatArray
    velocity_phase_margin: FloatArray
    circular_deviation: FloatArray
    stable: np.ndarray
    failures: Mapping[int, str] = field(default_factory=dict)
    name: str = ""
    grid: Mapping[str, FloatArray] = field(default_factory=dict)
    angles: tuple[str, ...] = ()
    structure_doubts: tuple[Doubt, ...] = ()

    def worst(self) -> tuple[int, str]:
        """Return pose index and axis with the smallest phase margin of the velocity loop."""
        index = np.unravel_index(int(np.nanargmin(self.velocity_phase_margin)), self.velocity_phase_margin.shape)
        return int(index[0]), self.axes[int(index[1])]

    @property
    def status(self) -> str:
        """Doubts in one line, or that all poses are stable."""
        return "; ".join(self.doubts()) or "all poses stable"

    def doubts(self) -> list[Doubt]:
        """Return doubts about the structure, then the poses that failed or are unstable, with their reasons."""
        failed = [Doubt(self._pose_text(k), words) for k, words in self.failures.items()]
        unstable = [Doubt(self._pose_text(k), "unstable") for k in np.flatnonzero(~self.stable).tolist()
                    if k not in self.failures]
        return [*self.structure_doubts, *failed, *unstable]

    def _pose_text(self, k: int) -> str:
        return ", ".join(f"{name} {position_words(value, name in self.angles)}"
                         for name, value in self.poses[k].items()) or "reference pose"

    def columns(self, quantity: str, factor: float = 1.0) -> tuple[FloatArray, tuple[str, ...]]:
        """Return a quantity (a field's name) times `factor` as (n_poses, n_columns), and the columns' names."""
        values = factor * getattr(self, quantity)
        return (values[:, None], ("tool point",)) if values.ndim == 1 else (values, self.axes)

    def rows(self) -> list[list[str]]:
        """Return quantity, axis, smallest and largest value over the poses, as words."""
        rows = []
        for key, words, factor in QUANTITIES:
            values, names = self.columns(key, factor)
            for k, name in enumerate(names):
                if np.isfinite(values[:, k]).any():
                    rows.append([words, name, f"{np.nanmin(values[:, k]):.2f}", f"{np.nanmax(values[:, k]):.2f}"])
        return rows

    def table(self) -> str:
        """Return doubts, then smallest and largest value of every quantity over the poses."""
        failed = f", {len(self.failures)} failed" if self.failures else ""
        title = f"Servo at {len(self.poses)} poses, axes {', '.join(self.axes)}: {int(self.stable.sum())} stable{failed}"
        table = text_table(title, ["quantity", "axis", "smallest", "largest"], self.rows())
        return "\n".join([*mark_notes(self.doubts()), table])

    def to_dict(self) -> dict[str, Any]:
        """Return poses, margins (deg), bandwidths (Hz) and deviations (m; None where none was run) as plain values."""
        return {"doubts": self.doubts(), "poses": [dict(pose) for pose in self.poses], "axes": self.axes,
                "velocity_phase_margin_deg": self.velocity_phase_margin.tolist(), "bandwidth_hz": self.bandwidth.tolist(),
                "stable": self.stable.tolist(),
                "circular_deviation_m": [None if v != v else v for v in self.circular_deviation.tolist()]}

    def __repr__(self) -> str:
        return (f"ServoMap({len(self.poses)} poses, axes {', '.join(self.axes)}, {int(self.stable.sum())} stable, "
                f"{len(self.failures)} failed)")


def map_servo(drives: DriveDescription, *, machine: Machine, grid: Mapping[str, FloatArray],
              circle: tuple[float, float] | None = None, progress: Progress | None = None) -> ServoMap:
    """Return the margins of described drives over a grid of poses of their machine.

    Parameters
    ----------
    grid : mapping of axis of the machine to positions (m or rad)
        One or two axes, two positions or more of each.
    circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle simulated at every stable pose; the structure stays that of the pose.
    progress : callable, optional
        Called with the number of poses done and their number.

    Examples
    --------
    Runs in ``examples/map_a_servo_over_the_workspace.py``.
    """
    if not 1 <= len(grid) <= 2:
        fail("grid", f"{len(grid)} axes", "a map has one or two")
    short = [name for name, positions in grid.items() if np.size(positions) < 2]
    if short:
        fail("grid", f"one position of {', '.join(short)}", "needs two positions or more of each axis")
    free, ends, tools = free_machine(drives, machine)
    build_servo(drives)  # the faults of the description once, and the warnings of its friction
    poses = [dict(zip(grid, values, strict=True)) for values in product(*grid.values())]
    at_pose = lambda structure: build_servo(drives, structure, warn=False)
    result = map_margins(free, poses, ends=ends, tools=tools, build=at_pose,
                         circle=circle, progress=progress)
    angles = tuple(axis.name for axis in machine.chain.axes if axis.is_rotary)
    return replace(result, name=drives.name, grid=dict(grid), angles=angles,
                   structure_doubts=_question_corners(drives, machine, grid))


def _question_corners(drives: DriveDescription, machine: Machine, grid: Mapping[str, FloatArray]) -> tuple[Doubt, ...]:
    """Return the doubt about the structure's loss factors at the corner of the grid where they err most."""
    doubts = list[Doubt]()
    for values in product(*((float(np.min(positions)), float(np.max(positions))) for positions in grid.values())):
        try:
            doubts += question_structure(drives, machine, dict(zip(grid, values, strict=True)))
        except ToolpointError:
            continue  # a pose that cannot be is a failure of the map, with its reason
    return (max(doubts, key=lambda doubt: doubt.figure or 0.0),) if doubts else ()


def map_margins(
    machine: Machine, poses: Sequence[Mapping[str, float]], *, ends: Mapping[str, str], tools: Mapping[str, str],
    build: Callable[[Structure], Servo], circle: tuple[float, float] | None = None, progress: Progress | None = None,
) -> ServoMap:
    """Return the margins of any servo whose structure is the machine at each pose.

    Parameters
    ----------
    machine : Machine
        With its driven directions free (a vanishing drive stiffness), so that the drives carry them.
    poses : sequence of mappings of axis name to m or rad
    ends : mapping of a drive's boundary (``x.table``) to the machine's Dof (``saddle:+x``)
    tools : mapping of axis name to the Dof of the tool point in its direction
    build : callable
        Takes the Structure of a pose, returns the Servo (drives and control on that structure).
    circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle simulated at every stable pose; the structure stays that of the pose.
    progress : callable, optional
        Called with the number of poses done and their number.
    """
    if not check_poses(poses):
        fail("poses", "none", "must be at least one")
    rows: list[_PoseFigures | None] = []
    failures: dict[int, str] = {}
    for i, pose in enumerate(poses):
        try:
            rows.append(_figures(build(structure_at(machine, pose, ends=ends, tools=tools)), circle))
        except ToolpointError as error:
            failures[i] = str(error)
            rows.append(None)
        if progress is not None:
            progress(i + 1, len(poses))
    names = next((row.axes for row in rows if row is not None), None)
    if names is None:
        fail("poses", "every pose failed", failures[0])
    failures |= {i: row.failure for i, row in enumerate(rows) if row is not None and row.failure}
    failed_figures = _PoseFigures(names, np.full((5, len(names)), np.nan), np.nan, False)
    all_rows = [row or failed_figures for row in rows]
    gain, phase, width, velocity_gain, velocity_phase = np.array([row.figures for row in all_rows]).swapaxes(0, 1)
    return ServoMap(tuple(dict(pose) for pose in poses), names, gain, phase, width, velocity_gain, velocity_phase,
                    np.array([row.deviation for row in all_rows]), np.array([row.stable for row in all_rows]), failures)


@dataclass(frozen=True, eq=False)
class _PoseFigures:
    """One pose: rows gain, phase, bandwidth, gain and phase of the velocity loop, a column an axis; deviation of the circle."""

    axes: tuple[str, ...]
    figures: FloatArray
    deviation: float
    stable: bool
    failure: str = ""


def _figures(servo: Servo, circle: tuple[float, float] | None) -> _PoseFigures:
    levels = compute_loops(servo)
    names = tuple(levels.position.closed.inputs)
    figures = _loop_figures(levels.position, levels.velocity, len(names))
    if circle is None or not levels.stable:
        return _PoseFigures(names, figures, np.nan, levels.stable)
    try:
        return _PoseFigures(names, figures, circle_deviation(servo, *circle), True)
    except ToolpointError as error:
        # The margins are known all the same.
        return _PoseFigures(names, figures, np.nan, True, str(error))


def _loop_figures(position: LoopLevel, velocity: LoopLevel, axes: int) -> FloatArray:
    position_margins, velocity_margins = [position.margins(k, _MARGIN_LINES)
                                          for k in range(axes)], [velocity.margins(k, _MARGIN_LINES) for k in range(axes)]
    nyquist = 0.5 / float(position.closed.sample_time or 1.0)
    f = np.geomspace(1e-4, 0.999, _MARGIN_LINES) * nyquist
    widths = [bandwidth(f, position.closed_response(f, k)) for k in range(axes)]
    return np.array([[m.gain_db for m in position_margins], [m.phase for m in position_margins], widths,
                     [m.gain_db for m in velocity_margins],
                     [m.phase for m in velocity_margins]])


def circle_deviation(servo: Servo, radius: float, feed: float) -> float:
    """Return the circular deviation G (ISO 230-4, m) of the second turn at the tool point, first two axes; m and m/s.

    The command starts at the full feed, so the first turn is not judged; a third axis and more are at rest.
    """
    turn = 2 * np.pi * radius / feed
    plane = circle_command(radius, feed, servo.controllers[0].position.sample_time, duration=2 * turn, center=(-radius, 0.0))
    axes = len(servo.controllers)
    if axes < 2:
        fail("axes", f"{axes}", "must be at least two for a circle")
    pad = lambda v: np.pad(v, ((0, 0), (0, axes - 2)))
    command = replace(plane, position=pad(plane.position), velocity=pad(plane.velocity), acceleration=pad(plane.acceleration))
    result = simulate(servo, command, record_interval=servo.counts.velocity)
    points = result.output("tool")[result.time > turn][:, :2] + np.array([radius, 0.0])
    return circular_test(points, radius).deviation
