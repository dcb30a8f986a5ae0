r"""Ties: coordinates that follow others, rigidly (RBE2) or as their weighted mean (RBE3), and their elimination.

A set of ties says :math:`u_m = A_{mm} u_m + A_{mn} u_n`; followers of followers are solved together,
:math:`u_m = (1 - A_{mm})^{-1} A_{mn} u_n`. Mass and stiffness over all coordinates become
:math:`T^T K T` with :math:`u = T u_n`, so that no work is lost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, eye_array
from scipy.sparse.linalg import splu

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.spatial.rotation import skew
from toolpoint.vibration import Dof

WAYS = ("+x", "+y", "+z", "+rx", "+ry", "+rz")
# Smallest over largest singular value of what the leaders of a mean tell apart: below, they leave a motion open.
_MIN_MEAN_RATIO = 1e-9


@dataclass(frozen=True)
class TieEquation:
    """Motion of one coordinate as a sum of others: u_follower = sum of coefficient x u_leader."""

    follower: Dof
    terms: Mapping[Dof, float]


def rigid_ties(places: Mapping[int, FloatArray], leader: int, followers: Sequence[int], *,
               ways: Sequence[int] = range(6)) -> list[TieEquation]:
    """Return the ties by which points follow a leader as one rigid piece, in some of the ways 0 .. 5 (x y z rx ry rz)."""
    ties = []
    for point in followers:
        motion = _rigid(places[point] - places[leader])
        ties += [TieEquation(Dof(point, WAYS[way]), {Dof(leader, WAYS[k]): float(motion[way, k])
                                                      for k in range(6) if motion[way, k]}) for way in ways]
    return ties


@dataclass(frozen=True)
class MeanLeaders:
    """Points with one weight, of which some of the ways 0 .. 5 count in a mean."""

    weight: float
    ways: tuple[int, ...]
    points: tuple[int, ...]


def mean_ties(places: Mapping[int, FloatArray], follower: int, ways: Sequence[int], *,
              leaders: Sequence[MeanLeaders]) -> list[TieEquation]:
    r"""Return the ties by which a point follows others as the rigid motion nearest to them (RBE3).

    :math:`u = (R^T W R)^{-1} R^T W u_l`, with the leaders' rigid motions R about the follower. Rotations weigh by the square of
    the leaders' mean distance, so that the result does not hang on the unit of length.

    Raises ToolpointError where the leaders leave a motion open.
    """
    arms = [places[point] - places[follower] for group in leaders for point in group.points]
    distance = float(np.mean([np.linalg.norm(arm) for arm in arms])) or 1.0
    dofs, rows, weights = [], [], []
    for group in leaders:
        for point in group.points:
            motion = _rigid(places[point] - places[follower])
            for way in group.ways:
                dofs.append(Dof(point, WAYS[way]))
                rows.append(motion[way] * np.array([1, 1, 1, 1 / distance, 1 / distance, 1 / distance]))
                weights.append(group.weight * (1.0 if way < 3 else distance**2))
    motion, weight = np.array(rows).reshape(-1, 6), np.array(weights)
    normal = motion.T @ (weight[:, None] * motion)
    singular = np.linalg.svd(normal, compute_uv=False)
    if not singular[-1] > _MIN_MEAN_RATIO * singular[0]:
        fail(f"point {follower}", f"follows {len(arms)} points", "these must tell six motions apart",
             remedy="points on a line, or translations of one point, leave a rotation open: take more of them")
    solution = np.linalg.solve(normal, motion.T * weight) / np.array([1, 1, 1, distance, distance, distance])[:, None]
    return [TieEquation(Dof(follower, WAYS[way]), _sum_terms(dofs, solution[way])) for way in ways]


def _sum_terms(dofs: Sequence[Dof], values: FloatArray) -> dict[Dof, float]:
    terms: dict[Dof, float] = {}
    for dof, value in zip(dofs, values.tolist(), strict=True):
        if value:
            terms[dof] = terms.get(dof, 0.0) + value
    return terms


def _rigid(arm: FloatArray) -> FloatArray:
    """Return the motion (6, 6) of a point per motion of another, of which it stands at `arm` (3,)."""
    return np.block([[np.eye(3), -skew(arm)], [np.zeros((3, 3)), np.eye(3)]])


def eliminate_ties(dofs: Sequence[Dof], ties: Sequence[TieEquation]) -> tuple[tuple[Dof, ...], csc_array]:
    """Return the coordinates that are left, and T: the motion of all `dofs` per each of them, (all, left).

    Raises ToolpointError for a coordinate that follows twice, and for ties that lead round in a circle.
    """
    followers = {tie.follower: k for k, tie in enumerate(ties)}
    if len(followers) < len(ties):
        followed = [tie.follower for tie in ties]
        twice = next(dof for dof in followed if followed.count(dof) > 1)
        raise ToolpointError(f"ties: {twice} follows in two of them; must follow in one")
    left = tuple(dof for dof in dofs if dof not in followers)
    column = {dof: k for k, dof in enumerate(left)}
    entries = [(k, leader, value) for k, tie in enumerate(ties) for leader, value in tie.terms.items()]
    among = [(k, followers[leader], value) for k, leader, value in entries if leader in followers]
    on_left = [(k, column[leader], value) for k, leader, value in entries if leader not in followers]
    motion = _sparse(on_left, (len(ties), len(left)))
    if among:
        system = csc_array(eye_array(len(ties)) - _sparse(among, (len(ties), len(ties))))
        try:
            motion = csc_array(splu(system).solve(motion.toarray()))
        except RuntimeError:
            raise ToolpointError("ties: points follow each other in a circle; must lead to points that follow none") from None
    order = coo_array(motion)
    free = [(k, column[dof]) for k, dof in enumerate(dofs) if dof in column]
    place = {dof: k for k, dof in enumerate(dofs)}
    rows = np.array([place[tie.follower] for tie in ties], dtype=int)
    i = np.concatenate([[k for k, _ in free], rows[order.coords[0]]]).astype(int)
    j = np.concatenate([[k for _, k in free], order.coords[1]]).astype(int)
    return left, csc_array(coo_array((np.concatenate([np.ones(len(free)), order.data]), (i, j)), shape=(len(dofs), len(left))))


def _sparse(entries: Sequence[tuple[int, int, float]], shape: tuple[int, int]) -> csc_array:
    i, j, values = zip(*entries, strict=True) if entries else ((), (), ())
    return csc_array(coo_array((np.array(values, dtype=float), (np.array(i, dtype=int), np.array(j, dtype=int))), shape=shape))
