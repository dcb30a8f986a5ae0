"""Places of a program nearest to their limit, judged with draws of machine and coefficients within their uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from toolpoint._check import BoolArray, FloatArray
from toolpoint._doubt import Doubt
from toolpoint.cutting import Engagement, MillingProblem, stability
from toolpoint.project.limits.attached_tool_draws import AttachedToolDraws
from toolpoint.project.limits.drawn_limits import quantile_of
from toolpoint.project.limits.line_draws import LineDraws
from toolpoint.project.limits.systems import DrawnSystems, MachineDraws, coefficient_factors, problem_of
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.solver import MIN_SEARCHED_DEPTH, SEARCHED_DEPTH_RATIO
from toolpoint.studies.machining.tool_tips import ToolTips

MAX_DRAWN_PLACES = 10  # distinct engagements that are judged by all draws, the nearest to their limit


@dataclass(frozen=True, eq=False)
class DrawnPlaces:
    """Places of a program over draws.

    line, tool, speed (rev/min), depth (m) : (m,) of the places, the nearest to its limit first; limit, frequency : (m,) of the
    likeliest machine, m, Hz; draws : (n, m) limits, m; stable : (n, m) whether the depth is stable; count : of all distinct
    engagements of the program.
    """

    line: np.ndarray
    tool: np.ndarray
    speed: FloatArray
    depth: FloatArray
    limit: FloatArray
    frequency: FloatArray
    draws: FloatArray
    stable: BoolArray
    count: int

    def interval(self, weights: FloatArray, place: int = 0, level: float = 0.95) -> tuple[float, float]:
        """Return both ends of the interval of the limit of a place, m; infinite above the searched depth."""
        tail, column = (1 - level) / 2, self.draws[:, place]
        return quantile_of(column, weights, tail), quantile_of(column, weights, 1 - tail)

    def chances(self, weights: FloatArray) -> FloatArray:
        """Return P(stable) of every place, (m,); so many draws can say neither 0 nor 1 (rule of succession)."""
        return np.asarray((weights.size * (weights @ self.stable) + 1) / (weights.size + 2))

    def chance(self, weights: FloatArray) -> float:
        """Return P(all places stable): the places share machine and coefficients, so it is no product."""
        return float((weights.size * (weights @ self.stable.all(axis=1)) + 1) / (weights.size + 2))

    @property
    def worst(self) -> int:
        """Index of the place that fails in most draws, the first of equal ones."""
        return int(np.argmin(self.stable.mean(axis=0)))

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubt where engagements that were not drawn could fail too."""
        left_out = self.count - self.line.size
        fails_last = self.line.size and not self.stable[:, -1].all()
        if left_out <= 0 or not fails_last:
            return ()
        return (Doubt("probability of the program", f"{left_out} further engagements were not judged by the draws; the last of "
                      "those that were still fails in some of them", "the true probability is lower: take more in hand"),)


@dataclass(frozen=True, eq=False)
class ProgramDraws:
    """Draws of what the tools of a program cut on: those of the machine or the tap, and of tools with a tip of their own."""

    systems: DrawnSystems
    tips: ToolTips

    def of_tool(self, tool: int) -> DrawnSystems:
        """Return the draws of a tool."""
        return self._own.get(tool, self.systems)

    @cached_property
    def _own(self) -> dict[int, DrawnSystems]:
        """Draws of the tools that have a tip of their own."""
        systems, tips = self.systems, self.tips
        draws: dict[int, DrawnSystems] = {tool: LineDraws(tip, f"the tip of tool {tool}", systems.count, systems.seed)
                                          for tool, tip in tips.struck.items()}
        if isinstance(systems, MachineDraws):
            draws |= {tool: AttachedToolDraws(systems.machine, systems.count, systems.seed, tips.point, shaft, shaft.length)
                      for tool, shaft in tips.shafts.items()}
        return draws

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """Doubts about the spread of all draws."""
        own = [doubt.within(f"tool {tool}") for tool in self.tips.numbers for doubt in self.of_tool(tool).doubts
               if doubt not in self.systems.doubts]
        return (*self.systems.doubts, *own)


def draw_places(drawn: ProgramDraws, stages: Sequence[JudgedPlaces], deviation_of: Callable[[int], tuple[str, float]]
                ) -> DrawnPlaces:
    """Return the places nearest to their limit over all draws; deviation_of : name and deviation of a tool's coefficients."""
    parts = [_draw_stage(drawn, judged, deviation_of) for judged in stages if judged.arcs.place.size]
    ratio = np.concatenate([part.limit / part.depth for part in parts])
    order = np.lexsort((np.concatenate([part.stable.mean(axis=0) for part in parts]), ratio))[:MAX_DRAWN_PLACES]
    columns = {name: np.concatenate([getattr(part, name) for part in parts])[order]
               for name in ("line", "tool", "speed", "depth", "limit", "frequency")}
    return DrawnPlaces(**columns, draws=np.hstack([part.draws for part in parts])[:, order],
                       stable=np.hstack([part.stable for part in parts])[:, order], count=sum(part.count for part in parts))


def _draw_stage(drawn: ProgramDraws, judged: JudgedPlaces, deviation_of: Callable[[int], tuple[str, float]]) -> DrawnPlaces:
    places, arcs = judged.nearest(MAX_DRAWN_PLACES), judged.arcs
    block = judged.block[places]
    tool, speed, pose = judged.laid.tool[block], judged.laid.speed[block], judged.pose[arcs.place[places]]
    draws, stable = np.full((drawn.systems.count, places.size), np.inf), np.ones((drawn.systems.count, places.size), bool)
    for number, index in dict.fromkeys(zip(tool.tolist(), pose.tolist(), strict=True)):
        columns = np.flatnonzero((tool == number) & (pose == index))
        for row, problem in enumerate(_problems(drawn.of_tool(number), judged, number, index, deviation_of(number))):
            for column in columns.tolist():
                m = int(places[column])
                draws[row, column], stable[row, column] = _judge(problem, (float(arcs.entry[m]), float(arcs.exit[m])),
                                                                 angle=float(arcs.angle[m]), speed=float(speed[column]),
                                                                 depth=float(arcs.depth[m]))
    limit = np.where(np.isnan(judged.margins.limit[places]), np.inf, judged.margins.limit[places])
    return DrawnPlaces(judged.laid.path.line[block], tool, speed, arcs.depth[places], limit, judged.margins.frequency[places],
                       draws, stable, judged.groups.count)


def _problems(systems: DrawnSystems, judged: JudgedPlaces, tool: int, pose: int, deviation: tuple[str, float]
              ) -> list[MillingProblem]:
    """Return the problem of a tool at a pose for every draw."""
    cut, factors = judged.solver.setup.cut_of(tool), coefficient_factors(*deviation, systems)
    # A tip has no pose: its draws are the same all along the program.
    solver = judged.solver
    return [problem_of(solver.beside_work(dynamics, pose), cut, row)
            for dynamics, row in zip(systems.drawn(solver.dynamics[pose].pose), factors, strict=True)]


def _judge(problem: MillingProblem, arc: tuple[float, float], *, angle: float, speed: float, depth: float
           ) -> tuple[float, bool]:
    """Return the limit of a place (m), and whether its depth is stable, also in a stable band above a first limit."""
    chart = stability.chart(problem.changed(engagement=Engagement(*arc), feed_angle=angle), np.array([speed]),
                            depth_max=max(SEARCHED_DEPTH_RATIO * depth, MIN_SEARCHED_DEPTH))
    is_stable = any(lower <= depth <= upper for lower, upper in chart.intervals(0))
    return float(chart.limit[0]), is_stable
