"""Compiled tracking of FloquetDeterminant's boundary points from a near problem, accepted only where every count agrees."""

from __future__ import annotations

import math

import numpy as np

from toolpoint._check import Array, ComplexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.floquet.kernels import green_at, node_at, put_point, room_of, root
from toolpoint.cutting.stability.floquet.records import ArcSet, Green, Room, Turning

DETERMINANT_ROUNDING = 2e-10  # relative, of the determinant


@inner_njit(cache=True, nogil=True)
def follow(theta: float, guess: complex, slope: complex, turning: Turning, green: Green, room: Room,
           c: ComplexArray) -> tuple[float, float, complex, bool]:
    """Return the crossing near (theta, guess) by the secant rule on Im s: (theta, s, ds/dtheta, whether it is there).

    slope : ds/dtheta to begin with, zero where it is not known.
    """
    s0, t0 = guess, theta
    degree = node_at(green.node, (t0, turning, green, room, c))
    s0 = root(c, degree, s0)
    if slope.imag == 0.0:
        t1 = t0 + 1e-4
    else:
        # A slope kept from the pose before may be off where two roots come close: no step leaves the neighbourhood.
        t1 = t0 - max(-0.1, min(0.1, s0.imag / slope.imag))
    for _ in range(8):
        if abs(s0.imag) < 1e-12 * abs(s0) and slope.imag != 0.0:
            return t0, s0.real, slope, s0.real > 0
        # At 0 and pi a pair becomes two real multipliers: that is another kind of point, and the count is taken anew.
        if t1 == t0 or not 1e-9 < t1 < math.pi - 1e-9:
            break
        degree = node_at(green.node, (t1, turning, green, room, c))
        s1 = root(c, degree, s0)
        slope = (s1 - s0) / (t1 - t0)
        if slope.imag == 0.0:
            break
        t0, s0 = t1, s1
        t1 = t0 - s0.imag / slope.imag
        if abs(t1 - t0) > 0.1:
            break
    return t0, s0.real, slope, False


@inner_njit(cache=True, nogil=True)
def track(previous: Array, coarse: Green, coarse_room: Room, coarse_c: ComplexArray, fine: ArcSet, turning: Turning,
          points: Array) -> int:
    """Follow the known points to this problem on the fine nodes; the change on the coarse ones is the error.

    coarse : Green matrix of the coarse nodes, with room for its determinant; fine : the other set of nodes. Returns the number
    of points below s = 1, -1 where one got lost.
    """
    if previous.shape[0] == 0:
        return 0
    green, room = green_at(turning, fine), room_of(fine)
    c = np.zeros(room.work.shape[0] + 1, np.complex128)
    number = int(0)  # noqa: RUF046, UP018
    for k in range(previous.shape[0]):
        s, t, slope, change = previous[k].s, previous[k].theta, previous[k].slope, previous[k].change
        if t == math.pi:
            degree = node_at(green.node, (t, turning, green, room, c))
            value = root(c, degree, complex(s, 0.0))
            if abs(value.imag) > 1e-9 * abs(value) or value.real <= 0:
                return -1
            s = value.real
        else:
            t, s, slope, good = follow(t, complex(s, 0.0), slope, turning, green, room, c)
            if not good:
                return -1
            # 1/s is an eigenvalue of -M: Im(1/s) falling with theta means Im s rising, and the count grows with depth.
            change = 2.0 if slope.imag > 0 else -2.0
        if s >= 1.0:
            continue
        for other in range(number):
            # Two points that ran into one: one of them is lost, so all are.
            if abs(points[other].s - s) < 1e-7 * s and abs(points[other].theta - t) < 1e-7:
                return -1
        degree = node_at(coarse.node, (t, turning, coarse, coarse_room, coarse_c))
        gap = root(coarse_c, degree, complex(s, 0.0)) - s
        # The coarse root at this theta is not real; along ds/dtheta its crossing lies where the imaginary part vanishes.
        shift = gap.real if t == math.pi else gap.real - slope.real / slope.imag * gap.imag
        if not abs(shift) < 0.1 * s:
            return -1
        put_point(points, number, s, t, change, abs(shift) + DETERMINANT_ROUNDING * s)
        points[number].slope = slope
        number += 1
    return number

# Code of other modules in these kernels: 7761872b9cb6
