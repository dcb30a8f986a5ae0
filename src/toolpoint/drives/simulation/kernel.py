"""Compiled simulation of a servo: exact first-order-hold step of the plant, implicit in its few nonlinear scalars.

Imported only when a simulation runs: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint.drives.controller.kernel import (
    current_sample,
    position_sample,
    switched_voltage,
    velocity_sample,
)
from toolpoint.drives.friction.kernel import (
    SCRATCH,
    SLIP,
    SLOTS,
    VELOCITY,
    bristle_rate,
    solve_bristle,
    solve_law,
)

PASSES = 60
# Products may be fused with sums (one rounding in place of two): the same bits on every run of one machine.
FUSED = {"contract"}


@njit(cache=True, nogil=True, fastmath=FUSED)
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
def add_rounded(columns, x, out):
    """Add columns^T x to out with every product rounded: a force that holds a body still cancels its load exactly."""
    for j in range(x.size):
        for i in range(out.size):
            out[i] += columns[j, i] * x[j]


@njit(cache=True, nogil=True, fastmath=FUSED)
def advance(core, pairs, x, new):
    """Write phi x to new: a dense core (by columns), then two by two blocks over the halves of the rest."""
    n, half = core.shape[0], pairs.shape[1]
    for i in range(half):
        a, b = x[n + i], x[n + half + i]
        new[n + i] = pairs[0, i] * a + pairs[1, i] * b
        new[n + half + i] = pairs[2, i] * a + pairs[3, i] * b
    if n > 0:
        new[:n] = 0.0
        add_columns(core, x[:n], new[:n])


@njit(cache=True, nogil=True)
def start_scalars(rows, products, s, states, w):
    """Write the laws' values and rates at the start, from the scalars and the stored states."""
    for k in range(rows.shape[0]):
        kind = rows[k, 0]
        if kind == 1.0:
            rate = bristle_rate(rows, k, states[k, 0], s[k])
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
def law_end(rows, k, states, step, other, gain, guess, trial):
    """Solve one law with its surroundings `other`; its states at the end of the step go to trial."""
    if rows[k, 0] == 1.0:
        s, value, z, rate, good = solve_bristle(rows, k, states[k, 0], states[k, 1], step, other, gain, guess)
        trial[k, 0], trial[k, 1] = z, rate
        return s, value, good
    return solve_law(rows, k, states[k], step, other, gain, guess, trial[k])


@njit(cache=True, nogil=True)
def implicit(rows, products, gain, free, states, step, s, w, trial):
    """Solve s = free + gain w(s) by passes over the laws (each solved alone exactly) and the products; return success."""
    laws, m = rows.shape[0], w.size
    fine, before = True, 1e-300
    for turn in range(PASSES):
        change, size = 0.0, 0.0
        for k in range(laws):
            other = free[k] - gain[k, k] * w[k]
            for j in range(m):
                other += gain[k, j] * w[j]
            # The laws hardly feel each other within a step: one whose surroundings stand still is not solved again.
            if turn and abs(other - trial[k, SCRATCH]) <= 1e-10 * (abs(other) + abs(gain[k, k] * w[k])):
                continue
            trial[k, SCRATCH] = other
            guess = s[k] if turn else other + gain[k, k] * w[k]
            s[k], value, good = law_end(rows, k, states, step, other, gain[k, k], guess, trial)
            fine = good if turn == 0 and k == 0 else fine and good
            change, size = max(change, abs(value - w[k])), max(size, abs(value))
            w[k] = value
        # One product after the other, each with the newest of the others: the error falls with the square of the coupling.
        for k in range(products.shape[0]):
            for side in range(2):
                i = products[k, side]
                total = free[i]
                for j in range(m):
                    total += gain[i, j] * w[j]
                s[i] = total
            value = s[products[k, 0]] * s[products[k, 1]]
            change, size = max(change, abs(value - w[laws + k])), max(size, abs(value))
            w[laws + k] = value
        # What is left after a pass falls again as the change did.
        if change * min(1.0, change / before) <= 1e-7 * size + 1e-15:
            return fine
        before = change
    return False


