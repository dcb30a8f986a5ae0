"""Moves of a program as plain arrays, and the list that a reader fills segment by segment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint._notebook import NotebookText
from toolpoint.drives.program.path import Path as DrivePath
from toolpoint.io.faults import Fault, FileFaults
from toolpoint.io.program.language.remarks import Remarks
from toolpoint.io.program.path.compensated_rows import compensate_rows
from toolpoint.io.program.path.radius_compensation import Compensation, ContourEnd, CutterRadii
from toolpoint.io.program.path.rounded_corners import Corner, round_corners

# Twice the largest programs of moulds; a loop that never ends reaches it within seconds and is named.
MOST_SEGMENTS = 2_000_000
DIRECTION_WIDTH = 12  # numbers of a segment: angles of A, B, C (rad) and vector at its start, the same at its end


@dataclass(frozen=True, eq=False)
class Program(NotebookText):
    """Segments of a program in SI, as plain arrays.

    `kind` (n,) 0 line, 1 arc; `start`, `end`, `center` (n, 3) m; `sweep` (n,) rad, positive from the plane's first to its
    second axis; `plane` (n, 2) axis indices; `feed` (n,) m/s; `rapid`, `stop` (n,) bools; `line` (n,) program lines;
    `dwell` (n,) s, waited after each. `words` holds the auxiliary words (line, letter, value) that do not move; `notes` what
    was assumed or left out, the most important first. `speed` (n,) rev/min, 0 before the first S; `tool` (n,) the number of the
    tool in the spindle, 0 before the first. `plane_index` (n,) says in the axes of which of `rotations` (k, 3, 3) a segment is
    written: columns are the axes of a tilted plane in the work, the first are the work's own. `rotary` holds the lines whose
    words turn A, B or C: these are not followed. Of programs with tool centre control `directions` (n, 12) holds what was
    programmed of the tool's direction at both ends of every segment (see `control.tool_centre`), `is_controlled` (n,) where it
    is in force, `unseen` (n,) rapids whose tip's way is not known.
    """

    kind: np.ndarray
    start: FloatArray
    end: FloatArray
    center: FloatArray
    sweep: FloatArray
    plane: np.ndarray
    feed: FloatArray
    rapid: np.ndarray
    stop: np.ndarray
    line: np.ndarray
    dwell: FloatArray
    words: tuple[tuple[int, str, float], ...] = ()
    notes: tuple[str, ...] = ()
    speed: FloatArray = field(default_factory=lambda: np.zeros(0))
    tool: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    plane_index: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    rotations: FloatArray = field(default_factory=lambda: np.eye(3)[None])
    rotary: tuple[int, ...] = ()
    directions: FloatArray = field(default_factory=lambda: np.zeros((0, DIRECTION_WIDTH)))
    is_controlled: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    unseen: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))

    @property
    def path(self) -> DrivePath:
        """The segments as a path of lines and arcs; refused where planes are tilted (see `stages`)."""
        if self.is_five_axis:
            line = int(self.line[int(np.argmax(self.is_controlled))])
            raise ToolpointError(f"program: line {line} moves under tool centre control; only `toolpoint machining` takes "
                                 "five axes")
        if self.is_tilted:
            line = int(self.line[int(np.argmax(self.plane_index > 0))])
            raise ToolpointError(f"program: line {line} is in a tilted plane; only `toolpoint machining` takes tilted planes")
        return self.tip_path()

    def tip_path(self) -> DrivePath:
        """Return the segments of the tool's tip as a path, of five axes too: in the work, which follows the rotary axes."""
        return DrivePath(self.kind, self.start, self.end, self.center, self.sweep, self.plane, self.feed, self.stop, self.line,
                         self.rapid, self.dwell)

    @property
    def is_tilted(self) -> bool:
        """Whether any segment is in a tilted plane."""
        return bool(self.plane_index.size and (self.plane_index > 0).any())

    @property
    def is_five_axis(self) -> bool:
        """Whether any segment is under tool centre control."""
        return bool(self.is_controlled.any())

    def stages(self) -> tuple[tuple[FloatArray, Program], ...]:
        """Return the runs of segments in one plane: its rotation (3, 3), and their program in its axes."""
        plane = self.plane_index if self.plane_index.size else np.zeros(self.kind.size, int)
        edges = np.concatenate([[0], np.flatnonzero(np.diff(plane)) + 1, [plane.size]])
        columns = ("kind", "start", "end", "center", "sweep", "plane", "feed", "rapid", "stop", "line", "dwell", "speed",
                   "tool")
        stages = []
        for first, last in pairwise(edges.tolist()):
            parts = {name: getattr(self, name)[first:last] for name in columns if len(getattr(self, name))}
            stages.append((self.rotations[plane[first]], replace(self, **parts, plane_index=np.zeros(last - first, int))))
        return tuple(stages)

    def __repr__(self) -> str:
        return f"Program({self.kind.size} segments, {int((self.kind == 1).sum())} arcs, {int(self.rapid.sum())} rapid)"


