"""Compiled loops over the node pairs of a finite-element matrix."""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray


@njit(cache=True, nogil=True)
def number_pairs(pointers: IndexArray, columns: IndexArray) -> IndexArray:
    """Return a number for each pair of neighbours, counted over pairs i >= j row by row, the same for (i, j) and (j, i).

    pointers (n + 1,) and columns (k,) int32, ascending in each row. Returns (k,) int32.
    """
    n = pointers.size - 1
    entries = np.empty(columns.size, np.int32)
    waiting = pointers[:-1].copy()
    count = 0
    for i in range(n):
        for k in range(pointers[i], pointers[i + 1]):
            j = columns[k]
            if j > i:
                break
            entries[k] = count
            if j < i:
                # Rows come in order, so the mirror images in row j are met in order too.
                if j >= columns[waiting[j]]:
                    while columns[waiting[j]] <= j:
                        waiting[j] += 1
                entries[waiting[j]] = count
                waiting[j] += 1
            count += 1
    return entries


@njit(cache=True, nogil=True)
def scatter_pairs(elements: IndexArray, matrices: FloatArray, width: int, pointers: IndexArray, columns: IndexArray,
                  entries: IndexArray, blocks: FloatArray) -> None:
    """Add element matrices to the stored blocks: B[i, j] += A_e[i, j] over the elements that hold both nodes, i >= j.

    elements (e, n) int, matrices (e, width n, width n) float64; pointers, columns, entries as in `NodePattern`; blocks (pairs,
    width, width) float64, changed in place.
    """
    n = elements.shape[1]
    for e in range(elements.shape[0]):
        for i in range(n):
            row = elements[e, i]
            first, last = pointers[row], pointers[row + 1]
            for j in range(n):
                if elements[e, j] > row:
                    continue
                entry = entries[first + np.searchsorted(columns[first:last], elements[e, j])]
                for a in range(width):
                    for b in range(width):
                        blocks[entry, a, b] += matrices[e, i * width + a, j * width + b]


@njit(cache=True, nogil=True)
def multiply(pointers: IndexArray, columns: IndexArray, entries: IndexArray, blocks: FloatArray, x: FloatArray,
             result: FloatArray) -> None:
    """Add the product with `x` (nodes, 3, k) to `result`, float64: y_i += B_ij x_j, B_ij = B_ji^T above the diagonal."""
    k = x.shape[2]
    for i in range(pointers.size - 1):
        for p in range(pointers[i], pointers[i + 1]):
            j = columns[p]
            block = blocks[entries[p]]
            for a in range(3):
                for b in range(3):
                    value = block[a, b] if j <= i else block[b, a]
                    for c in range(k):
                        result[i, a, c] += value * x[j, b, c]


@njit(cache=True, nogil=True)
def multiply_scalars(pointers: IndexArray, columns: IndexArray, entries: IndexArray, values: FloatArray, x: FloatArray,
                     result: FloatArray) -> None:
    """Add the product of numbers times unit blocks with `x` (nodes, 3 k) to `result`, both float64: y_i += b_ij x_j."""
    for i in range(pointers.size - 1):
        for p in range(pointers[i], pointers[i + 1]):
            value, other, target = values[entries[p]], x[columns[p]], result[i]
            for c in range(x.shape[1]):
                target[c] += value * other[c]
