"""Compiled sorting of some dozens to hundreds of numbers.

The library's own sort, search, distinct values and order of values compile for tenths of a second to seconds a kernel, these
for less than two tenths.
"""

from __future__ import annotations

import numba as nb

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._inner_kernels import inner_njit
from toolpoint._kernel_options import BORROWS


@inner_njit(cache=True, nogil=True)
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


@inner_njit(cache=True, nogil=True, **BORROWS)
def number_below(values: FloatArray, limit: float, inclusive: bool) -> int:
    """Return how many of the rising values, shape (n,), are below a limit, or at it too where `inclusive`: by bisection."""
    a, b = 0, values.size
    while a < b:
        middle = (a + b) // 2
        if values[middle] < limit or (inclusive and values[middle] == limit):
            a = middle + 1
        else:
            b = middle
    return a

# Code of other modules in these kernels: 814697192537
