"""Compiled sampled controllers of one axis: position, velocity and current sample, and the inverter's voltage.

`p` is a record of `PARAMETERS`, `s` one of `CONTROL_STATE` (see `records`), changed in place.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def quantise(value, resolution):
    """Return the reading of an encoder; resolution 0 is ideal."""
    return value if resolution == 0.0 else math.floor(value / resolution + 0.5) * resolution


@njit(cache=True, nogil=True)
def position_sample(p, s, set_point, angle, scale):
    """Write the speed set point (K_v e + f v_set)/lead, the feed-forward torque and the following error e = x_set - x."""
    if p.scale_feedback:
        actual = quantise(scale, p.scale_resolution)
    else:
        actual = quantise(angle, p.angle_resolution) * p.lead
    s.following_error = set_point.position - actual
    s.speed_set = (p.position_gain * s.following_error + p.velocity_feedforward * set_point.velocity) / p.lead
    s.torque_feedforward = (p.inertia_feedforward * set_point.acceleration
                            # A sign would jump by twice the friction at every reversal, with all of the noise of a set
                            # point that stands still.
                            + p.friction_feedforward * math.tanh(set_point.velocity / p.friction_velocity))


@njit(cache=True, nogil=True)
def velocity_sample(p, s, angle, speed, place, add_speed, add_torque):
    """Write the torque command (PI of the speed error, damping, filtered, limited, delayed) and the current set point.

    place : scale or tool, m, whose speed beyond that of the motor the damping feeds back.
    """
    if p.difference:
        # Real drives take the difference of two readings: its steps of resolution over sample time are part of what is
        # simulated.
        reading = quantise(angle, p.angle_resolution)
        speed = (reading - s.last_angle) / p.velocity_sample_time
        s.last_angle = reading
    error = s.speed_set + add_speed - speed
    command = p.velocity_gain * error + s.speed_integral + s.torque_feedforward
    if p.damping_gain != 0.0:
        # A table that runs ahead of its motor is damped by a motor that runs after it.
        position = place if p.damps_tool else quantise(place, p.scale_resolution)
        stretch = position / p.lead - quantise(angle, p.angle_resolution)
        command += p.damping_gain * (stretch - s.last_stretch) / p.velocity_sample_time
        s.last_stretch = stretch
    torque = filter_torque(p, s, command) + add_torque
    limit = min(p.torque_limit, p.current_limit * p.torque_constant) if p.has_current_loop else p.torque_limit
    limited = min(max(torque, -limit), limit)
    # The integral rests while the limit holds and the error would drive it further in.
    if limited == torque or error * torque < 0.0:
        s.speed_integral += p.velocity_integral * p.velocity_sample_time * error
    for i in range(p.velocity_delay, 0, -1):
        s.torque_line[i] = s.torque_line[i - 1]
    s.torque_line[0] = limited
    s.torque_set = s.torque_line[p.velocity_delay]
    s.current_set = s.torque_set / p.torque_constant


@njit(cache=True, nogil=True)
def filter_torque(p, s, torque):
    """Return the torque behind the filters: second-order stages in transposed direct form II (two memories each)."""
    for i in range(p.filter_count):
        y = p.filter_b0[i] * torque + s.filter_first[i]
        s.filter_first[i] = p.filter_b1[i] * torque - p.filter_a1[i] * y + s.filter_second[i]
        s.filter_second[i] = p.filter_b2[i] * torque - p.filter_a2[i] * y
        torque = y
    return torque


@njit(cache=True, nogil=True)
def current_sample(p, s, angle, speed, i_d, i_q, add_current, add_voltage):
    """Apply the delayed voltage and compute the next one: PI in d and q, decoupling, limit of the amplitude."""
    if not p.has_current_loop:
        s.voltage_d, s.voltage_q = 0.0, s.torque_set
        return
    turn = p.model_pole_pairs * speed
    error_d, error_q = -i_d, s.current_set + add_current - i_q
    u_d = p.current_gain * error_d + s.integral_d
    u_q = p.current_gain * error_q + s.integral_q + add_voltage
    if p.decoupling:
        # The rotational voltages of the model, so that the loops see resistance and inductance only.
        u_d -= turn * p.model_inductance_q * i_q
        u_q += turn * (p.model_inductance_d * i_d + p.model_flux)
    length = math.sqrt(u_d * u_d + u_q * u_q)
    scale = p.voltage_limit / length if length > p.voltage_limit else 1.0
    # Back-calculation: what the voltage limit took away leaves the integrals with the loop's own time constant.
    rise = p.current_sample_time * p.current_integral
    anti_windup = rise / p.current_gain
    s.integral_d += rise * error_d + anti_windup * (scale - 1.0) * u_d
    s.integral_q += rise * error_q + anti_windup * (scale - 1.0) * u_q
    for i in range(p.current_delay, 0, -1):
        s.voltage_line_d[i], s.voltage_line_q[i] = s.voltage_line_d[i - 1], s.voltage_line_q[i - 1]
    s.voltage_line_d[0], s.voltage_line_q[0] = scale * u_d, scale * u_q
    s.voltage_d, s.voltage_q = s.voltage_line_d[p.current_delay], s.voltage_line_q[p.current_delay]
    s.held_angle, s.held_speed = angle, speed


@njit(cache=True, nogil=True)
def leg_fraction(duty, start, stop):
    """Return the fraction of [start, stop] (in carrier periods, within one) in which the leg is high: a centred pulse."""
    rise, fall = 0.5 - 0.5 * duty, 0.5 + 0.5 * duty
    return max(0.0, min(stop, fall) - max(start, rise)) / (stop - start)


@njit(cache=True, nogil=True)
def write_switched_voltage(p, s, phase, width, angle, speed, out):
    """Write the dq voltage of the switched legs, mean over one simulation step.

    `phase` and `width` are the step's start and length as fractions of the current sample. The command is turned to the
    stator with the rotor's angle in the middle of the sample, the legs' mean back with that in the middle of the step.
    """
    period, bus = p.current_sample_time, math.sqrt(3.0) * p.voltage_limit
    # The inverter holds a voltage in the stator for a whole sample while the rotor turns on: its middle is right on
    # average.
    electrical_angle = p.pole_pairs * (s.held_angle + 0.5 * period * s.held_speed)
    c, q = math.cos(electrical_angle), math.sin(electrical_angle)
    alpha, beta = c * s.voltage_d - q * s.voltage_q, q * s.voltage_d + c * s.voltage_q
    a, b = alpha, -0.5 * alpha + 0.5 * math.sqrt(3.0) * beta
    d = -0.5 * alpha - 0.5 * math.sqrt(3.0) * beta
    # Half of the extremes' sum to all legs (space-vector modulation): the same voltages between phases with 15 % more room
    # to the bus.
    shift = 0.5 * (max(a, b, d) + min(a, b, d))
    # A step that begins at a carrier's end by rounding belongs to the next one.
    start = phase * p.carrier - math.floor(phase * p.carrier + 1e-9)
    start = max(start, 0.0)
    stop = start + width * p.carrier
    high_a = leg_fraction(min(max(0.5 + (a - shift) / bus, 0.0), 1.0), start, stop) * bus
    high_b = leg_fraction(min(max(0.5 + (b - shift) / bus, 0.0), 1.0), start, stop) * bus
    high_d = leg_fraction(min(max(0.5 + (d - shift) / bus, 0.0), 1.0), start, stop) * bus
    alpha = (2.0 * high_a - high_b - high_d) / 3.0
    beta = (high_b - high_d) / math.sqrt(3.0)
    now = p.pole_pairs * (angle + 0.5 * width * period * speed)
    c, q = math.cos(now), math.sin(now)
    out[0], out[1] = c * alpha + q * beta, -q * alpha + c * beta
