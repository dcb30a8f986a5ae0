r"""Damping mode by mode, with real shapes: what the key `modal_damping` of a machine says.

``energy``: at every pose each undamped mode dissipates what joints and bodies do by their share of its strain energy,
:math:`\zeta_r = \phi_r^T D \phi_r / 2 \omega_r^2 + \phi_r^T C \phi_r / 2 \omega_r` with unit modal mass (Ewins, Modal Testing,
2nd ed., section 2.5); what unequal losses couple between modes is left out, as the test said.

Ratios of the modes at the reference pose: :math:`D = K \Phi\, diag(2 \zeta_r / \omega_r^2)\, \Phi^T K` of that pose dissipates
as much in its modes, and the same formula gives every mode at another pose the ratios of those whose strain energy it shares.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.machine.assembly.joint_terms import joint_matrices
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import place_machine
from toolpoint.vibration import SecondOrderSystem, damping
from toolpoint.vibration.eigen import mass_normalised

ENERGY_DAMPING = "energy"
# Squared frequency, of the largest, below which a mode is a motion without stiffness and has no ratio.
_RIGID_SQUARE_RATIO = 1e-12


def damp_modes(machine: Machine, system: SecondOrderSystem, reference_mass: FloatArray) -> SecondOrderSystem:
    """Return a system, or a batch, with the viscous matrix of its modal ratios in place of what joints and bodies couple.

    Parameters
    ----------
    machine : Machine
        Whose description states `modal_damping`.
    system : SecondOrderSystem
        With the damping of joints and bodies.
    reference_mass : (1, n, n) floats
        Mass matrix at the reference pose.
    """
    squares, vectors = mass_normalised(system.mass, system.stiffness)
    structural, viscous = system.structural_damping, system.damping
    if machine.description.modal_damping != ENERGY_DAMPING:
        structural, viscous = reference_loss(machine, reference_mass), None
    ratio = modal_ratios(squares, vectors, structural=structural, viscous=viscous)
    return damping.modal(replace(system, structural_damping=None), ratio)


def modal_ratios(squares: FloatArray, vectors: FloatArray, *, structural: FloatArray | None, viscous: FloatArray | None
                 ) -> FloatArray:
    """Return the damping ratios (..., n) of undamped modes with unit modal mass by the energy that they dissipate."""
    is_elastic = squares > _RIGID_SQUARE_RATIO * squares.max(axis=-1, keepdims=True)
    omega = np.sqrt(np.where(is_elastic, squares, 1.0))
    ratio = np.zeros_like(squares)
    for matrix, denominator in ((structural, 2 * omega**2), (viscous, 2 * omega)):
        if matrix is not None:
            ratio = ratio + np.einsum("...ar,...ab,...br->...r", vectors, matrix, vectors, optimize=True) / denominator
    return np.where(is_elastic, ratio, 0.0)


def reference_loss(machine: Machine, mass: FloatArray) -> FloatArray:
    """Return the loss matrix (n, n) that gives the modes at the reference pose the ratios that the description states.

    Modes beyond the stated ones have the mean of these.
    """
    stated = machine.description.modal_damping
    assert not isinstance(stated, str)
    if machine.loops:
        fail("modal_damping", "a ratio for every mode, and the machine has closed loops", "must be 'energy' or left out there",
             remedy="give its joints loss factors, or one damping_ratio for all modes")
    stiffness = joint_matrices(place_machine(machine))[0][0]
    squares, vectors = mass_normalised(mass[0], stiffness)
    if len(stated) > len(squares):
        fail("modal_damping", f"{len(stated)} ratios", f"must be at most {len(squares)}: the machine has no more modes")
    ratio = np.full(len(squares), float(np.mean(stated)))
    ratio[:len(stated)] = stated
    scaled_vectors = stiffness @ vectors
    return np.asarray((scaled_vectors * (2 * ratio / np.maximum(squares, _RIGID_SQUARE_RATIO * squares.max())))
                      @ scaled_vectors.T)
