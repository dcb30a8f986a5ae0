"""The stated error from three levels: exact for a known order, whole where no order is seen."""

import numpy as np
import pytest

from toolpoint.studies.accuracy.refinement import ORDER_SAFETY_FACTOR, remaining_error


@pytest.mark.parametrize("order", [0.75, 1.0, 1.5, 2.0])
def test_an_error_of_one_order_is_found_with_its_safety(order):
    truth, error = 3.0, 1e-3
    values = [truth * (1 + error * width**order) for width in (1, 2, 4)]
    assert remaining_error(*values) == pytest.approx(ORDER_SAFETY_FACTOR * error, rel=5e-3)


def test_levels_that_disagree_count_whole():
    assert remaining_error(1.0, 1.01, 1.005) == pytest.approx(ORDER_SAFETY_FACTOR * 0.01)
    assert remaining_error(1.0, 1.01, 1.011) == pytest.approx(ORDER_SAFETY_FACTOR * 0.01)


def test_a_near_change_that_vanishes_by_chance_does_not_hide_the_error():
    assert remaining_error(1.0, 1.0, 1.16) == pytest.approx(ORDER_SAFETY_FACTOR * 0.01)
    assert np.isnan(remaining_error(1.0, 1.0, float("nan")))


@pytest.mark.parametrize("seed", range(20))
def test_mixed_orders_are_covered(seed):
    """Errors of first and second order together, of one sign: what is stated is at least what is left."""
    first, second = np.random.default_rng(seed).uniform(0, 1e-3, 2)
    values = [1 + first * width + second * width**2 for width in (1, 2, 4)]
    assert remaining_error(*values) >= first + second
