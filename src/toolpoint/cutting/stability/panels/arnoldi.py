"""Compiled Arnoldi basis of PanelArnoldi's one-period map, and the Ritz vector it begins with at the next depth."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.panels.eigenvalues import eigenvalues
from toolpoint.cutting.stability.panels.kernels import SUMS, advance, product
from toolpoint.cutting.stability.panels.records import PeriodOperator
from toolpoint.cutting.stability.sorting import sort_by_size

MAX_RESIDUAL_RATIO = 1e-4  # of a multiplier's distance from the unit circle: a level is judged when the residual is below it
OVERFLOW_MARK = -1  # in place of a number of vectors, where the cut grows beyond double precision


@inner_njit(cache=True, nogil=True, fastmath=SUMS)
def sweep(basis: FloatArray, count: int | np.int64, y: FloatArray, dots: FloatArray) -> float:
    """Orthogonalise y against the first `count` rows of a basis (classical Gram-Schmidt); return the remaining length of y."""
    product(basis, y, y.size, dots[:count])
    for j in range(count):
        row, dot = basis[j], dots[j]
        for i in range(y.size):
            y[i] -= dot * row[i]
    total = 0.0
    for i in range(y.size):
        total += y[i] * y[i]
    return math.sqrt(total)


@nb.njit(cache=True, nogil=True)
def extend(basis: FloatArray, h: FloatArray, have: int | np.int64, vectors_max: int, operator: PeriodOperator,
           weight: FloatArray) -> int:
    """Extend an Arnoldi basis (rows of `basis`) from `have` to `vectors_max` vectors; return their number, `OVERFLOW_MARK`
    where the cut grows beyond double precision.

    weight : diagonal W of the similar map W^-1 U W whose basis this is (its multipliers are those of U); empty for U itself.
    """
    size = basis.shape[1]
    none = np.int64(0)  # of a type: a written zero would be compiled for apart
    dots = np.empty(vectors_max)
    weighted = np.empty(weight.size)
    for k in range(have, vectors_max):
        y = basis[k + 1]
        if weight.size > 0:
            for i in range(size):
                weighted[i] = weight[i] * basis[k, i]
            advance(weighted, y, operator)
            for i in range(size):
                y[i] /= weight[i]
        else:
            advance(basis[k], y, operator)
        full_norm = sweep(basis, none, y, dots)
        if not full_norm < 1e290:  # also not a number: the cut grows beyond double precision within one period
            return OVERFLOW_MARK
        previous_norm, norm = full_norm, full_norm
        for _sweep in range(5):  # until a sweep takes away no more than half: then the vector is orthogonal to rounding
            norm = sweep(basis, k + 1, y, dots)
            for j in range(k + 1):
                h[j, k] += dots[j]
            if norm > 0.5 * previous_norm or norm < 1e-13 * full_norm:
                break
            previous_norm = norm
        h[k + 1, k] = norm
        if norm < 1e-13 * full_norm:  # an invariant subspace: what is left is rounding
            return k + 1
        for i in range(size):
            y[i] /= norm
    return vectors_max


@nb.njit(cache=True, nogil=True)
def ritz(h: FloatArray, n: int, value: complex, basis: FloatArray, out: FloatArray) -> float:
    """Write the Ritz vector of an eigenvalue of the Hessenberg matrix h (n x n) as a real start vector; returns its residual.

    The eigenvector follows upwards from its last component, which is the small one for a converged value.
    """
    y = np.zeros(n, np.complex128)
    y[n - 1] = 1.0
    for k in range(n - 1, 0, -1):
        total = -value * y[k]
        for j in range(k, n):
            total += h[k, j] * y[j]
        y[k - 1] = -total / h[k, k - 1]
        # Far from an eigenvalue of the leading block the recursion grows by orders a step; only the direction is wanted.
        if abs(y[k - 1]) > 1e100:
            for j in range(k - 1, n):
                y[j] *= 1e-100
    norm = 0.0
    for k in range(n):
        norm += y[k].real ** 2 + y[k].imag ** 2
    norm = math.sqrt(norm)
    for i in range(out.size):
        out[i] = 0.0
    for k in range(n):
        # Any real combination of a complex pair lies in its invariant plane; as the last component of y is real, this one
        # cannot vanish.
        f = (y[k].real + y[k].imag) / norm
        for i in range(out.size):
            out[i] += f * basis[k, i]
    # In an Arnoldi relation all that the map adds beyond the basis goes through the last component: no further product is
    # needed.
    return h[n, n - 1] * abs(y[n - 1]) / norm


def leading_eigenvalues(basis: FloatArray, h: FloatArray, vector: FloatArray, *, operator: PeriodOperator, weight: FloatArray,
                        plan: tuple[float, int, int]) -> tuple[int, ComplexArray]:
    """Return (number of vectors used, multipliers, largest first) of a map; the basis grows until the first is known.

    basis (n + 1, size) float64 : its first row the start, n the most vectors; h (n + 1, n) float64 : room for the Hessenberg
    matrix; vector (size,) float64 : takes the Ritz vector of the first; plan : (accuracy, vectors before the first look, how
    many more after each), the accuracy relative, negative where the distance from the unit circle is enough. Beyond double
    precision the number is `OVERFLOW_MARK`, without multipliers.
    """
    # Not compiled itself: what it calls would be compiled again within it, and so would the library's eigenvalues.
    accuracy, step, increment = plan
    have, vectors_max = 0, h.shape[1]
    step = min(vectors_max, step)
    while True:
        # `extend` adds to h sweep by sweep, and the room still holds the depth before.
        h[:step + 1, have:step] = 0.0
        h[have + 1:step + 1, :have] = 0.0
        now = extend(basis, h, have, step, operator, weight)
        if now == OVERFLOW_MARK:
            return now, np.empty(0, np.complex128)
        values: ComplexArray = eigenvalues(h[:now, :now].copy())
        if np.isnan(values[0].real):
            values = np.linalg.eigvals(h[:now, :now]).astype(complex)
        sort_by_size(values)
        leading = complex(values[0])
        size, residual = abs(leading), ritz(h, now, leading, basis, vector)
        # A multiplier of a thousandth is deeply stable: more digits of it would cost vectors and change no verdict.
        good = residual < abs(accuracy) * max(size, 1e-3) or (
            accuracy < 0 and residual < MAX_RESIDUAL_RATIO * abs(size - 1) and residual < MAX_RESIDUAL_RATIO * size)
        # Fewer vectors than asked for span an invariant subspace: its eigenvalues are exact, and none could be added.
        if good or now < step or step == vectors_max:
            return now, values
        have, step = now, min(vectors_max, step + increment)

# Code of other modules in these kernels: 31ae267b4b8b
