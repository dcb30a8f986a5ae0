r"""Response of a machine to forces with its drives on, off, shorted and braked: the loops as their frequency responses.

With the plant :math:`\dot x = A x + B_u u + B_d d` and set points that stand still, every axis feeds back
:math:`u_q = -h_c [C_i (i_q + s_v / k_t (C_v (\dot\theta_m + s_p K_v x_m / p) - F_v G_d (\dot x_s / p - \dot\theta_m)))]`,
with the damping gain G_d of a sensor x_s and the filters F_v of the torque. C are the responses of the sampled controllers
(:math:`z = e^{j \omega T}`), h the hold of the current loop's samples, s the mean of a slower loop's step over the faster one's
samples, p the travel for each radian. What sampling mirrors about half a loop's rate is left out. Linear at rest: dry friction,
which holds a table that small forces push, is not in it. Source: Franklin, Powell, Workman, Digital Control of Dynamic Systems,
chapter 5.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, floats
from toolpoint.drives.axis.outputs import ANGLE, CURRENT_Q, OUTPUTS, SCALE, SPEED, TOOL
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import Controller

DriveState = Literal["on", "off", "shorted", "braked"]
DRIVE_STATES: tuple[DriveState, ...] = ("on", "off", "shorted", "braked")


def respond_to_forces(servo: Servo, forces: FloatArray, outputs: FloatArray, *, frequency: FloatArray,
                      state: DriveState = "on", losses: ComplexArray | None = None) -> ComplexArray:
    """Return the responses (n_f, n_out, n_in) of rows (n_out, n) of the plant's states to force columns (n, n_in), m/N.

    Parameters
    ----------
    frequency : (n_f,) floats
        Hz, above 0.
    state : str
        ``on``: loops closed, set points standing still. ``off``: no current. ``shorted``: windings shorted, which brake a
        synchronous motor. ``braked``: motors held.
    losses : (n, n) complexes, optional
        Added to A: structural damping, which has no equation in time.
    """
    plant, n = servo.plant, servo.plant.a.shape[0]
    a = np.array(plant.a) if losses is None else plant.a + losses
    currents = [k for k, name in enumerate(plant.states) if name.endswith((".i_d", ".i_q"))]
    torques = _torque_columns(servo, currents)
    if state in ("off", "braked"):
        a[:, currents] = 0.0
        a[currents, currents] = -1.0  # currents that stay zero
    rows = plant.outputs.reshape(len(plant.axes), len(OUTPUTS), n)
    result = np.empty((len(frequency), len(outputs), forces.shape[1]), complex)
    for k, omega in enumerate(2 * np.pi * floats("frequency", frequency, (None,))):
        system = 1j * omega * np.eye(n) - a
        if state == "on":
            for i, controller in enumerate(servo.controllers):
                # Column 2 i + 1 is the quadrature voltage (or the torque) of axis i.
                system += np.outer(plant.b_input[:, 2 * i + 1], _feedback(controller, omega, rows[i]))
        result[k] = outputs @ (_braked(system, torques, rows[:, ANGLE], forces) if state == "braked"
                               else np.linalg.solve(system, forces))
    return result


def _torque_columns(servo: Servo, currents: list[int]) -> FloatArray:
    """Return what a torque on each motor does to the states, (n, axes), up to its size."""
    plant, columns = servo.plant, []
    for i, axis in enumerate(plant.axes):
        name = f"{axis.name}.i_q"
        column = np.array(plant.a[:, plant.states.index(name)] if name in plant.states else plant.b_input[:, 2 * i + 1])
        column[currents] = 0.0
        columns.append(column)
    return np.column_stack(columns)


def _braked(system: ComplexArray, torques: FloatArray, angles: FloatArray, forces: FloatArray) -> ComplexArray:
    """Return the states under forces where torques hold all motor angles at zero."""
    free = np.linalg.solve(system, np.hstack([forces, torques]).astype(complex))
    moved, by_torque = free[:, :forces.shape[1]], free[:, forces.shape[1]:]
    return np.asarray(moved - by_torque @ np.linalg.solve(angles @ by_torque, angles @ moved))


def _feedback(c: Controller, omega: float, rows: FloatArray) -> ComplexArray:
    """Return the row over the states that an axis feeds back to its quadrature voltage, or torque."""
    times = c.sample_times
    z_current, z_velocity = np.exp(1j * omega * times.current), np.exp(1j * omega * times.velocity)
    hold = (1 - 1 / z_current) / (1j * omega * times.current)
    angle = rows[ANGLE]
    speed = angle * (1 - 1 / z_velocity) / times.velocity if c.encoders.difference or c.encoders.motor > 0 else rows[SPEED]
    position = rows[SCALE] / float(c.lead or 1) if c.position.feedback == "scale" else angle
    step = _mean_of_steps(z_velocity, times.position / times.velocity)
    torque = _velocity_controller(c, z_velocity) * (speed + step * c.position.gain * position)
    if c.velocity.damping_gain:
        place = rows[TOOL] if c.velocity.damping_sensor == "tool" else rows[SCALE]
        stretch_rate = (place / float(c.lead or 1) - angle) * (1 - 1 / z_velocity) / times.velocity
        torque = torque - c.velocity.damping_gain * _torque_filters(c, z_velocity) * stretch_rate
    reference = torque * _mean_of_steps(z_current, times.velocity / times.current)
    if c.current is None:
        return np.asarray(hold * reference)
    m = c.current.model
    controller = c.current.gain + times.current * c.current.integral / (z_current - 1)
    row = controller * (rows[CURRENT_Q] + reference / m.torque_constant)
    if c.current.decoupling:
        # The compensation acts against the voltage that the rotating flux induces, so it enters with the sign of the
        # feedback.
        row = row - m.pole_pairs * m.flux * rows[SPEED]
    return np.asarray(hold * z_current**-c.current.delay * row)


def _velocity_controller(c: Controller, z: complex) -> complex:
    value = c.velocity.gain * (1 + c.sample_times.velocity / c.velocity.integral_time / (z - 1))
    return complex(value * _torque_filters(c, z))


def _torque_filters(c: Controller, z: complex) -> complex:
    """Return the filters of the torque command with its delay."""
    value = 1.0 + 0.0j
    for part in c.velocity.filters:
        b0, b1, b2, a1, a2 = part.coefficients(c.sample_times.velocity)
        value *= (b0 + b1 / z + b2 / z**2) / (1 + a1 / z + a2 / z**2)
    return complex(value * z**-c.velocity.delay)


def _mean_of_steps(z: complex, ratio: float) -> complex:
    """Return what holding a value over `ratio` samples of a faster loop does to it: the mean of their delays."""
    return complex(np.mean(z ** -np.arange(round(ratio))))
