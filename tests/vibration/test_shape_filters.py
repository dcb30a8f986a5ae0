"""Shape filters: what a point costs MAC, and shapes that are mixes of neighbours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint.vibration.correlation import combine_shapes, mac, mac_without

RNG = np.random.default_rng(5)


@given(st.integers(0, 10_000))
def test_without_a_group_is_the_mac_of_the_other_rows(seed):
    rng = np.random.default_rng(seed)
    a, b = (rng.normal(size=(9, 3)) + 1j * rng.normal(size=(9, 3)) for _ in range(2))
    groups = [[0, 1, 2], [3, 4, 5], [8]]
    result = mac_without(a, b, groups)
    for k, rows in enumerate(groups):
        left = np.setdiff1d(np.arange(9), rows)
        assert np.allclose(result[k], np.diag(mac(a[left], b[left])))


def test_a_wrong_point_stands_out():
    shape = RNG.normal(size=(12, 2))
    wrong = shape.copy()
    wrong[6:9] *= -1
    gain = mac_without(wrong, shape, [range(i, i + 3) for i in range(0, 12, 3)]) - np.diag(mac(wrong, shape))
    assert (gain.argmax(axis=0) == 2).all() and np.allclose(gain[2] + np.diag(mac(wrong, shape)), 1)


def test_nothing_moves_without_the_group():
    assert np.isnan(mac_without(np.array([[1.0], [0.0]]), np.array([[2.0], [0.0]]), [[0]])).all()


def test_a_mix_of_two_neighbours():
    """cos t of one and sin t of the other: MAC cos^2 t with the first alone, 1 with the mix."""
    basis = np.linalg.qr(RNG.normal(size=(15, 3)))[0]
    t = 0.5
    mixed = (np.cos(t) * basis[:, :1] + np.sin(t) * basis[:, 1:2]) * 3 * np.exp(0.3j)
    factors, share = combine_shapes(mixed, basis, np.array([[True, True, False]]))
    assert share[0] == pytest.approx(1) and np.abs(factors[0]) == pytest.approx([np.cos(t), np.sin(t), 0])
    assert mac(mixed, basis)[0, 0] == pytest.approx(np.cos(t) ** 2)
    assert combine_shapes(mixed, basis, np.array([[True, False, False]]))[1][0] == pytest.approx(np.cos(t) ** 2)
    assert combine_shapes(mixed, basis, np.zeros((1, 3), bool))[1][0] == 0
