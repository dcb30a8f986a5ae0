"""Compiled simulation of a servo: exact first-order-hold step of the plant, implicit in its few nonlinear scalars.

Imported only when a simulation runs: numba takes most of a second to load.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint.drives.axis.outputs import ANGLE, CURRENT_D, CURRENT_Q, OUTPUTS, SCALE, SPEED, TOOL
from toolpoint.drives.controller.kernel import (
    current_sample,
    position_sample,
    velocity_sample,
    write_switched_voltage,
)
from toolpoint.drives.friction.kernel import bristle_rate, solve_law
from toolpoint.drives.friction.records import BRISTLE, CONTACT, MAXWELL
from toolpoint.drives.simulation import arrays
from toolpoint.drives.simulation.arrays import MAX_LAW_PASSES

WIDTH = len(OUTPUTS)  # outputs of an axis
# Products may be fused with sums (one rounding in place of two): the same bits on every run of one machine.
FUSED = {"contract"}


@njit(cache=True, nogil=True, fastmath=FUSED)
def add_columns(columns, x, out):
    """Add columns^T x to out; row j of `columns` is the column that x[j] multiplies, so the inner loop is contiguous.

    columns (m, n), x (m,), out (n,) : float64. Four columns at a time: `out` is loaded and stored a quarter as often.
    """
    grouped = x.size - x.size % 4
    for j in range(0, grouped, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        for i in range(out.size):
            out[i] += columns[j, i] * a + columns[j + 1, i] * b + columns[j + 2, i] * c + columns[j + 3, i] * d
    for j in range(grouped, x.size):
        a = x[j]
        if a != 0.0:
            for i in range(out.size):
                out[i] += columns[j, i] * a


@njit(cache=True, nogil=True)
def add_rounded(columns, x, out):
    """Add columns^T x to out with every product rounded: a force that holds a body still cancels its load exactly.

    columns (m, n), x (m,), out (n,) : float64.
    """
    for j in range(x.size):
        for i in range(out.size):
            out[i] += columns[j, i] * x[j]


@njit(cache=True, nogil=True, fastmath=FUSED)
def advance(core, pairs, x, new):
    """Write phi x to new: a dense core (by columns), then two by two blocks over the halves of the rest.

    core (n, n), pairs (4, half) : (p11, p12, p21, p22) of every block; x, new (n + 2 half,) : all float64.
    """
    n, half = core.shape[0], pairs.shape[1]
    for i in range(half):
        a, b = x[n + i], x[n + half + i]
        new[n + i] = pairs[0, i] * a + pairs[1, i] * b
        new[n + half + i] = pairs[2, i] * a + pairs[3, i] * b
    if n > 0:
        new[:n] = 0.0
        add_columns(core, x[:n], new[:n])


@njit(cache=True, nogil=True)
def start_scalars(laws, products, s, states, w):
    """Write the laws' values and rates at the start, from the scalars and the stored states.

    laws (n,) `LAW`; products (m, 2) int64 : pairs of scalars; s (n_scalars,) float64; states (n,) `LAW_STATE`, changed;
    w (n + m,) float64, written: values of the laws, then the products.
    """
    for k in range(laws.size):
        law, state = laws[k], states[k]
        if law.kind == BRISTLE:
            state.bristle_rate = bristle_rate(law, state.bristle, s[k])
            w[k] = law.bristle_stiffness * state.bristle + law.bristle_damping * state.bristle_rate + law.viscous * s[k]
        elif law.kind == MAXWELL:
            state.velocity = s[k]
            w[k] = law.viscous * s[k] + state.block_force.sum()
        elif law.kind == CONTACT:
            left, right = s[k] + law.contact_preload, law.contact_preload - s[k]
            w[k] = (law.contact_reference * s[k] - law.contact_stiffness * (max(left, 0.0) - max(right, 0.0))
                    - law.contact_cubic * s[k] ** 3)
    for k in range(products.shape[0]):
        w[laws.size + k] = s[products[k, 0]] * s[products[k, 1]]


@njit(cache=True, nogil=True)
def implicit(laws, products, gain, free, states, step, s, w, trial):
    """Solve s = free + gain w(s) by passes over the laws (each solved alone exactly) and the products; return success.

    Only the few scalars s in which the plant is not linear are unknown: the rest of the step is known in closed form.
    Block Gauss-Seidel: law k sees s_k = (free_k + sum_j gain_kj w_j, j not k) + gain_kk w_k.

    laws, states, trial (n,) records; products (m, 2) int64; gain (n_scalars, n + m), free, s (n_scalars,), w (n + m,) float64;
    s, w, trial are written.
    """
    count, m = laws.size, w.size
    converged, last_change = True, 1e-300
    for turn in range(MAX_LAW_PASSES):
        change, size = 0.0, 0.0
        for k in range(count):
            other = free[k] - gain[k, k] * w[k]
            for j in range(m):
                other += gain[k, j] * w[j]
            # The laws hardly feel each other within a step: one whose surroundings stand still is not solved again.
            if turn and abs(other - trial[k].surroundings) <= 1e-10 * (abs(other) + abs(gain[k, k] * w[k])):
                continue
            trial[k].surroundings = other
            guess = s[k] if turn else other + gain[k, k] * w[k]
            s[k], value, good = solve_law(laws[k], states[k], step, other, gain[k, k], guess, trial[k])
            converged = good if turn == 0 and k == 0 else converged and good
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
            change, size = max(change, abs(value - w[count + k])), max(size, abs(value))
            w[count + k] = value
        # What is left after a pass falls again as the change did.
        if change * min(1.0, change / last_change) <= 1e-7 * size + 1e-15:
            return converged
        last_change = change
    return False


@njit(cache=True, nogil=True)
def accept(laws, states, trial):
    """Store the laws' states after a step."""
    for k in range(laws.size):
        if laws[k].kind == BRISTLE:
            states[k].bristle, states[k].bristle_rate = trial[k].bristle, trial[k].bristle_rate
        elif laws[k].kind == MAXWELL:
            states[k] = trial[k]


