"""Compiled simulation of a servo: exact first-order-hold step of the plant, implicit in its few nonlinear scalars.

Imported only when a simulation runs: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint.drives.control_kernel import (
    current_sample,
    position_sample,
    switched_voltage,
    velocity_sample,
)
from toolpoint.drives.friction_kernel import SCRATCH, SLIP, SLOTS, VELOCITY, bristle_rate, solved

PASSES = 60


@njit(cache=True, nogil=True)
def add_columns(columns, x, out):
    """Add columns^T x to out; row j of `columns` is the column that x[j] multiplies, so the inner loop is contiguous.

    Four columns at a time: `out` is loaded and stored a quarter as often.
    """
    whole = x.size - x.size % 4
    for j in range(0, whole, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        for i in range(out.size):
            out[i] += columns[j, i] * a + columns[j + 1, i] * b + columns[j + 2, i] * c + columns[j + 3, i] * d
    for j in range(whole, x.size):
        a = x[j]
        if a != 0.0:
            for i in range(out.size):
                out[i] += columns[j, i] * a


@njit(cache=True, nogil=True)
def start_scalars(rows, products, s, states, w):
    """Write the laws' values and rates at the start, from the scalars and the stored states."""
    for k in range(rows.shape[0]):
        kind = rows[k, 0]
        if kind == 1.0:
            rate = bristle_rate(rows[k], states[k, 0], s[k])
            states[k, 1] = rate
            w[k] = rows[k, 9] * states[k, 0] + rows[k, 10] * rate + rows[k, 8] * s[k]
        elif kind == 2.0:
            states[k, VELOCITY] = s[k]
            w[k] = rows[k, 8] * s[k] + states[k, :SLIP].sum()
        elif kind == 3.0:
            left, right = s[k] + rows[k, 3], rows[k, 3] - s[k]
            w[k] = rows[k, 2] * s[k] - rows[k, 1] * (max(left, 0.0) - max(right, 0.0))
    for k in range(products.shape[0]):
        w[rows.shape[0] + k] = s[products[k, 0]] * s[products[k, 1]]


@njit(cache=True, nogil=True)
def implicit(rows, products, gain, free, states, step, s, w, trial):
    """Solve s = free + gain w(s) by passes over the laws (each solved alone exactly) and the products; return success."""
    laws, n = rows.shape[0], s.size
    fine = True
    for turn in range(PASSES):
        change, size = 0.0, 0.0
        for k in range(laws):
            other = free[k]
            for j in range(w.size):
                if j != k:
                    other += gain[k, j] * w[j]
            # The laws hardly feel each other within a step: one whose surroundings stand still is not solved again.
            if turn and abs(other - trial[k, SCRATCH]) <= 1e-10 * (abs(other) + abs(gain[k, k] * w[k])):
                continue
            trial[k, SCRATCH] = other
            guess = s[k] if turn else other + gain[k, k] * w[k]
            s[k], value, good = solved(rows[k], states[k], step, other, gain[k, k], guess, trial[k])
            fine = good if turn == 0 and k == 0 else fine and good
            change, size = max(change, abs(value - w[k])), max(size, abs(value))
            w[k] = value
        for k in range(laws, n):
            s[k] = free[k]
            for j in range(w.size):
                s[k] += gain[k, j] * w[j]
        for k in range(products.shape[0]):
            value = s[products[k, 0]] * s[products[k, 1]]
            change, size = max(change, abs(value - w[laws + k])), max(size, abs(value))
            w[laws + k] = value
        if change <= 1e-7 * size + 1e-15:
            return fine
    return False


@njit(cache=True, nogil=True)
def accept(rows, s, states, step, trial):
    """Store the laws' states after a step."""
    for k in range(rows.shape[0]):
        kind = rows[k, 0]
        if kind == 1.0:
            z = trial[k, 0]
            states[k, 1] = 2.0 * (z - states[k, 0]) / step - states[k, 1]
            states[k, 0] = z
            states[k, 1] = bristle_rate(rows[k], z, s[k])
        elif kind == 2.0:
            states[k, :SCRATCH] = trial[k, :SCRATCH]


