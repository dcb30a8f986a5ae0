"""Laws of limits of responses with draws: a shared gain, a shared shift of frequency, and direct charts of the draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, TurningProblem, ZeroOrder, stability
from toolpoint.studies.cuts.turning.direction import unconditional_limit
from toolpoint.vibration import Frf

LINES = np.arange(100.0, 2500.0, 2.0)
SPEEDS = np.array([4000.0, 5200.0, 7000.0, 9400.0, 11000.0])


def tip(frequency: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return receptances (n, n_f, 1, 1) of tips of one mode with 2 % of damping."""
    r = LINES / frequency[:, None]
    return (1 / stiffness[:, None] / (1 - r**2 + 0.04j * r))[:, :, None, None]


def frf_of(draws: np.ndarray) -> Frf:
    values = tip(np.array([800.0]), np.array([2e7]))[0]
    return Frf(LINES, values, ["tool:+x"], ["tool:+x"], draws=draws, variance=draws.var(axis=0))


def milling(frf: Frf, immersion: float = 0.5) -> MillingProblem:
    return MillingProblem(Tool(0.016, 4), Engagement.down(immersion), CuttingCoefficients(8e8, 2.5e8), frf, "tool:+x", "same")


def test_a_shared_gain_moves_every_limit_by_it() -> None:
    gains = np.exp(0.1 * np.random.default_rng(1).normal(size=60))
    frf = frf_of(tip(np.full(60, 800.0), 2e7 / gains))
    chart = stability.chart(milling(frf), SPEEDS, depth_max=0.01)
    finite = np.isfinite(chart.limit)
    np.testing.assert_allclose(chart.limit_draws[:, finite], np.repeat(1 / gains[:, None], finite.sum(), axis=1), rtol=1e-6)
    lower, upper = np.quantile(1 / gains, [0.025, 0.975], method="weibull")
    exact = stability.chart(milling(replace(frf, draws=None, variance=None)), SPEEDS, depth_max=0.01)
    stated = chart.limit_error[finite] / chart.limit[finite]
    # What is left beside the draws are errors of the lines.
    assert (stated >= (upper - lower) / 2).all()
    assert (stated <= (upper - lower) / 2 + exact.limit_error[finite] / exact.limit[finite] + 1e-3).all()


def test_taken_line_by_line_the_same_variance_says_much_more() -> None:
    shifted = np.exp(0.01 * np.random.default_rng(2).normal(size=60))
    frf = frf_of(tip(800.0 * shifted, np.full(60, 2e7)))
    together = stability.chart(milling(frf), SPEEDS, depth_max=0.01)
    apart = stability.chart(milling(replace(frf, draws=None)), SPEEDS, depth_max=0.01)
    assert np.median(apart.limit_error / apart.limit) > 2 * np.median(together.limit_error / together.limit)


def test_a_shared_shift_of_frequency_is_a_shift_of_speed() -> None:
    shifted = np.exp(0.01 * np.random.default_rng(2).normal(size=40))
    frf = frf_of(tip(800.0 * shifted, np.full(40, 2e7)))
    chart = stability.chart(milling(frf), SPEEDS, depth_max=0.01)
    alone = milling(replace(frf, draws=None, variance=None))
    scaled = np.array([ZeroOrder().solve(alone, SPEEDS / s, 0.02).limit for s in shifted])
    middle = ZeroOrder().solve(alone, SPEEDS, 0.02).limit
    finite = np.isfinite(middle) & np.isfinite(scaled).all(axis=0)
    assert finite.sum() >= 3
    np.testing.assert_allclose(chart.limit_draws[:, finite], (scaled / middle)[:, finite], rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("immersion", [0.5, 0.1])
def test_the_interval_is_that_of_exact_charts_of_the_draws(immersion: float) -> None:
    rng = np.random.default_rng(3)
    frf = frf_of(tip(800.0 * np.exp(0.01 * rng.normal(size=40)), 2e7 * np.exp(0.05 * rng.normal(size=40))))
    depth = 0.01 / immersion
    chart = stability.chart(milling(frf, immersion), SPEEDS, depth_max=depth)
    direct = np.array([stability.chart(milling(frf.at_draw(k), immersion), SPEEDS, depth_max=2 * depth).limit
                       for k in range(40)])
    finite = np.isfinite(chart.limit) & np.isfinite(direct).all(axis=0)
    assert finite.sum() >= 2
    lower, upper = chart.ratio_ends
    ratio = np.log(upper / lower)[finite] / (2 * 1.96 * np.log(direct[:, finite]).std(axis=0))
    assert (ratio > 0.7).all() and (ratio < 1.6).all()


def test_the_width_stable_at_every_speed_has_the_interval_of_a_shared_gain() -> None:
    gains = np.exp(0.05 * np.random.default_rng(4).normal(size=60))
    problem = TurningProblem(2e9, frf_of(tip(np.full(60, 800.0), 2e7 / gains)), "tool:+x")
    exact = TurningProblem(2e9, replace(frf_of(tip(np.full(60, 800.0), 2e7 / gains)), draws=None, variance=None), "tool:+x")
    lower, upper = np.quantile(1 / gains, [0.025, 0.975], method="weibull")
    limit, bare = unconditional_limit(problem), unconditional_limit(exact)
    assert limit.error / limit.width == pytest.approx((upper - lower) / 2, abs=bare.error / bare.width + 1e-9)
    chart = stability.chart(problem, SPEEDS, depth_max=10 * limit.width)
    finite = np.isfinite(chart.limit)
    np.testing.assert_allclose(chart.limit_draws[:, finite], np.repeat(1 / gains[:, None], finite.sum(), axis=1), rtol=1e-6)


def test_where_no_limit_was_found_the_sure_depth_is_lowered_by_the_draws() -> None:
    gains = np.exp(0.1 * np.random.default_rng(1).normal(size=60))
    frf = frf_of(tip(np.full(60, 800.0), 2e7 / gains))
    deep = stability.chart(milling(frf), SPEEDS, depth_max=0.01)
    least = float(np.min(deep.limit))
    shallow = stability.chart(milling(frf), SPEEDS[[int(np.argmin(deep.limit))]], depth_max=0.97 * least)
    assert np.isinf(shallow.limit[0])
    assert shallow.sure_limit[0] < 0.9 * least
