"""Canned cycles of drilling and boring as moves: G81-G89, G73, G76, with the levels of Fanuc, LinuxCNC or Sinumerik 850."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from toolpoint.io.program.control.frame import PLANES
from toolpoint.io.program.control.modes import ControlModes, Places

CYCLES = frozenset({73, 74, 76, 81, 82, 83, 84, 85, 86, 87, 88, 89})
# Cycles that leave the hole at the feed; the others leave it in rapid.
_FEED_OUT = frozenset({74, 84, 85, 89})
_PECKS = frozenset({73, 83})
MAX_PECKS = 1000  # of a hole, and holes of a block: a peck in the wrong unit would make a hundred thousand moves of one block
# Way that a peck with chip breaking goes back, and at which the next one of a full retract begins above the last, m.
_CHIP_RETRACT_M = 1e-3


@dataclass
class Cycle:
    """A cycle in force: levels in m (machine coordinates), dwell in s, depth of a peck in m."""

    number: int = 0
    level: float = 0.0
    depth: float = 0.0
    initial: float = 0.0
    dwell: float = 0.0
    peck: float = 0.0
    to_level: bool = False
    retract: float | None = None
    ready: bool = False
    surface: float | None = None  # from which pecks count, m; the level where left out


def begin_cycle(state: ControlModes, cycle: Cycle, number: int, *, places: Places, numbers: Mapping[str, float],
                parameters: Mapping[str, float]) -> None:
    """Keep the words of a block of a cycle: R, Z, P, Q, or the parameters R2, R3, R10 of a Sinumerik 850.

    `places` holds X, Y, Z, R; `numbers` the words P, Q; `parameters` the R parameters of this block.
    """
    third = 3 - sum(PLANES[state.plane])
    letter = "XYZ"[third]
    lift = state.length(third, 1.0)
    origin = state.origin[third]
    if {"R2", "R3"} <= parameters.keys():
        cycle.level, cycle.depth = origin + lift * parameters["R2"], origin + lift * parameters["R3"]
        cycle.retract = origin + lift * parameters["R10"] if "R10" in parameters else None
        cycle.ready = True
    if "CR" in places:
        value = lift * places["CR"][1]
        cycle.level = value + (cycle.initial if state.incremental else origin)
    if letter in places:
        value = lift * places[letter][1]
        cycle.depth = value + (cycle.level if state.incremental else origin)
        cycle.ready = True
    if "P" in numbers:
        cycle.dwell = dwell_of(numbers["P"])
    if "Q" in numbers:
        cycle.peck = abs(lift * numbers["Q"])


def dwell_of(word: float) -> float:
    """Return the time of a word P, s: whole numbers of 100 and more are milliseconds (Fanuc), others seconds (LinuxCNC)."""
    return word / 1000 if word == int(word) and word >= 100 else word


def drill(state: ControlModes, cycle: Cycle, number: int, *, places: Places, repeats: int = 1) -> None:
    """Add the moves of a cycle at the place of a block: over the hole, to the level R, down, up."""
    third = 3 - sum(PLANES[state.plane])
    if not cycle.ready:
        state.remarks.fault(number, 1, f"G{cycle.number} without a depth; program {'XYZ'[third]} and R in its first block")
        state.position = state.target({k: v for k, v in places.items() if k != "XYZ"[third]})
        return
    if not state.frame.is_upright(third):
        state.remarks.fault(number, 1, f"G{cycle.number} where the axis of the tool is turned or mirrored is not computed")
        return
    pecks = _peck_count(cycle)
    if max(pecks, repeats) > MAX_PECKS:
        state.remarks.fault(number, 1, f"G{cycle.number} of {repeats} holes of {pecks} pecks; must be at most {MAX_PECKS} of "
                            "each: check the depth of a peck, its unit and the number of repeats")
        return
    for _ in range(repeats):
        above = state.target({k: v for k, v in places.items() if k != "XYZ"[third]})
        if above[third] < cycle.level:
            state.rapid(number, _at(state.position, third, cycle.level))
            above[third] = cycle.level
        if above != state.position:
            state.rapid(number, above)
        _hole(state, cycle, number, third)
        retract_level = cycle.level if cycle.to_level else max(cycle.initial, cycle.level)
        retract_level = cycle.retract if cycle.retract is not None else retract_level
        if retract_level > state.position[third]:
            state.rapid(number, _at(state.position, third, retract_level))


def _hole(state: ControlModes, cycle: Cycle, number: int, third: int) -> None:
    if state.position[third] != cycle.level:
        state.rapid(number, _at(state.position, third, cycle.level))
    levels = [cycle.depth]
    if cycle.number in _PECKS and cycle.peck > 0:
        surface = cycle.level if cycle.surface is None else cycle.surface
        levels = [surface - k * cycle.peck for k in range(1, _peck_count(cycle))] + [cycle.depth]
    for k, level in enumerate(levels):
        if k and cycle.number == 83:
            state.rapid(number, _at(state.position, third, cycle.level))
            state.rapid(number, _at(state.position, third, min(levels[k - 1] + _CHIP_RETRACT_M, cycle.level)))
        elif k:
            state.rapid(number, _at(state.position, third, min(levels[k - 1] + _CHIP_RETRACT_M, cycle.level)))
        state.cut(number, _at(state.position, third, level), stop=True)
    state.wait(number, cycle.dwell)
    if cycle.number in _FEED_OUT:
        state.cut(number, _at(state.position, third, cycle.level), stop=True)


def _at(position: list[float], axis: int, value: float) -> list[float]:
    end = list(position)
    end[axis] = value
    return end


def _peck_count(cycle: Cycle) -> int:
    """Return in how many pecks a cycle drills its hole."""
    if cycle.number not in _PECKS or cycle.peck <= 0:
        return 1
    surface = cycle.level if cycle.surface is None else cycle.surface
    # A depth that is a whole number of pecks needs no further one, whatever rounding makes of the quotient.
    return int(min(abs(surface - cycle.depth) / cycle.peck + 1 - 1e-9, 100 * MAX_PECKS))
