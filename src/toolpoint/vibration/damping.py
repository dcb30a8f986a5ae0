"""Damping matrices: proportional, modal, and viscous in place of structural."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, floats, scalar
from toolpoint.vibration.eigen import mass_normalised
from toolpoint.vibration.gyroscopic import is_gyroscopic
from toolpoint.vibration.system import SecondOrderSystem


def proportional(system: SecondOrderSystem, mass_factor: float, stiffness_factor: float) -> SecondOrderSystem:
    """Return the system with C = a M + b K (Rayleigh); a in 1/s, b in s."""
    a, b = scalar("mass_factor", mass_factor), scalar("stiffness_factor", stiffness_factor)
    return system.with_damping(a * system.mass + b * system.stiffness)


def modal(system: SecondOrderSystem, ratio: ArrayLike) -> SecondOrderSystem:
    r"""Return the system with the damping matrix that gives these modal damping ratios.

    :math:`C = M \Phi\, diag(2 \zeta_r \omega_r)\, \Phi^T M`; a single ratio serves every mode.
    It takes the place of all damping present, viscous and structural, except a gyroscopic part.
    Source: Clough, Penzien, Dynamics of Structures, 3rd ed., section 12-5.
    """
    squares, vectors = mass_normalised(system.mass, system.stiffness)
    omega = np.sqrt(np.maximum(squares, 0.0))
    modal_rate = 2 * floats("ratio", np.broadcast_to(ratio, omega.shape)) * omega
    matrix = _from_modal(system.mass, vectors, modal_rate)
    viscous = matrix + _skew(system.damping) if is_gyroscopic(system) else matrix
    return replace(system, damping=viscous, structural_damping=None)


def equivalent_viscous(system: SecondOrderSystem) -> SecondOrderSystem:
    r"""Return the system with its structural damping replaced by viscous damping of equal loss at each resonance.

    :math:`C_{rs} = \phi_r^T D \phi_s / \sqrt{\omega_r \omega_s}` in modal coordinates, added to the viscous damping
    present. Exact at every resonance, an approximation between them: the result's notes say so.
    """
    if system.structural_damping is None:
        return system
    squares, vectors = mass_normalised(system.mass, system.stiffness)
    omega = np.sqrt(np.maximum(squares, 0.0))
    with np.errstate(divide="ignore"):
        inverse_root = np.where(omega > 1e-6 * omega.max(axis=-1, keepdims=True), 1 / np.sqrt(omega), 0.0)
    modal_damping = np.swapaxes(vectors, -1, -2) @ system.structural_damping @ vectors
    modal_damping = inverse_root[..., :, None] * modal_damping * inverse_root[..., None, :]
    momenta = system.mass @ vectors
    matrix = momenta @ modal_damping @ np.swapaxes(momenta, -1, -2)
    matrix = matrix if system.damping is None else matrix + system.damping
    note = "structural damping replaced by viscous damping of equal loss at each resonance"
    return replace(system, damping=matrix, structural_damping=None, notes=(*system.notes, note))


def _skew(damping: FloatArray | None) -> FloatArray:
    """Return the gyroscopic (skew) part of a damping matrix."""
    assert damping is not None
    return np.asarray((damping - np.swapaxes(damping, -1, -2)) / 2)


def _from_modal(mass: FloatArray, vectors: FloatArray, modal_rate: FloatArray) -> FloatArray:
    """Return the matrix C = M Phi diag(rate) Phi^T M."""
    momenta = mass @ vectors
    return (momenta * modal_rate[..., None, :]) @ np.swapaxes(momenta, -1, -2)
