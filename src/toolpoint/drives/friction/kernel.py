"""Compiled friction and contact laws: one implicit step of each, from the rows that `friction` and `contact` write.

Imported only when a simulation runs: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

ELEMENTS, STIFFNESS, SHARE = 12, 13, 21
# States of a law: bristle and its rate, or block forces 0-7, slip signs 8-15 and velocity 16; 17 is scratch of the solver.
SLIP, VELOCITY, SCRATCH, SLOTS = 8, 16, 17, 18


@njit(cache=True, nogil=True)
def dry(rows, k, speed):
    """Return the dry level g(|v|) and dg/d|v|."""
    level, slope = rows[k, 1], 0.0
    for at in (2, 5):
        a = rows[k, at]
        if a != 0.0:
            ratio, d = speed / rows[k, at + 1], rows[k, at + 2]
            power = ratio * ratio if d == 2.0 else (ratio if d == 1.0 else ratio**d)
            if power > 60.0:
                continue
            e = a * math.exp(-power)
            level += e
            if speed > 0.0:
                slope -= e * d * power / speed
    return level, slope


@njit(cache=True, nogil=True)
def bristle_rate(rows, k, z, v):
    """Return dz/dt of the LuGre bristle."""
    return v - rows[k, 9] * abs(v) * z / dry(rows, k, abs(v))[0]


@njit(cache=True, nogil=True)
def solve_bristle(rows, k, z0, rate0, step, free, gain, guess):
    """Return (v, F, z, dz/dt, converged) with v = free + gain F(v): one implicit trapezoidal step of the LuGre bristle.

    Safeguarded Newton steps from `guess`. The last step, small against the Stribeck velocity too, enters by the slopes.
    """
    s0, s1, s2, half = rows[k, 9], rows[k, 10], rows[k, 8], 0.5 * step
    v, low, high = guess, -np.inf, np.inf
    force, z, rate = 0.0, z0, rate0
    for _ in range(60):
        speed, sign = abs(v), 1.0 if v >= 0.0 else -1.0
        g, slope = dry(rows, k, speed)
        over = 1.0 / g
        share = s0 * speed * over
        bottom = 1.0 / (1.0 + half * share)
        z = (z0 + half * (rate0 + v)) * bottom
        dshare = s0 * over * (sign - v * slope * over)
        dz = half * (1.0 - z * dshare) * bottom
        rate = v - share * z
        drate = 1.0 - dshare * z - share * dz
        force, dforce = s0 * z + s1 * rate + s2 * v, s0 * dz + s1 * drate + s2
        residual = v - free - gain * force
        if residual > 0.0:
            high = min(high, v)
        else:
            low = max(low, v)
        base = 1.0 - gain * dforce
        change = -residual / base if base > 1e-6 else free + gain * force - v
        if not low < v + change < high:
            if np.isfinite(low) and np.isfinite(high):
                change = 0.5 * (low + high) - v
            elif change == 0.0:
                return v, force, z, rate, True
            else:
                change = free + gain * force - v
        if abs(change) <= max(1e-8 * (abs(free) + abs(gain * force)) + 1e-24, 3e-5 * min(speed, rows[k, 3], rows[k, 6])):
            return v + change, force + dforce * change, z + dz * change, rate + drate * change, True
        v += change
    return v, force, z, rate, False


@njit(cache=True, nogil=True)
def maxwell_force(rows, k, state, step, v, new):
    """Return (F, dF/dv) of the Maxwell-slip blocks at the end of a step; writes forces, slip signs and velocity.

    A block sticks with the mean velocity of the step until its limit; then it slips, and follows the Stribeck curve by
    an implicit step of its rate, until the velocity changes sign.
    """
    level = dry(rows, k, abs(v))[0]
    total, slope = rows[k, 8] * v, rows[k, 8]
    moved = 0.5 * step * (state[VELOCITY] + v)
    for i in range(int(rows[k, ELEMENTS])):
        stiff, limit, slip = rows[k, STIFFNESS + i], rows[k, SHARE + i] * level, state[SLIP + i]
        if slip != 0.0 and v * slip > 0.0:
            rise = step * rows[k, 11]
            force = slip * (abs(state[i]) + rise * rows[k, SHARE + i]) / (1.0 + rise / level)
        else:
            slip, force = 0.0, state[i] + stiff * moved
            if abs(force) >= limit:
                slip = 1.0 if force > 0.0 else -1.0
                force = slip * limit
            else:
                slope += 0.5 * stiff * step
        new[i], new[SLIP + i] = force, slip
        total += force
    new[VELOCITY] = v
    return total, slope


@njit(cache=True, nogil=True)
def contact_correction(rows, k, s):
    """Return (w, dw/ds): reference stiffness times s less the force of two one-sided springs."""
    stiff, reference, preload = rows[k, 1], rows[k, 2], rows[k, 3]
    left, right = s + preload, preload - s
    force, slope = 0.0, 0.0
    if left > 0.0:
        force, slope = force + stiff * left, slope + stiff
    if right > 0.0:
        force, slope = force - stiff * right, slope + stiff
    return reference * s - force, reference - slope


@njit(cache=True, nogil=True)
def evaluate(rows, k, state, step, v, new):
    """Return (w, dw/ds) of a law that is a function of its scalar (Maxwell slip, contact)."""
    if rows[k, 0] == 2.0:
        return maxwell_force(rows, k, state, step, v, new)
    return contact_correction(rows, k, v)


@njit(cache=True, nogil=True)
def static_force(rows, k, free, gain):
    """Return (v, F) with v = free + gain F, F in the set-valued static law, gain < 0: rest first, else slip."""
    if gain >= 0.0:
        return free, 0.0
    hold = -free / gain
    if abs(hold) <= dry(rows, k, 0.0)[0]:
        return 0.0, hold
    sign = 1.0 if free > 0.0 else -1.0
    low, high, speed = 0.0, abs(free), abs(free)
    for _ in range(60):
        g, slope = dry(rows, k, speed)
        residual = speed - abs(free) - gain * (g + rows[k, 8] * speed)
        if residual > 0.0:
            high = speed
        else:
            low = speed
        change = residual / (1.0 - gain * (slope + rows[k, 8]))
        trial = speed - change
        if not low <= trial <= high:
            trial = 0.5 * (low + high)
        if abs(trial - speed) <= 1e-13 * (speed + 1e-12):
            break
        speed = trial
    g = dry(rows, k, speed)[0]
    return sign * speed, sign * (g + rows[k, 8] * speed)


@njit(cache=True, nogil=True)
def solve_law(rows, k, state, step, free, gain, guess, new):
    """Return (s, w, converged) with s = free + gain w(s), by safeguarded Newton steps from `guess`."""
    if rows[k, 0] == 0.0:
        s, w = static_force(rows, k, free, gain)
        return s, w, True
    s = guess
    low, high = -np.inf, np.inf
    w = 0.0
    for _ in range(60):
        w, slope = evaluate(rows, k, state, step, s, new)
        residual = s - free - gain * w
        if residual > 0.0:
            high = min(high, s)
        else:
            low = max(low, s)
        bottom = 1.0 - gain * slope
        trial = s - residual / bottom if bottom > 1e-6 else free + gain * w
        if not low < trial < high:
            if np.isfinite(low) and np.isfinite(high):
                trial = 0.5 * (low + high)
            elif trial == s:
                return s, w, True
            else:
                trial = free + gain * w
        # A Newton step of 1e-8 leaves an error of the order of its square: below the rounding of free + gain w.
        near = abs(free) + abs(gain * w)
        if abs(trial - s) <= 1e-8 * near + 1e-24:
            return trial, w + slope * (trial - s), True
        s = trial
    return s, w, False
