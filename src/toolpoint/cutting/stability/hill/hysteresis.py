r"""Boundary points of a structure with structural damping, led from its causal equivalent to its own response.

Engines that march in time solve an equivalent of structural damping that is equal at the resonances and differs between them
(`PlaneDynamics.hysteresis`). Limits moved by up to 12 % on random machines where harmonics of the cut lie far below a
resonance. Hill's determinant takes any response, so every boundary point is the start of Newton's method in (theta, depth) on
the response itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.hill.response import HarmonicResponse
from toolpoint.cutting.stability.result import REAL_ANGLE_TOLERANCE, StabilityChart, assemble_chart

if TYPE_CHECKING:
    from toolpoint.cutting.stability.hill.system import HillSystem

Row = tuple[float, float, float, int, float]  # depth m, theta rad, chatter frequency Hz, change, error m

MAX_LED_ROWS = 400  # rows of the matrix up to which points are moved: beyond, each takes more than a second
MIXED_DAMPING_ERROR = 1e-4  # of a depth: with viscous and structural damping the response is interpolated between lines
MAX_DEPTH_SHIFT_RATIO = 0.3  # share of a depth by which a point may move and still be the same point
UNREFINED_SAFETY_FACTOR = 1.5  # on the estimate where a point cannot be led
NOTE = "structural damping: boundary points led from its equivalent in time to the response itself by Hill's determinant"


def lead_to_response(chart: StabilityChart, problem: MillingProblem) -> StabilityChart:
    """Return a chart of the causal equivalent with its points moved to those of the response with structural damping.

    A speed with a point that has no root near is solved anew by `HillDeterminant`, and so is one without a point whose response
    has unstable multipliers at the largest depth: its limit moved up to there. Where that cannot be (too large a matrix,
    speed variation) points stay and state the estimated distance: the depth times the largest difference of both responses at
    a harmonic, over the response at the chatter frequency.
    """
    rows: list[tuple[float, ...]] = []
    estimated = 0
    for i in range(chart.speeds.size):
        led = _lead_points(problem, chart, i)
        if led is None:
            led = [_keep_point(problem, chart, p) for p in chart.points(i).tolist()]
            estimated += len(led)
        rows += [(i, *row) for row in led if row[0] <= chart.depth_max]
    note = NOTE if not estimated else f"{NOTE}; {estimated} of {len(rows)} points stay, their errors hold how far they may move"
    return assemble_chart(chart.speeds, chart.depth_max, np.array(rows, float).reshape(-1, 6).T,
                          unstable_at_zero=chart.unstable_at_zero, method=chart.method, notes=(*chart.notes, note),
                          search=chart.search)


def _lead_points(problem: MillingProblem, chart: StabilityChart, index: int) -> list[Row] | None:
    """Return the points of a speed on the response itself, None where the matrix is too large or the speed varies."""
    from toolpoint.cutting.stability.hill.system import HillSystem  # brings the compiler, which few callers need

    speed = float(chart.speeds[index])
    plane = problem.plane_at(speed).with_modal_residual()
    response = HarmonicResponse.of(plane, HillDeterminant().reach, problem.tool.teeth * speed / 60)
    if problem.speed_variation is not None or HillSystem.rows(problem, speed, response) > MAX_LED_ROWS:
        return None
    system = HillSystem(problem, speed, response)
    if not np.isfinite(chart.limit[index]) and _count_unstable(system, chart.depth_max) != _count_after(chart, index):
        return _solve_again(problem, speed, chart.depth_max)
    rows = []
    for p in chart.points(index).tolist():
        row = _root_near(system, chart, p)
        # Had one point no root near, the response has other lobes than its equivalent: following the rest would miss some.
        if row is None:
            return _solve_again(problem, speed, chart.depth_max)
        rows.append(row)
    return rows


def _count_unstable(system: HillSystem, depth: float) -> int:
    """Return the number of unstable multipliers at a depth (m) on the response itself."""
    from toolpoint.cutting.stability.hill.search import HillSearch

    return HillSearch(system, HillDeterminant().base, np.array([depth])).count(depth)[0]


def _count_after(chart: StabilityChart, index: int) -> int:
    """Return the number of unstable multipliers of a chart beyond its last point at a speed."""
    return int(chart.unstable_at_zero[index] + chart.change[chart.points(index)].sum())


def _root_near(system: HillSystem, chart: StabilityChart, point: int) -> Row | None:
    """Return (depth, theta, frequency, change, error) of the root that a point leads to, None where there is no such root."""
    start, theta, change = float(chart.depth[point]), float(chart.theta[point]), int(chart.change[point])
    # A flip or fold stays at its angle: led as a pair it would split into two points beside it.
    real_angle = np.pi * round(theta / np.pi)
    is_real = abs(theta - real_angle) < REAL_ANGLE_TOLERANCE
    root = system.root(real_angle if is_real else theta, start, real=is_real)
    if root is None or root.change != change or abs(root.depth - start) > MAX_DEPTH_SHIFT_RATIO * start:
        return None
    angle, depth, error = system.corrected(root)
    return (depth, min(abs(angle), 2 * np.pi - angle), float(chart.frequency[point]), change,
            float(chart.error[point]) + error + _mixed_error(system.problem) * depth)


def _solve_again(problem: MillingProblem, speed: float, depth_max: float) -> list[Row] | None:
    """Return the points of a speed (rev/min) solved without a start, None where `HillDeterminant` refuses the cut."""
    method = HillDeterminant()
    if method.refuses(problem):
        return None
    fresh = method.solve(problem, np.array([speed]), depth_max)
    return list(zip(fresh.depth.tolist(), fresh.theta.tolist(), fresh.frequency.tolist(), fresh.change.tolist(),
                    (fresh.error + _mixed_error(problem) * fresh.depth).tolist(), strict=True))


def _mixed_error(problem: MillingProblem) -> float:
    """Return `MIXED_DAMPING_ERROR` where the plane keeps lines of the difference, else zero."""
    return 0.0 if problem.plane.deviation is None else MIXED_DAMPING_ERROR


def _keep_point(problem: MillingProblem, chart: StabilityChart, point: int) -> Row:
    """Return a point as it is, its error widened by 1.5 times the estimated distance."""
    depth, theta, frequency, error = (float(getattr(chart, name)[point]) for name in ("depth", "theta", "frequency", "error"))
    return depth, theta, frequency, int(chart.change[point]), error + UNREFINED_SAFETY_FACTOR * _estimate(problem, chart, point)


def _estimate(problem: MillingProblem, chart: StabilityChart, point: int) -> float:
    """Return how far (m) a point may be from that of the response: by the largest difference at its harmonics."""
    plane, speed = problem.plane, float(chart.speeds[chart.index[point]])
    tooth = problem.tool.teeth * speed / 60
    chatter = float(chart.frequency[point])
    # Two tooth passings above the chatter frequency, and all harmonics below it.
    harmonics = np.abs(chatter + tooth * np.arange(-int(chatter / tooth) - 1, 3))
    lacking = np.linalg.norm(plane.hysteresis(harmonics), ord=2, axis=(-2, -1)).max()
    size = np.linalg.norm(plane.response(np.array([chatter])), ord=2, axis=(-2, -1))[0]
    return float(chart.depth[point] * lacking / max(float(size), 1e-300))
