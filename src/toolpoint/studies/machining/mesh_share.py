"""Share of a limit that the mesh of a yielding work may change: it enters the stated error of the limit.

Each frequency of the work errs by about a share that two meshes tell. All are lowered together by parts of their shares, up to
twice them, as between two of them the flank of a lobe may turn; modal masses stay. Where the depth that is cut is near
the limit, the exact engine gives the changes: the single-frequency solution shows half of them at small immersion. Elsewhere
that one gives them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import MillingProblem, StabilityChart, stability
from toolpoint.cutting.stability.drawn_response import rough_limits
from toolpoint.cutting.stability.method import with_plane
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.vibration import Modes

MAX_MESH_SHARE = 2.0  # of a limit: largest stated change
NEAR_LIMIT_RATIO = 2.5  # of depth and limit, within which the exact engine gives the changes
MIN_MESH_ERROR = 1e-5  # relative error of a frequency below which its effect on limits is left out
_ERROR_FACTORS = (0.5, 1.0, 1.5, 2.0)  # of the errors by which frequencies are lowered
_MAX_POLE_DISTANCE = 1e-3  # relative distance of a pole from the work's mode that it is
_NEIGHBOUR_RANGE = 0.1  # relative distance of modes of two meshes, within which the largest of their errors counts


@dataclass(frozen=True, eq=False)
class MeshError:
    """Relative errors (k,) of frequencies (k,), Hz, of a work, as two meshes tell them at some of its stages."""

    frequency: FloatArray
    error: FloatArray

    def at(self, frequency: FloatArray) -> FloatArray:
        """Return the errors of frequencies (n,): the largest of those nearby, else that of the nearest."""
        distance = np.abs(np.log(frequency[:, None] / self.frequency[None, :]))
        nearby = np.where(distance < _NEIGHBOUR_RANGE, self.error, 0.0).max(axis=1)
        return np.where(nearby > 0, nearby, self.error[distance.argmin(axis=1)])


def widen_by_mesh(chart: StabilityChart, problem: MillingProblem, work: ToolDynamics, *, error: MeshError, depth: float
                  ) -> StabilityChart:
    """Return a chart with the effect of the mesh of the work in the errors of its boundary points.

    work : dynamics of the work alone, modes; depth : that is cut, m. Lines are left as they are.
    """
    if not problem.plane.is_modal or not isinstance(work.response, Modes):
        return chart
    share = mesh_share(chart, problem, work.response, error=error, depth=depth)
    return replace(chart, error=chart.error + chart.depth * share[chart.index])


def mesh_share(chart: StabilityChart, problem: MillingProblem, work: Modes, *, error: MeshError, depth: float) -> FloatArray:
    """Return the largest relative change of the limit at every speed of a chart, (n,), at most `MAX_MESH_SHARE`."""
    shares = _errors_of_poles(problem, work, error)
    if shares.max(initial=0.0) < MIN_MESH_ERROR:
        return np.zeros(chart.speeds.size)
    lowered = [_lowered(problem, factor * shares) for factor in _ERROR_FACTORS]
    middle = rough_limits(problem, chart.speeds, chart.depth_max)
    share = np.max([np.abs(rough_limits(each, chart.speeds, chart.depth_max) / middle - 1) for each in lowered], axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        judged = np.flatnonzero(np.abs(np.log(chart.limit / depth)) < np.log(NEAR_LIMIT_RATIO))
    if judged.size:
        exact = [stability.chart(each, chart.speeds[judged], depth_max=chart.depth_max).limit for each in lowered]
        # A limit that leaves the searched depths has changed as far as these reach.
        changes = np.abs(np.minimum(exact, chart.depth_max) / chart.limit[judged] - 1)
        share[judged] = changes.max(axis=0)
    return np.asarray(np.minimum(share, MAX_MESH_SHARE))


def _errors_of_poles(problem: MillingProblem, work: Modes, error: MeshError) -> FloatArray:
    """Return the error of every pole, (n,); zero for those that are no mode of the work."""
    frequency = np.abs(problem.plane.poles) / (2 * np.pi)
    distance = np.abs(frequency[:, None] / work.frequency[None, :] - 1).min(axis=1)
    return np.where(distance < _MAX_POLE_DISTANCE, error.at(frequency), 0.0)


def _lowered(problem: MillingProblem, share: FloatArray) -> MillingProblem:
    """Return the problem with its frequencies lower by shares (n,), damping ratios and modal masses as they are."""
    plane, factor = problem.plane, 1 - share
    residues = plane.residues / factor.reshape(-1, *[1] * (plane.residues.ndim - 1))
    lowered = with_plane(problem, replace(plane, poles=plane.poles * factor, residues=residues))
    assert isinstance(lowered, MillingProblem)
    return lowered
