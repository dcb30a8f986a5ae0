"""StabilitySolver: single cuts by the exact engines, as points of a study that is kept and resumed."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import Engagement, MillingProblem, StabilityChart, stability
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.cuts.work_dynamics import with_work
from toolpoint.studies.machines.reduced_limits import estimate_of, question_reduction
from toolpoint.studies.machines.tool_point import milling_problem
from toolpoint.studies.machining.mesh_share import MeshError, widen_by_mesh
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.tool_tips import ToolTips
from toolpoint.vibration import Frf

SEARCHED_DEPTH_RATIO = 4.0  # of a group's depth, up to which a limit is looked for
MIN_SEARCHED_DEPTH = 5e-5  # m
CONTENT_VERSION = 2  # of what kept solutions hold: raised where it changes
MAX_KEPT_INTERVALS = 12  # stable ones of a cut: the lowest


@dataclass(eq=False)
class StabilitySolver:
    """Solver of single cuts; the problem of each tool and pose is kept.

    dynamics : of every pose; tips : of tools that have a response of their own; work : of the work at every pose where it gives
    way, none where it is rigid; mesh_error : of the frequencies of the work, where
    it is known.
    """

    setup: MachiningSetup
    dynamics: Sequence[ToolDynamics]
    tips: ToolTips = field(default_factory=ToolTips)
    work: Sequence[ToolDynamics] = ()
    mesh_error: MeshError | None = None

    def __post_init__(self) -> None:
        self._tips: dict[tuple[int, int], ToolDynamics] = {}
        self._problems: dict[tuple[int, int], MillingProblem] = {}
        self._estimates: dict[tuple[int, int], ReductionEstimate | None] = {}
        self.solutions = 0

    @property
    def identity(self) -> str:
        """Key of this solver among others: the cuts and the dynamics of every pose."""
        digest = hashlib.sha256(repr((CONTENT_VERSION, self.setup.cut, sorted(self.setup.cuts.items()),
                                     self.tips.identity)).encode())
        if self.mesh_error is not None:
            digest.update(np.stack([self.mesh_error.frequency, self.mesh_error.error]).tobytes())
        for each in (*self.dynamics, *self.work):
            response = each.response
            arrays = (response.frequency, response.values) if isinstance(response, Frf) else (
                response.frequency, response.damping_ratio, response.shape)
            for array in arrays:
                digest.update(np.ascontiguousarray(array).tobytes())
            digest.update(repr((each.x, each.y, None if each.machine is None else each.machine.description,
                                each.pose)).encode())
        return digest.hexdigest()

    def dynamics_of(self, tool: int, pose: int) -> ToolDynamics:
        """Return the dynamics of a tool at a pose."""
        if (tool, pose) not in self._tips:
            self._tips[tool, pose] = self.beside_work(self.tips.dynamics_of(tool, self.dynamics[pose]), pose)
        return self._tips[tool, pose]

    def beside_work(self, tip: ToolDynamics, pose: int) -> ToolDynamics:
        """Return the dynamics of a tip with those of the work at a pose, the tip's own where the work is rigid."""
        return with_work(tip, self.work[pose]) if self.work else tip

    @property
    def is_isotropic(self) -> bool:
        """Whether no tool answers otherwise along x than along y, so that the direction of feed plays no part."""
        tips = (self.dynamics[0], *self.tips.struck.values())
        return not self.work and not self.tips.shafts and all(each.y == "same" for each in tips)

    def problem(self, tool: int, pose: int) -> MillingProblem:
        """Return the milling problem of a tool at a pose."""
        if (tool, pose) not in self._problems:
            dynamics = self.dynamics_of(tool, pose)
            problem = milling_problem(self.setup.cut_of(tool), dynamics.response, dynamics.x, y=dynamics.y)
            if dynamics.at_speed is not None:
                problem = problem.changed(dynamics=dynamics.at_speed)
            self._problems[tool, pose] = problem
        return self._problems[tool, pose]

    def chart(self, tool: int, pose: int, arc: tuple[float, float], *, angle: float, speeds: FloatArray, depth: float
              ) -> StabilityChart:
        """Return the chart of a cut up to several times its depth; its errors hold the reduction of elastic bodies and the
        mesh of the work."""
        problem = self.problem(tool, pose).changed(engagement=Engagement(*arc), feed_angle=angle)
        self.solutions += len(speeds)
        deepest = max(SEARCHED_DEPTH_RATIO * depth, MIN_SEARCHED_DEPTH)
        chart = stability.chart(problem, speeds, depth_max=deepest)
        if self.work and self.mesh_error is not None:
            chart = widen_by_mesh(chart, problem, self.work[pose], error=self.mesh_error, depth=depth)
        dynamics = self.dynamics_of(tool, pose)
        machine, place = dynamics.machine, dynamics.pose
        if (tool, pose) not in self._estimates:
            self._estimates[tool, pose] = estimate_of(machine, place, problem)
        estimate = self._estimates[tool, pose]
        reduced = None if estimate is None else question_reduction(machine, place, problem, chart=chart, estimate=estimate)
        return chart if reduced is None else reduced.widen(chart)

    def __call__(self, point: Sequence[float]) -> dict[str, FloatArray]:
        """Return limit, error, frequency, stable intervals and boundaries (m, Hz) of one cut.

        point : tool, pose, entry, exit, direction of feed (rad), speed (rev/min), depth (m).
        """
        tool, pose, entry, leave, angle, speed, depth = point
        chart = self.chart(int(tool), int(pose), (entry, leave), angle=angle, speeds=np.array([speed]), depth=depth)
        boundary = int(chart.limit_points()[0])
        intervals = np.full((MAX_KEPT_INTERVALS, 2), np.nan)
        stable = chart.intervals(0)[:MAX_KEPT_INTERVALS]
        intervals[:len(stable)] = stable
        return {"limit": chart.limit[0], "intervals": intervals, "boundaries": np.array(chart.depth),
                "error": np.array(chart.error[boundary] if boundary >= 0 else 0.0),
                "frequency": np.array(chart.frequency[boundary] if boundary >= 0 else np.nan)}
