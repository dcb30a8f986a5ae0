"""Compiled sampled controllers of one axis: position, velocity and current sample, and the inverter's voltage.

Parameters are the row of `control.Controller.parameters`. State: 0 speed set point, 1 feed-forward torque, 2 velocity
integral, 3 q-current set point (torque without current loop), 4-5 current integrals, 6 last angle, 7 torque, 8-15
filters, 16-23 torque delay line, 24-39 voltage delay lines, 40-41 voltage in force, 42 following error, 43 rotor angle
at the current sample, 44 rotor speed there.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit

STATE = 48


@njit(cache=True, nogil=True)
def quantise(value, resolution):
    """Return the reading of an encoder; resolution 0 is ideal."""
    return value if resolution == 0.0 else math.floor(value / resolution + 0.5) * resolution


@njit(cache=True, nogil=True)
def position_sample(p, s, command, angle, scale):
    """Write the speed set point and the feed-forward torque."""
    actual = quantise(scale, p[8]) if p[6] != 0.0 else quantise(angle, p[7]) * p[2]
    s[42] = command[0] - actual
    s[0] = (p[0] * s[42] + p[1] * command[1]) / p[2]
    s[1] = p[3] * command[2] + p[4] * math.tanh(command[1] / p[5])


@njit(cache=True, nogil=True)
def velocity_sample(p, s, angle, speed, add_speed, add_torque):
    """Write the torque command and the current set point."""
    if p[28] != 0.0:
        reading = quantise(angle, p[7])
        speed = (reading - s[6]) / p[26]
        s[6] = reading
    error = s[0] + add_speed - speed
    torque = p[9] * error + s[2] + s[1]
    for i in range(int(p[24])):
        b = 36 + 5 * i
        y = p[b] * torque + s[8 + 2 * i]
        s[8 + 2 * i] = p[b + 1] * torque - p[b + 3] * y + s[9 + 2 * i]
        s[9 + 2 * i] = p[b + 2] * torque - p[b + 4] * y
        torque = y
    torque += add_torque
    limit = min(p[11], p[31] * p[12]) if p[21] != 0.0 else p[11]
    limited = min(max(torque, -limit), limit)
    if limited == torque or error * torque < 0.0:
        s[2] += p[10] * p[26] * error
    delay = int(p[22])
    for i in range(delay, 0, -1):
        s[16 + i] = s[15 + i]
    s[16] = limited
    s[7] = s[16 + delay]
    s[3] = s[7] / p[12]


@njit(cache=True, nogil=True)
def current_sample(p, s, angle, speed, i_d, i_q, add_current, add_voltage):
    """Put the delayed voltage in force and compute the next one."""
    if p[21] == 0.0:
        s[40], s[41] = 0.0, s[7]
        return
    turn = p[19] * speed
    error_d, error_q = -i_d, s[3] + add_current - i_q
    u_d = p[13] * error_d + s[4] + add_voltage * 0.0
    u_q = p[13] * error_q + s[5] + add_voltage
    if p[15] != 0.0:
        u_d -= turn * p[17] * i_q
        u_q += turn * (p[16] * i_d + p[18])
    length = math.sqrt(u_d * u_d + u_q * u_q)
    scale = p[20] / length if length > p[20] else 1.0
    back = p[27] * p[14] / p[13]
    s[4] += p[27] * p[14] * error_d + back * (scale - 1.0) * u_d
    s[5] += p[27] * p[14] * error_q + back * (scale - 1.0) * u_q
    delay = int(p[23])
    for i in range(delay, 0, -1):
        s[24 + i], s[32 + i] = s[23 + i], s[31 + i]
    s[24], s[32] = scale * u_d, scale * u_q
    s[40], s[41] = s[24 + delay], s[32 + delay]
    s[43], s[44] = angle, speed


@njit(cache=True, nogil=True)
def leg_fraction(duty, start, stop):
    """Return the fraction of [start, stop] (in carrier periods, within one) in which the leg is high: a centred pulse."""
    low, high = 0.5 - 0.5 * duty, 0.5 + 0.5 * duty
    return max(0.0, min(stop, high) - max(start, low)) / (stop - start)


@njit(cache=True, nogil=True)
def switched_voltage(p, s, phase, width, angle, speed, out):
    """Write the dq voltage of the switched legs, mean over one simulation step.

    `phase` and `width` are the step's start and length as fractions of the current sample.
    """
    poles, period, bus = p[32], p[27], math.sqrt(3.0) * p[20]
    at = poles * (s[43] + 0.5 * period * s[44])
    c, q = math.cos(at), math.sin(at)
    alpha, beta = c * s[40] - q * s[41], q * s[40] + c * s[41]
    a, b = alpha, -0.5 * alpha + 0.5 * math.sqrt(3.0) * beta
    d = -0.5 * alpha - 0.5 * math.sqrt(3.0) * beta
    shift = 0.5 * (max(a, b, d) + min(a, b, d))
    start = phase * p[30] - math.floor(phase * p[30] + 1e-9)
    start = max(start, 0.0)
    stop = start + width * p[30]
    high_a = leg_fraction(min(max(0.5 + (a - shift) / bus, 0.0), 1.0), start, stop) * bus
    high_b = leg_fraction(min(max(0.5 + (b - shift) / bus, 0.0), 1.0), start, stop) * bus
    high_d = leg_fraction(min(max(0.5 + (d - shift) / bus, 0.0), 1.0), start, stop) * bus
    alpha = (2.0 * high_a - high_b - high_d) / 3.0
    beta = (high_b - high_d) / math.sqrt(3.0)
    now = poles * (angle + 0.5 * width * period * speed)
    c, q = math.cos(now), math.sin(now)
    out[0], out[1] = c * alpha + q * beta, -q * alpha + c * beta
