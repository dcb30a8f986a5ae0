"""Compiled eigenvalues of small Hessenberg matrices: for some dozens of rows the call of a library takes as long as they do."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._inner_kernels import inner_njit

MAX_QR_SWEEPS = 40  # a row at most; usually about two
DOUBLE_EPSILON = 2.0**-52


@nb.njit(cache=True, nogil=True)
def eigenvalues(h: FloatArray) -> ComplexArray:
    """Return the eigenvalues of a real upper Hessenberg matrix, shape (n, n); all nan where an element is not finite or the
    iteration did not converge.

    Implicit double-shift QR iteration (Francis, The Computer Journal 4 (1961) 265 and 4 (1962) 332) on the block that has
    not fallen apart yet.
    """
    n = h.shape[0]
    a, values, largest = np.empty((n, n)), np.empty(n, np.complex128), 0.0
    for i in range(n):
        values[i] = math.nan
        for j in range(n):
            if not abs(h[i, j]) < math.inf:  # also not a number
                largest = math.inf
            largest = max(largest, abs(h[i, j]))
    if not 0 < largest < math.inf:
        return np.zeros(n, np.complex128) if largest == 0 else values
    for i in range(n):
        for j in range(n):
            a[i, j] = h[i, j] / largest
    last, sweeps = n - 1, 0
    while last >= 0:
        first = block_start(a, last)
        if first == last:
            values[last] = largest * a[last, last]
            last, sweeps = last - 1, 0
        elif first == last - 1:
            values[first], values[last] = pair_eigenvalues(a, first, largest)
            last, sweeps = last - 2, 0
        else:
            sweeps += 1
            if sweeps > MAX_QR_SWEEPS:
                for i in range(n):
                    values[i] = math.nan
                return values
            sweep(a, first, last, sweeps)
    return values


@inner_njit(cache=True, nogil=True)
def block_start(a: FloatArray, last: int) -> int:
    """Return the first row of the block that ends at row `last`: where the element below the diagonal is rounding."""
    # From below: rows fall off at the end first, as the shifts are taken there.
    for k in range(last, 0, -1):
        neighbours = abs(a[k - 1, k - 1]) + abs(a[k, k])
        if abs(a[k, k - 1]) <= DOUBLE_EPSILON * (neighbours if neighbours > 0 else 1.0):
            a[k, k - 1] = 0.0
            return k
    return 0


@inner_njit(cache=True, nogil=True)
def pair_eigenvalues(a: FloatArray, k: int, scale: float) -> tuple[complex, complex]:
    """Return the eigenvalues of the block of rows k and k + 1, times `scale`."""
    half, middle = 0.5 * (a[k, k] - a[k + 1, k + 1]), 0.5 * (a[k, k] + a[k + 1, k + 1])
    square = half * half + a[k, k + 1] * a[k + 1, k]
    if square < 0:
        root = math.sqrt(-square)
        return complex(scale * middle, scale * root), complex(scale * middle, -scale * root)
    # The difference of two numbers nearly alike would lose digits; the other eigenvalue follows from the product.
    root = half + math.copysign(math.sqrt(square), half)  # the farther one from the second diagonal element
    other = -a[k, k + 1] * a[k + 1, k] / root if root != 0 else 0.0
    return complex(scale * (a[k + 1, k + 1] + root), 0.0), complex(scale * (a[k + 1, k + 1] + other), 0.0)


@inner_njit(cache=True, nogil=True, fastmath={"reassoc", "contract", "nsz"})
def sweep(a: FloatArray, first: int, last: int, number: int) -> None:
    """Apply one double-shift sweep to the block of rows first .. last, at least three."""
    total = a[last - 1, last - 1] + a[last, last]
    product = a[last - 1, last - 1] * a[last, last] - a[last - 1, last] * a[last, last - 1]
    if number % 10 == 0:  # any other shifts, where it goes round in circles
        off_diagonal = abs(a[last, last - 1]) + abs(a[last - 1, last - 2])
        total, product = 1.5 * off_diagonal + 2 * a[last, last], (a[last, last] + 0.75
                                                                  * off_diagonal) ** 2 + 0.4375 * off_diagonal * off_diagonal
    # First column of (A - s1)(A - s2) over its common factor, the element below the diagonal: both shifts of a pair at once
    # keep everything real.
    p = a[first, first] * (a[first, first] - total) + a[first, first + 1] * a[first + 1, first] + product
    q = a[first + 1, first] * (a[first, first] + a[first + 1, first + 1] - total)
    r = a[first + 1, first] * a[first + 2, first + 1]
    for k in range(first, last):
        three = k < last - 1
        if k > first:
            p, q, r = a[k, k - 1], a[k + 1, k - 1], a[k + 2, k - 1] if three else 0.0
        size = abs(p) + abs(q) + abs(r)
        if size == 0:
            continue
        p, q, r = p / size, q / size, r / size
        norm = math.copysign(math.sqrt(p * p + q * q + r * r), p)
        if k > first:
            a[k, k - 1], a[k + 1, k - 1] = -norm * size, 0.0
            if three:
                a[k + 2, k - 1] = 0.0
        share, y, z = (p + norm) / norm, q / (p + norm), r / (p + norm)
        if three:
            u, v, w = a[k], a[k + 1], a[k + 2]
            for j in range(k, last + 1):
                t = share * (u[j] + y * v[j] + z * w[j])
                u[j] -= t
                v[j] -= t * y
                w[j] -= t * z
            for i in range(first, min(k + 3, last) + 1):
                row = a[i]
                t = share * (row[k] + y * row[k + 1] + z * row[k + 2])
                row[k] -= t
                row[k + 1] -= t * y
                row[k + 2] -= t * z
        else:
            u, v = a[k], a[k + 1]
            for j in range(k, last + 1):
                t = share * (u[j] + y * v[j])
                u[j] -= t
                v[j] -= t * y
            for i in range(first, last + 1):
                row = a[i]
                t = share * (row[k] + y * row[k + 1])
                row[k] -= t
                row[k + 1] -= t * y