@njit(cache=True, nogil=True)
def sample_controllers(step, counts, parameters, control, y, command, inject, where):
    """Run every loop whose sample falls on this step; counts are steps per current, velocity and position sample."""
    if step % counts[0] != 0:
        return
    for i in range(parameters.shape[0]):
        p, s, b = parameters[i], control[i], 7 * i
        if step % counts[2] == 0:
            k = min(step // counts[2], command.shape[0] - 1)
            position_sample(p, s, command[k, i], y[b], y[b + 2])
        k = min(step // counts[1], inject.shape[0] - 1)
        if step % counts[1] == 0:
            velocity_sample(p, s, y[b], y[b + 1], inject[k, i] if where == 2 else 0.0, inject[k, i] if where == 3 else 0.0)
        k = min(step // counts[0], inject.shape[0] - 1)
        current_sample(p, s, y[b], y[b + 1], y[b + 3], y[b + 4], inject[k, i] if where == 4 else 0.0,
                       inject[k, i] if where == 5 else 0.0)


@njit(cache=True, nogil=True)
def held_inputs(step, counts, parameters, control, y, u, voltage):
    """Write the inputs that are in force over this step."""
    for i in range(parameters.shape[0]):
        if parameters[i, 29] != 0.0:
            phase = (step % counts[0]) / counts[0]
            switched_voltage(parameters[i], control[i], phase, 1.0 / counts[0], y[7 * i], y[7 * i + 1], voltage)
            u[2 * i], u[2 * i + 1] = voltage[0], voltage[1]
        else:
            u[2 * i], u[2 * i + 1] = control[i, 40], control[i, 41]


@njit(cache=True, nogil=True)
def record(at, y, u, control, s, w, viscous, outputs, signals, forces):
    """Store outputs, controller signals and laws' values (with their viscous part) at a step."""
    for i in range(y.size):
        outputs[at, i] = y[i]
    for i in range(control.shape[0]):
        signals[at, i, 0], signals[at, i, 1], signals[at, i, 2] = control[i, 0], control[i, 7], control[i, 3]
        signals[at, i, 3], signals[at, i, 4], signals[at, i, 5] = u[2 * i], u[2 * i + 1], control[i, 42]
    for k in range(forces.shape[1]):
        forces[at, k] = w[k] + (viscous[k] * s[k] if k < viscous.size else 0.0)


@njit(cache=True, nogil=True)
def run(steps, step, phi, held, force, first, last, scalars, gain, rows, viscous, products, reading, parameters, control,
        counts, command, inject, where, load, x, states, every, outputs, signals, forces):
    """Advance the servo by `steps`; returns the number of steps whose implicit equations did not converge.

    All matrices are stored by columns (transposed); phi, held, force, first and last carry the rows of the scalars and
    the outputs below those of the states, so that one pass gives all. x, states and control change in place.
    """
    n, m, laws = x.size, 16 * ((x.size + scalars.shape[1] + 15) // 16), rows.shape[0]
    switched = np.any(parameters[:, 29] != 0.0)
    whole, u = np.zeros(phi.shape[1]), np.zeros(held.shape[0])
    s, w, y = np.zeros(scalars.shape[1]), np.zeros(first.shape[0]), np.zeros(reading.shape[1])
    trial, voltage = np.zeros((max(laws, 1), SLOTS)), np.zeros(2)
    add_columns(scalars, x, s)
    add_columns(reading, x, y)
    start_scalars(rows, products, s, states, w)
    failed, before = 0, w.copy()
    for step_index in range(steps):
        sample_controllers(step_index, counts, parameters, control, y, command, inject, where)
        held_inputs(step_index, counts, parameters, control, y, u, voltage)
        if step_index % every == 0:
            record(step_index // every, y, u, control, s, w, viscous, outputs, signals, forces)
        following = step_index + 1
        seen = switched or following % counts[0] == 0 or following % every == 0
        new = whole if seen else whole[:m]
        new[:] = 0.0
        add_columns(phi, x, new)
        add_columns(held, u, new)
        add_columns(force, load[min(step_index, load.shape[0] - 1)], new)
        add_columns(first, w, new)
        for k in range(w.size):
            w[k], before[k] = 2.0 * w[k] - before[k], w[k]
        if not implicit(rows, products, gain, new[n:m], states, step, s, w, trial):
            failed += 1
        accept(rows, s, states, step, trial)
        add_columns(last, w, new)
        x[:] = new[:n]
        if seen:
            y[:] = new[m:m + y.size]
        if not np.isfinite(x[0]):
            return -1 - step_index
    return failed
