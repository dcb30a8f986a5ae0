"""The stability verbs: one problem type, several methods, one result."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem, checked_speeds, coverage
from toolpoint.cutting.stability.methods.zero_order import ZeroOrder
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmMethod, WarmStart

Problem = MillingProblem | TurningProblem
NEED_MODES = ("PanelArnoldi", "Collocation", "SemiDiscretization", "FullDiscretization")


class Method(Protocol):
    """What a stability method offers."""

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float) -> StabilityChart:
        """Return the chart of a checked problem."""
        ...


def chart(
    problem: Problem, speeds: FloatArray, method: Method | None = None, depth_max: float = 0.01,
    warm: WarmStart | None = None,
) -> StabilityChart:
    """Return the stable depth intervals at every spindle speed.

    Parameters
    ----------
    problem : MillingProblem or TurningProblem
    speeds : (n,) floats
        Spindle speeds, rev/min, above zero.
    method : method object, optional
        `ZeroOrder` and others; chosen to suit the problem where left out (`default_method`).
    depth_max : float
        Largest depth of cut looked at, m.
    warm : WarmStart, optional
        What the chart of a near problem left (a neighbouring pose, say), for this one to begin with and to bring up to
        date. Methods that cannot use it begin cold.

    Returns
    -------
    StabilityChart

    Raises
    ------
    ToolpointError
        For speeds or depths of zero, or where the method does not suit the problem.

    Warns
    -----
    ToolpointWarning
        Where a measured FRF does not cover the chatter band; the remark is also in the chart's notes.
    """
    if not isinstance(problem, (MillingProblem, TurningProblem)):
        fail("problem", type(problem).__name__, "must be a MillingProblem or a TurningProblem")
    n = checked_speeds(speeds)
    depth_max = positive("depth_max", depth_max, 10.0)
    remarks = coverage(problem, n)
    if method is None:
        method = default_method(problem)
    if isinstance(problem, MillingProblem) and problem.plane.is_modal and str(method).startswith(NEED_MODES):
        remarks = (*remarks, *problem.plane.with_modal_residual().notes[len(problem.plane.notes):])
    if warm is not None and isinstance(method, WarmMethod):
        found = method.solve_warm(problem, np.asarray(n), depth_max, warm)
    else:
        found = method.solve(problem, np.asarray(n), depth_max)
    return found.noted(*remarks, *([] if found.status == "complete" else [found.status]))


def default_method(problem: Problem) -> Method:
    """Return the method that suits a problem: HillDeterminant for a measured FRF; for modes FloquetDeterminant where it
    applies (at low speeds PanelArnoldi where that is much faster, see `Automatic`), PanelArnoldi for everything else."""
    from toolpoint.cutting.stability.automatic import Automatic
    from toolpoint.cutting.stability.floquet.method import FloquetDeterminant
    from toolpoint.cutting.stability.hill.method import HillDeterminant
    from toolpoint.cutting.stability.panels.method import PanelArnoldi

    if isinstance(problem, TurningProblem):
        return ZeroOrder()
    if not problem.plane.is_modal:
        return HillDeterminant()
    if problem.tool.is_cylinder and problem.process_damping == 0 and problem.speed_variation is None:
        return FloquetDeterminant() if np.abs(problem.plane.static).max() > 0 else Automatic()
    return PanelArnoldi()
