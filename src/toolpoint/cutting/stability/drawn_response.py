r"""Limits of equally likely responses: what lines have in common moves the limit as a whole.

A stiffness that is known to 5 % moves a resonance on all lines together. Taken line by line, as independent noise, the same
variance is as large as the response itself beside a resonance, and the stated error of a limit about 100 % where 10 % is true.
So every draw of the response gets limits of its own by the single-frequency solution (milliseconds a draw), as a ratio to those
of the response itself by the same solution. Errors of that solution go from the ratio; where its limit is not that of the exact
chart (flip lobes of small engagements), some draws are charted exactly and the logarithms of all ratios are scaled by what
those scatter more or less.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import FloatArray, IndexArray, ToolpointError
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.method import Problem, StabilityMethod, with_plane
from toolpoint.cutting.stability.methods.zero_order import ZeroOrder
from toolpoint.cutting.stability.result import StabilityChart

MAX_CHARTED_DRAWS = 100  # draws whose limits are solved by the single-frequency solution
DRAWN_DEPTH_FACTOR = 2.0  # largest depth of the charts of draws over that of the chart
MAX_ROUGH_DIFFERENCE = 0.25  # of a limit: single-frequency against exact, above which ratios are scaled by exact draws
# Speeds and draws that are charted exactly for it, on measured lines; of modes all draws, at twice as many speeds.
MAX_EXACT_SPEEDS, EXACT_DRAW_COUNT = 8, 8
SCATTER_FACTOR_RANGE = (0.5, 8.0)  # of the scatter of exact draws over that of single-frequency ones
MIN_LOG_SCATTER = 1e-9  # of drawn limits, below which nothing is scaled
NOTE = ("the lines are uncertain together (draws of the response): errors of limits hold 95 % of the limits of {count} equally "
        "likely responses")


def with_drawn_limits(chart: StabilityChart, problem: Problem, method: StabilityMethod) -> StabilityChart:
    """Return a chart with the limits of the draws of its response, and with errors that hold 95 % of them.

    method : of the chart, for draws that are charted exactly.
    """
    draws = limit_ratios(problem, chart, method)
    chart = replace(chart, limit_draws=draws, notes=(*chart.notes, NOTE.format(count=len(draws))))
    lower, upper = chart.ratio_ends
    return replace(chart, error=chart.error + chart.depth * ((upper - lower) / 2)[chart.index])


def limit_ratios(problem: Problem, chart: StabilityChart, method: StabilityMethod) -> FloatArray:
    """Return the limit in every draw of the response over that of the response itself, (n_draws, n_speeds)."""
    plane = problem.plane
    count = 0 if plane.draws is None else min(len(plane.draws), MAX_CHARTED_DRAWS)
    drawn = [with_plane(problem, plane.at_draw(k)) for k in range(count)]
    return ratios_of(with_plane(problem, replace(plane, draws=None)), drawn, chart, method=method)


def ratios_of(problem: Problem, drawn: Sequence[Problem], chart: StabilityChart, *, method: StabilityMethod) -> FloatArray:
    """Return the limits of drawn problems over those of the problem that a chart is of, (n_draws, n_speeds)."""
    depth = DRAWN_DEPTH_FACTOR * chart.depth_max
    middle = rough_limits(problem, chart.speeds, depth)
    ratios = np.array([rough_limits(each, chart.speeds, depth) for each in drawn]) / middle
    exact = np.minimum(chart.limit, depth)
    # Where the chart ends below the limit there is nothing to compare with.
    unlike = np.flatnonzero(np.isfinite(chart.limit) & (np.abs(middle / np.maximum(exact, 1e-300) - 1) > MAX_ROUGH_DIFFERENCE))
    # Modes are charted in milliseconds a speed, lines in tenths of a second.
    count = len(drawn) if problem.plane.is_modal else EXACT_DRAW_COUNT
    return _scaled_by_exact(ratios, drawn[:count], chart, method=method, unlike=unlike)


def response_alone(problem: MillingProblem) -> MillingProblem:
    """Return the milling problem without the draws of its response; one without draws is returned as it is."""
    if problem.plane.draws is None:
        return problem
    return problem.changed(dynamics=replace(problem.plane, draws=None), feed_angle=0.0)


def rough_limits(problem: Problem, speeds: FloatArray, depth: float) -> FloatArray:
    """Return limits (m) by the single-frequency solution, at most `depth`; process damping of a mill is left out."""
    if isinstance(problem, MillingProblem):
        problem = problem.changed(process_damping=0.0)
    limit = ZeroOrder(states_line_error=False).solve(problem, speeds, depth).limit
    return np.asarray(np.clip(limit, 1e-6 * depth, depth))


def _scaled_by_exact(ratios: FloatArray, drawn: Sequence[Problem], chart: StabilityChart, *, method: StabilityMethod,
                     unlike: IndexArray) -> FloatArray:
    """Return ratios that follow exact charts at speeds `unlike`: at some of them as charted, beside these by their scatter.

    Where not all draws are charted exactly, the logarithms of the ratios are scaled to the scatter of those that are, with
    Student's factor for so few.
    """
    if not unlike.size or len(drawn) < 2:
        return ratios
    speed_count = MAX_EXACT_SPEEDS * (2 if len(drawn) == len(ratios) else 1)
    some = unlike[np.unique(np.linspace(0, unlike.size - 1, speed_count).astype(int))]
    depth = DRAWN_DEPTH_FACTOR * chart.depth_max
    try:
        exact = np.array([np.clip(method.solve(each, chart.speeds[some], depth).limit, 1e-6 * depth, depth) for each in drawn])
    except ToolpointError:  # twice the depth may be beyond what a method takes: the ratios stay as they are
        return ratios
    logs = np.log(exact / np.minimum(chart.limit[some], depth))
    # Intervals downstream multiply by 1.96: the factor makes them Student's for so few draws.
    student = float(scipy.special.stdtrit(len(drawn) - 1, 0.975) / scipy.special.ndtri(0.975))
    rough = np.log(ratios[:len(drawn), some]).std(axis=0)
    factor = np.clip(student * logs.std(axis=0) / np.maximum(rough, MIN_LOG_SCATTER), *SCATTER_FACTOR_RANGE)
    result = ratios.copy()
    result[:, unlike] = ratios[:, unlike] ** np.interp(unlike, some, factor)
    if len(drawn) == len(ratios):
        result[:, some] = np.exp(logs)
    return result
