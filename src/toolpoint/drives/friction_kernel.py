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
def dry(row, speed):
    """Return the dry level g(|v|) and dg/d|v|."""
    level, slope = row[1], 0.0
    for at in (2, 5):
        a = row[at]
        if a != 0.0:
            ratio, d = speed / row[at + 1], row[at + 2]
            power = ratio * ratio if d == 2.0 else (ratio if d == 1.0 else ratio**d)
            if power > 60.0:
                continue
            e = a * math.exp(-power)
            level += e
            if speed > 0.0:
                slope -= e * d * power / speed
    return level, slope


@njit(cache=True, nogil=True)
def bristle_rate(row, z, v):
    """Return dz/dt of the LuGre bristle."""
    return v - row[9] * abs(v) * z / dry(row, abs(v))[0]


@njit(cache=True, nogil=True)
def bristle_force(row, state, step, v):
    """Return (F, dF/dv, z) at the end of an implicit trapezoidal step of the bristle; state = (z, dz/dt) at its start."""
    speed = abs(v)
    sign = 1.0 if v >= 0.0 else -1.0
    g, slope = dry(row, speed)
    s0 = row[9]
    a = 0.5 * step * s0 * speed / g
    top = state[0] + 0.5 * step * (state[1] + v)
    z = top / (1.0 + a)
    da = 0.5 * step * s0 * (sign / g - v * slope / (g * g))
    dz = (0.5 * step - z * da) / (1.0 + a)
    rate = v - s0 * speed * z / g
    drate = 1.0 - s0 * (sign * z / g + speed * dz / g - z * v * slope / (g * g))
    return s0 * z + row[10] * rate + row[8] * v, s0 * dz + row[10] * drate + row[8], z


@njit(cache=True, nogil=True)
def maxwell_force(row, state, step, v, new):
    """Return (F, dF/dv) of the Maxwell-slip blocks at the end of a step; writes forces, slip signs and velocity.

    A block sticks with the mean velocity of the step until its limit; then it slips, and follows the Stribeck curve by
    an implicit step of its rate, until the velocity changes sign.
    """
    level = dry(row, abs(v))[0]
    total, slope = row[8] * v, row[8]
    moved = 0.5 * step * (state[VELOCITY] + v)
    for i in range(int(row[ELEMENTS])):
        k, limit, slip = row[STIFFNESS + i], row[SHARE + i] * level, state[SLIP + i]
        if slip != 0.0 and v * slip > 0.0:
            rise = step * row[11]
            force = slip * (abs(state[i]) + rise * row[SHARE + i]) / (1.0 + rise / level)
        else:
            slip, force = 0.0, state[i] + k * moved
            if abs(force) >= limit:
                slip = 1.0 if force > 0.0 else -1.0
                force = slip * limit
            else:
                slope += 0.5 * k * step
        new[i], new[SLIP + i] = force, slip
        total += force
    new[VELOCITY] = v
    return total, slope


@njit(cache=True, nogil=True)
def contact_correction(row, s):
    """Return (w, dw/ds): reference stiffness times s less the force of two one-sided springs."""
    k, reference, preload = row[1], row[2], row[3]
    left, right = s + preload, preload - s
    force, slope = 0.0, 0.0
    if left > 0.0:
        force, slope = force + k * left, slope + k
    if right > 0.0:
        force, slope = force - k * right, slope + k
    return reference * s - force, reference - slope


@njit(cache=True, nogil=True)
def evaluate(row, state, step, v, new):
    """Return (w, dw/ds) of a law that is a function of its scalar (all but static friction)."""
    if row[0] == 1.0:
        force, slope, z = bristle_force(row, state, step, v)
        new[0] = z
        return force, slope
    if row[0] == 2.0:
        return maxwell_force(row, state, step, v, new)
    return contact_correction(row, v)


@njit(cache=True, nogil=True)
def static_force(row, free, gain):
    """Return (v, F) with v = free + gain F, F in the set-valued static law, gain < 0: rest first, else slip."""
    if gain >= 0.0:
        return free, 0.0
    hold = -free / gain
    if abs(hold) <= dry(row, 0.0)[0]:
        return 0.0, hold
    sign = 1.0 if free > 0.0 else -1.0
    low, high, speed = 0.0, abs(free), abs(free)
    for _ in range(60):
        g, slope = dry(row, speed)
        residual = speed - abs(free) - gain * (g + row[8] * speed)
        if residual > 0.0:
            high = speed
        else:
            low = speed
        change = residual / (1.0 - gain * (slope + row[8]))
        trial = speed - change
        if not low <= trial <= high:
            trial = 0.5 * (low + high)
        if abs(trial - speed) <= 1e-13 * (speed + 1e-12):
            break
        speed = trial
    g = dry(row, speed)[0]
    return sign * speed, sign * (g + row[8] * speed)


@njit(cache=True, nogil=True)
def solved(row, state, step, free, gain, guess, new):
    """Return (s, w, converged) with s = free + gain w(s), by safeguarded Newton steps from `guess`."""
    if row[0] == 0.0:
        s, w = static_force(row, free, gain)
        return s, w, True
    s = guess
    low, high = -np.inf, np.inf
    w = 0.0
    for _ in range(60):
        w, slope = evaluate(row, state, step, s, new)
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
