"""Draws of a project: how far the ends of an interval scatter is what repeated draws show."""

import numpy as np
import pytest

from toolpoint.project.limits.drawn_limits import quantile_of
from toolpoint.project.results import end_scatter


@pytest.mark.parametrize("draws", [24, 60, 240])
def test_ends_scatter_as_stated(draws):
    rng = np.random.default_rng(draws)
    # Limits are positive: their logarithms scatter, little enough here for the ends to be those of a normal distribution.
    ends = [100 * np.log(quantile_of(np.exp(0.01 * rng.standard_normal(draws)), np.full(draws, 1 / draws), 0.975))
            for _ in range(1500)]
    assert np.std(ends) / 1.96 == pytest.approx(end_scatter(draws), rel=0.12)
    # By hand: sqrt(0.025 * 0.975) = 0.156125, normal density at 1.95996 = 0.058445 (tables).
    assert end_scatter(draws) == pytest.approx(0.156125 / 0.058445 / 1.95996 / np.sqrt(draws), rel=1e-4)


@pytest.mark.parametrize("draws", [24, 60])
def test_intervals_of_few_draws_hold_the_next_one_as_often_as_of_many(draws):
    rng = np.random.default_rng(draws)
    inside, weights = [], np.full(draws, 1 / draws)
    for _ in range(2000):
        values = np.exp(0.1 * rng.standard_normal(draws))
        inside.append(quantile_of(values, weights, 0.025) <= np.exp(0.1 * rng.standard_normal()) <= quantile_of(
            values, weights, 0.975))
    assert 0.93 <= np.mean(inside) <= 0.965  # without an end beyond the draws: 0.92 of 24


def test_an_end_beyond_draws_without_logarithms_is_the_last_draw():
    weights = np.full(10, 0.1)
    assert quantile_of(np.arange(10.0), weights, 0.01) == 0.0
    assert quantile_of(np.append(np.arange(1.0, 10.0), np.inf), weights, 0.99) == np.inf
