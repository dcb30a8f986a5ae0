"""A free body keeps its rigid motions whatever digits its matrices were written with; a true instability is refused."""

from functools import cache

import numpy as np
import pytest
from scipy.sparse import csc_array

from toolpoint import ToolpointError
from toolpoint.vibration.sparse import modes


def free_body(digits, seed=0, points=30):
    """Return stiffness and mass of points joined by springs along their lines, numbers rounded to so many digits."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-1, 1, (points, 3))
    k = np.zeros((3 * points, 3 * points))
    for i in range(points):
        for j in range(i):
            along = (at[i] - at[j]) / np.linalg.norm(at[i] - at[j])
            row = np.zeros(3 * points)
            row[3 * i:3 * i + 3], row[3 * j:3 * j + 3] = along, -along
            k += rng.uniform(1, 10) * np.outer(row, row)
    mass = np.repeat(rng.uniform(1, 3, points), 3)
    rounded = (lambda table: np.array([[float(f"{x:.{digits - 1}e}") for x in line] for line in table]))
    return csc_array(rounded(np.triu(k)) + np.triu(rounded(k), 1).T), csc_array(rounded(np.diag(mass)))


@cache
def modes_of(digits, seed, number):
    """The body's lowest modes; those of all digits are asked by every test of fewer."""
    return modes(*free_body(digits, seed), number)


@pytest.mark.parametrize("digits", [7, 8, 10, 13, 17])
@pytest.mark.parametrize("number", [8, 12, 60])
@pytest.mark.default_cases(5)
def test_a_free_body_has_six_rigid_motions_in_any_digits(digits, number):
    for seed in range(3):
        pairs, exact = modes_of(digits, seed, number), modes_of(17, seed, number)
        assert (pairs.squares[:6] == 0).all() and (pairs.squares[6:] > 0).all()
        np.testing.assert_allclose(pairs.frequency[6:], exact.frequency[6:], rtol=10.0 ** (2 - digits) + 2e-8)
        assert pairs.status.startswith("all modes found")


@pytest.mark.parametrize("share", [1e-4, 0.1])
def test_a_stiffness_that_is_truly_negative_is_refused(share):
    k, m = free_body(17)
    first = modes(k, m, 8).squares[6]
    with pytest.raises(ToolpointError, match="negative"):
        modes(csc_array(k - share * first * m), m, 8)
