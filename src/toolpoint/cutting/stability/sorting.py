"""Compiled sorting of some dozens to hundreds of numbers.

The library's own sort, distinct values and order of values compile for seconds a kernel, these for tenths.
"""

from __future__ import annotations

import numba as nb

from toolpoint._check import ComplexArray, FloatArray


@nb.njit(cache=True, nogil=True)
def sort(values: FloatArray) -> None:
    """Put real values, shape (n,), into rising order in place (Shell, Communications of the ACM 2 (1959) 30)."""
    gap = 1
    while 3 * gap < values.size:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, values.size):
            value, k = values[i], i
            while k >= gap and values[k - gap] > value:
                values[k] = values[k - gap]
                k -= gap
            values[k] = value
        gap //= 3


@nb.njit(cache=True, nogil=True)
def sort_by_size(values: ComplexArray) -> None:
    """Put complex values, shape (n,), into falling order of their absolute values in place; equal ones stay as they stood."""
    for i in range(1, values.size):
        value, k = values[i], i
        size = abs(value)
        while k > 0 and abs(values[k - 1]) < size:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value
