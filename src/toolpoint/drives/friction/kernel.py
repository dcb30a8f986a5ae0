"""Compiled friction and contact laws: one implicit step of each.

`law` is a record of `LAW`, `state` and `trial` are records of `LAW_STATE` (see `records`): the state at the start of the
step is read, that at its end written to `trial`, so that a step can be tried many times before it is accepted.
Imported only when a simulation runs: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toolpoint.drives.friction.records import BRISTLE, MAX_LAW_ITERATIONS, MAXWELL, STATIC


@njit(cache=True, nogil=True)
def dry(law, speed):
    """Return the dry level g(|v|) = level + sum_i size_i exp(-(|v|/v_i)^d_i) and dg/d|v|."""
    level, slope = law.level, 0.0
    for i in range(2):
        size = law.fall_size[i]
        if size != 0.0:
            ratio, d = speed / law.fall_velocity[i], law.fall_exponent[i]
            # The usual exponents without a power: it takes ten times as long as a product, and this runs in every Newton
            # step.
            power = ratio * ratio if d == 2.0 else (ratio if d == 1.0 else ratio**d)
            # exp(-60) is below rounding of the level, and with an infinite power the slope would be zero times infinity.
            if power > 60.0:
                continue
            e = size * math.exp(-power)
            level += e
            if speed > 0.0:
                slope -= e * d * power / speed
    return level, slope


@njit(cache=True, nogil=True)
def bristle_rate(law, z, v):
    """Return dz/dt = v - sigma0 |v| z/g(v) of the LuGre bristle."""
    return v - law.bristle_stiffness * abs(v) * z / dry(law, abs(v))[0]


@njit(cache=True, nogil=True)
def solve_bristle(law, state, step, free, gain, guess, trial):
    """Return (v, F, converged) with v = free + gain F(v): one implicit trapezoidal step of the LuGre bristle.

    The trapezoidal rule gives the bristle z at the end of the step in closed form for a given v, so that v alone is
    unknown: safeguarded Newton steps from `guess`. A step as small as one part in 1e8, and small against the Stribeck
    velocities too (the curve bends there), ends the search and enters by the slopes.
    """
    s0, s1, s2, half = law.bristle_stiffness, law.bristle_damping, law.viscous, 0.5 * step
    z0, rate0 = state.bristle, state.bristle_rate
    v, lower, upper = guess, -np.inf, np.inf
    force = 0.0
    trial.bristle, trial.bristle_rate = z0, rate0
    for _ in range(MAX_LAW_ITERATIONS):
        speed, sign = abs(v), 1.0 if v >= 0.0 else -1.0
        g, slope = dry(law, speed)
        over = 1.0 / g
        share = s0 * speed * over
        bottom = 1.0 / (1.0 + half * share)
        # Trapezoidal, not explicit: a moving bristle settles at the rate sigma0 |v|/g, which is soon faster than the step.
        z = (z0 + half * (rate0 + v)) * bottom
        dshare = s0 * over * (sign - v * slope * over)
        dz = half * (1.0 - z * dshare) * bottom
        rate = v - share * z
        drate = 1.0 - dshare * z - share * dz
        force, dforce = s0 * z + s1 * rate + s2 * v, s0 * dz + s1 * drate + s2
        trial.bristle, trial.bristle_rate = z, rate
        residual = v - free - gain * force
        if residual > 0.0:
            upper = min(upper, v)
        else:
            lower = max(lower, v)
        base = 1.0 - gain * dforce
        # The Stribeck curve falls: with a soft surrounding the residual may lose its slope, and Newton's step would leave
        # for anywhere.
        change = -residual / base if base > 1e-6 else free + gain * force - v
        if not lower < v + change < upper:
            # Outside the bracket: its middle, or one fixed-point step while an end is open.
            if np.isfinite(lower) and np.isfinite(upper):
                change = 0.5 * (lower + upper) - v
            elif change == 0.0:
                return v, force, True
            else:
                change = free + gain * force - v
        tolerance = max(1e-8 * (abs(free) + abs(gain * force)) + 1e-24,
                        3e-5 * min(speed, law.fall_velocity[0], law.fall_velocity[1]))
        if abs(change) <= tolerance:
            # The last change enters by the slopes: it saves one evaluation in every step of the simulation.
            trial.bristle, trial.bristle_rate = z + dz * change, rate + drate * change
            return v + change, force + dforce * change, True
        v += change
    return v, force, False


@njit(cache=True, nogil=True)
def maxwell_force(law, state, step, v, trial):
    """Return (F, dF/dv) of the Maxwell-slip blocks at the end of a step; writes forces, slip signs and velocity.

    A block sticks with the mean velocity of the step until its limit; then it slips, and follows the Stribeck curve by
    an implicit step of its rate, until the velocity changes sign.
    """
    level = dry(law, abs(v))[0]
    total, slope = law.viscous * v, law.viscous
    moved = 0.5 * step * (state.velocity + v)
    for i in range(law.elements):
        stiff, limit, slip = law.element_stiffness[i], law.element_share[i] * level, state.block_slip[i]
        if slip != 0.0 and v * slip > 0.0:
            # An implicit step: with a fast attraction an explicit one would overshoot the curve and ring about it.
            rise = step * law.attraction
            force = slip * (abs(state.block_force[i]) + rise * law.element_share[i]) / (1.0 + rise / level)
        else:
            slip, force = 0.0, state.block_force[i] + stiff * moved
            if abs(force) >= limit:
                slip = 1.0 if force > 0.0 else -1.0
                force = slip * limit
            else:
                slope += 0.5 * stiff * step
        trial.block_force[i], trial.block_slip[i] = force, slip
        total += force
    trial.velocity = v
    return total, slope


@njit(cache=True, nogil=True)
def contact_correction(law, s):
    """Return (w, dw/ds): reference stiffness times s less the force of two one-sided springs and of a cubic one."""
    stiff, reference, preload = law.contact_stiffness, law.contact_reference, law.contact_preload
    left, right = s + preload, preload - s
    force, slope = 0.0, 0.0
    if left > 0.0:
        force, slope = force + stiff * left, slope + stiff
    if right > 0.0:
        force, slope = force - stiff * right, slope + stiff
    cubic = law.contact_cubic * s * s
    return reference * s - force - cubic * s, reference - slope - 3.0 * cubic


@njit(cache=True, nogil=True)
def evaluate(law, state, step, v, trial):
    """Return (w, dw/ds) of a law that is a function of its scalar (Maxwell slip, contact)."""
    if law.kind == MAXWELL:
        return maxwell_force(law, state, step, v, trial)
    return contact_correction(law, v)


@njit(cache=True, nogil=True)
def static_force(law, free, gain):
    """Return (v, F) with v = free + gain F, F in the set-valued static law, gain < 0: rest first, else slip."""
    # Nothing answers the force: no compliance, so no velocity can be changed by friction.
    if gain >= 0.0:
        return free, 0.0
    # Rest is tried first: the set-valued law is the force that holds, as long as it is within the level at standstill.
    hold = -free / gain
    if abs(hold) <= dry(law, 0.0)[0]:
        return 0.0, hold
    sign = 1.0 if free > 0.0 else -1.0
    # Friction brakes and never turns the motion: the speed lies between rest and that without friction.
    lower, upper, speed = 0.0, abs(free), abs(free)
    for _ in range(MAX_LAW_ITERATIONS):
        g, slope = dry(law, speed)
        residual = speed - abs(free) - gain * (g + law.viscous * speed)
        if residual > 0.0:
            upper = speed
        else:
            lower = speed
        change = residual / (1.0 - gain * (slope + law.viscous))
        trial = speed - change
        if not lower <= trial <= upper:
            trial = 0.5 * (lower + upper)
        if abs(trial - speed) <= 1e-13 * (speed + 1e-12):
            break
        speed = trial
    g = dry(law, speed)[0]
    return sign * speed, sign * (g + law.viscous * speed)


@njit(cache=True, nogil=True)
def solve_law(law, state, step, free, gain, guess, trial):
    """Return (s, w, converged) with s = free + gain w(s): the scalar of one law in surroundings that are linear in w.

    Set-valued static friction is solved by cases, the bristle with its own state, all others by safeguarded Newton steps
    from `guess`: the residual rises with s, so its sign keeps a bracket that a bad slope cannot leave.
    """
    if law.kind == STATIC:
        s, w = static_force(law, free, gain)
        return s, w, True
    if law.kind == BRISTLE:
        return solve_bristle(law, state, step, free, gain, guess, trial)
    s = guess
    lower, upper = -np.inf, np.inf
    w = 0.0
    for _ in range(MAX_LAW_ITERATIONS):
        w, slope = evaluate(law, state, step, s, trial)
        residual = s - free - gain * w
        if residual > 0.0:
            upper = min(upper, s)
        else:
            lower = max(lower, s)
        bottom = 1.0 - gain * slope
        following = s - residual / bottom if bottom > 1e-6 else free + gain * w
        if not lower < following < upper:
            if np.isfinite(lower) and np.isfinite(upper):
                following = 0.5 * (lower + upper)
            elif following == s:
                return s, w, True
            else:
                following = free + gain * w
        # A Newton step of 1e-8 leaves an error of the order of its square: below the rounding of free + gain w.
        magnitude = abs(free) + abs(gain * w)
        if abs(following - s) <= 1e-8 * magnitude + 1e-24:
            return following, w + slope * (following - s), True
        s = following
    return s, w, False

# Code of other modules in these kernels: 951c7f424395
