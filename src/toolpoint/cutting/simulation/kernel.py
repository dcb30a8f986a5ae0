"""Compiled kernel of the milling simulation: exact modal steps, forces linear over a step, memory of several flutes."""

# mypy: ignore-errors
# numba reads these functions; their argument types are in the docstrings of their callers.
from __future__ import annotations

import math

import numba as nb
import numpy as np


@nb.njit(cache=True, nogil=True)
def engaged_share(angle, step, entry, leave):
    """Share of the hat function about `angle` (half width `step`) that lies between entry and exit."""
    total = 0.0
    for turn in (-1, 0, 1):
        centre = angle + 2 * math.pi * turn
        low, high = max(entry, centre - step), min(leave, centre + step)
        if high > low:
            total += _hat((high - centre) / step) - _hat((low - centre) / step)
    return total


@nb.njit(cache=True, nogil=True)
def _hat(u):
    """Integral of the unit hat function from -1 to u."""
    u = min(1.0, max(-1.0, u))
    return 0.5 * (1 + u) ** 2 if u < 0 else 1.0 - 0.5 * (1 - u) ** 2


@nb.njit(cache=True, nogil=True, fastmath=True)
def simulate(steps, period_steps, feed_step, decay, left, first, last, compliance, state, start, angle_step, lag, share,
             meridian, arc, delay, extra, cutting, edge, memory, linear, damping, friction, dt, fed, displacement, force,
             torque, chip_max):
    """March `steps` steps; displacement, force (steps + 1, d), torque and chip_max (steps + 1,) are filled, d = 2 or 3.

    decay (n, modes), first, last (n, modes, d), compliance (n, d, d), damping, dt (n,): of each of the n steps after which
    the speed repeats; n is 1 at constant speed. fed: empty at constant speed, otherwise the feed in m at every step, the
    first of them as many steps before the start as there are more than `steps` + 1. linear: edges outside the material
    stay in contact.
    lag, share (elements,): angle behind tooth 0 and length of each edge element; meridian (elements, 3): sine and cosine of
    its axial immersion angle and its radius over the cutter's; arc (elements, 2): entry and exit; delay, extra (elements,
    memory): steps back to the i-th earlier passage and the static chip it leaves beside feed (run-out), m; feed_step is the
    feed in m per step. cutting, edge = (t, n, a); damping = process damping per metre over cutting speed, friction its share
    along the tangent.
    """
    kinds, modes, elements, ways = decay.shape[0], decay.shape[1], lag.size, left.shape[0]
    spatial = ways == 3
    before = fed.size - steps - 1
    dre, dim = decay.real.copy(), decay.imag.copy()
    zre, zim = state.real.copy(), state.imag.copy()
    lxr, lxi, lyr, lyi = left[0].real.copy(), left[0].imag.copy(), left[1].real.copy(), left[1].imag.copy()
    lzr, lzi = left[ways - 1].real.copy(), left[ways - 1].imag.copy()
    fxr, fxi = first[:, :, 0].real.copy(), first[:, :, 0].imag.copy()
    fyr, fyi = first[:, :, 1].real.copy(), first[:, :, 1].imag.copy()
    fzr, fzi = first[:, :, ways - 1].real.copy(), first[:, :, ways - 1].imag.copy()
    gxr, gxi = last[:, :, 0].real.copy(), last[:, :, 0].imag.copy()
    gyr, gyi = last[:, :, 1].real.copy(), last[:, :, 1].imag.copy()
    gzr, gzi = last[:, :, ways - 1].real.copy(), last[:, :, ways - 1].imag.copy()
    contact = np.empty((period_steps, elements))
    for k in range(period_steps):
        for e in range(elements):
            phi = (start + k * angle_step - lag[e]) % (2 * math.pi)
            contact[k, e] = engaged_share(phi, angle_step, arc[e, 0], arc[e, 1])
    fx, fy, fz = force[0, 0], force[0, 1], 0.0
    for k in range(1, steps + 1):
        rx, ry, rz = 0.0, 0.0, 0.0
        kind = (k - 1) % kinds
        for m in range(modes):
            re = dre[kind, m] * zre[m] - dim[kind, m] * zim[m] + fxr[kind, m] * fx + fyr[kind, m] * fy
            im = dre[kind, m] * zim[m] + dim[kind, m] * zre[m] + fxi[kind, m] * fx + fyi[kind, m] * fy
            if spatial:
                re += fzr[kind, m] * fz
                im += fzi[kind, m] * fz
                rz += lzr[m] * re - lzi[m] * im
            zre[m], zim[m] = re, im
            rx += lxr[m] * re - lxi[m] * im
            ry += lyr[m] * re - lyi[m] * im
        rx, ry, rz = 2 * rx, 2 * ry, 2 * rz
        fx, fy, fz, moment, thick = 0.0, 0.0, 0.0, 0.0, 0.0
        row = k % period_steps
        px, py, pz = rx, ry, rz
        for _ in range(2):
            nx, ny, nz, nm, thick = 0.0, 0.0, 0.0, 0.0, 0.0
            for e in range(elements):
                g = contact[row, e]
                if g <= 0.0:
                    continue
                phi = start + row * angle_step - lag[e]
                s, c = math.sin(phi), math.cos(phi)
                up, along = meridian[e, 0], meridian[e, 1]
                here = up * (s * px + c * py) - along * pz
                h = 1e300
                for i in range(memory):
                    back = delay[e, i]
                    at = k - back
                    low = math.floor(at)
                    part = at - low
                    was = 0.0
                    if low >= 0:
                        was = _along(displacement, low, up * s, up * c, along, spatial)
                        if part > 0.0:
                            was += part * (_along(displacement, low + 1, up * s, up * c, along, spatial) - was)
                    advance = feed_step * back
                    if before > 0:
                        from_start = low + before
                        advance = fed[k + before] - fed[from_start] - part * (fed[from_start + 1] - fed[from_start])
                    h = min(h, (advance * s + extra[e, i]) * up + here - was)
                if h <= 0.0 and not linear:
                    continue
                ft = cutting[0] * h + edge[0]
                fn = cutting[1] * h + edge[1]
                fa = cutting[2] * h + edge[2]
                if damping[kind] > 0.0:
                    drag = damping[kind] * (here - _along(displacement, k - 1, up * s, up * c, along, spatial)) / dt[kind]
                    fn += drag
                    ft += friction * drag
                a = share[e] * g
                radial = fn * up - fa * along
                nx -= a * (ft * c + radial * s)
                ny -= a * (-ft * s + radial * c)
                nz += a * (fn * along + fa * up)
                nm += a * ft * meridian[e, 2]
                thick = max(thick, h)
            fx, fy, fz, moment = nx, ny, nz, nm
            px = rx + compliance[kind, 0, 0] * fx + compliance[kind, 0, 1] * fy
            py = ry + compliance[kind, 1, 0] * fx + compliance[kind, 1, 1] * fy
            if spatial:
                px += compliance[kind, 0, 2] * fz
                py += compliance[kind, 1, 2] * fz
                pz = rz + compliance[kind, 2, 0] * fx + compliance[kind, 2, 1] * fy + compliance[kind, 2, 2] * fz
        for m in range(modes):
            zre[m] += gxr[kind, m] * fx + gyr[kind, m] * fy
            zim[m] += gxi[kind, m] * fx + gyi[kind, m] * fy
        displacement[k, 0], displacement[k, 1] = px, py
        force[k, 0], force[k, 1], force[k, 2] = fx, fy, fz
        if spatial:
            for m in range(modes):
                zre[m] += gzr[kind, m] * fz
                zim[m] += gzi[kind, m] * fz
            displacement[k, 2] = pz
        torque[k], chip_max[k] = moment, thick
        if abs(px) > 1.0:
            return k
    return steps


@nb.njit(cache=True, nogil=True, fastmath=True, inline="always")
def _along(displacement, k, x, y, z, spatial):
    """Displacement of step k along the outward normal [x, y, -z]."""
    total = x * displacement[k, 0] + y * displacement[k, 1]
    if spatial:
        total -= z * displacement[k, 2]
    return total
