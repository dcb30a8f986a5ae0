"""G-code: a subset of ISO 6983 and the common Siemens words -> path segments; every fault with its line; read.

G0 G1 G2 G3, G17 G18 G19, G90 G91, G70/G71 (lengths in inch, mm), G20/G21 or G700/G710 (feed too), G60 and G9 (exact stop), G64,
I J K with AC() and IC(), CR= or R radius, X Y Z with AC() and IC(), F (mm/min), S, T, M, N, D, comments ; and ( ).
Unknown words are faults.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.drives.program.path import Path as DrivePath
from toolpoint.io.faults import Fault, FileFaults

_WORD = re.compile(r"\s*(?:(CR)\s*=\s*|([A-Z]))\s*(?:=\s*)?(AC|IC)?\s*\(?\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*\)?", re.IGNORECASE)
_PLANES = {17: (0, 1), 18: (2, 0), 19: (1, 2)}
_GROUPS = {0: "motion", 1: "motion", 2: "motion", 3: "motion", 17: "plane", 18: "plane", 19: "plane", 90: "distance",
           91: "distance", 60: "exact", 64: "exact", 9: "once", 20: "unit", 21: "unit", 70: "unit", 71: "unit", 700: "unit",
           710: "unit"}
_AXES = {"X": 0, "Y": 1, "Z": 2}
_CENTER = {"I": 0, "J": 1, "K": 2}
_IGNORED = set("NSTMDO")


@dataclass(frozen=True, eq=False)
class Program:
    """Segments of a program in SI, as plain arrays.

    `kind` (n,) 0 line, 1 arc; `start`, `end`, `center` (n, 3) m; `sweep` (n,) rad, positive from the plane's first to its
    second axis; `plane` (n, 2) axis indices; `feed` (n,) m/s; `rapid`, `stop` (n,) bools; `line` (n,) program lines.
    `words` holds the auxiliary words (line, letter, value) that do not move.
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
    words: tuple[tuple[int, str, float], ...] = ()

    @property
    def path(self) -> DrivePath:
        """The segments as a path of lines and arcs."""
        return DrivePath(self.kind, self.start, self.end, self.center, self.sweep, self.plane, self.feed, self.stop, self.line,
                         self.rapid)

    def __repr__(self) -> str:
        return f"Program({self.kind.size} segments, {int((self.kind == 1).sum())} arcs, {int(self.rapid.sum())} rapid)"


