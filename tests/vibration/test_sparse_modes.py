"""Sparse modes: against dense solutions, closed forms, repeated and rigid modes, and the count that guards them."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import block_diag, csc_array, diags_array, kron
from scipy.sparse import random as sparse_random

from toolpoint import ToolpointError
from toolpoint.vibration.sparse import count_below, elimination, factorise, kernels, modes, symbolic
from toolpoint.vibration.sparse.factorisation import check_symmetric
from toolpoint.vibration.sparse.pencil import Pencil


def chain(n):
    """Free chain of n unit masses and springs; squares 4 sin^2(pi j / 2 n)."""
    main = np.full(n, 2.0)
    main[[0, -1]] = 1
    return diags_array([-np.ones(n - 1), main, -np.ones(n - 1)], offsets=[-1, 0, 1]).tocsc(), diags_array(np.ones(n)).tocsc()


def test_three_equal_free_chains_have_triple_modes_and_none_is_missed():
    k, m = chain(200)
    k3, m3 = block_diag([k] * 3, format="csc"), block_diag([m] * 3, format="csc")
    pairs = modes(k3, m3, 11)
    exact = np.repeat(4 * np.sin(np.pi * np.arange(4) / 400) ** 2, 3)
    assert pairs.count == 12 and pairs.rigid_count == 3 and pairs.is_complete
    assert np.allclose(pairs.squares, exact, rtol=1e-9, atol=1e-16)
    assert np.allclose(pairs.vectors.T @ (m3 @ pairs.vectors), np.eye(12), atol=1e-12)


def test_a_band_is_returned_whole():
    k, m = chain(300)
    top = np.sqrt(4 * np.sin(np.pi * 6.5 / 600) ** 2) / (2 * np.pi)
    pairs = modes(k, m, below=top)
    assert pairs.count == 7 == count_below(k, m, top) and pairs.counted_below == pytest.approx(top)


def test_random_pencil_against_a_dense_solution():
    rng = np.random.default_rng(2)
    a = rng.standard_normal((60, 60)) * (rng.random((60, 60)) < 0.1)
    k, m = csc_array(a @ a.T + np.eye(60)), csc_array(np.diag(rng.random(60) + 0.5))
    exact = eigh(k.toarray(), m.toarray(), eigvals_only=True)
    assert np.allclose(modes(k, m, 15).squares, exact[:15], rtol=1e-10)
    assert np.allclose(modes(k, m, 60).squares, exact, rtol=1e-9)


def test_rows_without_mass_are_condensed():
    k, m = chain(20)
    m = csc_array(m - diags_array(np.eye(20)[5]))
    inner = np.delete(np.arange(20), 5)
    full = k.toarray()
    condensed = full[np.ix_(inner, inner)] - np.outer(full[inner, 5], full[5, inner]) / full[5, 5]
    assert np.allclose(modes(k, m, 4).squares, np.linalg.eigvalsh(condensed)[:4], rtol=1e-9, atol=1e-14)


def test_solution_and_inertia():
    k, m = chain(50)
    shifted = csc_array(k - 4 * np.sin(np.pi * 3.5 / 100) ** 2 * m)
    factors = factorise(shifted)
    right = np.random.default_rng(0).standard_normal((50, 3))
    assert factors.negative_pivots == 4 and np.allclose(shifted @ factors.solve(right), right, atol=1e-11)


@pytest.mark.parametrize(("matrix", "message"), [
    (csc_array(np.array([[1.0, 2], [0, 1]])), "unsymmetric by 2"), (csc_array(np.ones((2, 3))), "must be square"),
    (csc_array(np.array([[1.0, np.nan], [np.nan, 1]])), "not finite"), (csc_array(np.diag([1.0, 0]) * 1.0), "singular")])
def test_bad_matrices_are_refused(matrix, message):
    with pytest.raises(ToolpointError, match=message):
        factorise(matrix)


def test_negative_stiffness_is_refused():
    k, m = chain(30)
    with pytest.raises(ToolpointError, match="1 negative eigenvalues"):
        modes(csc_array(k - 0.5 * diags_array(np.eye(30)[0])), m, 2)


def grid_laplacian(n):
    """Free grid of n^3 unit masses in unit cells of springs along the axes, three rows a node."""
    k, _ = chain(n)
    eye = diags_array(np.ones(n))
    total = kron(kron(k, eye), eye) + kron(kron(eye, k), eye) + kron(kron(eye, eye), k)
    return csc_array(kron(total, np.array([[3.0, 1, 0], [1, 3, 1], [0, 1, 3]])))


@pytest.mark.parametrize("with_places", [True, False])
def test_interpreted_solver_solves_and_counts(with_places, interpreted_solver, monkeypatch):
    """The kernels as plain Python on a small grid, cut into parts of a dozen nodes: every index is checked."""
    monkeypatch.setattr(elimination, "_MAX_LEAF_SIZE", 12)
    solve_and_count(4, with_places)


@pytest.mark.slow
@pytest.mark.parametrize("with_places", [True, False])
def test_our_own_factorisation_solves_and_counts(with_places):
    solve_and_count(9, with_places)


def solve_and_count(n, with_places):
    """Against the closed form of the eigenvalues of a sum of chains: inertia, and solutions by residual."""
    k = grid_laplacian(n)
    at = np.arange(n)
    places = np.repeat(np.stack(np.meshgrid(at, at, at, indexing="ij"), axis=-1).reshape(-1, 3), 3, axis=0).astype(float)
    square = 4 * np.sin(np.pi * at / (2 * n)) ** 2
    three = (square[:, None, None] + square[None, :, None] + square[None, None, :]).ravel()
    exact = np.outer(three, 3 + np.sqrt(2) * np.array([-1, 0, 1])).ravel()
    right = np.random.default_rng(0).standard_normal((k.shape[0], 3))
    for shift, positive in ((-0.3, True), (2.2345, False), (7.171, False)):
        matrix = csc_array(k - shift * diags_array(np.ones(k.shape[0])))
        factors = factorise(matrix, coordinates=places if with_places else None, solver="multifrontal")
        assert ("Cholesky" in factors.name) is positive
        assert factors.negative_pivots == (exact < shift).sum()
        assert abs(matrix @ factors.solve(right) - right).max() < 1e-9
        assert np.allclose(factors.solve(right[:, 0]), factors.solve(right)[:, 0], atol=1e-12)


def test_our_own_factorisation_takes_apart_pieces_and_lone_rows(interpreted_solver, monkeypatch):
    monkeypatch.setattr(elimination, "_MAX_LEAF_SIZE", 12)
    k, m = chain(40)
    matrix = csc_array(block_diag([k + m, [[2.0]], k + m, [[3.0]]]))
    right = np.arange(82.0)
    assert np.allclose(matrix @ factorise(matrix, solver="multifrontal").solve(right), right)
    with pytest.raises(ToolpointError, match="no usable pivot in row"):
        factorise(csc_array(block_diag([k + m, [[0.0]]])), solver="multifrontal")


def test_interpreted_counts_keep_no_factors(interpreted_solver, monkeypatch):
    monkeypatch.setattr(elimination, "_MAX_LEAF_SIZE", 12)
    monkeypatch.setattr(elimination, "_PIECE_SIZE", 300)
    count_beside_factors(3)


@pytest.mark.slow
@pytest.mark.parametrize("numbers", [elimination._PIECE_SIZE, 5000])
def test_negative_eigenvalues_are_counted_without_keeping_factors(numbers, monkeypatch):
    monkeypatch.setattr(elimination, "_PIECE_SIZE", numbers)  # of a factor that a piece may hold: all of it, or many pieces
    count_beside_factors(12)


def count_beside_factors(n):
    """In the order of the factors: the closed form's count, before there are factors, beside them and after them."""
    k, at = grid_laplacian(n), np.arange(n)
    square = 4 * np.sin(np.pi * at / (2 * n)) ** 2
    three = (square[:, None, None] + square[None, :, None] + square[None, None, :]).ravel()
    exact = np.outer(three, 3 + np.sqrt(2) * np.array([-1, 0, 1])).ravel()
    pencil = Pencil(k, csc_array(diags_array(np.ones(k.shape[0]))), 0.3, solver="multifrontal")
    right = np.random.default_rng(0).standard_normal(k.shape[0])
    assert pencil.count_below(0.5) == (exact < 0.5).sum()
    before = pencil.inverse.solve(right)
    assert np.allclose(k @ before + 0.3 * before, right, atol=1e-10)
    for shift in (0.5, 2.2345, 9.171):
        assert pencil.count_below(shift) == (exact < shift).sum()
    assert np.array_equal(pencil.inverse.solve(right), before)
    pencil.let_go()
    assert pencil.count_below(2.2345) == (exact < 2.2345).sum() and np.array_equal(pencil.inverse.solve(right), before)


