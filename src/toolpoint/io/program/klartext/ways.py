"""Moves of Klartext that need what was before them: LP and CP about the pole CC, CT along the last tangent."""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from toolpoint.io.program.control.frame import PLANES
from toolpoint.io.program.language.expressions import ExpressionFault
from toolpoint.io.program.path.compensated_rows import last_tangent

if TYPE_CHECKING:
    from toolpoint.io.program.control.modes import ControlModes

_POLAR_WORD = re.compile(r"\b(I?)P([RA])\s*([+-]?\s*(?:[\d.]+|Q[LRS]?\d+))")


def take_polar_words(text: str, value: Callable[[str], float]) -> tuple[dict[str, float], str]:
    """Return the words PR, PA, IPR and IPA of a block (degrees and units of the program), and what is left of it.

    >>> take_polar_words(" PR+30 IPA-45 DR-", float)
    ({'PR': 30.0, 'IPA': -45.0}, '   DR-')
    """
    words = {f"{match[1]}P{match[2]}": value(match[3].replace(" ", "")) for match in _POLAR_WORD.finditer(text)}
    return words, _POLAR_WORD.sub("", text)


def polar_end(state: ControlModes, pole: Mapping[int, float], words: Mapping[str, float]) -> dict[int, float]:
    """Return the place of a block LP in the plane, m, in machine coordinates; the word that is left out stays as it is."""
    plane, centre = PLANES[state.plane], _pole(state, pole)
    ray = complex(*(state.position[i] for i in plane)) - centre
    radius, angle = abs(ray), cmath.phase(ray)
    radius = words["PR"] * state.scale if "PR" in words else radius + words.get("IPR", 0.0) * state.scale
    angle = math.radians(words["PA"]) if "PA" in words else angle + math.radians(words.get("IPA", 0.0))
    place = centre + cmath.rect(radius, angle)
    return {plane[0]: place.real, plane[1]: place.imag}


def circle_about_pole(state: ControlModes, number: int, pole: Mapping[int, float], *, words: Mapping[str, float],
                      direction: int, height: float) -> None:
    """Add the arc of a block CP: about the pole to an angle PA, or by an angle IPA, that may be several turns of a helix.

    direction : 1 for DR+, -1 for DR-, 0 where the block does not say; height : of its end along the tool, m.
    """
    plane, centre = PLANES[state.plane], _pole(state, pole)
    ray = complex(*(state.position[i] for i in plane)) - centre
    if abs(ray) == 0:
        raise ExpressionFault("CP from its own pole: the circle has no radius")
    if "IPA" in words:
        sweep = math.radians(words["IPA"])
        if direction and sweep * direction < 0:
            raise ExpressionFault("CP: IPA and DR turn against each other")
    elif "PA" in words and direction:
        sweep = direction * ((direction * (math.radians(words["PA"]) - cmath.phase(ray))) % (2 * math.pi)) or \
            direction * 2 * math.pi
    else:
        raise ExpressionFault("CP needs PA and DR, or IPA")
    place = centre + ray * cmath.rect(1.0, sweep)
    end, middle = list(state.position), list(state.position)
    end[3 - sum(plane)] = height
    for axis, goal, about in zip(plane, (place.real, place.imag), (centre.real, centre.imag), strict=True):
        end[axis], middle[axis] = goal, about
    state.follow_arc(number, middle, sweep, end=end)


def tangent_arc(state: ControlModes, number: int, end: list[float]) -> None:
    """Add the arc of a block CT: it begins along the last block's tangent and ends at a place."""
    plane = PLANES[state.plane]
    tangent = last_tangent(state.segments, plane)
    if tangent is None:
        raise ExpressionFault("CT without a block before it whose tangent it takes")
    start, goal = (complex(*(point[i] for i in plane)) for point in (state.position, end))
    way, normal = goal - start, 1j * tangent
    across = (way * normal.conjugate()).real
    # An end on the tangent itself is an arc of infinite radius: a straight line.
    if abs(way) == 0 or abs(across) < 1e-9 * abs(way):
        if (way * tangent.conjugate()).real <= 0:
            raise ExpressionFault("CT to a place behind its start, or to the start itself: no arc leads there")
        state.cut(number, end)  # straight on
        return
    radius = abs(way) ** 2 / (2 * across)
    centre, turn = start + radius * normal, math.copysign(1.0, radius)
    sweep = turn * ((turn * cmath.phase((goal - centre) / (start - centre))) % (2 * math.pi))
    middle = list(state.position)
    middle[plane[0]], middle[plane[1]] = centre.real, centre.imag
    state.follow_arc(number, middle, sweep, end=end)


def _pole(state: ControlModes, pole: Mapping[int, float]) -> complex:
    plane = PLANES[state.plane]
    if not all(i in pole for i in plane):
        raise ExpressionFault("a polar move without CC before it")
    return complex(*(pole[i] for i in plane))
