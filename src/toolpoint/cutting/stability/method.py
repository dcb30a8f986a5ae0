"""StabilityMethod: properties that every stability method states, and the check that a problem suits it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Protocol

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.cut.problem import MillingProblem, TurningProblem
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.cutting.stability.warm_start import WarmStart

Problem = MillingProblem | TurningProblem

# Reasons that several methods share, in the form of every message of the package: value; limit (remedy).
TURNING_REASON = "a TurningProblem; ZeroOrder is exact for it (use method=ZeroOrder() or leave it out)"
MEASURED_REASON = "a measured FRF; this method needs modes (identify modes, or use HillDeterminant())"

HEAVY_DAMPING_RATIO = 0.5  # above it a pole is heavily damped: its decay limits the engines, not its oscillation


class StabilityMethod(Protocol):
    """Solver of a cut for its stable depths: a small frozen object with its own tolerances.

    name : as `METHODS` and the command line write it.
    needs_modes : whether a measured FRF must be identified first.
    takes_response : whether it solves the response at frequencies; else the sum of modes, which is an equivalent of structural
        damping only, and its points are led to the response afterwards (`hill.hysteresis`).
    uses_warm : whether `solve` begins with what a near problem left.

    >>> from toolpoint.cutting.stability import method_named
    >>> method = method_named("hill")
    >>> method.takes_response, method.needs_modes  # solves a measured response as it is
    (True, False)
    """

    name: ClassVar[str]
    needs_modes: ClassVar[bool]
    takes_response: ClassVar[bool]
    uses_warm: ClassVar[bool]

    def refuses(self, problem: Problem) -> str | None:
        """Return why the method cannot solve this problem and what to use instead; None where it can."""
        ...

    def solve(self, problem: Problem, speeds: FloatArray, depth_max: float, *, warm: WarmStart | None = None
              ) -> StabilityChart:
        """Return the chart of speeds (rev/min, (n,)) up to `depth_max` (m); see `stability.chart`.

        A method that does not use `warm` begins cold whatever is given.
        """
        ...


def with_plane(problem: Problem, plane: PlaneDynamics) -> Problem:
    """Return the problem on another response, in the frame of the feed."""
    if isinstance(problem, MillingProblem):
        return problem.changed(dynamics=plane, feed_angle=0.0)
    return replace(problem, dynamics=plane)


def require_suited(method: StabilityMethod, problem: Problem) -> None:
    """Raise the method's reason where it refuses the problem."""
    reason = method.refuses(problem)
    if reason is not None:
        value, _, limit = reason.partition("; ")
        fail("problem", value, limit)


def require_milling(method: StabilityMethod, problem: Problem) -> MillingProblem:
    """Return the milling problem where the method takes it; raise its reason otherwise."""
    require_suited(method, problem)
    assert isinstance(problem, MillingProblem)  # of the two kinds of problem only ZeroOrder takes the other
    return problem


def decay_of_overdamped(problem: MillingProblem, speed: float) -> float:
    """Return the exponent by which the fastest heavily damped pole (real, or of a damping ratio above a half) decays in a tooth
    period (a revolution where teeth differ); 0 of none.

    What grows backwards in time by more than double precision holds leaves rounding alone.
    """
    poles = problem.plane.poles
    heavy = -poles.real > HEAVY_DAMPING_RATIO * np.abs(poles)
    if not heavy.any():
        return 0.0
    period = float(problem.tooth_period(speed)) if problem.tool.is_regular else 60 / speed
    return float(-poles.real[heavy].min()) * period


def refuse_overdamped(name: str, problem: MillingProblem, speeds: FloatArray, *, decay_max: float) -> None:
    """Refuse a problem whose heavily damped poles decay by more than `decay_max` (an exponent) in the longest tooth period."""
    lowest = float(np.min(speeds))
    decay = decay_of_overdamped(problem, lowest)
    if decay > decay_max:
        fail("dynamics", f"an overdamped mode that decays by exp(-{decay:.0f}) in a tooth period at {lowest:g} rev/min",
             f"must be at most exp(-{decay_max:.0f}) for {name}",
             remedy="use PanelArnoldi(), ZeroOrder() or SemiDiscretization() (--method panel, zero-order, "
                    "semi-discretization), or leave so stiff a damper out of the modes")
