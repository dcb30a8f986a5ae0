"""Path of a program over the stock: tools and speeds of its segments, feeds as planned, and moves whose height is not known."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.drives.program.path import Path
from toolpoint.drives.program.planner import plan_motion
from toolpoint.material_removal import Moves, split_moves
from toolpoint.studies.machining.setup import STEP_RATIO, MachiningSetup

SAFE_HEIGHT = 0.1  # m above the stock, of moves whose height the program does not hold
_SPEED_PATTERN = re.compile(r"(?<![A-Z#])S\s*=?\s*\d")
# Moves in machine coordinates or to the reference point: the program does not hold the heights of their ends.
_REFERENCE_PATTERN = re.compile(r"\bG\s*0?(28|30|53)\b|\bM\s*(?:91|92)\b|\bM\s*140\s+MB\s*MAX")


class ParsedProgram(Protocol):
    """Program as a reader gives it, see `io.program`."""

    @property
    def path(self) -> Path:
        """Segments, m."""
        ...

    @property
    def speed(self) -> FloatArray:
        """Spindle speed of every segment, rev/min; 0 where none is programmed."""
        ...

    @property
    def tool(self) -> np.ndarray:
        """Number of the tool of every segment."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on assumptions and words left out."""
        ...


@dataclass(frozen=True, eq=False)
class ProgramPath:
    """Segments of a program as they are run: speed (rev/min), tool number, feed (m/s) and time (s) of each, and the pieces.

    place_feed : (places,) feed of the cutting edge at every place of the removal, m/s, where it is not that of the segment.
    """

    path: Path
    moves: Moves
    speed: FloatArray
    tool: np.ndarray
    numbers: tuple[int, ...]
    feed: FloatArray
    time: FloatArray
    remarks: tuple[str, ...]
    place_feed: FloatArray | None = None


def lay_program(program: ParsedProgram, setup: MachiningSetup, text: str = "") -> ProgramPath:
    """Return the path of a program with its tools, speeds and feeds.

    Raises ToolpointError for a cutting segment without a spindle speed, with its line.
    """
    _check_rotary(program)
    path = raise_reference_moves(program.path, text, float(setup.stock.upper[2]) + SAFE_HEIGHT)
    tool, speed, numbers, remarks = tools_and_speeds(program, path, path.lengths > 0, setup=setup)
    feed, time, words = _feeds(path, setup)
    shapes = {number: setup.shape_of(number) for number in numbers}
    step = STEP_RATIO * min(shape.radius for shape in shapes.values())
    index = np.searchsorted(numbers, np.clip(tool, numbers[0], numbers[-1]))
    pieces = split_moves(path.start, path.end, step, kind=path.kind, center=path.center, sweep=path.sweep, plane=path.plane,
                        rapid=path.rapid, shape=np.minimum(index, len(numbers) - 1))
    return ProgramPath(path, pieces, speed, tool, numbers, feed, time, (*remarks, words))


def tools_and_speeds(program: ParsedProgram, path: Path, is_moving: np.ndarray, *, setup: MachiningSetup
                     ) -> tuple[np.ndarray, FloatArray, tuple[int, ...], list[str]]:
    """Return tool number and spindle speed of every segment, the numbers of the tools that cut, and the remarks of the program.

    Raises ToolpointError for a cutting segment without a spindle speed, and for several tools that are not given.
    """
    remarks = list(program.notes)
    tool = np.asarray(program.tool) if len(program.tool) else np.zeros(path.count, int)
    speed = np.asarray(program.speed) if len(program.speed) else np.zeros(path.count)
    cutting = ~path.rapid & is_moving
    numbers = tuple(sorted(set(tool[cutting].tolist()))) or (0,)
    _check_tools(path, tool, cutting, numbers, setup)
    unset = cutting & (speed <= 0)
    if unset.any() and not setup.speed:
        k = int(np.argmax(unset))
        raise ToolpointError(f"program: line {path.line[k]} cuts without a spindle speed; program S before it, or give `speed`")
    if unset.any():
        remarks.append(f"the program holds no S before line {path.line[int(np.argmax(unset))]}: {setup.speed:g} "
                       f"rev/min, as given")
    return tool, np.where(speed > 0, speed, setup.speed), numbers, remarks


def _check_rotary(program: ParsedProgram) -> None:
    """Refuse a program whose words turn A, B or C: its engagement is another than that of X, Y and Z alone."""
    if getattr(program, "is_five_axis", False):
        raise ToolpointError("program: it moves under tool centre control (G43.4, TRAORI, M128); `run_five_axes` takes it")
    refuse_rotary(program)


def refuse_rotary(program: ParsedProgram) -> None:
    """Refuse a program that cuts with axes turned by words of their own, without tool centre control."""
    lines: Sequence[int] = getattr(program, "rotary", ())
    if len(lines):
        number = "" if len(lines) == 1 else f" and {len(lines) - 1} more"
        raise ToolpointError(f"program: line {lines[0]}{number} cut with A, B or C turned by words of their own and "
                             "without tool centre control; program G43.4, TRAORI or M128, or tilt the plane by G68.2, CYCLE800 "
                             "or PLANE SPATIAL")


def _check_tools(path: Path, tool: np.ndarray, cutting: np.ndarray, numbers: tuple[int, ...], setup: MachiningSetup) -> None:
    """Refuse a program of several tools of which not all are given."""
    unknown = [number for number in numbers if number not in setup.cuts]
    if len(numbers) > 1 and len(unknown) > (1 if setup.cuts else 0):
        lines = ", ".join(f"T{n} from line {path.line[int(np.argmax(cutting & (tool == n)))]}" for n in unknown)
        raise ToolpointError(f"tools: the program cuts with {len(numbers)} tools and {len(setup.cuts)} are given by "
                             f"number; give "
                             f"the others by number too: {lines}")


