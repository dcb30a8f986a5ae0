"""Names of two points of two components that were exchanged in the test: each shows the motion of the other's component.

Without such a point the others of its component determine the motions, and these say how its place moves. Where what is called
by the name of the one moves as the place of the other does, in all modes, and the reverse, the two names were exchanged. No
number is fitted for it. Both are left out; a force at one of them stays where it is stated, as it is no name of a sensor.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.body_misfit import (
    MAX_POINT_MISFIT_RATIO,
    MAX_ROUNDING_MISFIT,
    MIN_POINT_MISFIT_RATIO,
    SuspectPoint,
    find_suspect,
    point_weights,
)
from toolpoint.joint_identification.motion.exchanged_points import ExchangedPoints
from toolpoint.joint_identification.motion.measured import Component


def find_exchanged_names(parts: Mapping[str, Component]) -> list[ExchangedPoints]:
    """Return the points of two components that move as each other's place.

    parts : at their stated places, with the variance of noise and coordinates.
    """
    suspects = [(part, suspect) for part in parts.values() if (suspect := find_suspect(part)) is not None]
    exchanged = []
    for (first, first_suspect), (second, second_suspect) in combinations(suspects, 2):
        if not (_moves_as(first, first_suspect, second, second_suspect.point)
                and _moves_as(second, second_suspect, first, first_suspect.point)):
            continue
        names = first.points[first_suspect.point], second.points[second_suspect.point]
        ratio = min(first_suspect.ratio, second_suspect.ratio)
        doubt = Doubt(f"points {names[0]} and {names[1]}", f"their motions are exchanged: {names[0]} moves as the place of "
                      f"{names[1]} on {second.name} does, and the reverse; without them both move as one body {ratio:.2g} "
                      f"times better. They are left out of the motions of {first.name} and {second.name}",
                      "look at the names of their records", figure=ratio)
        for part, suspect, said in ((first, first_suspect, doubt), (second, second_suspect, None)):
            place = {part.points[suspect.point]: part.at[suspect.point]}
            exchanged.append(ExchangedPoints(part.name, (names,), place, said))
    return exchanged


def _moves_as(part: Component, suspect: SuspectPoint, other: Component, point: int) -> bool:
    """Whether a point of another component moves as the place of the suspect point does by the motions of its component."""
    rows, other_rows = np.flatnonzero(part.owner == suspect.point), np.flatnonzero(other.owner == point)
    if rows.size != other_rows.size or not np.allclose(part.ways[rows], other.ways[other_rows]):
        return False
    motion, weight = part.rows[rows] @ suspect.twist, point_weights(part, rows)
    as_stated = float((((part.values[rows] - motion) * weight) ** 2).mean())
    exchanged = float((((other.values[other_rows] - motion) * weight) ** 2).mean())
    return as_stated >= MIN_POINT_MISFIT_RATIO * exchanged and exchanged < max(MAX_POINT_MISFIT_RATIO * suspect.misfit,
                                                                               MAX_ROUNDING_MISFIT * as_stated)
