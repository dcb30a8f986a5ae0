"""Lowest limit between the charted speeds: the minimum of a chart depends on its grid, this one does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.stability.compute import chart as chart_at
from toolpoint.cutting.stability.method import Problem, StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart

# Of every round: local minima looked at, at most, and how far above the least they may lie; then speeds to either side of each.
REFINEMENT_ROUNDS = ((24, 1.2), (6, 1.03), (3, 1.01))
SPEEDS_PER_SIDE = 3
SPEED_SPACING_ERROR = 1e-4  # relative error of depth that the last distance of speeds leaves: up to 5e-5 on random cuts
MIN_SPEED_SPACING_RATIO = 1e-6  # relative distance of speeds between which no further one is looked at


@dataclass(frozen=True)
class LowestLimit:
    """Least limit over all speeds between the first and the last of a chart.

    depth : m, infinite where the chart has no limit; error : of `depth`, m, what the last refinement of the speed still changed
    and the method's own; speed : rev/min; frequency : of chatter, Hz.

    >>> print(LowestLimit(1.25e-3, 2e-6, 6400.0, 212.0))
    1.2500 mm ± 0.002 mm at 6400 rev/min
    """

    depth: float
    error: float
    speed: float
    frequency: float

    def __str__(self) -> str:
        if not np.isfinite(self.depth):
            return "no limit below the depths looked at"
        return f"{1e3 * self.depth:.4f} mm ± {1e3 * self.error:.1g} mm at {self.speed:.0f} rev/min"


def lowest_limit(problem: Problem, chart: StabilityChart, method: StabilityMethod | None = None) -> LowestLimit:
    """Return the least limit between the first and the last speed of a chart, refined about its lowest local minima.

    The stated error holds what the last round still changed, and what the minima that a round left out would gain if they
    gained in it and the later ones as much as the one that gained most. A lobe narrower than the steps of the chart that shows
    in none of its speeds is not seen.

    problem, method : those of the chart; chart : the chart, whose `depth_max` is the largest depth looked at here too.

    >>> from toolpoint.cutting import TurningProblem
    >>> from toolpoint.cutting.stability import chart
    >>> from toolpoint.vibration import Modes
    >>> zeta, stiffness, k_n = 0.05, 1e7, 1e9
    >>> w = 2 * np.pi * 100.0
    >>> problem = TurningProblem(k_n, Modes([100.0], [zeta], [[w / np.sqrt(stiffness)]], ["tool:+x"]))
    >>> limit = lowest_limit(problem, chart(problem, np.linspace(3000, 9000, 60), depth_max=0.01))
    >>> bool(np.isclose(limit.depth, 2 * stiffness * zeta * (1 + zeta) / k_n, rtol=1e-4))  # of one mode, Tlusty
    True
    """
    depths = np.minimum(chart.limit, chart.depth_max)
    if not np.isfinite(chart.limit).any():
        return LowestLimit(float("inf"), 0.0, float("nan"), float("nan"))
    order = np.argsort(chart.speeds)
    speeds, depths, best, step = chart.speeds[order], depths[order], _lowest_of(chart), 0.0
    left_out: list[float] = []
    gains: list[float] = []
    for minima_max, ratio_max in REFINEMENT_ROUNDS:
        minima = _local_minima(depths)
        chosen = minima[depths[minima] <= ratio_max * best.depth][:minima_max]
        left_out.append(depths[np.setdiff1d(minima, chosen)].min(initial=np.inf))
        fresh = np.unique(np.concatenate([_speeds_between(speeds, i) for i in chosen.tolist()]))
        if fresh.size == 0:
            break
        closer = chart_at(problem, fresh, method, depth_max=chart.depth_max)
        values = np.minimum(closer.limit, chart.depth_max)
        gains.append(max(1.0, *(_gain(speeds, depths, i, fresh, values) for i in chosen.tolist())))
        step = max(best.depth - float(values.min()), 0.0)
        best = min(best, _lowest_of(closer), key=lambda limit: limit.depth)
        order = np.argsort(np.concatenate([speeds, fresh]))
        speeds, depths = np.concatenate([speeds, fresh])[order], np.concatenate([depths, values])[order]
    error = best.error + step + SPEED_SPACING_ERROR * best.depth + max(best.depth - _least_left_out(left_out, gains), 0.0)
    return LowestLimit(best.depth, float(error), best.speed, best.frequency)


def _least_left_out(left_out: list[float], gains: list[float]) -> float:
    """Return how deep the minima that a round left out may reach, had they gained in it and later what the others gained."""
    to_come = np.cumprod(gains[::-1])[::-1]
    reach = [depth / gain for depth, gain in zip(left_out, [*to_come, 1.0], strict=False)]
    return min(reach, default=np.inf)


def _local_minima(depths: FloatArray) -> Array:
    """Return the places of local minima, lowest first."""
    padded = np.concatenate([[np.inf], depths, [np.inf]])
    places = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]))
    return places[np.argsort(depths[places], kind="stable")]


def _speeds_between(speeds: FloatArray, i: int) -> FloatArray:
    """Return speeds between a place and its neighbours, none of which is one of them."""
    lower, centre, upper = speeds[max(i - 1, 0)], speeds[i], speeds[min(i + 1, speeds.size - 1)]
    sides = [np.linspace(a, b, SPEEDS_PER_SIDE + 2)[1:-1] for a, b in ((lower, centre), (centre, upper))
             if b - a > MIN_SPEED_SPACING_RATIO * b]
    return np.concatenate(sides) if sides else np.zeros(0)


def _gain(speeds: FloatArray, depths: FloatArray, i: int, fresh: FloatArray, values: FloatArray) -> float:
    """Return by what factor the depth at a place was larger than the least beside it now."""
    lower, upper = speeds[max(i - 1, 0)], speeds[min(i + 1, speeds.size - 1)]
    neighbours = values[(fresh > lower) & (fresh < upper)]
    return float(depths[i] / max(neighbours.min(initial=np.inf), 1e-300)) if neighbours.size else 1.0


def _lowest_of(chart: StabilityChart) -> LowestLimit:
    limit = chart.limit
    index = int(np.argmin(limit))
    point = int(chart.limit_points()[index])
    error, frequency = (0.0, float("nan")) if point < 0 else (float(chart.error[point]), float(chart.frequency[point]))
    return LowestLimit(float(limit[index]), error, float(chart.speeds[index]), frequency)
