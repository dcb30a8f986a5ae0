"""Compiled steps of a linear system whose matrices change slowly along a path; see `varying`."""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray
from toolpoint.vibration.simulation.varying import CourseArrays, CutArrays, NodeArrays, RunArrays


@njit(cache=True, nogil=True, fastmath=True)
def advance(nodes: NodeArrays, cut: CutArrays, course: CourseArrays, motion: RunArrays, keep: int, first: int,
            out: FloatArray, base: FloatArray) -> int:
    """Advance a block of steps of x_{k+1} = x_s + Phi (x_k - x_s), with x_s the static deflection of the inputs.

    All matrices are stored by columns, at nodes along the path, and blended linearly between two of them.

    Parameters
    ----------
    nodes, cut, course, motion : `varying.NodeArrays`, `CutArrays`, `CourseArrays`, `RunArrays`
        Arrays of float64, contiguous; `course.node` int64.
    keep, first : int
        Every which step is written, and the number of the block's first step.
    out : (k, 6) float64
        Motion of the tip, written.
    base : (k, 9) float64
        Force and moment on the base, and the tip's force, written; empty (0, 9) where not wanted.

    Returns
    -------
    int
        Number of steps written.
    """
    transition, deflection, reading, moving, _, load_map, _, _ = nodes
    table, regeneration, depth = cut
    node, share, feed, loads = course
    state, delayed, totals = motion
    size = state.size
    n_coordinates = size // 2
    n_inputs = deflection.shape[1]
    steps = share.size
    period = table.shape[1]
    feeds = table.shape[0]
    inputs = np.zeros(n_inputs)
    after = np.zeros(size)
    static = np.zeros(n_coordinates)
    extended = np.zeros(size + n_inputs)
    n_written = 0
    for k in range(steps):
        i, t = node[k], share[k]
        phase = (first + k) % period
        # The force of the step, between two feeds of the table.
        feed_position = feed[k] * (feeds - 1)
        feed_row = min(int(feed_position), feeds - 2) if feeds > 1 else 0
        fraction = feed_position - feed_row
        for a in range(3):
            inputs[a] = table[feed_row, phase, a]
            if feeds > 1:
                inputs[a] += fraction * (table[feed_row + 1, phase, a] - table[feed_row, phase, a])
        for a in range(n_inputs - 3):
            inputs[3 + a] = loads[k, a]
        if depth > 0.0:
            slot = (first + k) % delayed.shape[0]
            next_slot = (slot + 1) % delayed.shape[0]
            previous = (slot - 1) % delayed.shape[0]
            tip = np.zeros(3)
            for a in range(3):
                for b in range(n_coordinates):
                    tip[a] += (load_map[i, a, b] + t * (load_map[i + 1, a, b] - load_map[i, a, b])) * state[b]
            for a in range(3):
                for b in range(3):
                    # Both at the middle of the step: now by extrapolation, a period ago by interpolation.
                    tip_half_way = 1.5 * tip[b] - 0.5 * delayed[previous, b]
                    tip_delayed = 0.5 * (delayed[slot, b] + delayed[next_slot, b])
                    inputs[a] -= depth * regeneration[phase, a, b] * (tip_half_way - tip_delayed)
            for a in range(3):
                delayed[slot, a] = tip[a]
        # About the static deflection of the held inputs, which is blended as such: the transition acts on the rest alone.
        for r in range(n_coordinates):
            static[r] = 0.0
        for j in range(n_inputs):
            x = inputs[j]
            if x != 0.0:
                for r in range(n_coordinates):
                    static[r] += (deflection[i, j, r] + t * (deflection[i + 1, j, r] - deflection[i, j, r])) * x
        for r in range(size):
            after[r] = static[r] if r < n_coordinates else 0.0
        for j in range(size):
            x = state[j] - static[j] if j < n_coordinates else state[j]
            for r in range(size):
                after[r] += (transition[i, j, r] + t * (transition[i + 1, j, r] - transition[i, j, r])) * x
        if totals.size > 0:
            _account(nodes, i, t, inputs, after, extended, motion)
        if (first + k) % keep == 0:
            for a in range(6):
                value, reaction = 0.0, 0.0
                for b in range(n_coordinates):
                    value += (reading[i, a, b] + t * (reading[i + 1, a, b] - reading[i, a, b])) * after[b]
                    if base.shape[0] > 0:
                        reaction += (moving[i, a,
                                        b] + t * (moving[i + 1, a, b] - moving[i, a, b])) * (after[n_coordinates + b]
                                                                                             - state[n_coordinates + b])
                out[n_written, a] = value
                if base.shape[0] > 0:
                    base[n_written, a] = reaction
            if base.shape[0] > 0:
                for a in range(3):
                    base[n_written, 6 + a] = inputs[a]
            n_written += 1
        for r in range(size):
            state[r] = after[r]
    return n_written


@njit(cache=True, nogil=True, fastmath=True)
def _account(nodes: NodeArrays, i: int, t: float, inputs: FloatArray, after: FloatArray, extended: FloatArray,
             motion: RunArrays) -> None:
    """Add the energies of a step: work f^T du of held inputs, loss [x; f]^T Q [x; f], gain in (u^T K u + v^T M v)/2."""
    dissipation, load_map, mass, stiffness = nodes.dissipation, nodes.load_map, nodes.mass, nodes.stiffness
    state, totals = motion.state, motion.totals
    size, n_inputs = state.size, inputs.size
    n_coordinates = size // 2
    work = 0.0
    for a in range(n_inputs):
        motion_of_input = 0.0
        for b in range(n_coordinates):
            motion_of_input += (load_map[i, a, b] + t * (load_map[i + 1, a, b] - load_map[i, a, b])) * (after[b] - state[b])
        work += inputs[a] * motion_of_input
        totals[2] += abs(inputs[a] * motion_of_input)
    totals[0] += work
    # Loss is a quadratic form in the state at the begin and the inputs, which are held: no quadrature within the step.
    for r in range(size):
        extended[r] = state[r]
    for r in range(n_inputs):
        extended[size + r] = inputs[r]
    loss = 0.0
    for a in range(size + n_inputs):
        x = extended[a]
        if x != 0.0:
            momentum = 0.0
            for b in range(size + n_inputs):
                momentum += (dissipation[i, a, b] + t * (dissipation[i + 1, a, b] - dissipation[i, a, b])) * extended[b]
            loss += x * momentum
    totals[1] += loss
    gain = 0.0
    for a in range(n_coordinates):
        momentum, momentum_before = 0.0, 0.0
        elastic_after, elastic_before = 0.0, 0.0
        for b in range(n_coordinates):
            m = mass[i, a, b] + t * (mass[i + 1, a, b] - mass[i, a, b])
            k = stiffness[i, a, b] + t * (stiffness[i + 1, a, b] - stiffness[i, a, b])
            momentum += m * after[n_coordinates + b]
            momentum_before += m * state[n_coordinates + b]
            elastic_after += k * after[b]
            elastic_before += k * state[b]
        gain += 0.5 * (after[n_coordinates + a] * momentum - state[n_coordinates + a] * momentum_before
                       + after[a] * elastic_after - state[a] * elastic_before)
    totals[3] += gain
