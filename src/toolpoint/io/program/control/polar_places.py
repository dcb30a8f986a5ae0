"""Polar words of LinuxCNC: @ is the distance from the program's zero, ^ the angle from X, both in the plane of X and Y."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

POLAR_WORDS = frozenset("@^")
Places = Mapping[str, tuple[str, float]]


def question_polar_words(places: Places, programmed: Sequence[float], *, plane: int, incremental: bool) -> str:
    """Return what is wrong with the polar words of a block, in words; empty where nothing is."""
    if not places.keys() & POLAR_WORDS:
        return ""
    if plane != 17 or places.keys() & {"X", "Y", "I", "J", "CR"}:
        return "@ and ^ are distance and angle in X and Y; program them in G17, without X, Y, I, J and R"
    if incremental and not any(programmed[:2]):
        return "a step of @ or ^ from the program's zero, where the tool has no angle; program X and Y"
    return ""


def from_pole(places: Places, programmed: Sequence[float], *, scale: float, incremental: bool) -> dict[str, tuple[str, float]]:
    """Return the places of a block with X and Y for its polar words; the one that is left out stays as it is.

    programmed : position in the program's coordinates, m; scale : m of a programmed unit.

    >>> from_pole({"@": ("", 2.0), "^": ("", 90.0)}, (0.0, 0.0, 0.0), scale=1e-3, incremental=False)["Y"]
    ('AC', 2.0)
    """
    if not places.keys() & POLAR_WORDS:
        return dict(places)
    x, y = programmed[:2]
    radius, angle = math.hypot(x, y) / scale, math.degrees(math.atan2(y, x))
    if "@" in places:
        radius = places["@"][1] + (radius if incremental else 0.0)
    if "^" in places:
        angle = places["^"][1] + (angle if incremental else 0.0)
    place = {"X": ("AC", radius * math.cos(math.radians(angle))), "Y": ("AC", radius * math.sin(math.radians(angle)))}
    return {letter: value for letter, value in places.items() if letter not in POLAR_WORDS} | place