@njit(cache=True, nogil=True)
def sample_controllers(step, control, y):
    """Run every loop whose sample falls on this step; `y` are the outputs of all axes, one axis after the other."""
    counts, inject, place = control.counts, control.excitation, control.place
    for i in range(control.parameters.size):
        p, s, b = control.parameters[i], control.states[i], WIDTH * i
        if step % counts.position == 0:
            # Behind the end of the set points the last one holds: a simulation may run longer, until the axes rest.
            k = min(step // counts.position, control.set_points.shape[0] - 1)
            position_sample(p, s, control.set_points[k, i], y[b + ANGLE], y[b + SCALE])
        k = min(step // counts.velocity, inject.shape[0] - 1)
        if step % counts.velocity == 0:
            damped = y[b + TOOL] if p.damps_tool else y[b + SCALE]
            velocity_sample(p, s, y[b + ANGLE], y[b + SPEED], damped, inject[k, i] if place == arrays.SPEED else 0.0,
                            inject[k, i] if place == arrays.TORQUE else 0.0)
        k = min(step // counts.current, inject.shape[0] - 1)
        current_sample(p, s, y[b + ANGLE], y[b + SPEED], y[b + CURRENT_D], y[b + CURRENT_Q],
                       inject[k, i] if place == arrays.CURRENT else 0.0, inject[k, i] if place == arrays.VOLTAGE else 0.0)


@njit(cache=True, nogil=True)
def held_inputs(step, control, y, u, voltage):
    """Write the inputs that are in force over this step."""
    substeps = control.counts.current
    for i in range(control.parameters.size):
        p, s, b = control.parameters[i], control.states[i], WIDTH * i
        if p.six_pulse:
            write_switched_voltage(p, s, (step % substeps) / substeps, 1.0 / substeps, y[b + ANGLE], y[b + SPEED], voltage)
            u[2 * i], u[2 * i + 1] = voltage[0], voltage[1]
        else:
            u[2 * i], u[2 * i + 1] = s.voltage_d, s.voltage_q


@njit(cache=True, nogil=True)
def record(line, y, u, control, s, w, viscous, histories):
    """Store outputs, controller signals (in the order of `SIGNALS`) and laws' values (with their viscous part) at a
    step."""
    outputs, signals, forces = histories.outputs, histories.signals, histories.forces
    for i in range(outputs.shape[1]):
        outputs[line, i] = y[i]
    for i in range(control.states.size):
        state = control.states[i]
        signals[line, i, 0], signals[line, i, 1], signals[line, i, 2] = state.speed_set, state.torque_set, state.current_set
        signals[line, i, 3], signals[line, i, 4], signals[line, i, 5] = u[2 * i], u[2 * i + 1], state.following_error
    for k in range(forces.shape[1]):
        forces[line, k] = w[k] + (viscous[k] * s[k] if k < viscous.size else 0.0)


@njit(cache=True, nogil=True)
def read(reading, direct, x, w, y):
    """Write the outputs of shifted coordinates x: y = reading x + direct w; matrices by columns, all float64."""
    y[:] = 0.0
    add_columns(reading, x, y)
    add_columns(direct, w, y)


@njit(cache=True, nogil=True)
def begin(start, matrices, laws, motion, s, w):
    """Write the scalars and the laws' values at the start; the coordinates become those less shift w."""
    add_columns(matrices.scalars, motion.coordinates, s)
    if start == 0:
        start_scalars(laws.records, laws.products, s, motion.laws, w)
        put(w, motion.values[0], 0)
        put(w, motion.values[1], 0)
    for k in range(w.size):
        w[k] = -motion.values[0, k]
    add_columns(matrices.shift, w, motion.coordinates)
    put(motion.values[0], w, 0)


@njit(cache=True, nogil=True)
def press(matrices, laws, x, w, load, records):
    """Write the dry level of every loaded law into records: its own level and load_arm |load|.

    laws, records (n,) `LAW`; x less shift w, w and load (n,) float64, load is written. The load is that before the step's own
    change of w: friction moves it by hundredths, within one step by nothing.
    """
    for k in range(load.size):
        load[k] = 0.0
    add_columns(matrices.loads, x, load)
    add_columns(matrices.load_direct, w, load)
    for k in range(load.size):
        records[k].level = laws[k].level + laws[k].load_arm * abs(load[k])


@njit(cache=True, nogil=True)
def put(values, out, first):
    """Write values into out from a place on; a copy by slices compiles the text of its error for seconds."""
    for k in range(values.size):
        out[first + k] = values[k]


@njit(cache=True, nogil=True)
def all_finite(values):
    """Whether no value is infinite or not a number: one test of their sum."""
    total = 0.0
    for i in range(values.size):
        total += values[i]
    return np.isfinite(total)


@njit(cache=True, nogil=True)
def run(start, steps, matrices, laws, control, motion, histories):
    """Advance the servo from step `start` by `steps`; returns the number whose implicit equations did not converge.

    Arguments are those of `arrays`. Inside, x is less shift w, so that one product with w carries both ends of the step:
    x1 - shift w1 = phi (x0 - shift w0) + (first + phi shift) w0 + held u. The motion changes in place (values are read where
    start is not 0), so that a run can be taken up again. A motion that is not finite returns minus the step.
    """
    counts, load, record_interval = control.counts, control.load, histories.record_interval
    scalars, gain, shift, jump = matrices.scalars, matrices.gain, matrices.shift, matrices.jump
    records, products, states, x = laws.records.copy(), laws.products, motion.laws, motion.coordinates
    axes = load.shape[1]
    new, u, drive = np.zeros(x.size), np.zeros(2 * axes), np.zeros(matrices.inputs.shape[0])
    s, w, y = np.zeros(scalars.shape[1]), np.zeros(shift.shape[0]), np.zeros(matrices.reading.shape[1])
    free, trial, voltage = np.zeros(scalars.shape[1]), states.copy(), np.zeros(2)
    switched, held_laws = np.any(control.parameters.six_pulse != 0), np.any(jump != 0.0)
    begin(start, matrices, laws, motion, s, w)
    read(matrices.reading, matrices.direct, x, w, y)
    failed, last_values, load_force = 0, motion.values[1].copy(), np.zeros(matrices.loads.shape[1])
    for step in range(start, start + steps):
        if step % counts.current == 0:
            sample_controllers(step, control, y)
        if switched or step % counts.current == 0 or step == start:
            held_inputs(step, control, y, u, voltage)
            put(u, drive, 0)
        if step % record_interval == 0:
            record(step // record_interval, y, u, control, s, w, laws.viscous, histories)
        put(load[min(step, load.shape[0] - 1)], drive, 2 * axes)
        put(w, drive, 3 * axes)
        advance(matrices.core, matrices.pairs, x, new)
        add_columns(matrices.inputs, drive, new)
        x, new = new, x
        free[:] = 0.0
        add_columns(scalars, x, free)
        # The laws' values run on as a straight line: the first guess of their implicit equations.
        for k in range(w.size):
            w[k], last_values[k] = 2.0 * w[k] - last_values[k], w[k]
        if load_force.size > 0:
            press(matrices, laws.records, x, w, load_force, records)
        if not implicit(records, products, gain, free, states, matrices.step, s, w, trial):
            failed += 1
        accept(records, states, trial)
        if held_laws:
            add_rounded(jump, w, x)
        following = step + 1
        if switched or following % counts.current == 0 or following % record_interval == 0:
            read(matrices.reading, matrices.direct, x, w, y)
            if not all_finite(y):
                failed = -following
                break
    if steps % 2:
        put(x, new, 0)
        x = new
    add_columns(shift, w, x)
    put(w, motion.values[0], 0)
    put(last_values, motion.values[1], 0)
    return failed

# Code of other modules in these kernels: 8b0688c8a56a
