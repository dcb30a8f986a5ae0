"""Stability of every distinct engagement by the exact engines, and of the blocks near a limit with their own arcs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.cutting import Engagement, MillingProblem, StabilityChart, WarmStart, stability
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.engagement_classes import EngagementClasses, PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup

SEARCHED_DEPTH_RATIO = 4.0  # of a group's depth, up to which a limit is looked for
MIN_SEARCHED_DEPTH = 5e-5  # m
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


@dataclass(eq=False)
class StabilitySolver:
    """Solver of single cuts: the problem of each tool and pose is kept, and what one solution leaves for the next."""

    setup: MachiningSetup
    dynamics: Sequence[ToolDynamics]

    def __post_init__(self) -> None:
        self._problems: dict[tuple[int, int], MillingProblem] = {}
        self._memories: dict[tuple[int, float, float], WarmStart] = {}
        self.solutions = 0

    def problem(self, tool: int, pose: int) -> MillingProblem:
        """Return the milling problem of a tool at a pose."""
        if (tool, pose) not in self._problems:
            dynamics = self.dynamics[pose]
            problem = milling_problem(self.setup.cut_of(tool), dynamics.response, dynamics.x, y=dynamics.y)
            if dynamics.at_speed is not None:
                problem = problem.changed(dynamics=dynamics.at_speed)
            self._problems[tool, pose] = problem
        return self._problems[tool, pose]

    def chart(self, tool: int, pose: int, arc: tuple[float, float], *, angle: float, speeds: FloatArray, depth: float
              ) -> StabilityChart:
        """Return the chart of a cut up to several times its depth."""
        problem = self.problem(tool, pose).changed(engagement=Engagement(*arc), feed_angle=angle)
        self.solutions += len(speeds)
        deepest = max(SEARCHED_DEPTH_RATIO * depth, MIN_SEARCHED_DEPTH)
        return stability.chart(problem, speeds, depth_max=deepest)


def place_margins(arcs: PlaceArcs, classes: EngagementClasses, laid: ProgramPath, piece: np.ndarray, *, solver: StabilitySolver,
                  pose: np.ndarray, progress: Callable[[int, int], None] = lambda finished, total: None) -> PlaceMargins:
    """Return the limits of all places: those of their groups, then of the deepest places near a limit with their own arcs."""
    group_limit = np.full((classes.count, 3), np.nan)
    charts: list[StabilityChart | None] = [None] * classes.count
    failures = dict[str, None]()
    for k in range(classes.count):
        try:
            chart = solver.chart(int(classes.tool[k]), int(classes.pose[k]), (classes.entry[k], classes.exit[k]),
                                 angle=float(classes.angle[k]), speeds=classes.speed[k:k + 1], depth=float(classes.depth[k]))
        except ToolpointError as error:
            failures[str(error)] = None
            continue
        group_limit[k], charts[k] = _numbers(chart), chart
        progress(k + 1, classes.count)
    values = group_limit[classes.group]
    stable, gap = _judge_members(arcs.depth, classes.group, charts)
    is_own, grouping, unsolved = _solve_near(arcs, values, stable, laid, piece, solver=solver, pose=pose, gap=gap)
    return PlaceMargins(values[:, 0], values[:, 1], values[:, 2], stable, is_own, grouping, solver.solutions, tuple(failures),
                        unsolved)


def _judge_members(depth: FloatArray, group: np.ndarray, charts: Sequence[StabilityChart | None]) -> tuple[np.ndarray,
        FloatArray]:
    """Return whether places are stable by the chart of their group, and how far (of their depth) its nearest boundary is.

    All boundaries count: a place may lie in a stable band above the first limit.
    """
    stable, gap = np.zeros(depth.size, bool), np.full(depth.size, np.inf)
    order = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[order], np.arange(len(charts) + 1))
    for k, chart in enumerate(charts):
        members = order[ends[k]:ends[k + 1]]
        if chart is None:
            continue
        stable[members] = chart.stable(depth[members])[0]
        if chart.depth.size:
            gap[members] = np.abs(chart.depth[:, None] / depth[members] - 1).min(axis=0)
    return stable, gap


def _solve_near(arcs: PlaceArcs, values: FloatArray, stable: np.ndarray, laid: ProgramPath, piece: np.ndarray, *,
                solver: StabilitySolver, pose: np.ndarray, gap: FloatArray) -> tuple[np.ndarray, float, int]:
    """Solve the places near a boundary with their own arcs, the nearest first.

    Return which were solved, the largest change of limit over depth, and how many near ones were left to their group.
    """
    ratio = values[:, 0] / arcs.depth
    doubtful = np.flatnonzero(gap < NEAR_RATIO)
    chosen = doubtful[np.argsort(gap[doubtful], kind="stable")][:MAX_OWN_SOLUTIONS]
    is_own, grouping = np.zeros(arcs.place.size, bool), 0.0
    for m in chosen.tolist():
        block = int(laid.moves.block[piece[arcs.place[m]]])
        try:
            chart = solver.chart(int(laid.tool[block]), int(pose[arcs.place[m]]), (float(arcs.entry[m]), float(arcs.exit[m])),
                                 angle=float(arcs.angle[m]), speeds=laid.speed[block:block + 1], depth=float(arcs.depth[m]))
        except ToolpointError:
            continue
        values[m] = _numbers(chart)
        stable[m], is_own[m] = bool(chart.stable(arcs.depth[m:m + 1])[0, 0]), True
        if np.isfinite(values[m, 0]) and np.isfinite(ratio[m]) and ratio[m] > 0:
            grouping = max(grouping, abs(values[m, 0] / arcs.depth[m] / ratio[m] - 1))
    return is_own, float(grouping), int(doubtful.size - chosen.size)


def _numbers(chart: StabilityChart) -> FloatArray:
    """Return limit, its error and the chatter frequency of a chart of one speed."""
    point = int(chart.limit_points()[0])
    return np.array([chart.limit[0], chart.error[point] if point >= 0 else 0.0, chart.frequency[point] if point >= 0
                     else np.nan])
