"""Eigenvalues of Hessenberg matrices: closed forms, LAPACK's on random ones, scale, and what cannot be solved."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint.cutting.stability.panels.eigenvalues import eigenvalues


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Largest distance of an eigenvalue from the nearest one of the other set, both ways."""
    gaps = np.abs(a[:, None] - b[None])
    return float(max(gaps.min(0).max(), gaps.min(1).max()))


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 3, 7, 24, 61])
def test_roots_of_unity(n: int) -> None:
    """A cyclic shift, on which double shifts alone go round in circles: the n-th roots of 1."""
    shift = np.zeros((n, n))
    shift[np.arange(1, n), np.arange(n - 1)] = 1
    shift[0, n - 1] = 1
    assert distance(eigenvalues(shift), np.exp(2j * np.pi * np.arange(n) / n)) < 1e-13


@pytest.mark.slow
def test_second_differences() -> None:
    """A symmetric tridiagonal matrix: 2 - 2 cos(k pi/(n + 1)), all of them real."""
    n = 40
    found = eigenvalues(2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    assert (found.imag == 0).all()
    assert np.sort(found.real) == pytest.approx(2 - 2 * np.cos(np.arange(1, n + 1) * np.pi / (n + 1)), abs=1e-13)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.integers(1, 90), st.integers(0, 10**6), st.floats(-0.3, 0.3), st.sampled_from([1e-200, 1.0, 1e200]))
def test_random_matrices(n: int, seed: int, fall: float, scale: float) -> None:
    """LAPACK's eigenvalues within the rounding of the matrix's norm and their own condition, at any scale, rows that fall."""
    rng = np.random.default_rng(seed)
    h = np.triu(rng.standard_normal((n, n)) * np.exp(fall * np.arange(n))[:, None], -1)
    values, vectors = np.linalg.eig(h)
    condition = np.linalg.norm(np.linalg.inv(vectors), axis=1).max()
    found = eigenvalues(scale * h) / scale
    assert distance(found, values) < 1e-13 * n * condition * np.linalg.norm(h)
    assert np.array_equal(np.sort_complex(found[found.imag != 0]), np.sort_complex(found[found.imag != 0].conj()))


def test_zero_and_no_numbers() -> None:
    """Nothing gives zeros; what is no number, or infinite, gives no numbers. A part of a matrix, as Arnoldi's method has it:
    the kernel is compiled for that."""
    assert (eigenvalues(np.zeros((5, 5))[:4, :4]) == 0).all()
    for bad in (np.nan, np.inf):
        h = np.eye(5)[:4, :4]
        h[1, 2] = bad
        assert np.isnan(eigenvalues(h)).all()