@pytest.mark.parametrize("change", ["none", "value", "missing above", "missing below"])
def test_symmetry_of_large_matrices_is_asked_without_copies(change):
    n = 7000
    rng = np.random.default_rng(1)
    half = sparse_random(n, n, 5e-4, rng=rng, format="csc")
    matrix = csc_array(half + half.T + diags_array(np.full(n, 10.0)))
    matrix.sort_indices()
    broken = matrix.copy()
    column = next(j for j in range(n // 2, n) if matrix.indices[matrix.indptr[j]] < j)
    above = int(matrix.indptr[column])
    size = abs(broken.data[above])
    if change == "value":
        broken.data[above] += 0.25
    elif change == "missing above":
        broken.data[above] = 0.0
    elif change == "missing below":
        row = int(matrix.indices[above])
        below = int(matrix.indptr[row] + np.searchsorted(matrix.indices[matrix.indptr[row]:matrix.indptr[row + 1]], column))
        broken.data[below] = 0.0
    if change.startswith("missing"):
        broken.eliminate_zeros()
    expected = {"none": 0.0, "value": 0.25}.get(change, size)
    assert symbolic.asymmetry(broken.indptr, broken.indices, broken.data) == pytest.approx(expected)
    if change == "none":
        check_symmetric("matrix", broken)
    else:
        with pytest.raises(ToolpointError, match="unsymmetric by"):
            check_symmetric("matrix", broken)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["multifrontal", "SuperLU"])
def test_a_mass_between_rows_that_no_stiffness_joins_is_in_the_factors(solver):
    """The order is that of both patterns together: against a dense solution, and counted."""
    n = 7
    k = csc_array(grid_laplacian(n))
    size = k.shape[0]
    m = csc_array(diags_array(np.ones(size)) + csc_array(([0.4, 0.4], ([0, size - 1], [size - 1, 0])), shape=k.shape))
    pencil = Pencil(k, m, 0.7, solver=solver)
    right = np.random.default_rng(3).standard_normal((size, 2))
    assert np.allclose(pencil.inverse.solve(right), np.linalg.solve((k + 0.7 * m).toarray(), right), atol=1e-10)
    exact = eigh(k.toarray(), m.toarray(), eigvals_only=True)
    assert pencil.count_below(2.2345) == (exact < 2.2345).sum()


def test_interpreted_wide_fronts_are_solved_by_blocks(interpreted_solver, monkeypatch):
    for kernel_size in ("KEPT_BLOCK_COLUMNS", "_PIVOT_BLOCK_COLUMNS"):
        monkeypatch.setattr(kernels, kernel_size, 8)
    solve_by_blocks(19)


@pytest.mark.slow
def test_wide_fronts_are_solved_by_blocks():
    solve_by_blocks(150)


def solve_by_blocks(n):
    """A full matrix is one front: more columns than a block holds, and a part below the last whole block."""
    rng = np.random.default_rng(4)
    a = rng.standard_normal((n, n))
    size = n + 30
    for matrix, positive in ((a @ a.T + n * np.eye(n), True), ((a + a.T) / 2 + 5 * np.eye(n), False)):
        pair = csc_array(([0.5, 0.5], ([3, n + 10], [n + 10, 3])), shape=(size, size))
        sparse = csc_array(block_diag([matrix, np.eye(30)]) + pair)
        factors = factorise(sparse, solver="multifrontal", is_positive=positive)
        right = rng.standard_normal((size, 5))
        assert np.allclose(sparse @ factors.solve(right), right, atol=1e-8)
        assert factors.negative_pivots == (np.linalg.eigvalsh(sparse.toarray()) < 0).sum()


def test_a_band_below_all_modes_of_a_held_body_is_empty():
    k, m = diags_array([4.0e6, 9.0e6, 16.0e6], format="csc"), diags_array([1.0, 1.0, 1.0], format="csc")
    pairs = modes(k, m, below=100.0)  # the lowest is at 318 Hz
    assert pairs.count == 0 and pairs.vectors.shape == (3, 0) and "all modes of the band" in pairs.status
