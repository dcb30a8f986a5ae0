"""Compiled theta nodes of FloquetDeterminant: those to begin with, cold or warm, and those worth keeping for a neighbour."""

# mypy: ignore-errors
# numba reads these functions; their argument types are in the docstrings of their callers.
from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint.cutting.stability.sorting import sort

LARGEST_STEP = 0.3624  # cosine of 1.2 rad
KEPT_STEP = 0.6216  # cosine of 0.9 rad: room for the change from one chart to the next
BENT = 0.3  # a node is dropped where the values of its neighbours, joined by a line, miss its own by less than this share
WIDE = 0.3  # half width, rad, that the even base resolves
MOST_KEPT = 250
FAR = 0.2  # share of poles that may have moved


@nb.njit(cache=True, nogil=True)
def plain_step(a, b, cosine=LARGEST_STEP):
    """Whether the phase step from a to b is below 1.2 rad (or another angle's cosine)."""
    dot = a.real * b.real + a.imag * b.imag
    size = (a.real * a.real + a.imag * a.imag) * (b.real * b.real + b.imag * b.imag)
    return dot > 0.0 and dot * dot >= cosine * cosine * size


@nb.njit(cache=True, nogil=True)
def first_bad(a, b, usable, last, cosine=LARGEST_STEP):
    """The first level at which the phase step is not plain, -1 if none (the value at theta = pi is real)."""
    for l in range(usable):
        end = complex(b[l].real, 0.0) if last else b[l]
        if not plain_step(a[l], end, cosine):
            return l
    return -1


@nb.njit(cache=True, nogil=True)
def loops(nodes, turning, hint_s, out):
    """Write for every pole how large a loop it makes in the determinant at the largest depth, as a complex number."""
    pairs, weight = nodes.pairs, nodes.weight
    for r in range(out.size):
        total = 0.0 + 0.0j
        for j in range(weight.size):
            total += weight[j] * pairs[r, j, j]
        out[r] = 2 * turning.w_max * total / (turning.omega * hint_s[r] * turning.period)


@nb.njit(cache=True, nogil=True)
def first_nodes(base, hint_w, hint_s, loop, period, before, seen):
    """Sorted theta nodes to begin with.

    Cold (`before` empty): an even base, and nodes about every sharp pole's own theta. Warm: the nodes kept of a near problem,
    and those about the poles that since they were last looked at have moved by half their half width, changed their width by
    a quarter or their loop by a third; the even base again where such a pole is not sharp. seen (poles,): `SEEN` of each
    pole when last looked at; brought up to date.
    """
    warm = before.size > 0
    even = not warm
    out = np.empty(before.size + base + 1 + 5 * hint_w.size)
    n = before.size
    for i in range(n):
        out[i] = before[i]
    for r in range(hint_w.size):
        half = hint_s[r] * period
        t = (hint_w[r] * period) % (2 * math.pi)
        if warm and is_near(seen[r], t, half, loop[r]):
            continue
        if seen.shape[0] > 0:
            seen[r].theta, seen[r].half, seen[r].loop = t, half, loop[r]
        if half > WIDE:
            even = True
            continue
        for x in (-3.0, -1.0, 0.0, 1.0, 3.0):
            y = (t + x * half) % (2 * math.pi)
            if y > math.pi:
                y = 2 * math.pi - y
            out[n] = y
            n += 1
    if even:
        for i in range(base + 1):
            out[n] = math.pi * i / base
            n += 1
    sort(out[:n])
    keep = 1
    for i in range(1, n):
        if out[i] - out[keep - 1] > 1e-9:
            out[keep] = out[i]
            keep += 1
    out[keep - 1] = math.pi
    return out[:keep]


@nb.njit(cache=True, nogil=True)
def are_far(hint_w, hint_s, loop, period, seen):
    """Whether most poles are no longer as they were when last looked at: then a cold start is cheaper."""
    moved = 0
    for r in range(hint_w.size):
        if not is_near(seen[r], (hint_w[r] * period) % (2 * math.pi), hint_s[r] * period, loop[r]):
            moved += 1
    return moved > FAR * hint_w.size


@nb.njit(cache=True, nogil=True)
def is_near(seen, t, half, loop):
    """Whether a pole is still much as it was when nodes were last laid about it."""
    gap = abs(t - seen.theta)
    gap = min(gap, 2 * math.pi - gap)
    change = abs(loop - seen.loop)
    return (gap <= 0.5 * min(half, seen.half) and abs(half - seen.half) <= 0.25 * seen.half
            and change <= 0.3 * abs(seen.loop) + 0.1)


@nb.njit(cache=True, nogil=True)
def keep_nodes(theta, order, used, at_levels, usable, base, out):
    """Write the nodes that a near problem can begin with: as few as leave plain steps, and no bend of the values out.

    A pole whose loop is not yet an encirclement bends the values: nodes that show it stay, and no gap is wider than two
    intervals of the base. Returns their number, 0 where there are too many.
    """
    if used > MOST_KEPT:
        return 0
    out[0] = theta[order[0]]
    number, a = 1, 0
    while a < used - 1:
        b = a + 1
        while (b + 1 < used and theta[order[b + 1]] - theta[order[a]] <= 2.01 * math.pi / base
               and straight(theta, order, a, b + 1, used, at_levels, usable)):
            b += 1
        out[number] = theta[order[b]]
        number += 1
        a = b
    return number


@nb.njit(cache=True, nogil=True)
def straight(theta, order, a, b, used, at_levels, usable):
    """Whether the nodes between places a and b can be left out."""
    va, vb = at_levels[order[a]], at_levels[order[b]]
    last = b == used - 1
    if first_bad(va, vb, usable, last, KEPT_STEP) >= 0:
        return False
    ta, tb = theta[order[a]], theta[order[b]]
    for k in range(a + 1, b):
        part = (theta[order[k]] - ta) / (tb - ta)
        v = at_levels[order[k]]
        for l in range(usable):
            line = va[l] * (1 - part) + vb[l] * part
            gap = v[l] - line
            if gap.real**2 + gap.imag**2 > BENT * BENT * (line.real**2 + line.imag**2):
                return False
    return True
