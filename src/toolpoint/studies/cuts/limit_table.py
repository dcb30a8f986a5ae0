"""Limits at other immersions and numbers of teeth, by the engine of the chart, for questions that a page answers at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import StabilityChart
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machines.tool_point import deep_chart

TABLE_IMMERSIONS = (0.1, 0.25, 0.5, 0.75, 1.0)  # radial immersions a/D
MAX_QUICK_MODES = 8  # modes up to which a table takes a few seconds and is made unasked
TABLE_SPEEDS = 40  # speeds over the range of the chart
TOOTH_STEPS = (-1, 0, 1)  # beside the number of teeth of the cut
MIN_TABLE_TEETH = 1


@dataclass(frozen=True, eq=False)
class LimitTable:
    """Limits of a cut over radial immersion, number of teeth and spindle speed.

    Parameters
    ----------
    immersions : (n_i,) floats
        a/D, increasing; that of the cut is among them.
    teeth : (n_z,) ints
        Increasing; that of the cut is among them.
    speeds : (n,) floats
        rev/min.
    limit : (n_i, n_z, n) floats
        m, infinite where none was found down to `depth_max`.
    immersion, tooth_count : of the cut
    depth_max : (n_i, n_z) floats
        m, end of the searched depths.
    overstated : float
        How far the lower of two neighbouring speeds is above the limit of the cut's chart between them, at most, as a share.
    """

    immersions: FloatArray
    teeth: tuple[int, ...]
    speeds: FloatArray
    limit: FloatArray
    immersion: float
    tooth_count: int
    depth_max: FloatArray
    overstated: float

    @property
    def words(self) -> str:
        """Rule between two speeds, and its error against the chart, in words."""
        return (f"By the engine of the chart at {self.speeds.size} speeds; between two the lower counts. At this page's own "
                f"cut, whose chart has more speeds, that is at most {100 * self.overstated:.0f} % too much.")


def tabulate_limits(dynamics: ToolDynamics, values: Mapping[str, Any], cut: CuttingDescription, *, chart: StabilityChart,
                    method: StabilityMethod | None = None,
                    progress: Callable[[int, int], None] = lambda finished, total: None) -> LimitTable | None:
    """Return the limits of a cut at other immersions and numbers of teeth; None where its arc is given by angles, or where the
    dynamics are measured lines, whose charts take long.

    Parameters
    ----------
    dynamics, values : of the cut, as for `build_problem`
    cut : CuttingDescription
        Their cut.
    chart : StabilityChart
        Of the cut.
    """
    immersion = cut.engagement.immersion
    if immersion is None or cut.engagement.direction == "slot" or len(set(cut.tool.pitch)) > 1 or isinstance(
            cut.tool.helix, tuple):
        return None
    immersions = np.unique([*TABLE_IMMERSIONS, immersion])
    teeth = tuple(sorted({max(cut.tool.teeth + step, MIN_TABLE_TEETH) for step in TOOTH_STEPS}))
    # A chart of one speed has a table of one: the same limit forty times took half a minute with a helix.
    speeds = np.unique(np.linspace(chart.speeds[0], chart.speeds[-1], TABLE_SPEEDS))
    limit, depth_max = np.full((len(immersions), len(teeth), len(speeds)), np.inf), np.zeros((len(immersions), len(teeth)))
    for place, (i, k) in enumerate(np.ndindex(len(immersions), len(teeth))):
        progress(place, depth_max.size)
        problem, used, _ = build_problem(dynamics, {**values, "immersion": float(immersions[i]), "teeth": teeth[k]})
        if not problem.plane.is_modal:
            return None
        part = deep_chart(problem, speeds, method, share=0.5, end=used.depth_end[0])
        limit[i, k], depth_max[i, k] = part.limit, part.depth_max
    charted = limit[int(np.searchsorted(immersions, immersion)), teeth.index(cut.tool.teeth)]
    return LimitTable(immersions, teeth, speeds, limit, immersion, cut.tool.teeth, depth_max,
                      _overstatement(speeds, charted, chart))


def _overstatement(speeds: FloatArray, limit: FloatArray, chart: StabilityChart) -> float:
    """Return how far the lower of two neighbouring speeds is above the limit of a chart between them, at most, as a share."""
    right = np.clip(np.searchsorted(speeds, chart.speeds), 1, len(speeds) - 1)
    rule = np.minimum(np.minimum(limit[right - 1], limit[right]), chart.depth_max)
    compared = np.isfinite(chart.limit) & (chart.limit > 0)
    return max(float((rule[compared] / chart.limit[compared]).max(initial=1.0)) - 1, 0.0)
