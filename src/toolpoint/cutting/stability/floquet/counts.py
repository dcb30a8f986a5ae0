"""Compiled counts of FloquetDeterminant: unstable multipliers at a depth, and where between depths to look again."""

# mypy: ignore-errors
# numba reads these functions; their argument types are in the docstrings of their callers.
from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint.cutting.stability.floquet.kernels import horner

PARTS = 8  # in which the depths between two levels are looked at for flips
# Where between a boundary point and its neighbours the count is looked at once more.
BEFORE, BEYOND = (1 / 3, 2 / 3), (1 / 8, 1 / 2)


@nb.njit(cache=True, nogil=True)
def count_at(table, used, s):
    """(N, place of the largest phase step) at s: N = -(phase of D from 0 to pi)/pi, always a whole number."""
    order, c, degree = table.order, table.coefficient, table.degree
    total, worst, place = 0.0, -1.0, 0
    before = 1.0 + 0.0j
    for k in range(used):
        i = order[k]
        now, _ = horner(c[i], degree[i], s)
        if k == used - 1:
            now = complex(now.real, 0.0)
        if k > 0:
            step = math.atan2(before.real * now.imag - before.imag * now.real, before.real * now.real + before.imag * now.imag)
            total += step
            if abs(step) > worst:
                worst, place = abs(step), k - 1
        before = now
    return int(np.round(-total / math.pi)), place


@nb.njit(cache=True, nogil=True)
def counts_of(order, used, at_levels, number):
    """N at the first levels from the determinant's values there."""
    out = np.empty(number, np.int64)
    for l in range(number):
        total = 0.0
        before = at_levels[order[0], l]
        for k in range(1, used):
            now = at_levels[order[k], l]
            if k == used - 1:
                now = complex(now.real, 0.0)
            turned = now * before.conjugate()
            total += math.atan2(turned.imag, turned.real)
            before = now
        out[l] = int(np.round(-total / math.pi))
    return out


@nb.njit(cache=True, nogil=True)
def add_flips(table, used, levels, counts):
    """The levels and their counts, and those of depths between where the real determinant at theta = pi changes its sign and
    back: a flip lobe that opens and closes there."""
    last = table.order[used - 1]
    c, degree = table.coefficient[last], table.degree[last]
    out, more = np.empty(levels.size * PARTS), np.empty(levels.size * PARTS, np.int64)
    n = 0
    a, sign_a = 0.0, True
    for l in range(levels.size):
        sign_b = horner(c, degree, levels[l])[0].real > 0
        for k in range(1, PARTS):
            m = a + (levels[l] - a) * k / PARTS
            if sign_a == sign_b and (horner(c, degree, m)[0].real > 0) != sign_a:
                out[n] = m
                more[n], _ = count_at(table, used, m)
                n += 1
        out[n], more[n] = levels[l], counts[l]
        n += 1
        a, sign_a = levels[l], sign_b
    return out[:n], more[:n]


@nb.njit(cache=True, nogil=True)
def put_cell(stack, top, low, n_low, high, n_high):
    """Put two depths with their counts on the stack; returns the new top."""
    stack[top].low, stack[top].n_low, stack[top].high, stack[top].n_high = low, n_low, high, n_high
    return top + 1


@nb.njit(cache=True, nogil=True)
def split(stack, top, below, above, places, table, used):
    """Put the depths from `below` to `above`, each (s, count), on the stack in parts, so that a band that opens and closes
    beside a boundary point is seen; returns the new top."""
    a, n_low = below
    b, n_b = above
    if b <= a * (1 + 1e-6):
        return top
    low = a
    for k in range(len(places) + 1):
        high, n_high = b, n_b
        if k < len(places):
            high = a + (b - a) * places[k]
            n_high, _ = count_at(table, used, high)
        if n_high != n_low:
            top = put_cell(stack, top, low, n_low, high, n_high)
        low, n_low = high, n_high
    return top


@nb.njit(cache=True, nogil=True)
def explain_counts(points, counts, levels, table, used):
    """Whether the points explain the count at every level and at the depths where `split` would look."""
    for l in range(levels.size):
        if not explains(points, levels[l], counts[l]):
            return False
    for p in range(points.size):
        s = points[p].s
        above = np.searchsorted(levels, s)
        a = levels[above - 1] if above > 0 else 0.0
        b = levels[above] if above < levels.size else levels[-1]
        for place in BEFORE:
            m = a + (s - a) * place
            if not explains(points, m, count_at(table, used, m)[0]):
                return False
        for place in BEYOND:
            m = s + (b - s) * place
            if not explains(points, m, count_at(table, used, m)[0]):
                return False
    return True


@nb.njit(cache=True, nogil=True)
def explains(points, s, count):
    """Whether the points below s make up the count there (one within its error of s may count either way)."""
    total = 0
    for p in range(points.size):
        if abs(points[p].s - s) <= points[p].error + 1e-9 * s:
            return True
        if points[p].s < s:
            total += int(points[p].change)
    return total == count
