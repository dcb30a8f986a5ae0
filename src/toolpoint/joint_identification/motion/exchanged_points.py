r"""Two exchanged points of one rigid component: each was measured where the other is stated to be.

The displacements of a rigid component obey linear conditions in every mode. With the places of two points exchanged, the
component moves as one body again in all modes, and no number was fitted for it: the exchange is one of n (n - 1) / 2, told
apart by what each leaves. With the normal matrices :math:`N_p(q)` of point p at the place of q and their right sides
:math:`b_p(q)`, that of every exchange (p, q) is

.. math:: \chi^2_{pq} = \sum u^2 - b^T N^{-1} b, \quad N = \sum_s N_s(s) - N_p(p) - N_q(q) + N_p(q) + N_q(p)

Where the places are symmetric about a point, u = v + w x p does not tell an exchange of two points from that of others with
w turned round (the corners of a rectangle): all of them are named then. Exchanged points are left out of the motion of their
component where the others determine it; where they do not, the joints of that component are not to be had from the test.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint._doubt import Doubt
from toolpoint.joint_identification.motion.body_misfit import (
    MAX_ROUNDING_MISFIT,
    can_leave_out,
    leave_out_points,
    mean_square_misfit,
    point_weights,
    shift_of_point,
)
from toolpoint.joint_identification.motion.measured import Component, Point, about
from toolpoint.joint_identification.motion.rigid_motion import SmallMotion
from toolpoint.joint_identification.motion.wrong_channels import RIVAL_MISFIT_RATIO, channel_misfit_ratio
from toolpoint.spatial import transform as tf

MIN_EXCHANGE_MISFIT_RATIO = 6.0  # misfit as stated over that with two points exchanged
MIN_EXCHANGE_FREEDOM = 12  # displacements of all modes beyond the motions: with fewer, chance picks one of the pairs
MAX_RIVAL_MISFIT_RATIO = 3.0  # misfit over that of the best exchange, up to which another one explains the motions as well
# Misfit with two points exchanged over that with both left out, at most: points that move otherwise are not exchanged.
MAX_EXCHANGED_MISFIT_RATIO = 4.0
MAX_SCREENED_POINTS = 24  # those that stand out most, of which pairs are formed
MIN_NORMAL_RATIO = 1e-12  # of the trace, added to normal matrices
MAX_SCREENED_PAIRS = 12  # of which the misfit is computed anew, without the rounding of normal equations


@dataclass(frozen=True, eq=False)
class ExchangedPoints:
    """Points of a component of which two were exchanged, or one of which the name was exchanged with that of another's.

    pairs : the exchange that explains the motions, and others that the motions do not tell from it; places : by point, m, of
    all points of the pairs, as exchanged, or by the motions of the others where there are several pairs; doubt : None where
    that of the other component says it.
    """

    component: str
    pairs: tuple[tuple[Point, Point], ...]
    places: Mapping[Point, FloatArray]
    doubt: Doubt | None


def find_exchanged(parts: Mapping[str, Component]) -> list[ExchangedPoints]:
    """Return the exchange of two points of every component that moves as one body only with it.

    parts : at their stated places, with the variance of noise and coordinates.

    Raises
    ------
    ToolpointError
        Where the other points of the component do not determine its motions.
    """
    exchanged = []
    for part in parts.values():
        pairs, ratio = _explaining_pairs(part)
        if not pairs:
            continue
        points = tuple(sorted({point for pair in pairs for point in pair}))
        names = tuple((part.points[first], part.points[second]) for first, second in pairs)
        if not can_leave_out(part, points):
            _refuse(part, names, ratio)
        places = {part.points[point]: _place_of(part, point, pairs) for point in points}
        exchanged.append(ExchangedPoints(part.name, names, places, _doubt_of(part, names, ratio)))
    return exchanged


def _explaining_pairs(part: Component) -> tuple[list[tuple[int, int]], float]:
    """Return the pairs of points whose exchange explains the motions, the best first, and what it lowers the misfit by."""
    if (len(part.rows) - 6) * part.values.shape[1] < MIN_EXCHANGE_FREEDOM:
        return [], 1.0
    pairs, misfits = _exchange_misfits(part)
    exchanged = float(misfits[0])
    as_stated = mean_square_misfit(part, SmallMotion().twists(part))
    ratio = as_stated / max(exchanged, 1e-300)
    if ratio < MIN_EXCHANGE_MISFIT_RATIO or not _is_motion_of_rest(part, pairs[0], exchanged, as_stated):
        return [], ratio
    # One wrong channel or one misplaced point is the simpler cause where it explains the motions as well.
    of_point = min(leave_out_points(part, (point,))[0] for point in range(len(part.points)))
    if min(of_point, as_stated / channel_misfit_ratio(part)) < RIVAL_MISFIT_RATIO * exchanged:
        return [], ratio
    return [pair for pair, misfit in zip(pairs, misfits, strict=True) if misfit <= MAX_RIVAL_MISFIT_RATIO * exchanged], ratio


def _is_motion_of_rest(part: Component, pair: tuple[int, int], misfit: float, as_stated: float) -> bool:
    """Whether two points move, exchanged, as the others do; True where the others do not determine the motions."""
    of_others = leave_out_points(part, pair)[0]
    return not np.isfinite(of_others) or misfit <= max(MAX_EXCHANGED_MISFIT_RATIO * of_others,
                                                       MAX_ROUNDING_MISFIT * as_stated)


def _exchange_misfits(part: Component) -> tuple[list[tuple[int, int]], FloatArray]:
    """Return the pairs of points whose exchange leaves least, and what it leaves, ascending."""
    pairs = list(combinations(_outstanding_points(part), 2))
    screened = _screen_pairs(part, np.array(pairs))
    kept = [pairs[k] for k in np.argsort(screened)[:MAX_SCREENED_PAIRS]]
    moved = [_exchange(part, pair) for pair in kept]
    misfits = np.array([mean_square_misfit(each, SmallMotion().twists(each)) for each in moved])
    order = np.argsort(misfits)
    return [kept[k] for k in order], misfits[order]


def _outstanding_points(part: Component) -> list[int]:
    """Return the points that move least as the motions of all say."""
    weight = point_weights(part, np.arange(len(part.rows)))
    left = ((part.values - part.rows @ SmallMotion().twists(part)) * weight) ** 2
    return sorted(np.argsort(-np.bincount(part.owner, left.sum(axis=1), len(part.points)))[:MAX_SCREENED_POINTS].tolist())


def _screen_pairs(part: Component, pairs: FloatArray) -> FloatArray:
    """Return minus b N^-1 b of every pair (p,), summed over the modes: what its exchange leaves, but for a constant."""
    points, indices = np.unique(pairs, return_inverse=True)
    first, second = indices.reshape(pairs.shape).T
    weight = point_weights(part, np.arange(len(part.rows)))
    to_origin = about(part.centre, part.size)
    normal = np.zeros((len(points), len(points), part.values.shape[1], 6, 6))  # of a point, at the place of another
    right = np.zeros(normal.shape[:-1])
    for k, point in enumerate(points):
        rows = np.flatnonzero(part.owner == point)
        local = np.einsum("ni,pij->pnj", part.ways[rows], tf.point_velocity(part.at[points])) @ to_origin
        normal[k] = np.einsum("pni,nk,pnj->pkij", local, weight[rows] ** 2, local, optimize=True)
        right[k] = np.einsum("pni,nk->pki", local, weight[rows] ** 2 * part.values[rows])
    local = part.rows @ to_origin
    matrix = np.einsum("ni,nk,nj->kij", local, weight**2, local, optimize=True) + _change_of_pairs(normal, first, second)
    side = np.einsum("ni,nk->ki", local, weight**2 * part.values) + _change_of_pairs(right, first, second)
    # Exchanged places may leave a motion undetermined: a small addition keeps the matrix regular.
    matrix += MIN_NORMAL_RATIO * np.trace(matrix, axis1=-2, axis2=-1)[..., None, None] * np.eye(6)
    solved = np.linalg.solve(matrix, side[..., None])[..., 0]
    return np.asarray(-(side * solved).sum(axis=(-2, -1)))


def _change_of_pairs(terms: FloatArray, first: IndexArray, second: IndexArray) -> FloatArray:
    """Return the change of sums over points by the exchange of pairs; terms : of a point, at the place of another."""
    return np.asarray(terms[first, second] + terms[second, first] - terms[first, first] - terms[second, second])


def _exchange(part: Component, pair: tuple[int, int]) -> Component:
    """Return the component with the places of two points exchanged."""
    positions = part.at.copy()
    positions[list(pair)] = positions[list(pair[::-1])]
    places = positions[part.owner]
    return replace(part, at=positions, places=places, rows=np.einsum("ni,nij->nj", part.ways, tf.point_velocity(places)))


def _place_of(part: Component, point: int, pairs: Sequence[tuple[int, int]]) -> FloatArray:
    """Return the place (3,) of a point: that of the one it was exchanged with, or by the others where several pairs are."""
    if len(pairs) == 1:
        first, second = pairs[0]
        return part.at[second if point == first else first]
    others = tuple({other for pair in pairs for other in pair} - {point})
    return part.at[point] + shift_of_point(part, point, others)[2]


def _refuse(part: Component, pairs: Sequence[tuple[Point, Point]], ratio: float) -> None:
    """Raise the error of a component of which two points are exchanged, and whose others do not determine its motions."""
    fail(f"points {_words_of(pairs)}", f"exchanged, {part.name} moves as one body {ratio:.2g} times better",
         f"must be where they are stated: the other points do not determine the motion of {part.name}",
         remedy="exchange the two in the geometry, or measure their places again")


def _doubt_of(part: Component, pairs: Sequence[tuple[Point, Point]], ratio: float) -> Doubt:
    """Return the doubt about exchanged points."""
    return Doubt(f"points {_words_of(pairs)}", f"they move as if they were exchanged: with their places exchanged {part.name} "
                 f"moves as one body {ratio:.2g} times better. They are left out of the motion of {part.name}",
                 "look at their places and at the names of their records", figure=ratio)


def _words_of(pairs: Sequence[tuple[Point, Point]]) -> str:
    """Return pairs of points as words."""
    return " or ".join(f"{first} and {second}" for first, second in pairs)
