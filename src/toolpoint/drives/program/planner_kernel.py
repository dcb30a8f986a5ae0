"""Compiled parts of the look-ahead planner: reachable speeds, peaks and sampling of many seven-phase segments.

Imported only when a path is planned: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def change(start, end, a, j):
    """Return (jerk time, constant time, distance) of the fastest change of speed."""
    dv = abs(end - start)
    if dv >= a * a / j:
        t1 = a / j
        t2 = dv / a - t1
    else:
        t1, t2 = math.sqrt(dv / j), 0.0
    return t1, t2, 0.5 * (start + end) * (2.0 * t1 + t2)


@njit(cache=True, nogil=True)
def reachable(start, length, top, a, j):
    """Return the largest speed, at most `top`, that the fastest change from `start` reaches within `length`."""
    if top <= start or change(start, top, a, j)[2] <= length:
        return top
    low, high = start, top
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        if change(start, middle, a, j)[2] <= length:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, nogil=True)
def look_ahead(length, top, junction, a, j, steady):
    """Lower the junction speeds (n + 1) in place until every segment can change from its first to its last.

    A steady segment keeps one speed. Lowering an end never spoils what the backward pass allowed before it.
    """
    n = length.size
    for k in range(n - 1, -1, -1):
        if junction[k] > junction[k + 1]:
            junction[k] = junction[k + 1] if steady[k] else reachable(junction[k + 1], length[k], junction[k], a[k], j[k])
    for k in range(n):
        if junction[k + 1] > junction[k]:
            junction[k + 1] = junction[k] if steady[k] else reachable(junction[k], length[k], junction[k + 1], a[k], j[k])


@njit(cache=True, nogil=True)
def phases(length, top, junction, a, j, times):
    """Write the seven durations of every segment."""
    for k in range(length.size):
        v0, v1 = junction[k], junction[k + 1]
        peak = max(top[k], v0, v1)
        if change(v0, peak, a[k], j[k])[2] + change(peak, v1, a[k], j[k])[2] > length[k]:
            low, high = max(v0, v1), peak
            for _ in range(70):
                middle = 0.5 * (low + high)
                if middle <= low or middle >= high:
                    break
                if change(v0, middle, a[k], j[k])[2] + change(middle, v1, a[k], j[k])[2] <= length[k]:
                    low = middle
                else:
                    high = middle
            peak = low
        a1, a2, up = change(v0, peak, a[k], j[k])
        d1, d2, down = change(peak, v1, a[k], j[k])
        even = max((length[k] - up - down) / peak, 0.0) if peak > 0.0 else 0.0
        for phase, duration in enumerate((a1, a2, a1, even, d1, d2, d1)):
            times[k, phase] = duration


@njit(cache=True, nogil=True)
def sample_motion(times, junction, j, length, step, segment, share, motion):
    """Write segment, share of its length, and (length, speed, acceleration) at every sample; return their number."""
    n, base, clock, at = length.size, 0.0, 0.0, 0
    for k in range(n):
        s, v, a, t0 = 0.0, junction[k], 0.0, clock
        for p in range(7):
            jerk = j[k] if p == 0 or p == 6 else (-j[k] if p == 2 or p == 4 else 0.0)
            t = times[k, p]
            if p == 1 or p == 3 or p == 5:
                a = a if p != 3 else 0.0
            while at < segment.size and at * step < t0 + t:
                d = at * step - t0
                d = max(d, 0.0)
                place = s + v * d + 0.5 * a * d * d + jerk * d * d * d / 6.0
                segment[at], share[at] = k, min(max(place / length[k], 0.0), 1.0) if length[k] > 0.0 else 1.0
                for order, value in enumerate((base + place, v + a * d + 0.5 * jerk * d * d, a + jerk * d)):
                    motion[at, order] = value
                at += 1
            s += v * t + 0.5 * a * t * t + jerk * t * t * t / 6.0
            v += a * t + 0.5 * jerk * t * t
            a += jerk * t
            t0 += t
        clock, base = t0, base + length[k]
    return at
