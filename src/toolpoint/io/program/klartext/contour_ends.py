"""Ways to a compensated contour and from it in Klartext: APPR and DEP with LT, LN, CT and LCT, and their polar kinds."""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from toolpoint.io.program.control.frame import PLANES
from toolpoint.io.program.language.expressions import ExpressionFault
from toolpoint.io.program.path.compensated_rows import last_tangent
from toolpoint.io.program.path.radius_compensation import ContourEnd

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

# APPR PLCT and its like: way to or from, polar or not, and one of four ways.
_CONTOUR_END = re.compile(r"(APPR|DEP)\s+(P?)(LT|LN|CT|LCT)\b(.*)")
_VALUE = r"\s*([+-]?(?:[\d.]+|Q\w+))"
_WORDS = {name: re.compile(rf"\b{name}{_VALUE}") for name in ("LEN", "CCA", "R")}
_WORDS_OF_WAYS = {"LT": ("LEN",), "LN": ("LEN",), "CT": ("CCA", "R"), "LCT": ("R",)}


def split_contour_end(line: str, value: Callable[[str], float], scale: float) -> tuple[str, bool, ContourEnd, str]:
    """Return verb, whether its place is polar, the way, and the remainder of a block APPR or DEP; scale : m of a unit.

    Raises ExpressionFault for other ways, and for words that are missing.
    """
    match = _CONTOUR_END.match(line)
    if match is None:
        raise ExpressionFault(f"{' '.join(line.split()[:2])}: this way to a contour or away from it is not computed; program "
                              "APPR or DEP with LT, LN, CT or LCT")
    remainder, words = match[4], dict[str, float]()
    for name in _WORDS_OF_WAYS[match[3]]:
        word = _WORDS[name].search(remainder)
        if word is None:
            raise ExpressionFault(f"{match[1]} {match[2]}{match[3]} without {name}")
        words[name] = value(word[1])
        remainder = remainder[:word.start()] + " " + remainder[word.end():]
    end = ContourEnd(match[3], words.get("LEN", 0.0) * scale, words.get("R", 0.0) * scale, math.radians(words.get("CCA", 0.0)))
    if match[3] in ("CT", "LCT") and (end.radius == 0 or (match[3] == "CT" and end.angle <= 0)):
        raise ExpressionFault(f"{match[1]} {match[3]}: radius and angle must not be zero")
    return match[1], bool(match[2]), end, remainder


def leave_contour(state: ControlModes, number: int, way: ContourEnd, *, goal: list[float] | None = None) -> None:
    """Leave a contour by a way, and end compensation.

    goal : where the tool goes then (LCT), m. Of the others the end beside the programmed contour stands for it until the radius
    of the tool is known.
    """
    side, plane = state.compensation.side, PLANES[state.plane]
    tangent = last_tangent(state.segments, plane)
    if not side or tangent is None:
        raise ExpressionFault(f"DEP {way.kind} without a contour under RL or RR before it")
    end = list(state.position) if goal is None else goal
    if goal is None:
        turn = side * (1 if way.radius > 0 else -1)
        arc = 1j * turn * abs(way.radius) * tangent * (1 - cmath.exp(1j * turn * way.angle))
        move = arc if way.kind == "CT" else way.length * (tangent if way.kind == "LT" else 1j * side * tangent)
        end[plane[0]] += move.real
        end[plane[1]] += move.imag
    state.cut(number, end)
    if way.kind != "LT":
        state.segments.contour_ends[len(state.segments.rows) - 1] = way
    state.compensation.begin(0)
