"""Compiled kernels that condense closed machines to their independent coordinates: mass, stiffness, and M scaled by K.

Imported only when asked for: numba takes most of a second to load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolpoint._check import BoolArray, FloatArray, IndexArray
from toolpoint.machine.frequencies.closed_kernel import forward, side, solve
from toolpoint.machine.frequencies.kernel import _inertias, _momentum, _transform_point, _twist
from toolpoint.machine.frequencies.tree_arrays import BodyMoments


@njit(cache=True, nogil=True)
def condense_matrices(tree: tuple[Any, ...], ways: IndexArray, loops: tuple[Any, ...], values: FloatArray,
                      inertia: BodyMoments, columns: tuple[Any, ...], elastic: FloatArray, parts: tuple[Any, ...],
                      stiffness: FloatArray, out_mass: FloatArray, out_stiffness: FloatArray, is_solved: BoolArray) -> None:
    """Fill mass and stiffness (P, f, f) in the independent coordinates of every pose.

    inertia : masses, first and second moments of the bodies; columns : link, motion in the joint's frame, step or -1, whether
    on the path of a link, and whether springs ride with the child; elastic : stiffness of the loops
    (n_loops, 6, 6); parts : rows kept of the locked directions, dependent and independent coordinates.
    """
    link, motion, step, on_path, at_child = columns
    row_loop, row_way, dependent, independent = parts
    links, steps, n = tree[0].size, ways.size, link.size
    r, f, n_loops = dependent.size, independent.size, elastic.shape[0]
    state = (np.empty((links, 3, 3)), np.empty((links, 3)), np.empty((links, 3, 3)), np.empty((links, 3)),
             np.empty((steps, 6)))
    mass, first_moment, second_moment = np.empty(links), np.empty((links, 3)), np.empty((links, 3, 3))
    twists, force, work = np.empty((n, 6)), np.empty(6), np.empty((7, 3, 3))
    full_m, full_k, rows = np.empty((n, n)), np.empty((n, n)), np.empty((n_loops, 6, n))
    lock, right, basis, half_product = np.empty((r, r)), np.empty((r, f)), np.zeros((n, f)), np.empty((n, f))
    base_place = np.empty(3)
    for pose in range(values.shape[0]):
        forward(tree, ways, values[pose], state, work)
        _inertias(tree[0], inertia, state[0], state[1], mass, first_moment, second_moment, work)
        for j in range(n):
            if step[j] >= 0:  # a step of the chain is a coordinate itself: its twist is known
                twists[j] = state[4][step[j]]
                continue
            i = link[j]
            # An elastic coordinate acts where its springs are: they ride with the child, or stay with the parent.
            if at_child[i]:
                base_place[:] = state[3][i]
            elif tree[0][i] >= 0:
                _transform_point(state[0][tree[0][i]], tree[2][i], state[1][tree[0][i]], base_place)
            else:
                base_place[:] = tree[2][i]
            _twist(motion[j], state[2][i], base_place, twists[j])
        for j in range(n):
            _momentum(mass[link[j]], first_moment[link[j]], second_moment[link[j]], twists[j], force)
            for i in range(j + 1):
                total = 0.0
                # M_ij is the power of j's momentum on i's twist: nothing where j's link does not hang on i's.
                if on_path[link[i], link[j]]:
                    for a in range(6):
                        total += twists[i, a] * force[a]
                full_m[i, j] = full_m[j, i] = total
        _loop_rows(loops, state, twists, link, on_path, rows, work)
        full_k[:] = stiffness
        _add_elastic(elastic, rows, full_k)
        # Locked directions of the loops are equations: dependent coordinates follow the independent ones.
        for i in range(r):
            for j in range(r):
                lock[i, j] = rows[row_loop[i], row_way[i], dependent[j]]
            for j in range(f):
                right[i, j] = -rows[row_loop[i], row_way[i], independent[j]]
        if r > 0 and solve(lock, right, r, f) == 0.0:
            is_solved[pose] = False
        for j in range(f):
            basis[independent[j], j] = 1.0
            for i in range(r):
                basis[dependent[i], j] = right[i, j]
        _project(full_m, basis, half_product, out_mass[pose])
        _project(full_k, basis, half_product, out_stiffness[pose])


@njit(cache=True, nogil=True)
def _loop_rows(loops: tuple[Any, ...], state: tuple[Any, ...], twists: FloatArray, link: IndexArray, on_path: BoolArray,
               rows: FloatArray, work: FloatArray) -> None:
    """Fill `rows` (n_loops, 6, n) with the motion of the child's side against the parent's, in the parent's axes, per
    coordinate."""
    parent, child, frame_r, frame_t = loops[0], loops[1], loops[2], loops[3]
    base_r, base_t = work[4], work[3, 0]
    for l in range(parent.size):
        side(parent[l], frame_r[l], frame_t[l], state, base_r, base_t)
        for j in range(link.size):
            sign = 0.0
            if child[l] >= 0 and on_path[link[j], child[l]]:
                sign += 1.0
            if parent[l] >= 0 and on_path[link[j], parent[l]]:
                sign -= 1.0
            xi = twists[j]
            v0 = xi[0] - (base_t[1] * xi[5] - base_t[2] * xi[4])
            v1 = xi[1] - (base_t[2] * xi[3] - base_t[0] * xi[5])
            v2 = xi[2] - (base_t[0] * xi[4] - base_t[1] * xi[3])
            for a in range(3):
                rows[l, a, j] = sign * (base_r[0, a] * v0 + base_r[1, a] * v1 + base_r[2, a] * v2)
                rows[l, 3 + a, j] = sign * (base_r[0, a] * xi[3] + base_r[1, a] * xi[4] + base_r[2, a] * xi[5])


@njit(cache=True, nogil=True)
def _add_elastic(elastic: FloatArray, rows: FloatArray, full: FloatArray) -> None:
    """Add the stiffness of all loops, K += sum over loops of R^T K_l R, with R the rows (6, n) of a loop."""
    for l in range(elastic.shape[0]):
        for a in range(6):
            for b in range(6):
                k = elastic[l, a, b]
                # Most loop joints are stiff in one or two directions: two tests save most of the products.
                if k != 0.0:
                    for i in range(full.shape[0]):
                        if rows[l, a, i] != 0.0:
                            for j in range(full.shape[0]):
                                full[i, j] += k * rows[l, a, i] * rows[l, b, j]


@njit(cache=True, nogil=True)
def _project(full: FloatArray, basis: FloatArray, half_product: FloatArray, out: FloatArray) -> None:
    """Fill `out` (f, f) with B^T A B, A symmetric (n, n), B (n, f)."""
    n, f = basis.shape
    for i in range(n):
        for j in range(f):
            total = 0.0
            for k in range(n):
                total += full[i, k] * basis[k, j]
            half_product[i, j] = total
    for i in range(f):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += basis[k, i] * half_product[k, j]
            out[i, j] = out[j, i] = total


@njit(cache=True, nogil=True)
def scale_by_stiffness(mass: FloatArray, stiffness: FloatArray, is_solved: BoolArray) -> None:
    """Replace mass matrices M (P, f, f) by L^-1 M L^-T with K = L L^T; a pose whose stiffness is not positive is not good."""
    f = mass.shape[1]
    for pose in range(mass.shape[0]):
        k, m = stiffness[pose], mass[pose]
        for i in range(f):
            for j in range(i + 1):
                total = k[i, j]
                for c in range(j):
                    total -= k[i, c] * k[j, c]
                if i == j:
                    # Less than rounding of the products above is left: a motion without stiffness, whose 1/frequency would
                    # be infinite.
                    if not total > 1e-12 * k[i, i]:
                        is_solved[pose] = False
                        total = 1.0
                    k[i, i] = np.sqrt(total)
                else:
                    k[i, j] = total / k[j, j]
        for column in range(f):
            for i in range(f):
                for c in range(i):
                    m[i, column] -= k[i, c] * m[c, column]
                m[i, column] /= k[i, i]
        for row in range(f):
            for i in range(f):
                for c in range(i):
                    m[row, i] -= k[i, c] * m[row, c]
                m[row, i] /= k[i, i]

# Code of other modules in these kernels: 9dd95a7d7080
