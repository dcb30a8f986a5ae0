"""Ways to a compensated contour and from it in Klartext: APPR LT, APPR LN, DEP LT and DEP LN; those on circles are refused."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from toolpoint.io.program.compensated_rows import last_tangent
from toolpoint.io.program.expressions import ExpressionFault
from toolpoint.io.program.program_frame import PLANES
from toolpoint.io.program.radius_compensation import ContourEnd

if TYPE_CHECKING:
    from toolpoint.io.program.control_modes import ControlModes

_CONTOUR_END = re.compile(r"(APPR|DEP)\s+(LT|LN)\b(.*)")
_LENGTH = re.compile(r"\bLEN\s*([+-]?(?:[\d.]+|Q\w+))")


def split_contour_end(line: str) -> tuple[str, str, str, str]:
    """Return verb, kind, text of the length LEN, and the remainder of a block APPR or DEP.

    Raises ExpressionFault for other ways.
    """
    match = _CONTOUR_END.match(line)
    length = None if match is None else _LENGTH.search(match[3])
    if match is None or length is None:
        raise ExpressionFault(f"{' '.join(line.split()[:2])}: this way to a contour or away from it is not computed; program "
                              "APPR or DEP with LT or LN and LEN")
    return match[1], match[2], length[1], _LENGTH.sub(" ", match[3])


def leave_contour(state: ControlModes, number: int, *, kind: str, length: float) -> None:
    """Leave a contour by a straight line of a length (m), along its tangent (LT) or square to it (LN), and end compensation."""
    side, plane = state.compensation.side, PLANES[state.plane]
    tangent = last_tangent(state.segments, plane)
    if not side or tangent is None:
        raise ExpressionFault(f"DEP {kind} without a contour under RL or RR before it")
    way = length * (tangent if kind == "LT" else 1j * side * tangent)
    end = list(state.position)
    end[plane[0]] += way.real
    end[plane[1]] += way.imag
    state.cut(number, end)
    if kind == "LN":
        state.segments.contour_ends[len(state.segments.rows) - 1] = ContourEnd(is_square=True, length=length)
    state.compensation.begin(0)