@njit(cache=True, nogil=True)
def accept(rows, states, trial):
    """Store the laws' states after a step."""
    for k in range(rows.shape[0]):
        kind = rows[k, 0]
        if kind == 1.0:
            states[k, 0], states[k, 1] = trial[k, 0], trial[k, 1]
        elif kind == 2.0:
            states[k, :SCRATCH] = trial[k, :SCRATCH]


@njit(cache=True, nogil=True)
def sample_controllers(step, counts, parameters, control, y, command, inject, where):
    """Run every loop whose sample falls on this step; counts are steps per current, velocity and position sample."""
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
def read(reading, direct, x, w, y):
    """Write the outputs of shifted coordinates x: y = reading x + direct w."""
    y[:] = 0.0
    add_columns(reading, x, y)
    add_columns(direct, w, y)


@njit(cache=True, nogil=True)
def run(start, steps, step, core, pairs, inputs, shift, jump, scalars, gain, rows, viscous, products, reading, direct,
        parameters, control, counts, command, inject, where, load, x, states, values, every, outputs,
        signals, forces):
    """Advance the servo from step `start` by `steps`; returns the number whose implicit equations did not converge.

    The matrices are those of `exact_step.StepMatrices`, x its coordinates. Inside, x is less shift w, so that one
    product with w carries both ends of the step: x1 - shift w1 = phi (x0 - shift w0) + (first + phi shift) w0 + held u.
    x, states, control and values (w now and a step before; read where start is not 0) change in place, so that a run can be
    taken up again. A motion that is not finite returns minus the step.
    """
    laws, axes = rows.shape[0], load.shape[1]
    new, u, drive = np.zeros(x.size), np.zeros(2 * axes), np.zeros(inputs.shape[0])
    s, w, y = np.zeros(scalars.shape[1]), np.zeros(shift.shape[0]), np.zeros(reading.shape[1])
    free, trial, voltage = np.zeros(scalars.shape[1]), np.zeros((max(laws, 1), SLOTS)), np.zeros(2)
    switched, held_laws = np.any(parameters[:, 29] != 0.0), np.any(jump != 0.0)
    add_columns(scalars, x, s)
    if start == 0:
        start_scalars(rows, products, s, states, w)
        values[0], values[1] = w, w
    w[:] = values[0]
    add_columns(shift, -w, x)
    read(reading, direct, x, w, y)
    failed, before = 0, values[1].copy()
    for at in range(start, start + steps):
        if at % counts[0] == 0:
            sample_controllers(at, counts, parameters, control, y, command, inject, where)
        if switched or at % counts[0] == 0 or at == start:
            held_inputs(at, counts, parameters, control, y, u, voltage)
            drive[:2 * axes] = u
        if at % every == 0:
            record(at // every, y[:outputs.shape[1]], u, control, s, w, viscous, outputs, signals, forces)
        drive[2 * axes:3 * axes] = load[min(at, load.shape[0] - 1)]
        drive[3 * axes:3 * axes + w.size] = w
        advance(core, pairs, x, new)
        add_columns(inputs, drive, new)
        x, new = new, x
        free[:] = 0.0
        add_columns(scalars, x, free)
        for k in range(w.size):
            w[k], before[k] = 2.0 * w[k] - before[k], w[k]
        if not implicit(rows, products, gain, free, states, step, s, w, trial):
            failed += 1
        accept(rows, states, trial)
        if held_laws:
            add_rounded(jump, w, x)
        following = at + 1
        if switched or following % counts[0] == 0 or following % every == 0:
            read(reading, direct, x, w, y)
            total = 0.0
            for i in range(y.size):
                total += y[i]
            if not np.isfinite(total):
                failed = -following
                break
    if steps % 2:
        new[:], x = x, new
    add_columns(shift, w, x)
    values[0], values[1] = w, before
    return failed
