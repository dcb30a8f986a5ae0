"""Lobes of the engagements that are nearest to their limit: stable depth over the spindle speed, and the blocks they are of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.margins import limit_over_depth

LOBE_SPEED_RANGE = (0.5, 1.5)  # of the programmed speed
LOBE_SPEED_COUNT = 81


@dataclass(frozen=True, eq=False)
class EngagementLobes:
    """Lobes of an engagement: blocks (k,) whose worst place it is; speeds (n,) rev/min; limit (n,) m, infinite where none lies
    within four times its largest depth (m); programmed speed, rev/min."""

    blocks: np.ndarray
    speed: FloatArray
    limit: FloatArray
    depth: float
    programmed: float


def lobes_of_blocks(judged: JudgedPlaces, count: int, progress: Callable[[int, int], None]) -> tuple[EngagementLobes, ...]:
    """Return the lobes of the `count` engagements nearest to their limit; those that cannot be solved are left out."""
    groups, block = judged.groups, judged.block
    ratio = np.nan_to_num(limit_over_depth(judged.margins, judged.arcs), nan=np.inf)
    order = np.argsort(-ratio, kind="stable")
    group_of_block = np.full(judged.laid.path.count, -1)
    group_of_block[block[order]] = groups.group[order]  # written last is the nearest to its limit
    least_ratio = np.full(groups.count, np.inf)
    np.minimum.at(least_ratio, groups.group, ratio)
    chosen = [k for k in np.argsort(least_ratio, kind="stable").tolist() if (group_of_block == k).any()][:count]
    lobes = list[EngagementLobes]()
    for number, k in enumerate(chosen):
        progress(number, len(chosen))
        speeds = groups.speed[k] * np.linspace(*LOBE_SPEED_RANGE, LOBE_SPEED_COUNT)
        try:
            chart = judged.solver.chart(int(groups.tool[k]), int(groups.pose[k]),
                                        (float(groups.entry[k]), float(groups.exit[k])),
                                        angle=float(groups.angle[k]), speeds=speeds, depth=float(groups.depth[k]))
        except ToolpointError:
            continue
        lobes.append(EngagementLobes(np.flatnonzero(group_of_block == k), speeds, np.array(chart.limit), float(groups.depth[k]),
                                     float(groups.speed[k])))
    return tuple(lobes)
