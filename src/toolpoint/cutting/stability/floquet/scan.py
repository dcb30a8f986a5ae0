r"""Compiled scan of FloquetDeterminant: theta nodes refined until every phase step is plain, counts, boundary points.

At fixed depth s the number of unstable multipliers is minus the phase that D(theta, s) gathers over theta in [0, pi], over pi
(the argument principle; D(2 pi - theta) is the conjugate). D is a polynomial in s at every theta node, so one set of nodes
serves all depths: a new node goes between two whose phase step is above 1.2 rad at any level. Where the count changes between
two depths a root s(theta) crosses the real axis; it lies where the phase step is largest, which is where the secant rule for
Im s(theta) = 0 begins. A point is put to the table as a node of its own, so the counts beside it are exact.

Counters begin with ``int(0)``: what is called with a literal is compiled for the literal and once more for any integer.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.floquet.counts import (
    add_flips,
    count_at,
    counts_of,
    explain_counts,
    put_cell,
    split,
)
from toolpoint.cutting.stability.floquet.kernels import (
    MAX_NODES,
    MAX_POINTS,
    green_at,
    horner,
    node_at,
    polish,
    put_point,
    room_of,
    root,
    turning_at,
)
from toolpoint.cutting.stability.floquet.nodes import LARGEST_STEP_COSINE, are_far, first_bad, first_nodes, keep_nodes, loops
from toolpoint.cutting.stability.floquet.records import CELL, ArcSet, Green, Room, ScanMemory, ThetaTable, Turning
from toolpoint.cutting.stability.floquet.track import track
from toolpoint.cutting.stability.levels import FRACTIONS_ABOVE_ROOT, FRACTIONS_BELOW_ROOT


@inner_njit(cache=True, nogil=True)
def values_at(c: ComplexArray, degree: int, levels: FloatArray, out: ComplexArray) -> None:
    """Write the polynomial at all levels."""
    for l in range(levels.size):
        s = levels[l]
        re, im = c[degree].real, c[degree].imag
        for d in range(degree - 1, -1, -1):
            re = re * s + c[d].real
            im = im * s + c[d].imag
        out[l] = complex(re, im)


@inner_njit(cache=True, nogil=True)
def insert(order: IndexArray, used: int, new: int, place: int) -> None:
    """Put node `new` after position `place` of the order."""
    for k in range(used, place + 1, -1):
        order[k] = order[k - 1]
    order[place + 1] = new


@inner_njit(cache=True, nogil=True)
def real_root(c: ComplexArray, degree: int, a: float, b: float) -> float:
    """Return the root of the real part between a and b by bisection (its sign differs there)."""
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


# Within `scan_many`, its one caller: apart, all below it would be compiled twice.
@nb.njit(cache=True, nogil=True, inline="always")
def scan(turning: Turning, coarse: ArcSet, fine: ArcSet, levels: FloatArray, base: int, points: Array,
         memory: ScanMemory) -> tuple[int, int, float]:
    """Solve for the boundary points of one speed.

    coarse, fine : `ArcSet`; the points are solved on the coarse one, and again on the fine one, their change is the error.
    levels : depths s at which the count is taken; base : theta intervals before refinement; points (MAX_POINTS,) of `POINT`
    are written; memory : `ScanMemory` of this speed. Returns (number of points, status, largest s resolved): status 0 good, 1
    not resolved to s = 1, 2 points ran out, 3 a point unpolished.
    """
    numbers, last_poles = memory.numbers, memory.poles
    warm = memory.nodes.size > 0
    size = turning.poles.size
    hint_w, hint_s, loop = np.empty(size), np.empty(size), np.zeros(size, np.complex128)
    for r in range(size):
        hint_w[r], hint_s[r] = abs(turning.poles[r].imag), -turning.poles[r].real
    if warm:  # nodes and points of the pose before say where to look; poles that moved far make them worthless
        loops(coarse, turning, hint_s, loop)
        if are_far(hint_w, hint_s, loop, turning.period, last_poles):
            numbers[0].nodes, numbers[0].points = 0, -1
    green, room = green_at(turning, coarse), room_of(coarse)
    start = first_nodes(base, hint_w, hint_s, loop, turning.period, memory.nodes[:numbers[0].nodes].copy(), last_poles)
    columns = room.work.shape[0] + 1
    table = ThetaTable(np.empty(MAX_NODES), np.zeros(MAX_NODES, np.int64), np.empty((MAX_NODES, columns), np.complex128),
                       np.zeros(MAX_NODES, np.int64))
    at_levels = np.empty((MAX_NODES, levels.size), np.complex128)
    used, usable, status = lay_nodes(table, start, at_levels, levels, turning, green, room)
    resolved = levels[usable - 1] if usable > 0 else 0.0
    if warm:
        kept = keep_nodes(table.theta, table.order, used, at_levels, usable, base, memory.nodes)
        numbers[0].nodes = kept if status == 0 else 0
    counts = counts_of(table.order, used, at_levels, usable)
    depths, counts = add_flips(table, used, levels[:usable], counts)
    number = -1
    if warm and numbers[0].points >= 0 and status == 0:
        # Followed points count only if they explain the counts at every level; else all is looked for anew.
        number = track(memory.points[:numbers[0].points], green, room, table.coefficient[MAX_NODES - 1], fine, turning, points)
        if number >= 0 and not explain_counts(points[:number], counts, depths, table, used):
            number = -1
    if number < 0:
        number, state = boundaries(table, used, depths, counts, turning, green, room, points)
        status = max(status, state)
        if number > 0:
            improve(points[:number], fine, turning)
    if warm:
        numbers[0].points = number if status == 0 else -1
        for p in range(number):
            memory.points[p] = points[p]
    return number, status, resolved


@inner_njit(cache=True, nogil=True)
def lay_nodes(table: ThetaTable, start: FloatArray, at_levels: ComplexArray, levels: FloatArray, turning: Turning, green: Green,
              room: Room) -> tuple[int, int, int]:
    """Fill the table with the first theta nodes, and with nodes between them until every phase step is plain at every level;
    returns (number of nodes, number of levels that are resolved, status)."""
    theta, order, c, degree = table.theta, table.order, table.coefficient, table.degree
    used, status, usable = start.size, 0, levels.size
    for i in range(used):
        theta[i] = start[i]
        degree[i] = node_at(green.node, (theta[i], turning, green, room, c[i]))
        values_at(c[i], degree[i], levels, at_levels[i])
        order[i] = i
    k = int(0)  # noqa: RUF046, UP018
    while k < used - 1:
        i, j = order[k], order[k + 1]
        bad = first_bad(at_levels[i], at_levels[j], usable, k == used - 2, LARGEST_STEP_COSINE)
        if bad < 0:
            k += 1
            continue
        # Steps that stay wild on ever shorter intervals are rounding noise: such depths are beyond double precision.
        if theta[j] - theta[i] < 1e-8 or used >= MAX_NODES - 2 * MAX_POINTS:
            # Growth with depth makes the deepest levels wild first: where nodes run out, giving up a quarter of them is
            # tried before all.
            usable = bad if theta[j] - theta[i] < 1e-8 else min(bad, (3 * usable) // 4)
            status = 1
            if usable == 0:
                break
            continue
        theta[used] = 0.5 * (theta[i] + theta[j])
        degree[used] = node_at(green.node, (theta[used], turning, green, room, c[used]))
        values_at(c[used], degree[used], levels, at_levels[used])
        insert(order, used, used, k)
        used += 1
    return used, usable, status


@inner_njit(cache=True, nogil=True)
def boundaries(table: ThetaTable, used: int, levels: FloatArray, counts: IndexArray, turning: Turning, green: Green, room: Room,
               points: Array) -> tuple[int, int]:
    """Write every change of the count between levels, narrowed by bisection and polished; returns (number, status)."""
    theta, order, c, degree = table.theta, table.order, table.coefficient, table.degree
    stack = np.empty(400, CELL)
    size, number, n0 = int(0), int(0), int(0)  # noqa: RUF046, UP018
    s0, status = 0.0, 0
    for l in range(levels.size):
        if counts[l] != n0:
            size = put_cell(stack, size, s0, n0, levels[l], counts[l])
        s0, n0 = levels[l], counts[l]
    while size > 0:
        size -= 1
        a, na, b, n_b = stack[size].lower, stack[size].n_lower, stack[size].upper, stack[size].n_upper
        if na == n_b:
            continue
        if number >= MAX_POINTS or size > 380 or used >= MAX_NODES - 1:
            status = 2
            break
        m = 0.5 * (a + b)
        nm, place = count_at(table, used, m)
        if (n_b - na) % 2 != 0:  # an odd change is a flip: D(pi, s) is real and changes its sign
            flip = order[used - 1]
            s = real_root(c[flip], degree[flip], a, b)
            count_below, _ = count_at(table, used, s * (1 - 1e-9))
            count_above, _ = count_at(table, used, s * (1 + 1e-9))
            # A pair crosses so near that a part in 1e9 beside the flip does not tell them apart: the cell's own change is
            # taken.
            if (count_above - count_below) % 2 == 0 or abs(count_above - count_below) > 2:
                count_above, count_below = (n_b, na) if abs(n_b - na) == 1 else (na + 1, na)
            put_point(points, number, s, math.pi, float(count_above - count_below), 0.0)
            number += 1
            size = split(stack, size, (a, na), (s * (1 - 1e-9), count_below), FRACTIONS_BELOW_ROOT, table, used)
            size = split(stack, size, (s * (1 + 1e-9), count_above), (b, n_b), FRACTIONS_ABOVE_ROOT, table, used)
            continue
        ta, tb = theta[order[place]], theta[order[place + 1]]
        end = tb
        if place == used - 2:
            # The last interval is mirrored at pi, so that a pair that meets there is between the two thetas, not at an end.
            end = 2 * math.pi - ta
        t, s, _, ok = polish((ta, end), 0.5 * (ta + tb), complex(m, 0.0), turning, green, room, c[used])
        if t > math.pi:
            t = 2 * math.pi - t
        # The secant rule may have gone to another crossing, which its own cell will give: only one of this cell counts.
        inside = ok and a < s < b and ta - 0.5 * (tb - ta) <= t <= tb + 0.5 * (tb - ta) and t > 0 and t < math.pi
        if inside:
            position = int(0)  # noqa: RUF046, UP018
            while position < used - 1 and theta[order[position + 1]] <= t:
                position += 1
            if theta[order[position]] == t or position >= used - 1:
                inside = False
        if inside:
            theta[used] = t
            degree[used] = node_at(green.node, (t, turning, green, room, c[used]))
            insert(order, used, used, position)
            used += 1
            count_below, _ = count_at(table, used, s * (1 - 1e-7))
            count_above, _ = count_at(table, used, s * (1 + 1e-7))
            put_point(points, number, s, t, float(count_above - count_below), 0.0)
            number += 1
            size = split(stack, size, (a, na), (s * (1 - 1e-7), count_below), FRACTIONS_BELOW_ROOT, table, used)
            size = split(stack, size, (s * (1 + 1e-7), count_above), (b, n_b), FRACTIONS_ABOVE_ROOT, table, used)
            continue
        # As narrow as the polished points are exact: further halving would not separate what is left.
        if b - a < 1e-7 * b:
            put_point(points, number, m, 0.5 * (ta + tb), float(n_b - na), b - a)
            number += 1
            status = 3
            continue
        size = put_cell(stack, size, a, na, m, nm)
        size = put_cell(stack, size, m, nm, b, n_b)
    return number, status


@inner_njit(cache=True, nogil=True)
def improve(points: Array, fine: ArcSet, turning: Turning) -> None:
    """Solve every point again with more nodes on the arc; the difference is its error."""
    green, room = green_at(turning, fine), room_of(fine)
    c = np.zeros(room.work.shape[0] + 1, np.complex128)
    for p in range(points.size):
        s, t = points[p].s, points[p].theta
        if t == math.pi:
            degree = node_at(green.node, (t, turning, green, room, c))
            new = root(c, degree, complex(s, 0.0)).real
            ok = True
        else:
            # The finer nodes move a point by far less; a wider span could reach the mirror image beyond 0 or pi.
            span = min(2e-2, 0.2 * t, 0.2 * (math.pi - t))
            t, new, _, ok = polish((t - span, t + span), t, complex(s, 0.0), turning, green, room, c)
            if t > math.pi:
                t = 2 * math.pi - t
        error = abs(new - s) + 2e-10 * s  # rounding of the determinant
        if ok and error < 0.1 * s:
            points[p].s, points[p].theta = new, t
            points[p].error += error
        else:
            points[p].error += max(error, 0.05 * s)


@nb.njit(cache=True, nogil=True)
def scan_many(periods: FloatArray, omegas: FloatArray, w_max: float, poles: ComplexArray, sets: tuple[ArcSet, ArcSet],
              levels: FloatArray, base: int, points: Array, memory: ScanMemory) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Scan all speeds; `points` (n, MAX_POINTS) are written, sets = (coarse, fine), `memory` has a leading axis over
    speeds.

    Returns (number of points, status, largest s resolved) of every speed.
    """
    number, status, resolved = np.zeros(periods.size, np.int64), np.zeros(periods.size, np.int64), np.zeros(periods.size)
    coarse, fine = sets
    for i in range(periods.size):
        turning = turning_at(periods[i], omegas[i], w_max, poles)
        memory_of_speed = ScanMemory(memory.nodes[i], memory.numbers[i:i + 1], memory.poles[i], memory.points[i])
        number[i], status[i], resolved[i] = scan(turning, coarse, fine, levels, base, points[i], memory_of_speed)
    return number, status, resolved

# Code of other modules in these kernels: be814ae6fb66
