"""Compiled scan of FloquetDeterminant: theta nodes refined until every phase step is plain, counts, boundary points."""

# mypy: ignore-errors
# numba reads these functions; their argument types are in the docstrings of their callers.
from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint.cutting.stability.floquet.counts import BEFORE, BEYOND, agreed, count_at, counts_of, split, with_flips
from toolpoint.cutting.stability.floquet.kernels import MAX_NODES, MAX_POINTS, horner, node, polished, prepared, root, size_of
from toolpoint.cutting.stability.floquet.nodes import begun, far, first_bad, kept, loops
from toolpoint.cutting.stability.floquet.track import tracked


@nb.njit(cache=True, nogil=True)
def values_at(c, degree, levels, out):
    """Polynomial at all levels."""
    for l in range(levels.size):
        s = levels[l]
        re, im = c[degree].real, c[degree].imag
        for d in range(degree - 1, -1, -1):
            re = re * s + c[d].real
            im = im * s + c[d].imag
        out[l] = complex(re, im)


@nb.njit(cache=True, nogil=True)
def inserted(order, used, new, place):
    """Put node `new` after position `place` of the order."""
    for k in range(used, place + 1, -1):
        order[k] = order[k - 1]
    order[place + 1] = new


@nb.njit(cache=True, nogil=True)
def real_root(c, degree, a, b):
    """Root of the real part between a and b by bisection (its sign differs there)."""
    fa = horner(c, degree, a)[0].real
    for _ in range(200):
        m = 0.5 * (a + b)
        fm = horner(c, degree, m)[0].real
        if (fm > 0) == (fa > 0):
            a = m
        else:
            b = m
        if b - a <= 1e-16 * b:
            break
    return 0.5 * (a + b)


