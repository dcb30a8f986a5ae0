r"""Probability of stability from uncertain modal parameters and coefficients, and which measurement would narrow it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import Array, FloatArray, count, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.problem import MillingProblem
from toolpoint.cutting.stability.compute import chart
from toolpoint.cutting.stability.drawn_response import rough_limits
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.result import StabilityChart
from toolpoint.vibration import Modes

RATIO_STEP = 0.04  # of the stated K_n/K_t: between charted ratios; half of it moves a limit by less than a step of its depths
OUTCOME_RELIABILITY = 0.95  # probability that the outcome of a cut is judged rightly
MAX_SAMPLE_STRETCH = 4.0  # of the depths of a sample by a draw of the response: beyond, the deepest charted one stands
Perturb = Callable[[MillingProblem, float], MillingProblem]


@dataclass(frozen=True, eq=False)
class Uncertain:
    """One uncertain parameter: its name, relative standard deviation (normal), and how it enters the problem.

    `change(problem, factor)` returns the problem with the parameter multiplied by `factor`.
    """

    name: str
    deviation: float
    change: Perturb


@dataclass(frozen=True, eq=False)
class ProbabilityChart(NotebookText):
    """Result of a Monte Carlo run over charts.

    Parameters
    ----------
    speeds, depths : (n,), (d,) floats
        rev/min and m.
    stable : (n_samples, n, d) bool
    factors : (n_samples, p) floats
        Factor of every parameter in every sample.
    names : sequence of str
    frequency : (n_samples, n) floats
        Chatter frequency of the first loss of stability, Hz; NaN where none.
    limit : (n_samples, n) floats
        First loss of stability, m, at most the chart's depth_max.
    weights : (n_samples,) floats
        Weight of every sample, sum 1.
    """

    speeds: FloatArray
    depths: FloatArray
    stable: Array
    factors: FloatArray
    names: tuple[str, ...]
    frequency: FloatArray
    limit: FloatArray
    weights: FloatArray

    @property
    def probability(self) -> FloatArray:
        """P(stable), shape (n_speeds, n_depths)."""
        return np.clip(np.einsum("s,snd->nd", self.weights, self.stable.astype(float)), 0.0, 1.0)

    @property
    def error(self) -> FloatArray:
        """Standard error of the probability from the number of samples, shape (n_speeds, n_depths)."""
        p, effective = self.probability, 1 / np.sum(self.weights**2)
        return np.sqrt(np.maximum(p * (1 - p), 0) / effective)

    def depth_at(self, level: float = 0.95) -> FloatArray:
        """Return the largest depth of the grid stable with at least this probability, with all below it, m, shape
        (n_speeds,)."""
        stable_count = np.cumprod(self.probability >= level, axis=1).sum(1)
        return np.where(stable_count > 0, self.depths[np.maximum(stable_count - 1, 0)], 0.0)

    def importance(self) -> dict[str, float]:
        """Return the share of the limit's variance that each parameter explains alone (first order, linear), largest first.

        The parameter with the largest share is the one whose better measurement narrows the chart most.
        """
        w = self.weights[:, None]
        x = self.factors - (w * self.factors).sum(0)
        y = self.limit - (w * self.limit).sum(0)
        spread = (w * y**2).sum(0)
        keep = spread > 1e-12 * spread.max(initial=0.0)
        covariance = (x * w).T @ y[:, keep]
        share = covariance**2 / (w * x**2).sum(0)[:, None]
        total = share.sum(1) / max(float(spread[keep].sum()), 1e-300)
        return dict(sorted(zip(self.names, total.tolist()), key=lambda item: -item[1]))

    def after_cuts(self, cuts: Sequence[tuple[float, float, bool]],
                   reliability: float = OUTCOME_RELIABILITY) -> ProbabilityChart:
        """Return the chart after cuts with known outcome (speed, depth, stable): samples weighed by Bayes' rule.

        `reliability` is the probability that an outcome is judged rightly.
        """
        weights = self.weights.copy()
        for cut in cuts:
            weights *= np.where(self.allows(cut), reliability, 1 - reliability)
        return replace(self, weights=weights / weights.sum())

    def allows(self, cut: tuple[float, float, bool]) -> Array:
        """Return which samples give a cut (speed, depth, stable) its outcome, at the nearest charted speed and depth."""
        speed, depth, was_stable = cut
        i, d = int(np.argmin(np.abs(self.speeds - speed))), int(np.argmin(np.abs(self.depths - depth)))
        return np.asarray(self.stable[:, i, d] == was_stable)

    def likelihoods(self, cuts: Sequence[tuple[float, float, bool]]) -> FloatArray:
        """Return the probability of every cut's outcome: the smaller of that before any cut and that after all the others.

        Near zero the model contradicts the cut, or the cuts contradict each other. Weighing the samples then changes nothing:
        all are about equally wrong.
        """
        shares = []
        for k, cut in enumerate(cuts):
            others = self.after_cuts([*cuts[:k], *cuts[k + 1:]])
            allowed = self.allows(cut)
            shares.append(min(float(self.weights @ allowed), float(others.weights @ allowed)))
        return np.array(shares)

    def __repr__(self) -> str:
        return (f"ProbabilityChart({self.stable.shape[0]} samples, {self.speeds.size} speeds, {self.depths.size} depths, "
                f"{len(self.names)} parameters)")


def modal_parameters(problem: MillingProblem, frequency: float | None = None, damping: float | None = None,
                     *, stiffness: float = 0.05) -> list[Uncertain]:
    """Return the uncertain frequency, damping and stiffness of every mode (relative standard deviations).

    Where frequency or damping is left out it is that of the identification (`Modes.covariance`), for modes without one
    0.01 and 0.1. The parameters are taken to be independent.
    """
    if not isinstance(problem.dynamics, Modes):
        fail("problem", "dynamics that are not one Modes noun", "must be Modes", remedy="identify the modes first")
    deviations = deviations_of(problem.dynamics)
    out = []
    for i in range(problem.dynamics.count):
        out.append(Uncertain(f"frequency {i + 1}", float(deviations[i, 0]) if frequency is None else frequency,
                             _mode_change(i, "frequency")))
        out.append(Uncertain(f"damping {i + 1}", float(deviations[i, 1]) if damping is None else damping,
                             _mode_change(i, "damping_ratio")))
        out.append(Uncertain(f"stiffness {i + 1}", stiffness, _mode_change(i, "shape")))
    return out


def deviations_of(modes: Modes) -> FloatArray:
    """Return the relative standard deviations of frequency and damping of every mode, (n_modes, 2): measured or usual."""
    if modes.covariance is None:
        return np.tile([0.01, 0.1], (modes.count, 1))
    deviation = np.sqrt(np.diagonal(modes.covariance, axis1=-2, axis2=-1))
    return np.asarray(deviation / np.stack([modes.frequency, modes.damping_ratio], axis=-1), float)


def _mode_change(mode: int, what: str) -> Perturb:
    def change(problem: MillingProblem, factor: float) -> MillingProblem:
        modes = problem.dynamics
        assert isinstance(modes, Modes)
        value = np.array(getattr(modes, what))
        value[..., mode] *= factor if what != "shape" else 1 / np.sqrt(factor)
        if what == "frequency":  # the stiffness stays: the modal mass takes up the change
            shape = np.array(modes.shape)
            shape[..., mode] *= factor
            return problem.changed(dynamics=replace(modes, frequency=value, shape=shape))
        changes: dict[str, Any] = {what: value}
        return problem.changed(dynamics=replace(modes, **changes))

    return change


def coefficient_parameters(deviation: float = 0.1) -> list[Uncertain]:
    """Return the uncertain cutting coefficients kt and kn (relative standard deviations)."""
    def change(name: str) -> Perturb:
        def put(problem: MillingProblem, factor: float) -> MillingProblem:
            c = problem.coefficients
            return problem.changed(coefficients=replace(c, **{name: getattr(c, name) * factor}))
        return put

    return [Uncertain(name, deviation, change(name)) for name in ("kt", "kn")]


def probability(problem: MillingProblem, parameters: Sequence[Uncertain], speeds: FloatArray, *, depths: FloatArray,
                rng: np.random.Generator, samples: int = 200, method: StabilityMethod | None = None,
                limit_draws: FloatArray | None = None, progress: Callable[[int, int], None] | None = None) -> ProbabilityChart:
    """Return P(stable) over speed and depth from independent normal factors of the parameters (kept above 0.05).

    Parameters
    ----------
    problem : MillingProblem
    parameters : sequence of Uncertain
        See `modal_parameters`, `coefficient_parameters`.
    speeds, depths : (n,), (d,) floats
    rng : numpy.random.Generator
    samples : int
    limit_draws : (n_draws, n) floats, optional
        Limits of equally likely responses over those of the problem's (`StabilityChart.limit_draws`) at the speeds: each
        sample takes one of them, and its depths are stretched by it.
    progress : callable, optional
        Called with (done, all) after every chart.

    Notes
    -----
    Where nothing but the coefficients is uncertain and the cut has the same shape at every depth, the force is K_t times the
    depth times a function of K_n/K_t: samples share charts of few ratios (`RATIO_STEP` apart, taken at the nearest), whose
    depths are stretched by their K_t. On measured lines a cut whose shape depends on depth (helix, rounded edge) takes seconds
    a speed: all samples share the chart of the cut itself, its depths stretched by the ratio of single-frequency limits.
    """
    w = floats("depths", np.atleast_1d(depths))
    n = floats("speeds", np.atleast_1d(speeds))
    deviation = np.array([p.deviation for p in parameters])
    # A wide deviation would draw stiffness below nought: a twentieth is as soft as any draw gets.
    factors = np.maximum(1 + deviation * rng.standard_normal((count("samples", samples), deviation.size)), 0.05)
    names = tuple(p.name for p in parameters)
    moved_limits = _picked_draws(limit_draws, samples, n.size, rng)
    stable = np.empty((samples, n.size, w.size), bool)
    frequency, limit = np.full((samples, n.size), np.nan), np.empty((samples, n.size))
    groups = _groups(problem, names, factors)
    if names == ("kt", "kn") and is_slow(problem):
        moved_limits = moved_limits * _rough_ratios(problem, parameters, factors, speeds=n, depth=float(w.max()))
    is_by_speed = bool((moved_limits != 1).any())
    for number, (row, members, stretches) in enumerate(groups, start=1):
        varied = problem
        for parameter, factor in zip(parameters, row):
            varied = parameter.change(varied, float(factor))
        speed_stretches = stretches[:, None] / moved_limits[members]  # (members, n)
        depth_max = float(min(w.max() * speed_stretches.max(), MAX_SAMPLE_STRETCH * w.max() * stretches.max()))
        sample: StabilityChart = chart(varied, n, method, depth_max=depth_max)
        first = sample.limit_points()
        for s, stretch in zip(members.tolist(), speed_stretches):
            stable[s] = [sample.stable(np.minimum(w * part, depth_max))[i] for i, part in enumerate(stretch)] \
                if is_by_speed else sample.stable(w * stretch[0])
            limit[s] = np.minimum(sample.limit / stretch, w.max())
            reached = (first >= 0) & (sample.limit / stretch <= w.max())
            frequency[s, reached] = sample.frequency[first[reached]]
        if progress is not None:
            progress(number, len(groups))
    return ProbabilityChart(n, w, stable, factors, names, frequency, limit,
                            np.full(samples, 1 / samples))


def is_slow(problem: MillingProblem) -> bool:
    """Whether every sample would need a chart of its own on measured lines, seconds a speed."""
    return not problem.plane.is_modal and not _is_scaled(problem)


def _groups(problem: MillingProblem, names: tuple[str, ...], factors: FloatArray) -> list[tuple[FloatArray, Array, FloatArray]]:
    """Return the factors that are charted, the samples that share each chart, and what stretches their depths."""
    if names == ("kt", "kn") and is_slow(problem):
        return [(np.ones(2), np.arange(len(factors)), np.ones(len(factors)))]
    if names == ("kt", "kn") and _is_scaled(problem):
        return _equal_ratios(factors)
    return [(row, np.array([s]), np.ones(1)) for s, row in enumerate(factors)]


def _rough_ratios(problem: MillingProblem, parameters: Sequence[Uncertain], factors: FloatArray, *, speeds: FloatArray,
                  depth: float) -> FloatArray:
    """Return single-frequency limits of every sample over those of the problem itself, (samples, speeds)."""
    deepest = MAX_SAMPLE_STRETCH * depth
    middle = rough_limits(problem, speeds, deepest)
    rows = []
    for row in factors:
        varied = problem
        for parameter, factor in zip(parameters, row, strict=True):
            varied = parameter.change(varied, float(factor))
        rows.append(rough_limits(varied, speeds, deepest) / middle)
    return np.array(rows)


def _picked_draws(limit_draws: FloatArray | None, samples: int, speeds: int, rng: np.random.Generator) -> FloatArray:
    """Return the factor of the limit at every speed for each sample (samples, speeds); ones where the response is exact."""
    if limit_draws is None:
        return np.ones((samples, speeds))
    return np.asarray(limit_draws[rng.integers(len(limit_draws), size=samples)])


def _is_scaled(problem: MillingProblem) -> bool:
    """Whether a cut of K_t times so much is the cut of so many times the depth, at the same K_n/K_t."""
    tool = problem.tool
    return (not tool.has_helix and tool.corner_radius == 0 and tool.tilt == 0 and problem.z is None
            and problem.process_damping == 0)


def _equal_ratios(factors: FloatArray) -> list[tuple[FloatArray, Array, FloatArray]]:
    """Return the factors (K_t unchanged) of every charted ratio K_n/K_t, its samples, and what stretches their depths."""
    steps = np.rint((factors[:, 1] / factors[:, 0] - 1) / RATIO_STEP)
    return [(np.array([1.0, max(1 + RATIO_STEP * step, 0.05)]), np.flatnonzero(steps == step), factors[steps == step, 0])
            for step in np.unique(steps)]
