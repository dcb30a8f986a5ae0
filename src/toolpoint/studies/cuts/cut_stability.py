"""Linear stability of a simulated cut: largest multiplier and limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ToolpointError
from toolpoint._rounding import limit_text
from toolpoint.cutting import PanelArnoldi, stability
from toolpoint.cutting.simulation.simulated_run import Simulation
from toolpoint.studies.machines.tool_point import MAX_CHART_DEPTH, depth_limit


@dataclass(frozen=True)
class CutStability:
    """Linear stability of one cut.

    Parameters
    ----------
    multiplier : float or None
        Size of the largest multiplier over one period of the simulated cut; None where it could not be computed.
    limit, limit_error : float or None
        First loss of stability at this speed and its stated error, m; infinite where none lies above the cut within the chart.
    stable : bool or None
        Whether the cut lies in a stable interval.
    reason : str
        Why something is None.
    """

    multiplier: float | None = None
    limit: float | None = None
    limit_error: float | None = None
    stable: bool | None = None
    reason: str = ""

    def rows(self) -> list[tuple[str, str]]:
        """Return rows (quantity, value)."""
        if self.multiplier is None or self.limit is None:
            return [("stability chart", self.reason)]
        limit = (f"{limit_text(1e3 * self.limit, 1e3 * (self.limit_error or 0.0))} mm, by the numbers as given"
                 if np.isfinite(self.limit) else "none")
        return [("largest multiplier", f"{self.multiplier:.5f} a period (stable below 1)"), ("stability limit", limit),
                ("stability chart", "stable" if self.stable else "unstable")]

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers; None where not known or infinite."""
        limit = self.limit if self.limit is not None and np.isfinite(self.limit) else None
        return {"multiplier": self.multiplier, "stability_limit_m": limit, "stability_limit_error_m": self.limit_error,
                "chart_stable": self.stable}


def cut_stability(run: Simulation) -> CutStability:
    """Return multiplier and limit of the cut that was simulated."""
    problem, speed, depth = run.problem, run.speed, run.depth
    try:
        multiplier = float(np.abs(PanelArnoldi().multipliers(problem, speed, depth)[0])) ** _periods(run)
        deepest = min(max(2 * depth, depth_limit(problem)), MAX_CHART_DEPTH)
        chart = stability.chart(problem, np.array([speed]), depth_max=deepest)
        point = int(chart.limit_points()[0])
        return CutStability(multiplier, float(chart.limit[0]), float(chart.error[point]) if point >= 0 else None,
                            bool(chart.stable(np.array([depth]))[0, 0]))
    except ToolpointError as error:
        return CutStability(reason=f"could not be computed: {error}")


def _periods(run: Simulation) -> float:
    """Return the periods of the one-period map in one period after which the simulated cut repeats."""
    problem = run.problem
    varies = problem.speed_variation is not None
    return run.steps_per_repeat / run.steps_per_period if problem.tool.is_regular and not varies else 1.0
