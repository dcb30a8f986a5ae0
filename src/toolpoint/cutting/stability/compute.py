"""The stability verb: one problem type, several methods, one result."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint._threads import on_one_thread
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem, check_speeds, coverage
from toolpoint.cutting.stability.automatic import Automatic, default_method
from toolpoint.cutting.stability.drawn_response import with_drawn_limits
from toolpoint.cutting.stability.hill.hysteresis import lead_to_response
from toolpoint.cutting.stability.method import Problem, StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.static_part import end_at, limit_static_part
from toolpoint.cutting.stability.warm_start import WarmStart


@on_one_thread
def chart(
    problem: Problem, speeds: FloatArray, method: StabilityMethod | None = None, *, depth_max: float = 0.01,
    warm: WarmStart | None = None,
) -> StabilityChart:
    """Return the stable depth intervals at every spindle speed.

    Parameters
    ----------
    problem : MillingProblem or TurningProblem
    speeds : (n,) floats
        Spindle speeds, rev/min, above zero.
    method : method object, optional
        `ZeroOrder` and others; chosen to suit the problem where left out (`Automatic`).
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
        For speeds or depths of zero, for a response of zeros, or where the method does not suit the problem.

    Warns
    -----
    ToolpointWarning
        Where a measured FRF does not cover the chatter band; the remark is also in the chart's notes.

    Examples
    --------
    The least stable width of orthogonal cutting of one mode is 2 k z (1 + z)/K_f, at the speeds of `lobe_tips`:

    >>> import numpy as np
    >>> from toolpoint.cutting import StabilityChart, TurningProblem, ZeroOrder
    >>> from toolpoint.cutting.stability.methods.turning import least_width, lobe_tips
    >>> from toolpoint.vibration import Dof, Modes
    >>> k, f, z = 2e7, 200.0, 0.03
    >>> modes = Modes([f], [z], [[2 * np.pi * f / np.sqrt(k)]], [Dof("tool", "+x")])
    >>> result = chart(TurningProblem(stiffness=1e9, dynamics=modes), lobe_tips(f, z, 3), ZeroOrder(), depth_max=0.01)
    >>> isinstance(result, StabilityChart), bool(np.allclose(result.limit, least_width(k, z, 1e9), rtol=1e-6))
    (True, True)
    """
    if not isinstance(problem, (MillingProblem, TurningProblem)):
        fail("problem", type(problem).__name__, "must be a MillingProblem or a TurningProblem")
    if method is not None and not (hasattr(method, "solve") and not isinstance(method, type)):
        name = method if isinstance(method, str) else getattr(method, "__name__", type(method).__name__)
        fail("method", repr(name), "must be a method object such as ZeroOrder() or FloquetDeterminant()",
             remedy="a name becomes one with method_named(name); leave it out for the one that suits the cut")
    n = check_speeds(speeds)
    depth_max = positive("depth_max", depth_max, 10.0)
    _check_motion(problem)
    remarks = coverage(problem, n)
    chosen = Automatic() if method is None else method
    end = limit_static_part(problem) if isinstance(problem, MillingProblem) else float("inf")
    result = chosen.solve(problem, np.asarray(n), min(depth_max, end), warm=warm)
    if isinstance(problem, MillingProblem) and problem.plane.is_hysteretic and not chosen.takes_response:
        result = lead_to_response(result, problem)
    if end < depth_max and isinstance(problem, MillingProblem):
        result = end_at(result, problem, end, depth_max=depth_max)
    if problem.plane.draws is not None:
        result = with_drawn_limits(result, problem, default_method(problem) if method is None else method)
    return result.noted(*remarks, *([] if result.search == "complete" else [result.search]), *result.doubts)


def _check_motion(problem: Problem) -> None:
    """Refuse a response that is zero at every line or in every mode: such a cut has no limit, and labels are at fault."""
    plane = problem.plane
    motion = plane.residues if plane.is_modal else plane.lines[1]
    if motion.size and not motion.any():
        fail("dynamics", "a response of zeros", "must move the tool in a direction of the cut",
             remedy="check the labels of the directions, and the shapes there")
