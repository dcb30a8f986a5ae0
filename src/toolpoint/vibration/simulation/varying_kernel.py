"""Compiled steps of a linear system whose matrices change slowly along a path; see `varying`."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, fastmath=True)
def advance(nodes, cut, course, motion, keep, first, out, base):
    """Advance a block of steps; all matrices are stored by columns, at nodes along the path, and blended between two of them.

    nodes, cut, course, motion : `varying.NodeArrays`, `CutArrays`, `CourseArrays`, `RunArrays`; keep, first : every which step
    is written, and the number of the block's first step; out, base : tip motion (k, 6) and what acts on the base (k, 9).
    """
    transition, deflection, reading, moving, _, load_map, _, _ = nodes
    table, regeneration, depth = cut
    node, share, feed, loads = course
    state, delayed, totals = motion
    size = state.size
    half = size // 2
    width = deflection.shape[1]
    steps = share.size
    period = table.shape[1]
    feeds = table.shape[0]
    inputs = np.zeros(width)
    after = np.zeros(size)
    still = np.zeros(half)
    extended = np.zeros(size + width)
    kept = 0
    for k in range(steps):
        i, t = node[k], share[k]
        place = (first + k) % period
        # The force of the step, between two feeds of the table.
        position = feed[k] * (feeds - 1)
        low = min(int(position), feeds - 2) if feeds > 1 else 0
        part = position - low
        for a in range(3):
            inputs[a] = table[low, place, a]
            if feeds > 1:
                inputs[a] += part * (table[low + 1, place, a] - table[low, place, a])
        for a in range(width - 3):
            inputs[3 + a] = loads[k, a]
        if depth > 0.0:
            slot = (first + k) % delayed.shape[0]
            following = (slot + 1) % delayed.shape[0]
            before = (slot - 1) % delayed.shape[0]
            now = np.zeros(3)
            for a in range(3):
                for b in range(half):
                    now[a] += (load_map[i, a, b] + t * (load_map[i + 1, a, b] - load_map[i, a, b])) * state[b]
            for a in range(3):
                for b in range(3):
                    # Both at the middle of the step: now by extrapolation, a period ago by interpolation.
                    middle = 1.5 * now[b] - 0.5 * delayed[before, b]
                    past = 0.5 * (delayed[slot, b] + delayed[following, b])
                    inputs[a] -= depth * regeneration[place, a, b] * (middle - past)
            for a in range(3):
                delayed[slot, a] = now[a]
        # About the static deflection of the held inputs, which is blended as such: the transition acts on the rest alone.
        for r in range(half):
            still[r] = 0.0
        for j in range(width):
            x = inputs[j]
            if x != 0.0:
                for r in range(half):
                    still[r] += (deflection[i, j, r] + t * (deflection[i + 1, j, r] - deflection[i, j, r])) * x
        for r in range(size):
            after[r] = still[r] if r < half else 0.0
        for j in range(size):
            x = state[j] - still[j] if j < half else state[j]
            for r in range(size):
                after[r] += (transition[i, j, r] + t * (transition[i + 1, j, r] - transition[i, j, r])) * x
        if totals.size > 0:
            _account(nodes, i, t, inputs, after, extended, motion)
        if (first + k) % keep == 0:
            for a in range(6):
                value, pull = 0.0, 0.0
                for b in range(half):
                    value += (reading[i, a, b] + t * (reading[i + 1, a, b] - reading[i, a, b])) * after[b]
                    if base.shape[0] > 0:
                        pull += (moving[i, a,
                                        b] + t * (moving[i + 1, a, b] - moving[i, a, b])) * (after[half + b] - state[half + b])
                out[kept, a] = value
                if base.shape[0] > 0:
                    base[kept, a] = pull
            if base.shape[0] > 0:
                for a in range(3):
                    base[kept, 6 + a] = inputs[a]
            kept += 1
        for r in range(size):
            state[r] = after[r]
    return kept


@njit(cache=True, nogil=True, fastmath=True)
def _account(nodes, i, t, inputs, after, extended, motion):
    """Add the work of the inputs over a step (exact for inputs held), the energy lost (a quadratic form) and the energy
    gained."""
    dissipation, load_map, mass, stiffness = nodes.dissipation, nodes.load_map, nodes.mass, nodes.stiffness
    state, totals = motion.state, motion.totals
    size, width = state.size, inputs.size
    half = size // 2
    work = 0.0
    for a in range(width):
        moved = 0.0
        for b in range(half):
            moved += (load_map[i, a, b] + t * (load_map[i + 1, a, b] - load_map[i, a, b])) * (after[b] - state[b])
        work += inputs[a] * moved
        totals[2] += abs(inputs[a] * moved)
    totals[0] += work
    # Loss is a quadratic form in the state at the begin and the inputs, which are held: no quadrature within the step.
    for r in range(size):
        extended[r] = state[r]
    for r in range(width):
        extended[size + r] = inputs[r]
    lost = 0.0
    for a in range(size + width):
        x = extended[a]
        if x != 0.0:
            row = 0.0
            for b in range(size + width):
                row += (dissipation[i, a, b] + t * (dissipation[i + 1, a, b] - dissipation[i, a, b])) * extended[b]
            lost += x * row
    totals[1] += lost
    gained = 0.0
    for a in range(half):
        row, old = 0.0, 0.0
        tense, slack = 0.0, 0.0
        for b in range(half):
            m = mass[i, a, b] + t * (mass[i + 1, a, b] - mass[i, a, b])
            k = stiffness[i, a, b] + t * (stiffness[i + 1, a, b] - stiffness[i, a, b])
            row += m * after[half + b]
            old += m * state[half + b]
            tense += k * after[b]
            slack += k * state[b]
        gained += 0.5 * (after[half + a] * row - state[half + a] * old + after[a] * tense - state[a] * slack)
    totals[3] += gained
