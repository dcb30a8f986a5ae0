"""Depths between the search levels where the spectral radius may cross 1 twice between two levels.

Two signs announce it: slopes that lead towards the circle from both sides (the tangents' crossing is looked at), and a pair of
multipliers that, continued by its mean and cosine, meets on the real axis (`bumps`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from toolpoint.cutting.stability.panels.bumps import Level, predict_meeting

MEETING_ROUNDS = 5  # of looking for meetings of multipliers between levels
MAX_TANGENT_DIVISIONS = 4  # times that the stretch between two levels is divided by tangents
SLOPE_STEP_FRACTION = 0.02  # of a stretch, for the slopes at its ends
LEFT_LEAD = 1.5  # factor by which a tangent must gain more than the distance from the circle, to cross it well within a stretch
Look = Callable[[float], Level]


def changes_of_sign(levels: list[Level]) -> list[tuple[Level, Level]]:
    """Return the neighbours between which the cut turns from stable to unstable or back."""
    return [(a, b) for a, b in pairwise(levels) if (a.growth > 0) != (b.growth > 0)]


def refine_levels(levels: list[Level], look: Look) -> list[Level]:
    """Return the levels and those between them at which the verdict may differ, by depth."""
    # Tangents cost two more multipliers a pair. They are spent only where the circle is no farther away than growth changes
    # from level to level nearby, with half as much again in hand.
    jumps = np.abs(np.diff([level.growth for level in levels]))
    near_circle = [(a, b) for i, (a, b) in enumerate(pairwise(levels))
                   if min(abs(a.growth), abs(b.growth)) < 1.5 * jumps[max(i - 1, 0):i + 2].max()]
    levels = _sorted([*levels, *_refine_by_tangents(near_circle, look)])
    return _add_meetings(levels, set(levels), look)


def refine_near_new_levels(levels: list[Level], fresh: list[Level], look: Look) -> list[Level]:
    """Return the levels with the fresh ones, and further ones where the fresh ones announce a crossing."""
    levels, new = _sorted([*levels, *fresh]), set(fresh)
    added = _refine_by_tangents([pair for pair in pairwise(levels) if new.intersection(pair)], look)
    return _add_meetings(_sorted([*levels, *added]), new.union(added), look)


def _add_meetings(levels: list[Level], fresh: set[Level], look: Look) -> list[Level]:
    """Add depths where multipliers may meet on the real axis in windows with fresh levels, and again about those."""
    for _ in range(MEETING_ROUNDS):
        outer_below, outer_above = [None, *levels[:-2]], [*levels[2:], None]
        windows = zip(outer_below, levels[:-1], levels[1:], outer_above)
        places = [predict_meeting(window) for window in windows if fresh.intersection(window)]
        fresh = {look(w) for w in places if w is not None}
        if not fresh:
            break
        levels = _sorted([*levels, *fresh])
    return levels


def _refine_by_tangents(pairs: list[tuple[Level, Level]], look: Look) -> list[Level]:
    """Return levels between these pairs where the radius may reach 1 and come back: the crossing of the tangents, then again in
    both halves."""
    out = []
    stack = [(a, b, 0) for a, b in pairs]
    while stack:
        a, b, halved = stack.pop()
        if (a.growth > 0) != (b.growth > 0) or halved > MAX_TANGENT_DIVISIONS:
            continue
        w = _tangent_crossing(a, b, look)
        if w is not None:
            middle = look(w)
            out.append(middle)
            stack += [(a, middle, halved + 1), (middle, b, halved + 1)]
    return out


def _tangent_crossing(a: Level, b: Level, look: Look) -> float | None:
    """Return the depth between two levels of one sign where their tangents cross, None where they do not lead to the circle
    from both.

    How far from the circle they cross is not asked: the growth falls steeply into a narrow band, and a tangent outside it
    knows nothing of that."""
    step = SLOPE_STEP_FRACTION * (b.depth - a.depth)
    if not a.depth + step > a.depth:  # one depth looked at twice: nothing lies between
        return None
    sign = -1.0 if a.growth > 0 else 1.0  # growth counted positive beyond the circle as seen from here
    ga, gb, width = sign * a.growth, sign * b.growth, b.depth - a.depth
    left = sign * (look(a.depth + step).growth - a.growth) / step
    if left <= 0:
        return None
    right = sign * (b.growth - look(b.depth - step).growth) / step
    if right >= 0:  # rises at both ends: it fell between where the first tangent leads beyond the circle before the second end
        return a.depth - ga / left if left * width > LEFT_LEAD * -ga else None
    # The crossing of both tangents; a tenth of the stretch from its ends, where the next look would tell nothing new.
    w = (gb - ga + left * a.depth - right * b.depth) / (left - right)
    return min(max(w, a.depth + 5 * step), b.depth - 5 * step)


def _sorted(levels: list[Level]) -> list[Level]:
    return sorted(levels, key=lambda level: level.depth)
