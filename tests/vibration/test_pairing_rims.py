"""Pairing of modes and FRAC at their rims: shapes that few points make alike, responses of rounding alone."""

from dataclasses import replace

import numpy as np

from toolpoint.vibration import Frf, Modes
from toolpoint.vibration.correlation import frac, pair_modes


def test_shapes_that_few_points_make_alike_are_paired_by_frequency():
    """One sensor makes all shapes alike: each mode goes with the nearest frequency; where shapes differ they decide."""
    first, second = (Modes(f, [0.02] * 3, [[0.1, -0.2, 0.3]], ["tip:+x"]) for f in ([20.0, 50.0, 90.0], [88.0, 21.0, 45.0]))
    assert pair_modes(first, second).pairs.tolist() == [[0, 1], [1, 2], [2, 0]]
    apart = Modes([20.0, 50.0], [0.02] * 2, np.eye(2), ["tip:+x", "tip:+y"])
    assert pair_modes(apart, replace(apart, frequency=np.array([55.0, 19.0]))).pairs.tolist() == [[0, 0], [1, 1]]


def test_responses_of_planes_that_do_not_couple_agree():
    """From plane to plane two computations leave different rounding: FRAC is that of zeros."""
    rng = np.random.default_rng(1)

    def test_of(factor):
        values = np.zeros((50, 2, 2), complex)
        values[:, 0, 0] = values[:, 1, 1] = factor / (1 - np.linspace(0, 2, 50) ** 2 + 0.05j)
        values[:, [0, 1], [1, 0]] = 1e-17 * rng.normal(size=(50, 2))
        return Frf(np.arange(1.0, 51.0), values, ["tip:+x", "tip:+y"], ["tip:+x", "tip:+y"])

    np.testing.assert_allclose(frac(test_of(1.0), test_of(3.0)), 1.0)