@nb.njit(cache=True, nogil=True)
def scan(speed_period, omega, poles, coarse, fine, hint_w, hint_s, levels, w_max, base, points, memory):
    """Boundary points of one speed.

    coarse, fine = (pairs, weights, partial, angle, static, truncated Hill matrix). points (MAX_POINTS, 4): s, theta, change,
    error. memory = (nodes, numbers, seen, known): what a near problem left, brought up to date: theta nodes, the numbers of
    nodes and of points (-1: none known), poles as last seen, boundary points; of no length where nothing is to be kept.
    Returns (number of points, status, largest s resolved): status 0 good, 1 not resolved to s = 1, 2 points ran out, 3 a
    point unpolished.
    """
    nodes, numbers, seen, known = memory
    warm = nodes.size > 0
    pairs, weights, partial, angle, static, lines = coarse
    period = speed_period
    loop = np.zeros(hint_w.size, np.complex128)
    if warm:
        loops(pairs, weights, hint_s, period, omega, w_max, loop)
        if far(hint_w, hint_s, loop, period, seen):
            numbers[0], numbers[1] = 0, -1
    factors = np.exp(poles * period)
    wrapped, direct = prepared(period, omega, poles, pairs, weights, partial, angle, static)
    green = (wrapped, direct, lines)
    q = size_of(lines, angle)
    work = np.empty((q, q), np.complex128)
    minors = np.zeros((q + 1, q + 1), np.complex128)
    theta = np.empty(MAX_NODES)
    start = begun(base, hint_w, hint_s, loop, period, nodes[:numbers[0]].copy(), seen)
    used = start.size
    c = np.empty((MAX_NODES, q + 1), np.complex128)
    degrees = np.zeros(MAX_NODES, np.int64)
    order = np.zeros(MAX_NODES, np.int64)
    at_levels = np.empty((MAX_NODES, levels.size), np.complex128)
    status, usable = 0, levels.size
    for i in range(used):
        theta[i] = start[i]
        degrees[i] = node(theta[i], w_max, period, factors, green, work, minors, c[i])
        values_at(c[i], degrees[i], levels, at_levels[i])
        order[i] = i
    k = 0
    while k < used - 1:
        i, j = order[k], order[k + 1]
        bad = first_bad(at_levels[i], at_levels[j], usable, k == used - 2)
        if bad < 0:
            k += 1
            continue
        # Steps that stay wild on ever shorter intervals are rounding noise: such depths are beyond double precision.
        if theta[j] - theta[i] < 1e-8 or used >= MAX_NODES - 2 * MAX_POINTS:
            usable = bad if theta[j] - theta[i] < 1e-8 else min(bad, (3 * usable) // 4)
            status = 1
            if usable == 0:
                break
            continue
        theta[used] = 0.5 * (theta[i] + theta[j])
        degrees[used] = node(theta[used], w_max, period, factors, green, work, minors, c[used])
        values_at(c[used], degrees[used], levels, at_levels[used])
        inserted(order, used, used, k)
        used += 1
    top = levels[usable - 1] if usable > 0 else 0.0
    if warm:
        numbers[0] = kept(theta, order, used, at_levels, usable, base, nodes) if status == 0 else 0
    counts = counts_of(order, used, at_levels, usable)
    levels, counts = with_flips(order, used, c, degrees, levels[:usable], counts)
    slopes = np.zeros(MAX_POINTS, np.complex128)
    found = -1
    if warm and numbers[1] >= 0 and status == 0:
        found = tracked(known[:numbers[1]], green, (work, minors, c[MAX_NODES - 1]), fine, poles, factors, w_max, period, omega,
                        points, slopes)
        if found >= 0 and not agreed(points, found, counts, levels, order, used, c, degrees):
            found = -1
    if found < 0:
        slopes[:] = 0.0
        found, used, state = boundaries(theta, order, used, c, degrees, levels, counts, w_max, period, factors, green, work,
                                        minors, points)
        status = max(status, state)
        if found > 0:
            improve(points, found, fine, poles, factors, w_max, period, omega)
    if warm:
        numbers[1] = found if status == 0 else -1
        for p in range(found):
            known[p, :4], known[p, 4], known[p, 5] = points[p], slopes[p].real, slopes[p].imag
    return found, status, top


@nb.njit(cache=True, nogil=True)
def boundaries(theta, order, used, c, degrees, levels, counts, w_max, period, factors, green, work, minors, points):
    """Every change of the count between levels, narrowed by bisection and polished."""
    stack = np.empty((400, 4))
    top, found, status = 0, 0, 0
    s0, n0 = 0.0, 0
    for l in range(levels.size):
        n = counts[l]
        if n != n0:
            stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3] = s0, n0, levels[l], n
            top += 1
        s0, n0 = levels[l], n
    first = 0
    while first < top:
        top -= 1
        a, na, b, nb_ = stack[top, 0], int(stack[top, 1]), stack[top, 2], int(stack[top, 3])
        if na == nb_:
            continue
        if found >= MAX_POINTS or top > 380 or used >= MAX_NODES - 1:
            status = 2
            break
        m = 0.5 * (a + b)
        nm, place = count_at(order, used, c, degrees, m)
        if (nb_ - na) % 2 != 0:
            flip = order[used - 1]
            s = real_root(c[flip], degrees[flip], a, b)
            points[found, 0], points[found, 1], points[found, 3] = s, math.pi, 0.0
            low, _ = count_at(order, used, c, degrees, s * (1 - 1e-9))
            high, _ = count_at(order, used, c, degrees, s * (1 + 1e-9))
            if (high - low) % 2 == 0 or abs(high - low) > 2:
                high, low = (nb_, na) if abs(nb_ - na) == 1 else (na + 1, na)
            points[found, 2] = high - low
            found += 1
            top = split(stack, top, a, na, s * (1 - 1e-9), low, BEFORE, order, used, c, degrees)
            top = split(stack, top, s * (1 + 1e-9), high, b, nb_, BEYOND, order, used, c, degrees)
            continue
        ta, tb = theta[order[place]], theta[order[place + 1]]
        end = tb
        if place == used - 2:
            end = 2 * math.pi - ta
        t, s, sense, ok = polished(ta, end, 0.5 * (ta + tb), complex(m, 0.0), w_max, period, factors, green, work,
                                   minors, c[used])
        if t > math.pi:
            t = 2 * math.pi - t
        inside = ok and a < s < b and ta - 0.5 * (tb - ta) <= t <= tb + 0.5 * (tb - ta) and t > 0 and t < math.pi
        if inside:
            at = 0
            while at < used - 1 and theta[order[at + 1]] <= t:
                at += 1
            if theta[order[at]] == t or at >= used - 1:
                inside = False
        if inside:
            theta[used] = t
            degrees[used] = node(t, w_max, period, factors, green, work, minors, c[used])
            inserted(order, used, used, at)
            used += 1
            points[found, 0], points[found, 1], points[found, 2], points[found, 3] = s, t, sense, 0.0
            found += 1
            low, _ = count_at(order, used, c, degrees, s * (1 - 1e-7))
            high, _ = count_at(order, used, c, degrees, s * (1 + 1e-7))
            if high - low != sense:
                points[found - 1, 2] = high - low
            top = split(stack, top, a, na, s * (1 - 1e-7), low, BEFORE, order, used, c, degrees)
            top = split(stack, top, s * (1 + 1e-7), high, b, nb_, BEYOND, order, used, c, degrees)
            continue
        if b - a < 1e-7 * b:
            points[found, 0], points[found, 1] = m, 0.5 * (ta + tb)
            points[found, 2], points[found, 3] = nb_ - na, b - a
            found += 1
            status = 3
            continue
        stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3] = a, na, m, nm
        stack[top + 1, 0], stack[top + 1, 1], stack[top + 1, 2], stack[top + 1, 3] = m, nm, b, nb_
        top += 2
    return found, used, status


