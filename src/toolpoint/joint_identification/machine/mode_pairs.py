"""Which mode of a machine is which of the measured ones: by the motions of all components and by frequency."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from toolpoint._check import Array, ComplexArray, FloatArray, IndexArray
from toolpoint.joint_identification.machine.rigid_machine import RigidMachine, solve_undamped
from toolpoint.joint_identification.modes.modal_data import ModalData

# Two modes may have changed partners where that costs less than this, of 2 for two of no likeness.
_RIVAL = 1.0
_SIDE_BY_SIDE = 3e-3


def modes_of(machine: RigidMachine, data: ModalData) -> tuple[ComplexArray, Array]:
    """Return poles and motions to compare with measured ones: complex modes, or undamped ones where those are real."""
    if data.is_complex:
        poles, motions, _ = machine.solve()
        return poles, motions
    return solve_undamped(machine)


def match_modes(machine: RigidMachine, data: ModalData) -> tuple[IndexArray, FloatArray]:
    """Return (partner (k,) of every measured mode among the machine's, MAC (k, n) by the motion of the points)."""
    alike, unlikeness = _likeness(machine, data)
    rows, columns = optimize.linear_sum_assignment(unlikeness)
    partner = np.full(len(data.frequency), -1)
    partner[rows] = columns
    return partner, alike


def rival_pairs(machine: RigidMachine, data: ModalData, count: int) -> list[IndexArray]:
    """Return up to `count` other pairs of modes, two measured modes changing partners in each, the likeliest first."""
    partner, cost = match_modes(machine, data)[0], _likeness(machine, data)[1]
    known = [int(r) for r in np.flatnonzero(partner >= 0)]
    price = sorted((float(cost[r, partner[s]] + cost[s, partner[r]] - cost[r, partner[r]] - cost[s, partner[s]]), r, s)
                   for i, r in enumerate(known) for s in known[:i])
    result = []
    for more, r, s in price[:count]:
        if more < _RIVAL:
            other = partner.copy()
            other[[r, s]] = partner[[s, r]]
            result.append(other)
    return result


def with_crossings(partner: IndexArray, computed: FloatArray, measured: FloatArray) -> IndexArray:
    """Return the partners with those changed that a fit has brought to one frequency where the measured order is the other.

    Modes are numbered by frequency, so two that must cross cannot: they stop side by side. Changed there, they go on.

    Parameters
    ----------
    partner, computed, measured : (k,) partners of the measured modes, the partners' frequencies, the measured ones, Hz
    """
    result = partner.copy()
    for r in range(len(partner)):
        for s in range(r):
            side_by_side = abs(computed[r] / computed[s] - 1) < _SIDE_BY_SIDE
            apart = abs(measured[r] / measured[s] - 1) > 2 * _SIDE_BY_SIDE
            if side_by_side and apart and (measured[r] - measured[s]) * (result[r] - result[s]) < 0:
                result[[r, s]] = result[[s, r]]
    return result


def _likeness(machine: RigidMachine, data: ModalData) -> tuple[FloatArray, FloatArray]:
    """Return (MAC (k, n) of measured modes and the machine's, what it costs to pair them)."""
    poles, motions = modes_of(machine, data)
    cross = np.einsum("cik,cij,cjn->kn", data.motions.conj(), data.grams, motions, optimize=True)
    first = np.einsum("cik,cij,cjk->k", data.motions.conj(), data.grams, data.motions, optimize=True).real
    second = np.einsum("cin,cij,cjn->n", motions.conj(), data.grams, motions, optimize=True).real
    alike = np.abs(cross) ** 2 / np.outer(first, second)
    away = np.abs(np.log(np.outer(2 * np.pi * data.frequency, 1 / np.abs(poles))))
    return alike, -alike + 0.2 * np.minimum(away, 2.0)
