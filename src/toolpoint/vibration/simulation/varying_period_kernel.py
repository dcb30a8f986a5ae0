"""Compiled steps of `varying_periods`: states within a period under its forces, and states from period to period."""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import FloatArray


@njit(cache=True, nogil=True, fastmath=True)
def answer_from_rest(transition: FloatArray, static: FloatArray) -> FloatArray:
    """Return the states (s, z) after a period from rest, to static deflections (m, s, n); transition (z, z) by columns."""
    period, feeds, _ = static.shape
    state, after = np.zeros((feeds, transition.shape[0])), np.zeros((feeds, transition.shape[0]))
    for j in range(period):
        _step(transition, state, static[j], after)
        state, after = after, state
    return state


@njit(cache=True, nogil=True, fastmath=True)
def sum_forced_states(transition: FloatArray, transition_slope: FloatArray, static: FloatArray, static_slope: FloatArray,
                  periodic_state: FloatArray) -> FloatArray:
    """Return the states (m + 1, 3 s, z) from rest of `varying_periods._forced`.

    transition, transition_slope : (z, z) by columns, the change a node; static, static_slope : (m, s, n) deflections, and their
    change a node; periodic_state : (s, z), that repeats after a period.
    """
    period, feeds, n_coordinates = static.shape
    size = transition.shape[0]
    # Rows beside the three groups: the periodic state, which is followed to weigh the change of the structure.
    states = np.zeros((period + 1, 4 * feeds, size))
    states[0, 3 * feeds:] = periodic_state
    equilibrium = np.zeros((4 * feeds, n_coordinates))
    for j in range(period):
        steps_since_middle = j - period // 2
        for c in range(feeds):
            for r in range(n_coordinates):
                equilibrium[c, r] = equilibrium[3 * feeds + c, r] = static[j, c, r]
                equilibrium[feeds + c, r] = steps_since_middle * static[j, c, r]
                equilibrium[2 * feeds + c, r] = steps_since_middle * static_slope[j, c, r]
        _step(transition, states[j], equilibrium, states[j + 1])
        for i in range(size):
            for c in range(feeds):
                deviation = states[j, 3 * feeds + c, i] - (static[j, c, i] if i < n_coordinates else 0.0)
                for r in range(size):
                    states[j + 1, 2 * feeds + c, r] += steps_since_middle * deviation * transition_slope[i, r]
    return states[:, :3 * feeds].copy()


@njit(cache=True, nogil=True, fastmath=True)
def advance_vibration(transition: FloatArray, transition_after: FloatArray, forced_before: FloatArray, forced_after: FloatArray,
                      share: FloatArray, state: FloatArray, starts: FloatArray) -> None:
    """Advance a state (z,) by whole periods between two nodes; the states at their starts are written to `starts` (k, z).

    transition, transition_after : (z, z), of a period at both nodes, by columns; forced_before, forced_after : (k, z).
    """
    size, count = state.size, share.size
    result = np.zeros(size)
    for k in range(count):
        t = share[k]
        for r in range(size):
            starts[k, r] = state[r]
            result[r] = (1 - t) * forced_before[k, r] + t * forced_after[k, r]
        for j in range(size):
            x, y = (1 - t) * state[j], t * state[j]
            for r in range(size):
                result[r] += transition[j, r] * x + transition_after[j, r] * y
        for r in range(size):
            state[r] = result[r]


@njit(cache=True, nogil=True, fastmath=True)
def _step(transition: FloatArray, states: FloatArray, equilibria: FloatArray, results: FloatArray) -> None:
    """Write the states (k, z) after a step of x_s + Phi (x - x_s), with the positions of x_s equilibria (k, n)."""
    (count, size), n_coordinates = states.shape, equilibria.shape[1]
    for c in range(count):
        for r in range(size):
            results[c, r] = equilibria[c, r] if r < n_coordinates else 0.0
    # A column of the transition serves all states while it is in the nearest cache.
    for j in range(size):
        for c in range(count):
            x = states[c, j] - (equilibria[c, j] if j < n_coordinates else 0.0)
            for r in range(size):
                results[c, r] += transition[j, r] * x
