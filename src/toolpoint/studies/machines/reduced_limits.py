"""Error of limits by the reduction of elastic bodies and by their meshes, which enters the stated error.

Reduced bodies are too stiff: every natural frequency is too high by at most a stated share (`estimate_reduction`), and by
about another with coarse elements. Each mode in turn is lowered by both, its modal mass as it is, and its limits are solved by
the single-frequency solution; the sizes of the changes add up. Static flexibility beyond the modes is not in it. Where nothing
bounds a mode, the estimate counts up to `MAX_COUNTED_ERROR`; chatter at such frequencies is doubted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.cutting import MillingProblem, StabilityChart
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.stability.drawn_response import rough_limits
from toolpoint.cutting.stability.lowest import LowestLimit
from toolpoint.cutting.stability.method import with_plane
from toolpoint.machine.assembly.reduction_error import REDUCTION_SUBJECT
from toolpoint.machine.assembly.reduction_estimate import ReductionEstimate, can_estimate, estimate_reduction
from toolpoint.machine.parts.model import Machine

MIN_FREQUENCY_ERROR = 1e-7  # relative error of a frequency below which its effect on limits is left out
MAX_COUNTED_ERROR = 0.2  # relative error of a frequency, where the estimate is larger and bounds nothing
MAX_LIMIT_SHARE = 1.0  # of a limit: largest stated change
MAX_MATCH_DISTANCE = 0.05  # relative distance of a pole from the mode of the estimate that it is


@dataclass(frozen=True, eq=False)
class ReducedLimits:
    """Share of the limit at each speed (rev/min) that reduction and meshes may change, and what is to be said."""

    speeds: FloatArray
    share: FloatArray
    notes: tuple[str, ...] = ()

    def widen(self, chart: StabilityChart) -> StabilityChart:
        """Return the chart of these speeds with the share in the errors of its boundary points."""
        return replace(chart, error=chart.error + chart.depth * self.share[chart.index])

    def widen_lowest(self, lowest: LowestLimit) -> LowestLimit:
        """Return the lowest limit with the largest share of its neighbouring charted speeds in its error."""
        if not np.isfinite(lowest.depth):
            return lowest
        neighbours = np.argsort(np.abs(self.speeds - lowest.speed))[:2]
        return replace(lowest, error=lowest.error + lowest.depth * float(self.share[neighbours].max()))


def question_reduction(machine: Machine | None, pose: Mapping[str, float], problem: MillingProblem, *,
                       chart: StabilityChart, estimate: ReductionEstimate | None = None) -> ReducedLimits | None:
    """Return what reduced bodies leave open of a chart's limits at a pose; None without such bodies, and for lines.

    estimate : of the machine at the pose (`estimate_of`), where several charts share it.
    """
    estimate = estimate_of(machine, pose, problem) if estimate is None else estimate
    if estimate is None:
        return None
    error = _frequency_errors(problem.plane, estimate)
    share = np.zeros(chart.speeds.size)
    middle = rough_limits(problem, chart.speeds, chart.depth_max)
    for k in np.flatnonzero(error > MIN_FREQUENCY_ERROR).tolist():
        lowered = with_plane(problem, _with_lower_pole(problem.plane, k, float(error[k])))
        share += np.abs(rough_limits(lowered, chart.speeds, chart.depth_max) / middle - 1)
    return ReducedLimits(chart.speeds, np.minimum(share, MAX_LIMIT_SHARE), _notes(share, estimate, chart))


def estimate_of(machine: Machine | None, pose: Mapping[str, float], problem: MillingProblem) -> ReductionEstimate | None:
    """Return the estimate for the modes of a problem at a pose; None where no body is reduced, and for lines."""
    if machine is None or not problem.plane.is_modal or not can_estimate(machine):
        return None
    return estimate_reduction(machine, pose, modes=problem.plane.poles.size)


def _frequency_errors(plane: PlaneDynamics, estimate: ReductionEstimate) -> FloatArray:
    """Return by how much (relative) each pole's frequency may be too high, (n,); zero for poles that are no estimated mode."""
    mesh = np.zeros(estimate.frequency.size) if estimate.mesh is None else np.abs(estimate.mesh)
    error = np.minimum(np.nan_to_num(estimate.error, nan=MAX_COUNTED_ERROR), MAX_COUNTED_ERROR) + mesh
    frequency = np.abs(plane.poles) / (2 * np.pi)
    partner = np.argmin(np.abs(frequency[:, None] - estimate.frequency[None, :]), axis=1)
    is_same = np.abs(estimate.frequency[partner] / frequency - 1) < MAX_MATCH_DISTANCE
    return np.where(is_same, error[partner], 0.0)


def _with_lower_pole(plane: PlaneDynamics, index: int, error: float) -> PlaneDynamics:
    """Return the response with one frequency lower by a share, its damping ratio and modal mass as they are."""
    poles, residues = plane.poles.copy(), plane.residues.copy()
    poles[index] *= 1 - error
    residues[index] /= 1 - error
    return replace(plane, poles=poles, residues=residues)


def _notes(share: FloatArray, estimate: ReductionEstimate, chart: StabilityChart) -> tuple[str, ...]:
    said: list[str] = []
    if share.max(initial=0.0) > 0:
        said.append(f"elastic bodies are reduced: up to {100 * min(float(share.max()), 1.0):.2g} % of a limit are in its error "
                    "for it, and for the meshes where they are known")
    points = chart.limit_points()
    chatter = chart.frequency[points[points >= 0]]
    unbounded_count = int((chatter > estimate.sure_to).sum())
    if unbounded_count:
        said.append(Doubt(REDUCTION_SUBJECT, f"at {unbounded_count} of {chart.speeds.size} speeds chatter lies above "
                          f"{estimate.sure_to:.4g} Hz, up to which what reduction does is bounded: no stated error holds it",
                          "write a larger band for the elastic bodies"))
    return tuple(said)