@nb.njit(cache=True, nogil=True)
def improve(points, found, fine, poles, factors, w_max, period, omega):
    """Solve every point again with more nodes on the arc; the difference is its error."""
    pairs, weights, partial, angle, static, lines = fine
    wrapped, direct = prepared(period, omega, poles, pairs, weights, partial, angle, static)
    green = (wrapped, direct, lines)
    q = size_of(lines, angle)
    work = np.empty((q, q), np.complex128)
    minors = np.zeros((q + 1, q + 1), np.complex128)
    c = np.zeros(q + 1, np.complex128)
    for p in range(found):
        s, t = points[p, 0], points[p, 1]
        if t == math.pi:
            degree = node(t, w_max, period, factors, green, work, minors, c)
            new = root(c, degree, complex(s, 0.0)).real
            ok = True
        else:
            span = min(2e-2, 0.2 * t, 0.2 * (math.pi - t))
            t, new, _, ok = polished(t - span, t + span, t, complex(s, 0.0), w_max, period, factors, green, work,
                                     minors, c)
            if t > math.pi:
                t = 2 * math.pi - t
        error = abs(new - s) + 2e-10 * s  # rounding of the determinant
        if ok and error < 0.1 * s:
            points[p, 0], points[p, 1] = new, t
            points[p, 3] += error
        else:
            points[p, 3] += max(error, 0.05 * s)


@nb.njit(cache=True, nogil=True)
def scan_many(periods, omegas, poles, coarse, fine, hint_w, hint_s, levels, w_max, base, points, found, status, top, memory):
    """Scan all speeds; points (n, MAX_POINTS, 4), found, status and top (n,).

    memory = (nodes (n, MOST_KEPT), numbers (n, 2), seen (n, poles, 4), known (n, MAX_POINTS, 6)), see `scan`.
    """
    nodes, numbers, seen, known = memory
    for i in range(periods.size):
        found[i], status[i], top[i] = scan(periods[i], omegas[i], poles, coarse, fine, hint_w, hint_s, levels, w_max, base,
                                           points[i], (nodes[i], numbers[i], seen[i], known[i]))
