"""Pairs of machine modes and measured modes: by the motions of all components and by frequency."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint.joint_identification.machine.rigid_machine import RigidMachine, solve_undamped
from toolpoint.joint_identification.modes.modal_data import ModalData

_MAX_RIVAL_COST = 1.0  # of two modes exchanging partners; 2 for two without any similarity
_MERGED_FREQUENCY_RATIO = 3e-3  # relative distance of frequencies that a fit has brought together


def modes_of(machine: RigidMachine, data: ModalData) -> tuple[ComplexArray, Array]:
    """Return poles and motions to compare with measured ones: complex modes, or undamped ones where those are real."""
    if data.is_complex:
        poles, motions, _ = machine.solve()
        return poles, motions
    return solve_undamped(machine)


def match_modes(machine: RigidMachine, data: ModalData) -> tuple[IndexArray, FloatArray]:
    """Return (partner (k,) of every measured mode among the machine's, MAC (k, n) by the motion of the points)."""
    correlation, cost = _similarity(machine, data)
    rows, columns = optimize.linear_sum_assignment(cost)
    partner = np.full(len(data.frequency), -1)
    partner[rows] = columns
    return partner, correlation


def rival_pairs(machine: RigidMachine, data: ModalData, count: int) -> list[IndexArray]:
    """Return up to `count` other pairs of modes, two measured modes changing partners in each, the likeliest first."""
    partner, cost = match_modes(machine, data)[0], _similarity(machine, data)[1]
    paired = [int(r) for r in np.flatnonzero(partner >= 0)]
    price = sorted((float(cost[r, partner[s]] + cost[s, partner[r]] - cost[r, partner[r]] - cost[s, partner[s]]), r, s)
                   for i, r in enumerate(paired) for s in paired[:i])
    result = []
    for extra_cost, r, s in price[:count]:
        if extra_cost < _MAX_RIVAL_COST:
            other = partner.copy()
            other[[r, s]] = partner[[s, r]]
            result.append(other)
    return result


def exchange_crossings(partner: IndexArray, computed: FloatArray, measured: FloatArray) -> IndexArray:
    """Return the partners with those changed that a fit has brought to one frequency where the measured order is the other.

    Modes are numbered by frequency, so two that must cross cannot: they stop side by side. Changed there, they go on.

    Parameters
    ----------
    partner, computed, measured : (k,) partners of the measured modes, the partners' frequencies, the measured ones, Hz
    """
    result = partner.copy()
    for r in range(len(partner)):
        for s in range(r):
            are_merged = abs(computed[r] / computed[s] - 1) < _MERGED_FREQUENCY_RATIO
            are_distinct = abs(measured[r] / measured[s] - 1) > 2 * _MERGED_FREQUENCY_RATIO
            if are_merged and are_distinct and (measured[r] - measured[s]) * (result[r] - result[s]) < 0:
                result[[r, s]] = result[[s, r]]
    return result


def _similarity(machine: RigidMachine, data: ModalData) -> tuple[FloatArray, FloatArray]:
    """Return (MAC (k, n) of measured modes and the machine's, cost of pairing them)."""
    poles, motions = modes_of(machine, data)
    cross = np.einsum("cik,cij,cjn->kn", data.motions.conj(), data.grams, motions, optimize=True)
    first = np.einsum("cik,cij,cjk->k", data.motions.conj(), data.grams, data.motions, optimize=True).real
    second = np.einsum("cin,cij,cjn->n", motions.conj(), data.grams, motions, optimize=True).real
    correlation = np.abs(cross) ** 2 / np.outer(first, second)
    log_distance = np.abs(np.log(np.outer(2 * np.pi * data.frequency, 1 / np.abs(poles))))
    # Shapes decide and frequencies break ties: far apart they count no further, as a wrong stiffness moves a mode by any
    # factor.
    return correlation, -correlation + 0.2 * np.minimum(log_distance, 2.0)