@dataclass
class Segments:
    """Rows of a program that is being read."""

    rows: list[tuple[float, ...]] = field(default_factory=list)
    waits: dict[int, float] = field(default_factory=dict)
    speed: float = 0.0
    called_tool: int = 0
    changed_tool: int = -1  # by the last M6; below zero before the first
    rotations: list[list[list[float]]] = field(default_factory=lambda: [[[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]])
    plane: int = 0  # in which of them segments are written
    rotary: set[int] = field(default_factory=set)
    directions: dict[int, tuple[float, ...]] = field(default_factory=dict)  # of rows under tool centre control
    unseen: set[int] = field(default_factory=set)  # rows whose tip's way is not known
    compensation: Compensation | None = None  # of the rows that follow
    compensations: dict[int, Compensation] = field(default_factory=dict)  # of rows
    corners: dict[int, Corner] = field(default_factory=dict)  # behind rows, that are rounded or broken
    contour_ends: dict[int, ContourEnd] = field(default_factory=dict)  # of rows that lead to a contour or away from it
    cutter_radii: CutterRadii | None = None  # as given from outside
    defined_radii: dict[int, float] = field(default_factory=dict)  # m, of tools that the program itself defines
    doubts: list[Doubt] = field(default_factory=list)

    def tool_of(self, row: Sequence[float]) -> int:
        """Return the number of the tool in the spindle; without any M6 a T changes at once, as on a turret."""
        return max(int(row[19] if self.changed_tool >= 0 else row[18]), 0)

    def keep_compensation(self) -> None:
        """Keep the compensation of the last row."""
        if self.compensation is not None:
            self.compensations[len(self.rows) - 1] = self.compensation

    def keep_directions(self, directions: tuple[float, ...]) -> None:
        """Keep the directions of the tool at both ends of the last row, see `control.tool_centre`."""
        self.directions[len(self.rows) - 1] = directions

    def keep_unseen(self) -> None:
        """Keep that the way of the tip in the last row is not known."""
        self.unseen.add(len(self.rows) - 1)

    def enter_plane(self, matrix: list[list[float]]) -> None:
        """Write the following segments in the axes of a plane."""
        if matrix not in self.rotations:
            self.rotations.append(matrix)
        self.plane = self.rotations.index(matrix)

    def call_tool(self, number: float | None, *, change: bool = False) -> None:
        """Keep a word T, and whether the tool is changed in this block (M6): a T before it only brings the tool near."""
        self.called_tool = self.called_tool if number is None else int(number)
        if change:
            self.changed_tool = self.called_tool

    def line(self, start: Sequence[float], end: Sequence[float], *, feed: float, rapid: bool, stop: bool, number: int,
             plane: tuple[int, int] = (0, 1)) -> None:
        """Add a straight line, m and m/s."""
        self.rows.append((0, *start, *end, *start, 0.0, *plane, feed, rapid, stop, number, *self._spindle))
        self.keep_compensation()

    def arc(self, start: Sequence[float], end: Sequence[float], center: Sequence[float], *, sweep: float,
            plane: tuple[int, int], feed: float, stop: bool, number: int) -> None:
        """Add an arc, m, rad and m/s."""
        self.rows.append((1, *start, *end, *center, sweep, *plane, feed, False, stop, number, *self._spindle))
        self.keep_compensation()

    @property
    def _spindle(self) -> tuple[float, float, float, float]:
        return self.speed, self.called_tool, self.changed_tool, self.plane

    def wait(self, duration: float) -> bool:
        """Wait after the last segment, s; False where there is none."""
        if not self.rows:
            return False
        self.waits[len(self.rows) - 1] = self.waits.get(len(self.rows) - 1, 0.0) + duration
        return True

    def program(self, name: str, text: str, *, words: Sequence[tuple[int, str, float]], remarks: Remarks) -> Program:
        """Return the arrays; raise FileFaults for faults, or where nothing moves."""
        round_corners(self, remarks)
        compensate_rows(self, remarks)
        if remarks.faults:
            raise FileFaults(name, text, remarks.fault_list())
        if not self.rows:
            raise FileFaults(name, text, [Fault(1, 1, "", "no block that moves")])
        # One table for all columns: a program of a million blocks is built in one call instead of twenty lists.
        t = np.array(self.rows, float)
        dwell = np.zeros(len(t))
        dwell[list(self.waits)] = list(self.waits.values())
        tool = t[:, 19] if (t[:, 19] >= 0).any() else t[:, 18]  # without an M6 a T changes at once, as on a turret
        return Program(t[:, 0].astype(int), t[:, 1:4], t[:, 4:7], t[:, 7:10], t[:, 10], t[:, 11:13].astype(int), t[:, 13],
                       t[:, 14] > 0, (t[:, 15] > 0) | (dwell > 0), t[:, 16].astype(int), dwell, tuple(words),
                       (*self.doubts, *remarks.note_list()), t[:, 17], np.maximum(tool, 0).astype(int), t[:, 20].astype(int),
                       np.array(self.rotations), tuple(sorted(self.rotary)), *self._turned_rows(len(t)))

    def _turned_rows(self, count: int) -> tuple[FloatArray, np.ndarray, np.ndarray]:
        """Return directions, whether tool centre control is in force, and rows not seen; empty where the tool stays upright."""
        if not self.directions and not self.unseen:
            return np.zeros((0, DIRECTION_WIDTH)), np.zeros(0, bool), np.zeros(0, bool)
        directions, is_controlled, unseen = np.zeros((count, DIRECTION_WIDTH)), np.zeros(count, bool), np.zeros(count, bool)
        # No number where no vector was programmed: zero would be a direction to reckon with.
        directions[:, 3:6] = directions[:, 9:12] = np.nan
        for k, values in self.directions.items():
            directions[k] = values
        is_controlled[list(self.directions)] = True
        unseen[list(self.unseen)] = True
        return directions, is_controlled, unseen
