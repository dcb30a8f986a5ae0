"""Compiled counts of FloquetDeterminant: unstable multipliers at a depth, and depths of a second look between two levels."""

from __future__ import annotations

import math

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.floquet.kernels import horner
from toolpoint.cutting.stability.floquet.records import ThetaTable
from toolpoint.cutting.stability.levels import FRACTIONS_ABOVE_ROOT, FRACTIONS_BELOW_ROOT
from toolpoint.cutting.stability.sorting import number_below

FLIP_SEARCH_PARTS = 8  # in which the depths between two levels are looked at for flips


@inner_njit(cache=True, nogil=True)
def count_at(table: ThetaTable, used: int, s: float) -> tuple[int, int]:
    """Return (N, place of the largest phase step) at s: N = -(phase of D over theta from 0 to pi)/pi, a whole number."""
    order, c, degree = table.order, table.coefficient, table.degree
    total, largest_step, place = 0.0, -1.0, 0
    previous = 1.0 + 0.0j
    for k in range(used):
        i = order[k]
        now, _ = horner(c[i], degree[i], s)
        if k == used - 1:
            # At theta = pi the determinant is real: its rounding must not turn the last step, which decides about a flip.
            now = complex(now.real, 0.0)
        if k > 0:
            # The angle of now over previous by cross and scalar product: no quotient that overflows, and no jump at -pi, as
            # steps are below 1.2 rad.
            step = math.atan2(previous.real * now.imag - previous.imag * now.real,
                              previous.real * now.real + previous.imag * now.imag)
            total += step
            if abs(step) > largest_step:
                largest_step, place = abs(step), k - 1
        previous = now
    return int(np.rint(-total / math.pi)), place


@inner_njit(cache=True, nogil=True)
def counts_of(order: IndexArray, used: int, at_levels: ComplexArray, number: int) -> IndexArray:
    """Return N at the first `number` levels from the determinant's values there."""
    out = np.empty(number, np.int64)
    for l in range(number):
        total = 0.0
        previous = at_levels[order[0], l]
        for k in range(1, used):
            now = at_levels[order[k], l]
            if k == used - 1:
                now = complex(now.real, 0.0)
            turned = now * previous.conjugate()
            total += math.atan2(turned.imag, turned.real)
            previous = now
        out[l] = int(np.rint(-total / math.pi))
    return out


@inner_njit(cache=True, nogil=True)
def add_flips(table: ThetaTable, used: int, levels: FloatArray, counts: IndexArray) -> tuple[FloatArray, IndexArray]:
    """Return the levels and their counts, with depths added where the real determinant at theta = pi changes its sign and back
    between two levels: a flip lobe that opens and closes there."""
    last = table.order[used - 1]
    c, degree = table.coefficient[last], table.degree[last]
    out, flip_counts = np.empty(levels.size * FLIP_SEARCH_PARTS), np.empty(levels.size * FLIP_SEARCH_PARTS, np.int64)
    n = 0
    a, sign_a = 0.0, True
    for l in range(levels.size):
        sign_b = horner(c, degree, levels[l])[0].real > 0
        for k in range(1, FLIP_SEARCH_PARTS):
            m = a + (levels[l] - a) * k / FLIP_SEARCH_PARTS
            # Two flips in one cell leave counts and signs at its ends alike; only a look inside tells, which costs one
            # polynomial.
            if sign_a == sign_b and (horner(c, degree, m)[0].real > 0) != sign_a:
                out[n] = m
                flip_counts[n], _ = count_at(table, used, m)
                n += 1
        out[n], flip_counts[n] = levels[l], counts[l]
        n += 1
        a, sign_a = levels[l], sign_b
    return out[:n], flip_counts[:n]


@inner_njit(cache=True, nogil=True)
def put_cell(stack: Array, size: int, lower: float, n_lower: int, upper: float, n_upper: int) -> int:
    """Put two depths with their counts on the stack; returns the new top."""
    stack[size].lower, stack[size].n_lower, stack[size].upper, stack[size].n_upper = lower, n_lower, upper, n_upper
    return size + 1


@inner_njit(cache=True, nogil=True)
def split(stack: Array, size: int, below: tuple[float, int], above: tuple[float, int], places: tuple[float, ...],
          table: ThetaTable, used: int) -> int:
    """Put the depths from `below` to `above`, each (s, count), on the stack in parts, so that a band that opens and closes
    beside a boundary point is seen; returns the new top."""
    a, n_lower = below
    b, n_b = above
    # Narrower than what two neighbouring points are apart by error alone.
    if b <= a * (1 + 1e-6):
        return size
    lower = a
    for k in range(len(places) + 1):
        upper, n_upper = b, n_b
        if k < len(places):
            upper = a + (b - a) * places[k]
            n_upper, _ = count_at(table, used, upper)
        if n_upper != n_lower:
            size = put_cell(stack, size, lower, n_lower, upper, n_upper)
        lower, n_lower = upper, n_upper
    return size


@inner_njit(cache=True, nogil=True)
def explain_counts(points: Array, counts: IndexArray, levels: FloatArray, table: ThetaTable, used: int) -> bool:
    """Whether the points explain the count at every level and at the depths where `split` would look."""
    for l in range(levels.size):
        if not explains(points, levels[l], counts[l]):
            return False
    for p in range(points.size):
        s = points[p].s
        above = number_below(levels, s, False)
        a = levels[above - 1] if above > 0 else 0.0
        b = levels[above] if above < levels.size else levels[-1]
        for place in FRACTIONS_BELOW_ROOT:
            m = a + (s - a) * place
            if not explains(points, m, count_at(table, used, m)[0]):
                return False
        for place in FRACTIONS_ABOVE_ROOT:
            m = s + (b - s) * place
            if not explains(points, m, count_at(table, used, m)[0]):
                return False
    return True


@inner_njit(cache=True, nogil=True)
def explains(points: Array, s: float, count: int) -> bool:
    """Whether the points below s make up the count there (one within its error of s may count either way)."""
    total = 0
    for p in range(points.size):
        if abs(points[p].s - s) <= points[p].error + 1e-9 * s:
            return True
        if points[p].s < s:
            total += int(points[p].change)
    return total == count

# Code of other modules in these kernels: 6cf8238174f2
