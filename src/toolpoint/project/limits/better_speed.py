"""Spindle speed that allows more of a goal's cut: chosen on a rough chart with a margin, judged by all draws."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointWarning
from toolpoint.cutting import ZeroOrder, stability
from toolpoint.project.limits.drawn_limits import CutQuestion, draw_limits, quantile_of
from toolpoint.project.limits.systems import DrawnSystems, problem_of
from toolpoint.studies.machines.tool_point import depth_limit

ROUGH_CHART_SPEEDS = 200  # over the range of the cut
SPEED_MARGIN_FRACTION = 0.02  # to each side, over which a speed must stay as good
ROUGH_DEPTH_RATIO = 4.0  # depth of the rough chart over the estimate of the lowest limit
CERTAIN_LEVEL = 0.05  # quantile of the limit that is stated as certain


@dataclass(frozen=True)
class BetterSpeed:
    """Speed (rev/min), depth that is stable there with 95 % (m), and the removal rate over that of the goal's own speed and
    certain depth."""

    speed: float
    certain_depth: float
    rate_ratio: float

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"speed_rpm": self.speed, "certain_depth_m": self.certain_depth, "rate_over_today": self.rate_ratio}


def find_better_speed(systems: DrawnSystems, question: CutQuestion, weights: FloatArray, *, certain_depth: float
                      ) -> BetterSpeed | None:
    """Return the speed of the largest certain removal rate by the draws, None where it does not exceed that of the goal's.

    certain_depth : m, of the goal's own speed.
    """
    problem = problem_of(systems.nominal(question.pose), question.cut)
    speeds = np.linspace(*question.cut.speeds, ROUGH_CHART_SPEEDS)
    depth_max = min(ROUGH_DEPTH_RATIO * depth_limit(problem), question.cut.depth_end[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)  # of the rough chart: its choice is judged by exact ones
        rough = np.minimum(stability.chart(problem, speeds, ZeroOrder(), depth_max=depth_max).limit, depth_max)
    is_beside = np.abs(speeds[:, None] / speeds[None, :] - 1) <= SPEED_MARGIN_FRACTION
    rate = np.where(is_beside, rough[:, None], np.inf).min(axis=0) * speeds
    rate[(speeds * (1 - SPEED_MARGIN_FRACTION) < speeds[0]) | (speeds * (1 + SPEED_MARGIN_FRACTION) > speeds[-1])] = 0.0
    best = float(speeds[int(np.argmax(rate))])
    around = (best * (1 - SPEED_MARGIN_FRACTION), best, best * (1 + SPEED_MARGIN_FRACTION))
    limits = draw_limits(systems, replace(question, speeds=around))
    lowest = np.minimum(limits.draws, limits.depth_max).min(axis=1)
    depth = max(quantile_of(lowest, weights, CERTAIN_LEVEL) - float(limits.error.max()), 0.0)
    ratio = depth * best / max(certain_depth * question.speeds[0], 1e-300)
    return BetterSpeed(best, depth, ratio) if ratio > 1 else None
