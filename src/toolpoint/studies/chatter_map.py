"""Stability over poses, feed directions and spindle speeds: where in the workspace a cut may be how deep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail
from toolpoint.cutting.description import CuttingDescription
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.pose_charts import PoseCharts, chart_poses
from toolpoint.machine.model import Machine
from toolpoint.studies.tool_point import ToolPoint, depth_limit, milling_problem, tool_point


@dataclass(frozen=True, eq=False)
class ChatterMap:
    """Charts of one cut over poses and feed directions.

    study : the tool-point dynamics of all poses; charts : PoseCharts; cut : the cut.
    """

    study: ToolPoint
    charts: PoseCharts
    cut: CuttingDescription

    @property
    def limit(self) -> FloatArray:
        """Depth of the first loss of stability, m, shape (n_poses, n_directions, n_speeds); infinite above the range."""
        return self.charts.limit

    def worst_pose(self) -> int:
        """Return the pose with the smallest depth that is stable at every speed and in every direction."""
        return int(np.argmin(self.limit.reshape(len(self.study.poses), -1).min(axis=1)))

    def __repr__(self) -> str:
        return f"ChatterMap({self.study.machine.name!r}, {self.charts!r})"


def chatter_map(
    machine: Machine, poses: Sequence[Mapping[str, float]] | None = None, speeds: ArrayLike | None = None,
    feed_angles: ArrayLike = (0.0,), cut: CuttingDescription | None = None, method: StabilityMethod | None = None,
    workers: int = 1, warm: bool = True, chain: int | None = None,
) -> ChatterMap:
    """Return stability charts of a cut over poses and feed directions.

    Parameters
    ----------
    machine : Machine
        Names its tool point, and the cut unless `cut` is given.
    poses : sequence of mappings of axis name to m or rad, optional
        The described ones where left out.
    speeds : (n,) floats, optional
        rev/min; 200 over the range of the cut where left out.
    feed_angles : (n_directions,) floats
        rad from x towards y.
    cut : CuttingDescription, optional
    method : stability method, optional
        The exact default engine where left out.
    workers : int
        Threads.
    warm : bool
        Let each chart begin with what its neighbour left, see `chart_poses`.
    chain : int, optional
        Poses that follow each other warm; by the rule of `chart_poses` where left out.
    """
    cut = cut or machine.description.cutting
    if cut is None:
        fail("cut", "none", "must be given, here or as 'cutting' in the machine file")
    study = tool_point(machine, poses)
    n = np.linspace(*cut.speeds, 200) if speeds is None else np.asarray(speeds, float)
    problems = [milling_problem(cut, study.modes.at_pose(i), f"{study.point}:+x", f"{study.point}:+y")
                for i in range(len(study.poses))]
    depth = max(depth_limit(problem) for problem in problems)
    charts = chart_poses(problems[0], study.modes, n, depth, np.atleast_1d(feed_angles), method, workers, warm, chain)
    return ChatterMap(study, charts, cut)
