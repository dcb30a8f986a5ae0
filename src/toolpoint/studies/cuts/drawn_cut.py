"""Chance that one cut is stable, by the equally likely responses that uncertain dynamics came with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.cutting import stability
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import MAX_CHART_DEPTH, depth_limit

CERTAIN_SHARE = 0.95  # of the draws that say the same, from which a verdict is not doubted


@dataclass(frozen=True)
class DrawnCut:
    """Share of equally likely responses whose cut is stable below its first limit, and the 95 % interval of that limit, m.

    count : of the responses; depth : of the cut, m.
    """

    stable_share: float
    limit_min: float
    limit_max: float
    count: int
    depth: float

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value): interval of the limit, share of responses in which the cut is stable."""
        return [("limit, 95 % of the responses", f"{1e3 * self.limit_min:.4g} .. {1e3 * self.limit_max:.4g} mm"),
                ("stable in", f"{100 * self.stable_share:.0f} % of {self.count} equally likely responses")]

    @property
    def note(self) -> str:
        """The share in words, a doubt where the responses do not agree about the cut."""
        words = (f"{1e3 * self.depth:.4g} mm is stable in {100 * self.stable_share:.0f} % of {self.count} equally likely "
                 "responses (95 % interval of the limit at this speed "
                 f"{1e3 * self.limit_min:.4g} .. {1e3 * self.limit_max:.4g} mm)")
        if max(self.stable_share, 1 - self.stable_share) >= CERTAIN_SHARE:
            return words
        return Doubt("verdict", f"the simulation is of the likeliest response alone: {words}",
                     "choose a depth below the interval, or know what the response rests on better", figure=self.stable_share)


def question_cut(dynamics: ToolDynamics, values: Mapping[str, Any], *, speed: float, depth: float) -> DrawnCut | None:
    """Return what the draws of a response say of a cut (rev/min, m); None for dynamics without draws."""
    if getattr(dynamics.response, "draws", None) is None:
        return None
    problem, _, _ = build_problem(dynamics, values)
    deepest = min(max(2 * depth, depth_limit(problem)), MAX_CHART_DEPTH)
    chart = stability.chart(problem, np.array([speed]), depth_max=deepest)
    assert chart.limit_draws is not None
    limit = min(float(chart.limit[0]), deepest) * chart.limit_draws[:, 0]
    # Weibull's plotting positions: of few draws the plain quantiles lie inside the interval that they stand for.
    lower, upper = np.quantile(limit, [0.025, 0.975], method="weibull")
    return DrawnCut(float((limit > depth).mean()), float(lower), float(upper), limit.size, depth)