def raise_reference_moves(path: Path, text: str, height: float) -> Path:
    """Return the path with moves to the reference point, and from it to the next height, raised over the stock."""
    lines = text.splitlines()
    reference = np.array([bool(0 < n <= len(lines) and _REFERENCE_PATTERN.search(lines[n - 1].upper().split("(")[0]))
                          for n in path.line.tolist()])
    start, end, is_up = path.start.copy(), path.end.copy(), True
    for k in range(path.count):
        if not path.rapid[k]:
            is_up = False
            continue
        if (is_up and k == 0) or is_up:
            start[k, 2] = max(start[k, 2], height)
        climbs = path.end[k, 2] != path.start[k, 2]
        if reference[k]:
            end[k, 2], is_up = max(end[k, 2], height), True
        elif is_up and not climbs:
            end[k, 2] = max(end[k, 2], height)
        elif is_up:
            is_up = False
    # A raised end is followed by a start as high: the path stays continuous by construction, but where a cut begins at once.
    for k in range(1, path.count):
        if not np.array_equal(start[k], end[k - 1]):
            start[k] = end[k - 1]
    return Path(path.kind, start, end, path.center, path.sweep, path.plane, path.feed, path.stop, path.line, path.rapid,
                path.dwell)


def _feeds(path: Path, setup: MachiningSetup) -> tuple[FloatArray, FloatArray, str]:
    """Return feed and time of every segment, and where they come from."""
    lengths = path.lengths
    if setup.planned is None:
        time = lengths / np.where(path.feed > 0, path.feed, 1.0) + path.dwell
        return path.feed, time, "feeds are those programmed: no limits of acceleration and jerk are given"
    plan = plan_motion(path, setup.planned, look_ahead=setup.look_ahead)
    time, feed, moving = np.zeros(path.count), path.feed.copy(), lengths > 0
    phases = np.asarray(plan.times)
    time[moving] = phases.sum(axis=1)
    # The largest feed of a block, for its loads: that of its first end and what jerk j over t1, then t2, adds: j t1 (t1 + t2).
    feed[moving] = plan.junction[:-1] + plan.jerk * phases[:, 0] * (phases[:, 0] + phases[:, 1])
    limits = setup.planned
    return feed, time + path.dwell, (f"feeds are the largest of each block by the planner (speed {60e3 * limits.speed:g} "
                                     f"mm/min, "
                                     f"{limits.acceleration:g} m/s^2, {limits.jerk:g} m/s^3; {sight_words(setup.look_ahead)})")


def sight_words(look_ahead: int | None) -> str:
    """Return what is taken of the control's look-ahead, in words."""
    if look_ahead is None:
        return "the control is taken to look ahead as far as it needs: give `look_ahead`, the number of blocks that it knows"
    return f"the control looks {look_ahead} block{'s' if look_ahead != 1 else ''} ahead"


def find_speed_lines(laid: ProgramPath, text: str) -> dict[int, list[int]]:
    """Return the lines that hold a word S, by the number of the tool that cuts next."""
    cutting = np.flatnonzero(~laid.path.rapid)
    lines = dict[int, list[int]]()
    for number, line in enumerate(text.splitlines(), 1):
        if not _SPEED_PATTERN.search(re.sub(r"\([^)]*\)|;.*", "", line.upper())):
            continue
        following = cutting[laid.path.line[cutting] >= number]
        if following.size:
            lines.setdefault(int(laid.tool[following[0]]), []).append(number)
    return lines


def travel_doubts(path: Path, axes: dict[str, tuple[float, float]], zero: dict[str, float], *, length: float, height: float
                  ) -> list[Doubt]:
    """Return a doubt for every axis whose travel the program leaves; its zero at `zero`, the tool `length` m long.

    height : m, to which rapids of unknown height were raised; these are not looked at.
    """
    doubts = []
    if "Z" in axes and length > axes["Z"][1] - axes["Z"][0]:
        travel = axes["Z"][1] - axes["Z"][0]
        doubts.append(Doubt("travel of Z", f"the tool sticks out {1e3 * length:g} mm, and Z goes {1e3 * travel:g} mm: it is "
                            "not brought over the work", "a shorter tool, or see `stick_out`", grave=True))
    for letter, k in (("X", 0), ("Y", 1), ("Z", 2)):
        if letter not in axes:
            continue
        lower, upper = axes[letter]
        places = np.concatenate([path.end[:, k], path.start[:, k]]) + zero.get(letter, 0.0)
        line = np.concatenate([path.line, path.line])
        excess = np.maximum(lower - places, places - upper)
        excess[path.count] = -1.0  # where the tool stands before the program is not known
        is_raised = np.concatenate([path.end[:, 2], path.start[:, 2]]) == height
        excess = np.where(is_raised & (letter == "Z"), -1.0, excess)
        k_worst = int(np.argmax(excess))
        if excess[k_worst] > 1e-9:
            tool = f", the tool {1e3 * length:g} mm long" if letter == "Z" and length else ""
            doubts.append(Doubt(f"travel of {letter}", f"line {line[k_worst]} goes to {1e3 * places[k_worst]:.4g} mm, "
                                                       f"{1e3 * excess[k_worst]:.4g} "
                                f"mm beyond {1e3 * lower:g} .. {1e3 * upper:g} mm{tool}",
                                "place the part otherwise with `zero`", grave=True))
    return doubts
