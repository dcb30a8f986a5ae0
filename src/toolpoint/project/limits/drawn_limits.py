"""Limits of one cut over draws of system and coefficients: interval, chance that a cut is stable, shares of the sources."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting import StabilityChart, stability
from toolpoint.cutting.description import CuttingDescription
from toolpoint.project.limits.systems import DrawnSystems, Pose, coefficient_factors, problem_of
from toolpoint.studies.machines.reduced_limits import question_reduction
from toolpoint.studies.machines.tool_point import deep_chart

SEARCH_DEPTH_RATIO = 2.0  # depth to which draws are searched, over the nominal limit
GOAL_DEPTH_RATIO = 1.5  # the same over the depth asked about
MIN_SCATTER_DRAWS = 8  # from which the scatter of draws says how far beyond them a quantile lies
COEFFICIENTS_SOURCE = "cutting coefficients"


@dataclass(frozen=True)
class CutQuestion:
    """A cut asked about: its name and description, the relative deviation of its coefficients, speeds (rev/min) and pose.

    depth : m, of the cut that may be stable or not, None where only limits are wanted.
    """

    name: str
    cut: CuttingDescription
    deviation: float
    speeds: tuple[float, ...]
    pose: Pose
    depth: float | None = None


@dataclass(frozen=True, eq=False)
class DrawnLimits:
    """Limits of a cut.

    limit, error, frequency : (n_speeds,) of the likeliest system, m, m, Hz; infinite and not a number where none lies above
    depth_max; the error holds what is stated of the reduction of elastic bodies. draws : (n_draws, n_speeds) m; stable :
    (n_draws, n_speeds) chance that the asked depth is, the limit of a draw anywhere within the stated error; frequencies : of
    the draws, Hz; depth_max : to which was searched, m; shares : of each source in the variance of the logarithm of the least
    limit; notes : what is to be said of the error.
    """

    question: CutQuestion
    limit: FloatArray
    error: FloatArray
    frequency: FloatArray
    draws: FloatArray
    stable: FloatArray
    frequencies: FloatArray
    depth_max: float
    shares: dict[str, float]
    notes: tuple[str, ...] = ()

    def interval(self, weights: FloatArray, level: float = 0.95) -> FloatArray:
        """Return both ends of the interval of the limit at every speed, (2, n_speeds) m; above depth_max infinite."""
        tail = (1 - level) / 2
        lower = [quantile_of(column, weights, tail) for column in self.draws.T]
        upper = [quantile_of(column, weights, 1 - tail) for column in self.draws.T]
        return np.array([np.maximum(np.array(lower) - self.error, 0.0), np.array(upper) + self.error])

    def least(self, weights: FloatArray, level: float = 0.95) -> tuple[float, float, float]:
        """Return the least limit over the speeds and the ends of its interval, m."""
        tail, lowest = (1 - level) / 2, self.draws.min(axis=1)
        error = float(self.error[int(np.argmin(self.limit))])
        return (float(self.limit.min()), max(quantile_of(lowest, weights, tail) - error, 0.0),
                quantile_of(lowest, weights, 1 - tail) + error)

    def chance(self, weights: FloatArray) -> FloatArray:
        """Return P(stable) of the asked depth at every speed; so many draws can say neither 0 nor 1 (rule of succession)."""
        return np.asarray((weights.size * (weights @ self.stable) + 1) / (weights.size + 2))


def quantile_of(values: FloatArray, weights: FloatArray, level: float) -> float:
    """Return a quantile of weighted draws, so far out that as much of the next draw lies beyond it (Weibull's places).

    Of few draws it lies beyond them all: there it is that of their logarithms' normal distribution, from the last draw on.
    """
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order]) * values.size / (values.size + 1)
    place = int(np.searchsorted(reached, level))
    if place == 0 or place >= values.size:
        last = min(place, values.size - 1)
        return float(values[order[last]]) * _beyond(values, weights, level, reached=float(reached[last]))
    below, above = float(values[order[place - 1]]), float(values[order[place]])
    if not np.isfinite(above) or above == below:
        return above
    fraction = (level - reached[place - 1]) / max(float(reached[place] - reached[place - 1]), 1e-300)
    return below + float(fraction) * (above - below)


def _beyond(values: FloatArray, weights: FloatArray, level: float, *, reached: float) -> float:
    """Return the factor from the last draw, at the level that it reaches, to a quantile beyond all draws.

    It is one where a draw has no logarithm, for levels in the direction of the draws, and for draws that are all alike.
    """
    if not np.isfinite(values).all() or values.min() <= 0 or values.size < MIN_SCATTER_DRAWS:
        return 1.0
    logs = np.log(values)
    mean = float(weights @ logs) / float(weights.sum())
    scatter = np.sqrt(float(weights @ (logs - mean) ** 2) / float(weights.sum()) * values.size / (values.size - 1))
    normal = NormalDist()
    return float(np.exp(scatter * (normal.inv_cdf(level) - normal.inv_cdf(reached))))


def draw_limits(systems: DrawnSystems, question: CutQuestion) -> DrawnLimits:
    """Return the limits of a cut over all draws of a project's systems and of its coefficients.

    The default engine, whose counts find every loss of stability below the searched depth. A cut is taken as stable below the
    first loss alone; islands of stability above it count as chatter.
    """
    speeds = np.asarray(question.speeds, float)
    dynamics = systems.nominal(question.pose)
    problem = problem_of(dynamics, question.cut)
    chart = deep_chart(problem, speeds, None, share=0.5, end=question.cut.depth_end[0])
    reduced = question_reduction(dynamics.machine, question.pose, problem, chart=chart)
    error = (chart if reduced is None else reduced.widen(chart)).limit_error
    finite = chart.limit[np.isfinite(chart.limit)]
    depth_max = max(SEARCH_DEPTH_RATIO * float(finite.max()) if finite.size else chart.depth_max,
                    GOAL_DEPTH_RATIO * (question.depth or 0.0))
    factors = coefficient_factors(question.name, question.deviation, systems)
    charts = [stability.chart(problem_of(part, question.cut, row), speeds, None, depth_max=depth_max)
              for part, row in zip(systems.drawn(question.pose), factors, strict=True)]
    draws = np.array([drawn.limit for drawn in charts])
    frequencies = np.array([_frequencies(drawn) for drawn in charts])
    shares = _shares(np.minimum(draws, depth_max).min(axis=1), factors, systems.shares(question.pose, question.cut))
    return DrawnLimits(question, chart.limit, error, _frequencies(chart), draws, _stable_shares(draws, error, question.depth),
                       frequencies, depth_max, shares, () if reduced is None else reduced.notes)


def _stable_shares(draws: FloatArray, error: FloatArray, depth: float | None) -> FloatArray:
    """Return the chance (n_draws, n_speeds) that a depth is stable, where every limit lies anywhere within its error."""
    above, half = draws - (depth or 0.0), np.maximum(error, 1e-12)
    return np.clip(0.5 + 0.5 * above / half, 0.0, 1.0)


def _frequencies(chart: StabilityChart) -> FloatArray:
    """Return the chatter frequency at the limit of every speed, not a number where there is none, Hz."""
    places = chart.limit_points()
    return np.array([float(chart.frequency[place]) if place >= 0 else np.nan for place in places])


def _shares(lowest: FloatArray, factors: FloatArray, parts: dict[str, float]) -> dict[str, float]:
    """Return the share of every source in the variance of the logarithm of the least limit.

    What the drawn coefficients explain (linear in their logarithms, adjusted for as many terms) is theirs, the rest is the
    system's, parted by its own shares.
    """
    # Limits scatter by factors: their logarithms are nearly normal, where limits themselves would reach below nought.
    logs = np.log(np.maximum(lowest, 1e-9))
    if not logs.std() > 0:
        return {}
    terms = np.column_stack([np.ones(logs.size), np.log(factors)])
    residual = logs - terms @ np.linalg.lstsq(terms, logs, rcond=None)[0]
    freedom = logs.size - terms.shape[1]
    of_systems = min(float(residual @ residual) / freedom / float(logs.var(ddof=1)), 1.0) if parts else 0.0
    shares = {COEFFICIENTS_SOURCE: 1 - of_systems, **{part: share * of_systems for part, share in parts.items()}}
    return dict(sorted(shares.items(), key=lambda item: -item[1]))
