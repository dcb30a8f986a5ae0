"""Compiled loops over the node pairs of a finite-element matrix."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def number_pairs(pointers, columns):
    """Return a number for each pair of neighbours, counted over pairs i >= j row by row; columns ascending."""
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
def scatter_pairs(elements, matrices, width, pointers, columns, entries, blocks):
    """Add element matrices (e, width n, width n) to the stored blocks (pairs, width, width)."""
    n = elements.shape[1]
    for e in range(elements.shape[0]):
        for i in range(n):
            row = elements[e, i]
            first, last = pointers[row], pointers[row + 1]
            for j in range(n):
                if elements[e, j] > row:
                    continue
                at = entries[first + np.searchsorted(columns[first:last], elements[e, j])]
                for a in range(width):
                    for b in range(width):
                        blocks[at, a, b] += matrices[e, i * width + a, j * width + b]


@njit(cache=True, nogil=True)
def multiply(pointers, columns, entries, blocks, x, result):
    """Add the product with `x` (nodes, 3, k) to `result`."""
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
def multiply_scalars(pointers, columns, entries, values, x, result):
    """Add the product of a matrix of numbers times unit blocks with `x` (nodes, 3 k) to `result`."""
    for i in range(pointers.size - 1):
        for p in range(pointers[i], pointers[i + 1]):
            value, other, to = values[entries[p]], x[columns[p]], result[i]
            for c in range(x.shape[1]):
                to[c] += value * other[c]
