"""Stability of every distinct engagement by the exact engines, and of the blocks near a limit with their own arcs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.studies.execute import Outcome, Threads, execute
from toolpoint.studies.machining.engagement_classes import EngagementClasses, PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.solver import StabilitySolver

NEAR_RATIO = 0.3  # of the depth: places with a boundary nearer than that are solved with their own arcs
MAX_OWN_SOLUTIONS = 400  # of blocks near their limit


@dataclass(frozen=True, eq=False)
class PlaceMargins:
    """Limits at every place that cuts, (m,), as `PlaceArcs`.

    limit : depth of the first loss of stability, m; infinite where none lies within the searched depths; not a number where it
    could not be computed. error : stated by the engine, m; frequency : of chatter there, Hz; stable : bools; is_own :
    whether the place was solved with its own arc; grouping : largest change of limit/depth between group and own arc where
    both are known.
    """

    limit: FloatArray
    error: FloatArray
    frequency: FloatArray
    stable: np.ndarray
    is_own: np.ndarray
    grouping: float
    solutions: int
    failures: tuple[str, ...] = ()
    unsolved: int = 0


def place_margins(arcs: PlaceArcs, classes: EngagementClasses, laid: ProgramPath, *, piece: np.ndarray, solver: StabilitySolver,
                  pose: np.ndarray, folder: Path | None = None,
                  progress: Callable[[int, int], None] = lambda finished, total: None) -> PlaceMargins:
    """Return the limits of all places: those of their groups, then of the places near a limit with their own arcs.

    Nothing is solved twice: a group of one place is solved with its own arc.

    folder : where solved cuts are kept, and found again after an interruption.
    """
    block = laid.moves.block[piece[arcs.place]]
    points = np.stack([classes.tool, classes.pose, classes.entry, classes.exit, classes.angle, classes.speed, classes.depth],
                      axis=1).tolist()
    # A group of one member is that member: its own arc is solved in place of the group's.
    is_single = np.bincount(classes.group, minlength=classes.count) == 1
    farthest = _farthest_members(arcs, classes)
    for k, point in zip(np.flatnonzero(is_single).tolist(),
                        _member_points(arcs, laid, block, pose, members=farthest[is_single]), strict=True):
        points[k] = point

    def solve(points: list[list[float]], name: str) -> Sequence[Outcome]:
        return execute(solver, points, Threads(), folder=None if folder is None else folder / name, progress=progress
                       ).outcomes if points else ()

    groups = solve(points, "groups-2")
    values = np.array([_numbers(outcome) for outcome in groups])[classes.group]
    stable, gap = _judge_members(arcs.depth, classes.group, groups)
    # An arc within the group's may have a boundary that the group's lacks (an island): the member farthest from it is solved
    # too.
    second = list(groups)
    members = farthest[~is_single]
    for k, outcome in zip(np.flatnonzero(~is_single).tolist(),
                          solve(_member_points(arcs, laid, block, pose, members=members), "members-2"), strict=True):
        second[k] = outcome
    stable_beside, gap_beside = _judge_members(arcs.depth, classes.group, second)
    gap = np.where(stable != stable_beside, 0.0, np.minimum(gap, gap_beside))
    # The nearest to a boundary first; those that were solved with their own arcs are known.
    is_own, grouping = np.zeros(arcs.place.size, bool), 0.0
    is_own[farthest] = True
    doubtful = np.flatnonzero((gap < NEAR_RATIO) & ~is_own)
    chosen = doubtful[np.argsort(gap[doubtful], kind="stable")][:MAX_OWN_SOLUTIONS]
    near_solutions = solve(_member_points(arcs, laid, block, pose, members=chosen), "near-2")
    solved = [*zip(farthest.tolist(), second, strict=True), *zip(chosen.tolist(), near_solutions, strict=True)]
    for m, outcome in solved:
        if outcome.values is None:
            is_own[m] = False
            continue
        group_limit, values[m], is_own[m] = values[m, 0], _numbers(outcome), True
        stable[m] = bool(_is_inside(outcome.values["intervals"], arcs.depth[m:m + 1])[0])
        if np.isfinite(values[m, 0]) and np.isfinite(group_limit) and group_limit > 0:
            grouping = max(grouping, abs(float(values[m, 0] / group_limit) - 1))
    failures = dict.fromkeys(outcome.failure for outcome in groups if outcome.values is None)
    count = len(groups) + members.size + len(near_solutions)
    return PlaceMargins(values[:, 0], values[:, 1], values[:, 2], stable, is_own, grouping, count, tuple(failures),
                        int(doubtful.size - chosen.size))


def _farthest_members(arcs: PlaceArcs, classes: EngagementClasses) -> np.ndarray:
    """Return the member of each group whose own arc differs most from the group's."""
    difference = np.abs(arcs.entry - classes.entry[classes.group]) + np.abs(arcs.exit - classes.exit[classes.group])
    order = np.argsort(difference, kind="stable")
    members = np.zeros(classes.count, int)
    members[classes.group[order]] = order  # written last is the largest
    return members


def _member_points(arcs: PlaceArcs, laid: ProgramPath, block: np.ndarray, pose: np.ndarray, *, members: np.ndarray
                   ) -> list[list[float]]:
    """Return the points of `StabilitySolver` of places with their own arcs."""
    segment = block[members]
    columns = [laid.tool[segment], pose[arcs.place[members]], arcs.entry[members], arcs.exit[members], arcs.angle[members],
               laid.speed[segment], arcs.depth[members]]
    return [[float(value) for value in row] for row in zip(*columns, strict=True)]


def limit_over_depth(margins: PlaceMargins, arcs: PlaceArcs) -> FloatArray:
    """Return the limit over the depth of every place: below 1 where it chatters, also in a stable band above a first limit."""
    ratio = margins.limit / arcs.depth
    return np.asarray(np.where(margins.stable, np.maximum(ratio, 1.0), np.minimum(ratio, 1.0)))


def _judge_members(depth: FloatArray, group: np.ndarray, groups: Sequence[Outcome]) -> tuple[np.ndarray, FloatArray]:
    """Return whether places are stable by the solution of their group, and how far (of their depth) its nearest boundary is.

    All boundaries count: a place may lie in a stable band above the first limit.
    """
    stable, gap = np.zeros(depth.size, bool), np.full(depth.size, np.inf)
    order = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[order], np.arange(len(groups) + 1))
    for k, outcome in enumerate(groups):
        members = order[ends[k]:ends[k + 1]]
        if outcome.values is None:
            continue
        stable[members] = _is_inside(outcome.values["intervals"], depth[members])
        if outcome.values["boundaries"].size:
            gap[members] = np.abs(outcome.values["boundaries"][:, None] / depth[members] - 1).min(axis=0)
    return stable, gap


def _is_inside(intervals: FloatArray, depth: FloatArray) -> np.ndarray:
    """Return whether depths lie in one of the stable intervals (not a number where there is none)."""
    return np.asarray(((intervals[:, :1] <= depth) & (depth <= intervals[:, 1:])).any(axis=0))


def _numbers(outcome: Outcome) -> FloatArray:
    """Return limit, its error and the chatter frequency of a solved cut; not a number where it failed."""
    values = outcome.values
    return np.full(3, np.nan) if values is None else np.array([float(values[name]) for name in ("limit", "error", "frequency")])
