"""Depths between the search levels at which the growth may reach the circle and come back, unseen by the levels.

Two signs announce it: slopes that lead towards the circle from both sides (the tangents' crossing is looked at), and a pair of
multipliers that, continued by its mean and cosine, meets on the real axis (`bumps`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from toolpoint.cutting.stability.panels.bumps import Level, bump

ROUNDS = 5  # of looking for meetings of multipliers between levels
HALVED = 4  # times that the stretch between two levels is divided by tangents
STEP = 0.02  # of a stretch, for the slopes at its ends
Look = Callable[[float], Level]


def changes_of_sign(levels: list[Level]) -> list[tuple[Level, Level]]:
    """Return the neighbours between which the cut turns from stable to unstable or back."""
    return [(a, b) for a, b in pairwise(levels) if (a.growth > 0) != (b.growth > 0)]


def complete_levels(levels: list[Level], look: Look) -> list[Level]:
    """Return the levels and those between them at which the verdict may be another, by depth."""
    jumps = np.abs(np.diff([level.growth for level in levels]))
    near = [(a, b) for i, (a, b) in enumerate(pairwise(levels))
            if min(abs(a.growth), abs(b.growth)) < 1.5 * jumps[max(i - 1, 0):i + 2].max()]
    levels = _sorted([*levels, *_by_tangents(near, look)])
    return _with_bumps(levels, set(levels), look)


def complete_beside(levels: list[Level], fresh: list[Level], look: Look) -> list[Level]:
    """Return the levels with the fresh ones, and those that these announce."""
    levels, new = _sorted([*levels, *fresh]), set(fresh)
    added = _by_tangents([pair for pair in pairwise(levels) if new.intersection(pair)], look)
    return _with_bumps(_sorted([*levels, *added]), new.union(added), look)


def _with_bumps(levels: list[Level], fresh: set[Level], look: Look) -> list[Level]:
    """Add depths where multipliers may meet on the real axis in windows with fresh levels, and again about those."""
    for _ in range(ROUNDS):
        before, beyond = [None, *levels[:-2]], [*levels[2:], None]
        windows = zip(before, levels[:-1], levels[1:], beyond)
        places = [bump(window) for window in windows if fresh.intersection(window)]
        fresh = {look(w) for w in places if w is not None}
        if not fresh:
            break
        levels = _sorted([*levels, *fresh])
    return levels


def _by_tangents(pairs: list[tuple[Level, Level]], look: Look) -> list[Level]:
    """Levels between these pairs, wherever the radius may reach 1 and come back: the crossing of the tangents, and the halves
    again."""
    out = []
    stack = [(a, b, 0) for a, b in pairs]
    while stack:
        a, b, halved = stack.pop()
        if (a.growth > 0) != (b.growth > 0) or halved > HALVED:
            continue
        w = _crossing(a, b, look)
        if w is not None:
            middle = look(w)
            out.append(middle)
            stack += [(a, middle, halved + 1), (middle, b, halved + 1)]
    return out


def _crossing(a: Level, b: Level, look: Look) -> float | None:
    """Depth between two levels of one sign where their tangents cross, None where they do not lead to the circle from both.

    How far from the circle they cross is not asked: the growth falls steeply into a narrow band, and a tangent outside it
    knows nothing of that."""
    step = STEP * (b.depth - a.depth)
    if not a.depth + step > a.depth:  # one depth looked at twice: nothing lies between
        return None
    away = -1.0 if a.growth > 0 else 1.0  # growth counted positive beyond the circle as seen from here
    left = away * (look(a.depth + step).growth - a.growth) / step
    if left <= 0:
        return None
    right = away * (b.growth - look(b.depth - step).growth) / step
    if right >= 0:
        return None
    ga, gb = away * a.growth, away * b.growth
    w = (gb - ga + left * a.depth - right * b.depth) / (left - right)
    return min(max(w, a.depth + 5 * step), b.depth - 5 * step)


def _sorted(levels: list[Level]) -> list[Level]:
    return sorted(levels, key=lambda level: level.depth)