def read(path: str | Path, rapid_feed: float = 0.5, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Program:
    """Return the segments of a program file; see `parse`."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise ToolpointError(f"{path}: cannot be read ({error.strerror}); check the name and the folder") from None
    return parse(text, rapid_feed, start, name=str(path))


def read_path(path: str | Path, rapid_feed: float = 0.5) -> DrivePath:
    """Return the path of lines and arcs that a program file describes; `rapid_feed` (m/s) is that of G0."""
    return read(path, rapid_feed).path


def parse(text: str, rapid_feed: float = 0.5, start: tuple[float, float, float] = (0.0, 0.0, 0.0),
          *, name: str = "program", arc_tolerance: float = 1e-5) -> Program:
    """Return the segments of a program.

    Parameters
    ----------
    text : str
        Millimetres and mm/min unless G70 (inches), G20 or G700 (inches and inch/min).
    rapid_feed : float
        Feed of G0, m/s.
    start : 3 floats
        Position before the first line, m.
    name : str
        Shown in faults.
    arc_tolerance : float
        Largest difference of the radii at an arc's start and end, m.

    Raises
    ------
    FileFaults
        Every faulty line: unknown words, two words of a group, an arc with a wrong radius or without centre, no feed.
    """
    state = _State(rapid_feed, arc_tolerance, [float(x) for x in start])
    for number, line in enumerate(text.splitlines(), 1):
        if not state.ended:
            state.take(number, line)
    if state.faults:
        raise FileFaults(name, text, state.faults[:100])
    return state.program(name, text)


@dataclass
class _State:
    """Modal state while lines are taken."""

    rapid_feed: float
    tolerance: float
    position: list[float]
    motion: int = 0
    plane: int = 17
    incremental: bool = False
    exact: bool = False
    scale: float = 1e-3
    feed_scale: float = 1e-3
    feed: float = 0.0
    feed_missed: bool = False
    ended: bool = False
    rows: list[tuple[float, ...]] = field(default_factory=list)
    words: list[tuple[int, str, float]] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)

    def fault(self, number: int, column: int, message: str) -> None:
        self.faults.append(Fault(number, column, "", message))

    def take(self, number: int, line: str) -> None:
        """Read one line and add its segment."""
        text = line.split(";", 1)[0]
        if "(" in text:
            text = re.sub(r"(?<!AC)(?<!IC)\((?:[^()]*)\)", lambda m: " " * len(m[0]), text, flags=re.IGNORECASE)
        text = text.rstrip()
        if not text or text.lstrip()[0] in "%/":
            return
        words = self.split(number, text)
        if words is not None:
            self.block(number, words)

    def split(self, number: int, text: str) -> list[tuple[str, str, float, int]] | None:
        """Return the words of a line: letter, AC/IC or nothing, value, column."""
        words, at = [], 0
        while at < len(text):
            match = _WORD.match(text, at)
            if match is None:
                if not text[at:].strip():
                    break
                column = at + len(text[at:]) - len(text[at:].lstrip()) + 1
                self.fault(number, column, f"{text[column - 1:].split()[0]!r} is not a word of the subset")
                return None
            words.append(((match[1] or match[2]).upper(), (match[3] or "").upper(), float(match[4]), match.start() + 1))
            at = match.end()
        return words

    def block(self, number: int, words: list[tuple[str, str, float, int]]) -> None:
        """Take the words of one block."""
        groups: dict[str, int] = {}
        places: dict[str, tuple[str, float]] = {}
        once, before, feed = False, len(self.faults), 0.0
        for letter, mode, value, column in words:
            if letter == "G":
                group = _GROUPS.get(int(value)) if value == int(value) else None
                if group is None:
                    self.fault(number, column, f"G{value:g} is not in the subset "
                               "(G0-G3, G9, G17-G21, G60, G64, G70, G71, G90, G91, G700, G710)")
                elif group in groups:
                    self.fault(number, column, f"G{value:g} and G{groups[group]} in one block")
                else:
                    groups[group] = int(value)
                    once |= group == "once"
            elif letter in _AXES or letter in _CENTER or letter in ("CR", "R"):
                key = "CR" if letter == "R" else letter
                if key in places:
                    self.fault(number, column, f"{letter} twice in one block")
                places[key] = mode, value
            elif letter == "F":
                if value <= 0:
                    self.fault(number, column, f"F{value:g}; feed must be above zero")
                feed = value
            elif letter in _IGNORED:
                self.words.append((number, letter, value))
                self.ended |= letter == "M" and value in (2, 30)
            else:
                self.fault(number, column, f"unknown word {letter}{value:g}")
        self.modal(groups)
        if feed > 0:
            self.feed = feed * self.feed_scale / 60
        if len(self.faults) > before:
            self.position = self.target(places)  # what follows is read from where the block was meant to end
        elif any(k in _AXES or k in _CENTER for k in places):
            self.move(number, places, once)

    def target(self, places: dict[str, tuple[str, float]]) -> list[float]:
        """Return the position after a block."""
        end = list(self.position)
        for letter, i in _AXES.items():
            if letter in places:
                mode, value = places[letter]
                relative = mode == "IC" or (self.incremental and mode != "AC")
                end[i] = value * self.scale + (end[i] if relative else 0.0)
        return end

    def modal(self, groups: dict[str, int]) -> None:
        """Keep the modal words."""
        self.motion = groups.get("motion", self.motion)
        self.plane = groups.get("plane", self.plane)
        if "distance" in groups:
            self.incremental = groups["distance"] == 91
        if "exact" in groups:
            self.exact = groups["exact"] == 60
        if "unit" in groups:
            self.scale = 0.0254 if groups["unit"] in (20, 70, 700) else 1e-3
            if groups["unit"] in (20, 21, 700, 710):
                self.feed_scale = self.scale

    def move(self, number: int, places: dict[str, tuple[str, float]], once: bool) -> None:
        """Add the segment of a block."""
        start, end = self.position, self.target(places)
        self.position = end
        if self.motion and self.feed == 0:
            if not self.feed_missed:
                self.fault(number, 1, "no feed yet; program F in this or an earlier block")
            self.feed_missed = True
            return
        center, sweep = start, 0.0
        if self.motion >= 2:
            arc = self.arc(number, places, start, end=end)
            if arc is None:
                return
            center, sweep = arc
        elif any(k in _CENTER or k == "CR" for k in places):
            self.fault(number, 1, "I, J, K or CR on a straight line; program G2 or G3")
            return
        a, b = _PLANES[self.plane]
        stop = self.exact or once or self.motion == 0
        feed = self.feed if self.motion else self.rapid_feed
        self.rows.append((self.motion >= 2, *start, *end, *center, sweep, a, b, feed, self.motion == 0, stop, number))

    def arc(self, number: int, places: dict[str, tuple[str, float]], start: list[float], *, end: list[float]
            ) -> tuple[list[float], float] | None:
        """Return centre and sweep of an arc, or nothing after a fault."""
        a, b = _PLANES[self.plane]
        turn = -1.0 if self.motion == 2 else 1.0
        if "CR" in places:
            center = self.from_radius(number, places["CR"][1] * self.scale, start, end=end, turn=turn)
            if center is None:
                return None
        elif any(k in places for k in _CENTER):
            center = list(start)
            for letter, i in _CENTER.items():
                if letter in places:
                    if i not in (a, b):
                        self.fault(number, 1, f"{letter} is not in the plane of G{self.plane}")
                        return None
                    mode, value = places[letter]
                    center[i] = value * self.scale + (0.0 if mode == "AC" else start[i])
        else:
            self.fault(number, 1, "an arc needs I, J, K or CR=")
            return None
        r0 = math.hypot(start[a] - center[a], start[b] - center[b])
        r1 = math.hypot(end[a] - center[a], end[b] - center[b])
        if r0 == 0 or abs(r0 - r1) > max(self.tolerance, 1e-4 * r0):
            self.fault(number, 1, f"arc with radius {1e3 * r0:.6g} mm at its start and {1e3 * r1:.6g} mm at its end; "
                       "correct I, J, K or the end point")
            return None
        first = math.atan2(start[b] - center[b], start[a] - center[a])
        last = math.atan2(end[b] - center[b], end[a] - center[a])
        sweep = (turn * (last - first)) % (2 * math.pi)
        if sweep < 1e-9 or 2 * math.pi - sweep < 1e-9:
            sweep = 2 * math.pi
        return center, turn * sweep

    def from_radius(self, number: int, radius: float, start: list[float], *, end: list[float], turn: float
                    ) -> list[float] | None:
        """Return the centre for a radius; a negative radius means the longer arc."""
        a, b = _PLANES[self.plane]
        da, db = end[a] - start[a], end[b] - start[b]
        chord = math.hypot(da, db)
        if chord == 0:
            self.fault(number, 1, "a full circle needs I, J, K instead of CR=")
            return None
        rest = radius * radius - chord * chord / 4
        if rest < -2 * self.tolerance * abs(radius):
            self.fault(number, 1, f"radius {1e3 * abs(radius):.6g} mm is below half the chord, {500 * chord:.6g} mm")
            return None
        offset = turn * math.copysign(math.sqrt(max(rest, 0.0)), radius) / chord
        center = list(start)
        center[a] = (start[a] + end[a]) / 2 - offset * db
        center[b] = (start[b] + end[b]) / 2 + offset * da
        return center

    def program(self, name: str, text: str) -> Program:
        """Return the arrays."""
        if not self.rows:
            raise FileFaults(name, text, [Fault(1, 1, "", "no block that moves")])
        t = np.array(self.rows, float)
        return Program(t[:, 0].astype(int), t[:, 1:4], t[:, 4:7], t[:, 7:10], t[:, 10], t[:, 11:13].astype(int), t[:, 13],
                       t[:, 14] > 0, t[:, 15] > 0, t[:, 16].astype(int), tuple(self.words))
