"""Draws of a project: how far the ends of an interval scatter is what repeated draws show."""

import numpy as np
import pytest

from toolpoint.project.limits.drawn_limits import quantile_of
from toolpoint.project.results import end_scatter


@pytest.mark.parametrize("draws", [24, 60, 240])
def test_ends_scatter_as_stated(draws):
    rng = np.random.default_rng(draws)
    ends = [quantile_of(rng.standard_normal(draws), np.full(draws, 1 / draws), 0.975) for _ in range(1500)]
    assert np.std(ends) / 1.96 == pytest.approx(end_scatter(draws), rel=0.12)
    # By hand: sqrt(0.025 * 0.975) = 0.156125, normal density at 1.95996 = 0.058445 (tables).
    assert end_scatter(draws) == pytest.approx(0.156125 / 0.058445 / 1.95996 / np.sqrt(draws), rel=1e-4)
