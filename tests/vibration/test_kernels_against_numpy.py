"""Loops that are compiled elsewhere, here as plain Python, against the equations that they compute, written with NumPy."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from toolpoint.vibration.simulation import varying_kernel
from toolpoint.vibration.simulation.varying import CourseArrays, CutArrays, NodeArrays, RunArrays
from toolpoint.vibration.sparse import node_kernels, symbolic
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, pattern_of
from toolpoint.vibration.sparse.ordering import cuts

RNG = np.random.default_rng(5)
ELEMENTS = np.array([[0, 1, 2, 3], [2, 3, 4, 5], [5, 4, 6, 7]])


@pytest.fixture(autouse=True)
def _plain_loops(interpreted):
    interpreted("vibration.simulation.varying_kernel", "vibration.sparse.elimination", "vibration.sparse.node_kernels")


def symmetric_pattern(n, share=0.2):
    matrix = (RNG.random((n, n)) < share) | np.eye(n, dtype=bool)
    return csc_array((matrix | matrix.T).astype(float))


@pytest.mark.parametrize("depth", [0.0, 2e-3])
def test_steps_along_a_path_are_those_of_the_blended_equation(depth):
    """x_{k+1} = x_s + Phi (x_k - x_s), both blended between nodes; the chip adds -depth G (u - u_delayed)."""
    n, w, period, steps = 3, 4, 5, 17
    nodes = NodeArrays(*(RNG.standard_normal(shape) * 0.3 for shape in (
        (3, 2 * n, 2 * n), (3, w, n), (3, 6, n), (3, 6, n), (3, 2 * n + w, 2 * n + w), (3, w, n), (3, n, n), (3, n, n))))
    cut = CutArrays(RNG.standard_normal((2, period, 3)), RNG.standard_normal((period, 3, 3)), depth)
    course = CourseArrays(np.repeat([0, 1], [9, 8]), RNG.random(steps), RNG.random(steps), RNG.standard_normal((steps, w - 3)))
    state, delayed = RNG.standard_normal(2 * n), RNG.standard_normal((period, 3))
    motion = RunArrays(state.copy(), delayed.copy(), np.zeros(0))
    tip, base = np.zeros((steps, 6)), np.zeros((0, 9))
    assert varying_kernel.advance(nodes, cut, course, motion, 1, 0, tip, base) == steps
    for k, (node, share, feed) in enumerate(zip(course.node, course.share, course.feed, strict=True)):
        phi, deflection, reading, load_map = (a[node] + share * (a[node + 1] - a[node]) for a in (
            nodes.transition, nodes.deflection, nodes.reading, nodes.load_map))
        force = cut.table[0, k % period] + feed * (cut.table[1, k % period] - cut.table[0, k % period])
        slot, now = k % period, load_map[:3] @ state[:n]
        if depth:
            ago = (delayed[slot] + delayed[(slot + 1) % period]) / 2
            force = force - depth * cut.regeneration[slot] @ (1.5 * now - 0.5 * delayed[slot - 1] - ago)
            delayed[slot] = now
        static = np.concatenate([deflection.T @ np.concatenate([force, course.loads[k]]), np.zeros(n)])
        state = static + phi.T @ (state - static)
        assert np.allclose(tip[k], reading @ state[:n], rtol=1e-10, atol=1e-12)
    assert np.allclose(motion.state, state) and np.allclose(motion.delayed, delayed)


@pytest.mark.parametrize("width", [3, 1])
def test_node_pairs_add_and_multiply_as_the_full_matrix_does(width):
    n, nodes = ELEMENTS.shape[1], 8
    parts = RNG.standard_normal((len(ELEMENTS), width * n, width * n))
    parts = parts + parts.transpose(0, 2, 1)
    full = np.zeros((width * nodes, width * nodes))
    for element, part in zip(ELEMENTS, parts, strict=True):
        rows = (width * element[:, None] + np.arange(width)).ravel()
        full[np.ix_(rows, rows)] += part
    full = full if width == 3 else np.kron(full, np.eye(3))
    pattern = pattern_of([ELEMENTS], nodes)
    blocks = np.zeros((pattern.block_count, width, width))
    node_kernels.scatter_pairs(ELEMENTS, parts, width, pattern.pointers, pattern.columns, pattern.entries, blocks)
    matrix = NodeMatrix(pattern, blocks if width == 3 else blocks.ravel())
    motion = RNG.standard_normal((3 * nodes, 2))
    assert np.allclose(matrix.columns().toarray(), full) and np.allclose(matrix @ motion, full @ motion)


def test_asymmetry_and_patterns_are_those_of_dense_matrices():
    dense = RNG.standard_normal((30, 30)) * (RNG.random((30, 30)) < 0.3)
    matrix, smaller = csc_array(dense), csc_array(np.where(np.abs(dense) > 1, dense, 0.0))
    assert symbolic.asymmetry(matrix.indptr, matrix.indices, matrix.data) == np.abs(dense - dense.T).max()
    assert symbolic.holds(matrix.indptr, matrix.indices, smaller.indptr, smaller.indices)
    assert not symbolic.holds(smaller.indptr, smaller.indices, matrix.indptr, matrix.indices)


def test_rows_of_the_factor_are_those_of_a_dense_elimination():
    """Every column of L: its pattern, joined to those of the columns eliminated before it that reach its row."""
    n = 25
    matrix = symmetric_pattern(n)
    xadj, adj, weight = symbolic.quotient(matrix.indptr, matrix.indices, np.arange(n), n)
    order = RNG.permutation(n)
    pattern = matrix.toarray()[np.ix_(order, order)] != 0
    for j in range(n):
        rows = j + 1 + np.flatnonzero(pattern[j + 1:, j])
        pattern[np.ix_(rows, rows)] = True
    parent = symbolic.elimination_tree(xadj, adj, order)
    below = [j + 1 + np.flatnonzero(pattern[j + 1:, j]) for j in range(n)]
    assert parent.tolist() == [int(rows[0]) if rows.size else -1 for rows in below]
    assert symbolic.column_weights(xadj, adj, order, parent, weight).tolist() == [1 + rows.size for rows in below]


def test_distances_and_separators_are_those_of_the_graph():
    matrix = symmetric_pattern(40, 0.04)
    xadj, adj, weight = symbolic.quotient(matrix.indptr, matrix.indices, np.arange(40), 40)
    edges, start = matrix.toarray() != 0, int(np.diff(xadj).argmax())
    reached, steps = np.eye(40, dtype=bool)[start], np.zeros(40)
    for _ in range(40):
        steps[~reached] += 1
        reached = reached | edges[reached].any(axis=0)
    inside = reached
    distance = cuts.distances(xadj, adj, start)
    assert np.array_equal(distance[inside], steps[inside]) and (distance[~inside] == distance[inside].max() + 1).all()
    part = cuts.sweep(xadj, adj, weight, RNG.random(40))
    cuts.refine(xadj, adj, weight, part, 4, cuts.MAX_SIDE_FRACTION)
    assert not edges[np.ix_(part == 0, part == 1)].any()
