"""Splines of LinuxCNC (G5 cubic, G5.1 quadratic) as chords within a micrometre.

A curve of degree n with control points P_k is a Bezier curve; of a part 1/m of it the chord lies within |B''|/(8 m^2) of it,
and |B''| is at most n (n - 1) times the largest second difference of the control points.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

_CHORD_ERROR = 1e-6  # m
SPLINE_MOTION = 5  # of `ControlModes.motion`


def divide_curve(points: list[complex], tolerance: float) -> list[complex]:
    """Return the ends of chords that lie within a tolerance of the Bezier curve of three or four points.

    >>> divide_curve([0, 1 + 1j, 2], 0.3)
    [(1+0.5j), (2+0j)]
    """
    degree = len(points) - 1
    bend = max(abs(points[k] - 2 * points[k + 1] + points[k + 2]) for k in range(degree - 1))
    count = max(1, math.ceil(math.sqrt(degree * (degree - 1) * bend / (8 * tolerance))))
    ends = []
    for k in range(1, count + 1):
        u = k / count
        ends.append(sum((math.comb(degree, m) * u**m * (1 - u) ** (degree - m) * complex(points[m])
                         for m in range(degree + 1)), 0j))
    return ends


def follow_spline(state: ControlModes, number: int, code: float, *, places: Mapping[str, tuple[str, float]],
                  numbers: Mapping[str, float]) -> None:
    """Add the chords of a block G5 (I J P Q) or G5.1 (I J); what cannot be followed is a fault."""
    if state.plane != 17 or not state.frame.is_identity or state.compensation.side or state.centre.word or "Z" in places:
        state.remarks.fault(number, 1, f"G{code:g}: a spline under radius compensation, tool centre control, in turned axes, "
                            "along Z or out of G17 is not computed; post the program with lines and arcs")
        return
    start, end = list(state.position), state.target({k: v for k, v in places.items() if k in "XY"})
    begin, goal = complex(*start[:2]), complex(*end[:2])
    first, last = (state.scale * complex(places.get("I", ("", 0.0))[1], places.get("J", ("", 0.0))[1]),
                   state.scale * complex(numbers.get("P", 0.0), numbers.get("Q", 0.0)))
    if code == 5 and not {"I", "J"} & places.keys():  # smooth behind the spline before it
        if state.spline_end is None or state.spline_end[0] != start:
            state.remarks.fault(number, 1, "G5 without I and J behind no other spline; program I and J")
            return
        first = -state.spline_end[1]
    controls = [begin, begin + first, goal] if code == 5.1 else [begin, begin + first, goal + last, goal]
    for place in divide_curve(controls, _CHORD_ERROR):
        state.cut(number, [place.real, place.imag, start[2]])
    state.position, state.motion = end, SPLINE_MOTION
    state.spline_end = (list(end), last)
