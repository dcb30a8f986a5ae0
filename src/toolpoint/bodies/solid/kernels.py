"""Compiled loops of the assembly: blocks into their places, and blocks into rows."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def scatter(elements, matrices, width, pointers, columns, data):
    """Add element matrices (e, width n, width n) to the blocks `data` (columns, width, width) of their node pairs."""
    n = elements.shape[1]
    for e in range(elements.shape[0]):
        for i in range(n):
            row = elements[e, i]
            first, last = pointers[row], pointers[row + 1]
            for j in range(n):
                at = first + np.searchsorted(columns[first:last], elements[e, j])
                for a in range(width):
                    for b in range(width):
                        data[at, a, b] += matrices[e, i * width + a, j * width + b]


@njit(cache=True)
def expand(pointers, columns, data, indptr, indices, values):
    """Write blocks as compressed rows."""
    width = data.shape[1]
    at = 0
    indptr[0] = 0
    for row in range(pointers.size - 1):
        for a in range(width):
            for k in range(pointers[row], pointers[row + 1]):
                for b in range(width):
                    indices[at] = columns[k] * width + b
                    values[at] = data[k, a, b]
                    at += 1
            indptr[row * width + a + 1] = at
