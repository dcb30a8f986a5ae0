"""Compiled theta nodes of FloquetDeterminant: the first ones, cold or warm, and those kept for a neighbouring problem."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint._inner_kernels import inner_njit
from toolpoint.cutting.stability.floquet.records import ArcSet, Turning
from toolpoint.cutting.stability.sorting import sort

LARGEST_STEP_COSINE = 0.3624  # cosine of 1.2 rad
KEPT_STEP_COSINE = 0.6216  # cosine of 0.9 rad: room for the change from one chart to the next
MAX_BEND_RATIO = 0.3  # of a value: distance from the line between its neighbours up to which a node is dropped
MAX_NARROW_HALF_WIDTH = 0.3  # rad: wider resonances are resolved by the even base
MAX_KEPT_NODES = 250  # theta nodes kept for a near problem
MAX_MOVED_POLE_FRACTION = 0.2  # of the poles: where more have moved, a cold start is cheaper


@inner_njit(cache=True, nogil=True)
def plain_step(a: complex, b: complex, cosine: float = LARGEST_STEP_COSINE) -> bool:
    """Whether the phase step from a to b is below 1.2 rad (or another angle's cosine)."""
    dot = a.real * b.real + a.imag * b.imag
    size = (a.real * a.real + a.imag * a.imag) * (b.real * b.real + b.imag * b.imag)
    return dot > 0.0 and dot * dot >= cosine * cosine * size


@inner_njit(cache=True, nogil=True)
def first_bad(a: ComplexArray, b: ComplexArray, usable: int, last: bool, cosine: float = LARGEST_STEP_COSINE) -> int:
    """Return the first level at which the phase step is not plain, -1 if none (the value at theta = pi is real)."""
    for l in range(usable):
        end = complex(b[l].real, 0.0) if last else b[l]
        if not plain_step(a[l], end, cosine):
            return l
    return -1


@inner_njit(cache=True, nogil=True)
def loops(nodes: ArcSet, turning: Turning, hint_s: FloatArray, out: ComplexArray) -> None:
    """Write for every pole how large a loop it makes in the determinant at the largest depth, as a complex number."""
    pairs, weight = nodes.pairs, nodes.weight
    for r in range(out.size):
        total = 0.0 + 0.0j
        for j in range(weight.size):
            # The trace: of one dominant mode the matrix has rank one, and its only eigenvalue is that.
            total += weight[j] * pairs[r, j, j]
        out[r] = 2 * turning.w_max * total / (turning.omega * hint_s[r] * turning.period)


@inner_njit(cache=True, nogil=True)
def first_nodes(base: int, hint_w: FloatArray, hint_s: FloatArray, loop: ComplexArray, period: float, kept_nodes: FloatArray,
                last_poles: Array) -> FloatArray:
    """Return the sorted theta nodes of a first scan.

    Cold (`kept_nodes` empty): an even base, and nodes about every sharp pole's own theta. Warm: the nodes kept of a near
    problem, and those about the poles that since they were last looked at have moved by half their half width, changed their
    width by a quarter or their loop by a third; the even base again where such a pole is not sharp.

    base : intervals of the even base; hint_w, hint_s (poles,) float64 : damped frequency and decay, rad/s; loop (poles,)
    complex128; period : s; kept_nodes (n,) float64 : rad; last_poles (poles,) `POLE_STATE` when last looked at; updated.
    """
    warm = kept_nodes.size > 0
    use_base = not warm
    out = np.empty(kept_nodes.size + base + 1 + 5 * hint_w.size)
    n = kept_nodes.size
    for i in range(n):
        out[i] = kept_nodes[i]
    for r in range(hint_w.size):
        half = hint_s[r] * period
        t = (hint_w[r] * period) % (2 * math.pi)
        if warm and is_near(last_poles[r], t, half, loop[r]):
            continue
        if last_poles.shape[0] > 0:
            last_poles[r].theta, last_poles[r].half, last_poles[r].loop = t, half, loop[r]
        if half > MAX_NARROW_HALF_WIDTH:
            use_base = True
            continue
        # A resonance turns the phase by half a turn within a few half widths: five places leave steps below 1.2 rad.
        for x in (-3.0, -1.0, 0.0, 1.0, 3.0):
            y = (t + x * half) % (2 * math.pi)
            # The determinant at 2 pi - theta is the conjugate: half of the circle is all.
            if y > math.pi:
                y = 2 * math.pi - y
            out[n] = y
            n += 1
    if use_base:
        for i in range(base + 1):
            out[n] = math.pi * i / base
            n += 1
    sort(out[:n])
    keep = 1
    for i in range(1, n):
        # A node costs a Hessenberg form; two that coincide would tell the same.
        if out[i] - out[keep - 1] > 1e-9:
            out[keep] = out[i]
            keep += 1
    # Flips are decided there, so the last node is pi to the last digit.
    out[keep - 1] = math.pi
    return out[:keep]


@inner_njit(cache=True, nogil=True)
def are_far(hint_w: FloatArray, hint_s: FloatArray, loop: ComplexArray, period: float, last_poles: Array) -> bool:
    """Whether most poles are no longer as they were when last looked at: then a cold start is cheaper."""
    moved = 0
    for r in range(hint_w.size):
        if not is_near(last_poles[r], (hint_w[r] * period) % (2 * math.pi), hint_s[r] * period, loop[r]):
            moved += 1
    return moved > MAX_MOVED_POLE_FRACTION * hint_w.size


@inner_njit(cache=True, nogil=True)
def is_near(last_pole: Any, t: float, half: float, loop: complex) -> bool:
    """Whether a pole is still much as it was when nodes were last laid about it."""
    gap = abs(t - last_pole.theta)
    gap = min(gap, 2 * math.pi - gap)
    change = abs(loop - last_pole.loop)
    return (gap <= 0.5 * min(half, last_pole.half) and abs(half - last_pole.half) <= 0.25 * last_pole.half
            and change <= 0.3 * abs(last_pole.loop) + 0.1)


@inner_njit(cache=True, nogil=True)
def keep_nodes(theta: FloatArray, order: IndexArray, used: int, at_levels: ComplexArray, usable: int, base: int,
               out: FloatArray) -> int:
    """Write the nodes that a near problem can begin with: as few as leave plain steps, and no bend of the values out.

    A pole whose loop is not yet an encirclement bends the values: nodes that show it stay, and no gap is wider than two
    intervals of the base. Returns their number, 0 where there are too many.
    """
    if used > MAX_KEPT_NODES:
        return 0
    out[0] = theta[order[0]]
    number, a = 1, int(0)  # noqa: RUF046, UP018
    while a < used - 1:
        b = a + 1
        while (b + 1 < used and theta[order[b + 1]] - theta[order[a]] <= 2.01 * math.pi / base
               and straight(theta, order, a, b + 1, used, at_levels, usable)):
            b += 1
        out[number] = theta[order[b]]
        number += 1
        a = b
    return number


@inner_njit(cache=True, nogil=True)
def straight(theta: FloatArray, order: IndexArray, a: int, b: int, used: int, at_levels: ComplexArray, usable: int) -> bool:
    """Whether the nodes between places a and b can be left out."""
    va, vb = at_levels[order[a]], at_levels[order[b]]
    last = b == used - 1
    if first_bad(va, vb, usable, last, KEPT_STEP_COSINE) >= 0:
        return False
    ta, tb = theta[order[a]], theta[order[b]]
    for k in range(a + 1, b):
        part = (theta[order[k]] - ta) / (tb - ta)
        v = at_levels[order[k]]
        for l in range(usable):
            line = va[l] * (1 - part) + vb[l] * part
            gap = v[l] - line
            if gap.real**2 + gap.imag**2 > MAX_BEND_RATIO * MAX_BEND_RATIO * (line.real**2 + line.imag**2):
                return False
    return True

# Code of other modules in these kernels: 10599a54148e
