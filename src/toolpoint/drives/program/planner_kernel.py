"""Compiled parts of the look-ahead planner: reachable speeds, peaks and sampling of many seven-phase segments.

Imported only when a path is planned: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def change(start, end, a, j):
    """Return (jerk time, constant time, distance) of the fastest change of speed; m/s, acceleration a, jerk j, all float.

    As `jerk_profile.speed_change`: t1 = a/j, t2 = dv/a - a/j, or t1 = sqrt(dv/j), t2 = 0 where a is not reached.
    """
    dv = abs(end - start)
    if dv >= a * a / j:
        t1 = a / j
        t2 = dv / a - t1
    else:
        t1, t2 = math.sqrt(dv / j), 0.0
    return t1, t2, 0.5 * (start + end) * (2.0 * t1 + t2)


@njit(cache=True, nogil=True)
def reachable(start, length, speed_max, a, j):
    """Return the largest speed, at most `speed_max`, that the fastest change from `start` reaches within `length`."""
    if speed_max <= start or change(start, speed_max, a, j)[2] <= length:
        return speed_max
    lower, upper = start, speed_max
    # More halvings than a double has digits; it ends where no number is left in between.
    for _ in range(60):
        middle = 0.5 * (lower + upper)
        if middle <= lower or middle >= upper:
            break
        if change(start, middle, a, j)[2] <= length:
            lower = middle
        else:
            upper = middle
    return lower


@njit(cache=True, nogil=True)
def look_ahead(length, speed_max, junction, a, j, steady):
    """Lower the junction speeds (n + 1) in place until every segment can change from its first to its last.

    A steady segment keeps one speed. Lowering an end never spoils what the backward pass allowed before it.

    length, speed_max, a, j (n,) float64 : m, m/s, m/s^2, m/s^3 of every segment; junction (n + 1,) float64, m/s, changed;
    steady (n,) bool.
    """
    n = length.size
    for k in range(n - 1, -1, -1):
        if junction[k] > junction[k + 1]:
            junction[k] = junction[k + 1] if steady[k] else reachable(junction[k + 1], length[k], junction[k], a[k], j[k])
    for k in range(n):
        if junction[k + 1] > junction[k]:
            junction[k + 1] = junction[k] if steady[k] else reachable(junction[k], length[k], junction[k + 1], a[k], j[k])


@njit(cache=True, nogil=True)
def phases(length, speed_max, junction, a, j, times):
    """Write the seven durations of every segment into times (n, 7) float64, s; the other arrays as in `look_ahead`.

    The peak speed is `speed_max`, or where the segment is too short the one whose two changes take just its length, by
    bisection.
    """
    for k in range(length.size):
        v0, v1 = junction[k], junction[k + 1]
        peak = max(speed_max[k], v0, v1)
        if change(v0, peak, a[k], j[k])[2] + change(peak, v1, a[k], j[k])[2] > length[k]:
            lower, upper = max(v0, v1), peak
            for _ in range(70):
                middle = 0.5 * (lower + upper)
                if middle <= lower or middle >= upper:
                    break
                if change(v0, middle, a[k], j[k])[2] + change(middle, v1, a[k], j[k])[2] <= length[k]:
                    lower = middle
                else:
                    upper = middle
            peak = lower
        a1, a2, up = change(v0, peak, a[k], j[k])
        d1, d2, down = change(peak, v1, a[k], j[k])
        cruise = max((length[k] - up - down) / peak, 0.0) if peak > 0.0 else 0.0
        for phase, duration in enumerate((a1, a2, a1, cruise, d1, d2, d1)):
            times[k, phase] = duration


@njit(cache=True, nogil=True)
def sample_motion(times, junction, j, length, step, segment, share, motion):
    """Write segment, share of its length, and (length, speed, acceleration) at every sample; return their number.

    times (n, 7), junction (n + 1,), j, length (n,) float64; step : s; segment (m,) int64, share (m,), motion (m, 3) float64.
    Within a phase s + v d + a d^2/2 + jerk d^3/6, d from its start.
    """
    n, base, clock, sample = length.size, 0.0, 0.0, 0
    for k in range(n):
        s, v, a, t0 = 0.0, junction[k], 0.0, clock
        for p in range(7):
            jerk = j[k] if p == 0 or p == 6 else (-j[k] if p == 2 or p == 4 else 0.0)
            t = times[k, p]
            if p == 1 or p == 3 or p == 5:
                a = a if p != 3 else 0.0
            while sample < segment.size and sample * step < t0 + t:
                d = sample * step - t0
                d = max(d, 0.0)
                place = s + v * d + 0.5 * a * d * d + jerk * d * d * d / 6.0
                segment[sample], share[sample] = k, min(max(place / length[k], 0.0), 1.0) if length[k] > 0.0 else 1.0
                for order, value in enumerate((base + place, v + a * d + 0.5 * jerk * d * d, a + jerk * d)):
                    motion[sample, order] = value
                sample += 1
            s += v * t + 0.5 * a * t * t + jerk * t * t * t / 6.0
            v += a * t + 0.5 * jerk * t * t
            a += jerk * t
            t0 += t
        clock, base = t0, base + length[k]
    return sample
