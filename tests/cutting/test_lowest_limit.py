"""The lowest limit between charted speeds: it holds for a dense chart, and does not move with the grid."""

from __future__ import annotations

import numpy as np
import pytest

from cutting.cutting_cases import altintas, modes_of
from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, TurningProblem, stability
from toolpoint.cutting.stability.methods.turning import least_width


def random_problem(seed: int) -> MillingProblem:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    modes = Modes(np.sort(rng.uniform(100, 1500, count)), 10 ** rng.uniform(-2.3, -1.2, count),
                  rng.standard_normal((2, count)) / np.sqrt(5), ("tool:+x", "tool:+y"))
    return MillingProblem(Tool(0.02, int(rng.integers(1, 6))), Engagement.down(float(rng.choice([0.05, 0.2, 0.5, 1.0]))),
                          CuttingCoefficients(6e8, 2e8), modes)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_no_speed_between_the_charted_ones_has_a_lower_limit_than_stated(seed) -> None:
    problem = random_problem(seed)
    coarse, fine = (stability.chart(problem, np.linspace(2500, 9000, n), depth_max=0.05) for n in (200, 1201))
    lowest = stability.lowest_limit(problem, coarse)
    if np.isfinite(fine.limit).any():
        assert lowest.depth - lowest.error <= fine.limit.min() * (1 + 1e-9)
        assert lowest.depth <= coarse.limit.min()
        assert lowest.error <= 2e-3 * lowest.depth


def test_the_lowest_limit_does_not_move_with_the_grid() -> None:
    problem = altintas()
    charts = [stability.chart(problem, np.linspace(6000, 15000, n), depth_max=0.005) for n in (23, 31, 47)]
    limits = [stability.lowest_limit(problem, chart) for chart in charts]
    least = min(limit.depth for limit in limits)
    assert max(chart.limit.min() for chart in charts) > 1.01 * least  # the charts' own minima move
    assert all(limit.depth - limit.error <= least for limit in limits)
    assert max(limit.depth for limit in limits) < 1.005 * least


def test_of_turning_it_is_the_closed_form() -> None:
    problem = TurningProblem(1e9, modes_of([503.3], [0.03], [1e7], "tool:+x"))
    chart = stability.chart(problem, np.linspace(4000, 20000, 50), depth_max=0.01)
    lowest = stability.lowest_limit(problem, chart)
    assert lowest.depth == pytest.approx(least_width(1e7, 0.03, 1e9), rel=1e-4)
    assert lowest.depth - least_width(1e7, 0.03, 1e9) <= lowest.error
