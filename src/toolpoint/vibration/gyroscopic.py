r"""Complex modes of systems whose damping matrix is not symmetric: gyroscopic ones above all.

Left and right vectors differ. With the state :math:`(q, \dot q)`, its matrix A and the right vectors X of A, the receptance is
:math:`\sum_r \phi_r \psi_r^T/(s - s_r)`, :math:`\phi_r` the upper half of column r of X and :math:`\psi_r^T` the lower half of
row r of :math:`X^{-1}` times :math:`M^{-1}`; then :math:`\psi_r^T (2 s_r M + C) \phi_r = 1`.
Source: Meirovitch, Fundamentals of Vibrations, 2001, section 7.15.
"""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.system import SecondOrderSystem

RIGID_TOLERANCE = 1e-9  # of the largest pole or eigenvalue: below, it is that of a rigid-body mode
MAX_PENCIL_CONDITION = 1e10  # of the eigenvectors: beyond, the pencil is defective within double precision


def is_gyroscopic(system: SecondOrderSystem) -> bool:
    """Whether the damping matrix has a skew part."""
    c = system.damping
    return c is not None and bool(np.abs(c - np.swapaxes(c, -1, -2)).max() > 1e-8 * max(float(np.abs(c).max()), 1e-300))


def gyroscopic_modes(system: SecondOrderSystem, keep: int | None = None) -> Modes:
    """Return the complex modes of one pose with their own participation, lowest first, modal A scaling.

    Raises ToolpointError for rigid-body modes and for a defective pencil, for which these modes do not exist.
    """
    poles, right, left = gyroscopic_pencil(system)
    poles, right, left = poles[:keep], right[:, :keep], left[:, :keep]
    omega = np.abs(poles)
    ratio = -poles.real / omega
    # A real pole has ratio 1 to rounding, and must not count as one that oscillates.
    ratio = np.where(np.abs(ratio) > 1 - 1e-12, np.sign(ratio), ratio)
    return Modes(omega / (2 * np.pi), ratio, system.output_map @ right, system.outputs, "modal A", "viscous",
                 participation=system.input_map.T @ left, input_dofs=system.inputs, notes=system.notes)


def gyroscopic_pencil(system: SecondOrderSystem) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return upper and real poles (rad/s), lowest first, with right and left vectors (n, m) of one pose."""
    mass, stiffness = system.mass, system.stiffness
    damping = np.zeros_like(mass) if system.damping is None else system.damping
    n = mass.shape[-1]
    inverse = np.linalg.inv(mass)
    companion = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
    poles, states = np.linalg.eig(companion)
    largest = float(np.abs(poles).max())
    if (np.abs(poles) <= RIGID_TOLERANCE * largest).any():
        fail("system", "a rigid-body mode", "gyroscopic modes need a system that is held",
             remedy="hold the free directions, or use frequency_response.direct")
    # By unit columns: displacements and rates differ by the frequency, which is no sign of a defect.
    if np.linalg.cond(states / np.linalg.norm(states, axis=0)) > MAX_PENCIL_CONDITION:
        fail("system", "a defective pencil (critical damping, or a limit of stability)", "its modes do not exist",
             remedy="change the damping or the spin a little, or use frequency_response.direct")
    left_rows = np.linalg.inv(states)[:, n:] @ inverse
    poles = np.where(np.abs(poles.imag) <= 1e-12 * np.abs(poles), poles.real + 0j, poles)
    is_upper = poles.imag >= 0
    order = np.lexsort((-poles[is_upper].real, np.abs(poles[is_upper])))
    right, left = states[:n, is_upper][:, order], left_rows[is_upper][order].T
    # Left and right vectors get equal norms; their product, the residue, does not change.
    balance = np.sqrt(np.linalg.norm(right, axis=0) / np.linalg.norm(left, axis=0))
    return poles[is_upper][order], right / balance, left * balance


def whirl_omega(mass: FloatArray, gyroscopic: FloatArray, stiffness: FloatArray) -> FloatArray:
    """Return the natural frequencies (rad/s) of M, G, K without damping, ascending, batched over poses, shape (..., n)."""
    inverse = np.linalg.inv(mass)
    n = mass.shape[-1]
    zero, unit = np.zeros_like(mass), np.broadcast_to(np.eye(n), mass.shape)
    companion = np.concatenate([np.concatenate([zero, unit], axis=-1),
                                np.concatenate([-inverse @ stiffness, -inverse @ gyroscopic], axis=-1)], axis=-2)
    poles = np.linalg.eigvals(companion)
    growth = np.abs(poles.real).max()
    if growth > 1e-6 * np.abs(poles).max():
        fail("machine", f"a free motion that grows by {growth:.3g} 1/s", "must be stable for natural frequencies",
             remedy="look at preload, gravity and free directions")
    # Poles come in pairs +-i w: every second of the sorted sizes.
    return np.sort(np.abs(poles.imag), axis=-1)[..., ::2]
