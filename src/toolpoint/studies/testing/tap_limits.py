"""Depth limits of a tapped tool with their intervals, and three speeds to use that stay stable also a little beside them.

A rough chart of many speeds (single-frequency solution) says where to look; limits at some speeds, at the least one, and at and
beside the speeds to use are exact. What the scatter of responses and coefficients does to limits is drawn in closed form.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointWarning
from toolpoint.cutting import MillingProblem, StabilityChart, stability
from toolpoint.cutting.stability import method_named
from toolpoint.studies.cuts.described_cut import build_problem
from toolpoint.studies.cuts.lobes_study import end_words
from toolpoint.studies.machines.tool_point import depth_limit
from toolpoint.studies.testing.tap_dynamics import (
    ASSUMED_DAMPING_DEVIATION,
    ASSUMED_FREQUENCY_DEVIATION,
    ASSUMED_SIZE_DEVIATION,
    TappedTip,
)

# draws; speeds of the exact chart; of the rough one; of which draws take every fourth
LIMIT_DRAWS, EXACT_SPEEDS, ROUGH_SPEEDS, DRAW_STRIDE = 80, 36, 400, 4
CHARTED_MINIMA = 12  # of the rough chart, added to the exact one
COEFFICIENT_DEVIATION = 0.1  # relative standard deviation of cutting coefficients from a table
INTERVAL_LEVELS = [0.025, 0.975]  # ends of a 95 % interval
# relative: margins of speed and depth; distance of speeds to use
SPEED_MARGIN, DEPTH_MARGIN, MIN_SPEED_DISTANCE = 0.02, 0.1, 0.08
DEPTH_RANGE_FACTOR = 3  # depth of the charts over the estimate of the lowest limit
MAX_SPEEDS_TO_USE, MAX_TRIED_SPEEDS = 3, 6  # how many are given, how many are looked at for them
MIN_USEFUL_DEPTH_RATIO = 0.8  # of the least depth, from which a speed is of use: depth margin and error of the rough chart
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class SpeedToUse:
    """Spindle speed to use, with its depth.

    speed : rev/min; depth : stable there and beside it with 95 % certainty, less a tenth, m; chatter : frequency of deeper
    cuts, Hz; worth : removal rate over that of the best.
    """

    speed: float
    depth: float
    chatter: float
    worth: float


@dataclass(frozen=True, eq=False)
class TapLimits:
    """Limits of a tapped tool, and speeds to use.

    chart : exact; rough : of more speeds; low, high : ends of the 95 % interval of the exact limits over them, ratios;
    lowest_ratios : those of the least limit of all speeds, which drawn tips have at other speeds.
    """

    chart: StabilityChart
    rough: StabilityChart
    low: FloatArray
    high: FloatArray
    lowest_ratios: tuple[float, float]
    speeds: tuple[SpeedToUse, ...]
    notes: tuple[str, ...]
    problem: MillingProblem

    @property
    def lowest(self) -> tuple[float, float, float, float]:
        """Least charted limit (m), the ends of its interval, and its speed."""
        k = int(np.argmin(self.chart.limit))
        limit = float(min(self.chart.limit[k], self.chart.depth_max))
        error = float(self.chart.limit_error[k])
        lower, upper = self.lowest_ratios
        return limit, (limit - error) * lower, (limit + error) * upper, float(self.chart.speeds[k])


def chart_limits(tip: TappedTip, values: Mapping[str, Any], *, speeds: tuple[float, float] | None, rng: np.random.Generator,
                 progress: Progress) -> TapLimits:
    """Return the limits of a cut on the modes of a tapped tip, with intervals and speeds to use."""
    problem, cut, notes = build_problem(tip.dynamics(), values)
    ends = cut.speeds if speeds is None else speeds
    fine = np.linspace(*ends, ROUGH_SPEEDS)
    progress("rough stability", 0, 1)
    end, why = cut.depth_end
    depth = min(DEPTH_RANGE_FACTOR * depth_limit(problem), end)
    rough = _chart_roughly(problem, fine, depth)
    progress(f"intervals of {LIMIT_DRAWS} draws", 0, 1)
    ratios, least_ratios = _draw_limit_ratios(tip, problem, rough, depth, rng)
    lower, upper = np.quantile(ratios, INTERVAL_LEVELS, axis=0, method="weibull")
    lower = np.minimum(lower, 1.0)  # where the search ended below the limit, draws look beyond it
    # At the speed of the least limit draws scatter to both sides; their least limits are those of other speeds then, and lower.
    least_lower, least_upper = np.quantile(least_ratios, INTERVAL_LEVELS, method="weibull").tolist()
    charted = np.unique(np.append(np.linspace(*ends, EXACT_SPEEDS), _lowest_places(rough)))
    progress(f"exact stability at {charted.size} speeds", 0, 1)
    chart = stability.chart(problem, charted, depth_max=depth)
    notes += ["interval: scatter of the hits in poles and sizes of the modes (one number for all sizes, the widest case), "
              f"either sign of cross responses of modes that x and y share, and cutting coefficients known to "
              f"{100 * COEFFICIENT_DEVIATION:.0f} % (assumed); not in it: clamping the tool anew, wear, another feed"]
    if not tip.is_known:
        notes.append(f"no scatter of the responses is known: {100 * ASSUMED_SIZE_DEVIATION:.0f} % of their size, "
                     f"{100 * ASSUMED_FREQUENCY_DEVIATION:.0f} % of "
                     f"frequency and {100 * ASSUMED_DAMPING_DEVIATION:.0f} % of damping are assumed")
    progress("speeds to use", 0, 1)
    picked, left_out = _speeds_to_use(problem, rough, lower, depth)
    if left_out:
        notes.append(f"speeds to use: {left_out} looked promising on the rough chart and {'is' if left_out == 1 else 'are'} "
                     "left out: the exact limit there, less its stated error, is below what is stable at every speed")
    return TapLimits(chart, rough, np.interp(charted, fine, lower), np.interp(charted, fine, upper),
                     (min(least_lower, 1.0), least_upper), picked,
                     tuple(dict.fromkeys([*end_words(chart, end, why), *notes, *chart.notes])), problem)


def _lowest_places(rough: StabilityChart) -> FloatArray:
    """Return the speeds of the lowest local minima of a rough chart: the least limit lies at one of them."""
    padded = np.concatenate([[np.inf], rough.limit, [np.inf]])
    minima = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
    return rough.speeds[minima[np.argsort(rough.limit[minima], kind="stable")][:CHARTED_MINIMA]]


def _chart_roughly(problem: MillingProblem, speeds: FloatArray, depth: float) -> StabilityChart:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)  # of the rough chart; those of the exact one are kept
        return stability.chart(problem, speeds, method_named("zero-order", "method"), depth_max=depth)


def _draw_limit_ratios(tip: TappedTip, problem: MillingProblem, rough: StabilityChart, depth: float, rng: np.random.Generator
                       ) -> tuple[FloatArray, FloatArray]:
    """Return drawn limits over the middle ones (n_draws, n_speeds), by rough charts of drawn tips and coefficients, and drawn
    least limits over the middle least one (n_draws,).
    """
    some = rough.speeds[::DRAW_STRIDE]
    middle = np.minimum(rough.limit, depth)[::DRAW_STRIDE]
    ratios, least_ratios = [], []
    for _ in range(LIMIT_DRAWS):
        dynamics, law = tip.drawn(rng), problem.coefficients
        kt, kn = np.exp(COEFFICIENT_DEVIATION * rng.standard_normal(2))
        drawn = problem.changed(dynamics=dynamics.response, coefficients=replace(law, kt=law.kt * kt, kn=law.kn * kn))
        limit = np.minimum(_chart_roughly(drawn, some, 2 * depth).limit, 2 * depth)
        ratios.append(limit / middle)
        least_ratios.append(limit.min() / middle.min())
    return np.array([np.interp(rough.speeds, some, ratio) for ratio in ratios]), np.array(least_ratios)


def _speeds_to_use(problem: MillingProblem, middle: StabilityChart, lower: FloatArray, depth: float
                   ) -> tuple[tuple[SpeedToUse, ...], int]:
    """Return up to three speeds of the largest removal rate, and the number of speeds that the exact check refused.

    Each is checked by the exact method at itself and beside it: a speed is of no use where its depth is below that which is
    stable at every speed.
    """
    speeds = middle.speeds
    sure = np.minimum(middle.limit, middle.depth_max) * lower
    is_beside = np.abs(speeds[:, None] / speeds[None, :] - 1) <= SPEED_MARGIN
    rate = np.where(is_beside, sure[:, None], np.inf).min(axis=0) * speeds
    # the margin must be charted
    rate[(speeds * (1 - SPEED_MARGIN) < speeds[0]) | (speeds * (1 + SPEED_MARGIN) > speeds[-1])] = 0.0
    results: list[SpeedToUse] = []
    tried: list[int] = []
    for k in np.argsort(-rate).tolist():
        if len(results) == MAX_SPEEDS_TO_USE or len(tried) == MAX_TRIED_SPEEDS or not rate[k] > 0:
            break
        if all(abs(speeds[k] / speeds[j] - 1) > MIN_SPEED_DISTANCE for j in tried):
            tried.append(k)
            checked = _check_speed(problem, float(speeds[k]), float(lower[k]), depth)
            if checked.depth > MIN_USEFUL_DEPTH_RATIO * float(sure.min()):
                results.append(checked)
    best = max((speed.speed * speed.depth for speed in results), default=1.0)
    ranked = sorted(results, key=lambda speed: -speed.speed * speed.depth)
    return tuple(replace(speed, worth=speed.speed * speed.depth / best) for speed in ranked), len(tried) - len(results)


def _check_speed(problem: MillingProblem, speed: float, lower: float, depth: float) -> SpeedToUse:
    chart = stability.chart(problem, speed * np.array([1 - SPEED_MARGIN, 1.0, 1 + SPEED_MARGIN]), depth_max=depth)
    k = int(np.argmin(chart.sure_limit))
    point = int(chart.limit_points()[k])
    chatter = float("nan") if point < 0 else float(chart.frequency[point])
    return SpeedToUse(speed, float(chart.sure_limit[k]) * lower * (1 - DEPTH_MARGIN), chatter, 1.0)
