"""Compiled tracking of FloquetDeterminant's boundary points from a near problem, accepted only where every count agrees."""

# mypy: ignore-errors
# numba reads these functions; their argument types are in the docstrings of their callers.
from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint.cutting.stability.floquet.kernels import node, prepared, root, size_of

ROUNDING = 2e-10  # relative, of the determinant


@nb.njit(cache=True, nogil=True)
def followed(theta, guess, slope, w_max, period, factors, green, work, minors, c):
    """Crossing near (theta, guess) by the secant rule on Im s: (theta, s, ds/dtheta, whether found).

    slope : ds/dtheta to begin with, zero where it is not known.
    """
    s0, t0 = guess, theta
    degree = node(t0, w_max, period, factors, green, work, minors, c)
    s0 = root(c, degree, s0)
    if slope.imag == 0.0:
        t1 = t0 + 1e-4
    else:
        t1 = t0 - max(-0.1, min(0.1, s0.imag / slope.imag))
    for _ in range(8):
        if abs(s0.imag) < 1e-12 * abs(s0) and slope.imag != 0.0:
            return t0, s0.real, slope, s0.real > 0
        if t1 == t0 or not 1e-9 < t1 < math.pi - 1e-9:
            break
        degree = node(t1, w_max, period, factors, green, work, minors, c)
        s1 = root(c, degree, s0)
        slope = (s1 - s0) / (t1 - t0)
        if slope.imag == 0.0:
            break
        t0, s0 = t1, s1
        t1 = t0 - s0.imag / slope.imag
        if abs(t1 - t0) > 0.1:
            break
    return t0, s0.real, slope, False


@nb.njit(cache=True, nogil=True)
def tracked(known, coarse, coarse_work, fine, poles, factors, w_max, period, omega, points, slopes):
    """Follow the known points to this problem on the fine nodes; the change on the coarse ones is the error.

    coarse : Green matrices of the coarse nodes; coarse_work : room for their determinant. Returns the number of points below
    s = 1, -1 where one got lost.
    """
    if known.shape[0] == 0:
        return 0
    pairs, weights, partial, angle, static, lines = fine
    wrapped, direct = prepared(period, omega, poles, pairs, weights, partial, angle, static)
    green = (wrapped, direct, lines)
    q = size_of(lines, angle)
    work = np.empty((q, q), np.complex128)
    minors = np.zeros((q + 1, q + 1), np.complex128)
    c = np.zeros(q + 1, np.complex128)
    rough, rough_minors, rough_c = coarse_work
    found = 0
    for k in range(known.shape[0]):
        s, t = known[k, 0], known[k, 1]
        slope = complex(known[k, 4], known[k, 5])
        if t == math.pi:
            degree = node(t, w_max, period, factors, green, work, minors, c)
            value = root(c, degree, complex(s, 0.0))
            if abs(value.imag) > 1e-9 * abs(value) or value.real <= 0:
                return -1
            s, change = value.real, known[k, 2]
        else:
            t, s, slope, good = followed(t, complex(s, 0.0), slope, w_max, period, factors, green, work, minors, c)
            if not good:
                return -1
            # 1/s is an eigenvalue of -M: Im(1/s) falling with theta means Im s rising, and the count grows with depth.
            change = 2 if slope.imag > 0 else -2
        if s >= 1.0:
            continue
        for other in range(found):
            if abs(points[other, 0] - s) < 1e-7 * s and abs(points[other, 1] - t) < 1e-7:
                return -1
        degree = node(t, w_max, period, factors, coarse, rough, rough_minors, rough_c)
        gap = root(rough_c, degree, complex(s, 0.0)) - s
        shift = gap.real if t == math.pi else gap.real - slope.real / slope.imag * gap.imag
        if not abs(shift) < 0.1 * s:
            return -1
        points[found, 0], points[found, 1], points[found, 2] = s, t, change
        points[found, 3] = abs(shift) + ROUNDING * s
        slopes[found] = slope
        found += 1
    return found
