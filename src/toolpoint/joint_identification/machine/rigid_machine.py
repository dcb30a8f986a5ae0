r"""Machine of rigid components on elastic joints, small enough to be solved a thousand times in a fit.

Joint j has the free twists :math:`B_j = Ad(F_j) S_j`, stiffness :math:`K_j`, loss factor :math:`\eta_j` and relaxation time
:math:`\tau_j`; a component moves by :math:`J_c q`, the sum of :math:`B_j q_j` on its path from the ground. With
:math:`M = \sum_c J_c^T M_c J_c` the poles solve :math:`(s^2 M + s \sum \tau_j K_j + \sum (1 + i \eta_j) K_j) q = 0` (Ewins,
Modal Testing, 2nd ed., sections 2.5 to 2.7); of every pair the upper one is taken.

That is the `COUPLED` law of damping. Where shapes are real it does not hold: with the `ENERGY` law every undamped mode
dissipates what its joints do by their share of its strain energy, with the `MEASURED_RATIOS` law each mode has a ratio of its
own that no joint explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.spatial import transform as tf

COUPLED, ENERGY, MEASURED_RATIOS = "coupled", "energy", "measured"


@dataclass(frozen=True, eq=False)
class ElasticJoint:
    """One joint: `frame` (4, 4) in the machine frame (m), free `twists` (6, f) in it, `stiffness` (f, f), loss factor, and
    `relaxation` (s), the viscous damping over the stiffness."""

    frame: FloatArray
    twists: FloatArray
    stiffness: FloatArray
    loss_factor: float = 0.0
    relaxation: float = 0.0

    @property
    def basis(self) -> FloatArray:
        """Free twists (6, f) about the machine's origin."""
        return np.asarray(tf.adjoint(self.frame) @ self.twists)


@dataclass(frozen=True, eq=False)
class RigidMachine:
    """Components in a tree: joint i carries component i, `parents` (-1: the ground) of every component, `masses` (c, 6, 6), and
    the `law` of damping."""

    parents: tuple[int, ...]
    joints: tuple[ElasticJoint, ...]
    masses: FloatArray
    law: str = COUPLED

    def jacobians(self) -> FloatArray:
        """Return the motion of every component per joint coordinate, (c, 6, n)."""
        sizes = [joint.twists.shape[1] for joint in self.joints]
        ends = np.cumsum([0, *sizes])
        result = np.zeros((len(self.joints), 6, int(ends[-1])))
        for i in range(len(self.joints)):
            ancestor = i
            while ancestor >= 0:
                result[i][:, ends[ancestor]:ends[ancestor + 1]] = self.joints[ancestor].basis
                ancestor = self.parents[ancestor]
        return result

    def matrices(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return (jacobians, mass, complex stiffness, damping)."""
        jacobians = self.jacobians()
        mass = np.einsum("cia,cij,cjb->ab", jacobians, self.masses, jacobians, optimize=True)
        n, start = mass.shape[0], 0
        stiffness, damping = np.zeros((n, n), complex), np.zeros((n, n))
        for joint in self.joints:
            part = slice(start, start + len(joint.stiffness))
            stiffness[part, part] = (1 + 1j * joint.loss_factor) * joint.stiffness
            damping[part, part] = joint.relaxation * joint.stiffness
            start = part.stop
        return jacobians, mass, stiffness, damping

    def solve(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return (upper poles (n,) rad/s by frequency, motions (c, 6, n) of the components, joint coordinates (n, n))."""
        if self.law != COUPLED:
            poles, real_motions, real_vectors = solve_real(self)
            return poles, real_motions.astype(complex), real_vectors.astype(complex)
        jacobians, mass, stiffness, damping = self.matrices()
        n = len(mass)
        if damping.any():
            inverse = np.linalg.inv(mass)
            pencil = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
            poles, vectors = np.linalg.eig(pencil)
            upper = np.argsort(poles.imag)[-n:]
            poles, vectors = poles[upper], vectors[:n, upper]
        else:
            lower = np.linalg.cholesky(mass)
            scaled = np.linalg.solve(lower, np.linalg.solve(lower, stiffness).T)
            squares, vectors = np.linalg.eig(scaled)
            poles, vectors = 1j * np.sqrt(squares), np.linalg.solve(lower.T, vectors)
        order = np.argsort(np.abs(poles))
        vectors = vectors[:, order]
        vectors = vectors * np.exp(-0.5j * np.angle((vectors**2).sum(axis=0)))
        return poles[order], np.einsum("cia,ar->cir", jacobians, vectors), vectors


def solve_undamped(machine: RigidMachine) -> tuple[ComplexArray, FloatArray]:
    """Return poles (n,) and real motions (c, 6, n) of the undamped modes, as `solve_real`."""
    return solve_real(machine)[:2]


def solve_real(machine: RigidMachine) -> tuple[ComplexArray, FloatArray, FloatArray]:
    r"""Return poles (n,), real motions (c, 6, n) and joint coordinates (n, n) of the undamped modes with unit modal mass.

    Damping ratios are those by the energy that joints dissipate,
    :math:`\zeta_r = \phi_r^T D \phi_r / 2 \omega_r^2 + \phi_r^T C \phi_r / 2 \omega_r` with unit modal mass (Ewins, section
    2.5).
    """
    jacobians, mass, stiffness, damping = machine.matrices()
    lower = np.linalg.cholesky(mass)
    squares, vectors = np.linalg.eigh(np.linalg.solve(lower, np.linalg.solve(lower, stiffness.real).T))
    vectors = np.linalg.solve(lower.T, vectors)
    omega = np.sqrt(np.maximum(squares, 1e-12))
    ratio = np.einsum("ar,ab,br->r", vectors, stiffness.imag, vectors) / (2 * omega**2)
    ratio = np.clip(ratio + np.einsum("ar,ab,br->r", vectors, damping, vectors) / (2 * omega), -0.99, 0.99)
    return omega * (-ratio + 1j * np.sqrt(1 - ratio**2)), np.einsum("cia,ar->cir", jacobians, vectors), vectors


def modal_constants(machine: RigidMachine, poles: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    """Return :math:`a_r = v_r^T (2 s_r M + C) v_r` (n,): with it the residue of a mode is :math:`v_r v_r^T / a_r`."""
    if machine.law != COUPLED:  # unit modal mass, and a C that couples no modes
        return np.asarray(2j * poles.imag)
    _, mass, _, damping = machine.matrices()
    return np.einsum("ar,rab,br->r", vectors, 2 * poles[:, None, None] * mass + damping, vectors, optimize=True)


def pole_slopes(machine: RigidMachine, neighbours: Sequence[RigidMachine], step: float
                ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    r"""Return the slopes of poles (m, n), motions (m, c, 6, n) and logarithms of modal constants (m, n) from a machine to
    neighbours a step away in one number each.

    With :math:`Z(s) = s^2 M + s C + K` symmetric, :math:`s_r' = -v_r^T Z' v_r / a_r`, :math:`a_r = v_r^T (2 s_r M + C) v_r`,
    and :math:`v_r'` is the sum of the other modes that solves :math:`Z v_r' = -(Z' + s_r' (2 s_r M + C)) v_r`; its part along
    :math:`v_r` is a change of scale, which is free. With that part zero :math:`a_r' = v_r^T (2 s_r' M + 2 s_r M' + C') v_r`.
    """
    if machine.law != COUPLED:
        return _real_slopes(machine, neighbours, step)
    jacobians, mass, stiffness, damping = machine.matrices()
    poles, motions, vectors = machine.solve()
    n = len(mass)
    rates = 2 * poles[:, None, None] * mass + damping
    size = np.einsum("ar,rab,br->r", vectors, rates, vectors, optimize=True)
    # Bordered systems: the row v^T (2 s M + C) v' = 0 makes Z regular.
    bordered = np.zeros((n, n + 1, n + 1), complex)
    bordered[:, :n, :n] = poles[:, None, None] ** 2 * mass + poles[:, None, None] * damping + stiffness
    sides = np.einsum("rab,br->ra", rates, vectors)
    bordered[:, :n, n] = bordered[:, n, :n] = sides
    inverse = np.linalg.inv(bordered)
    d_poles, d_motions = np.empty((len(neighbours), n), complex), np.empty((len(neighbours), *motions.shape), complex)
    d_constants = np.empty((len(neighbours), n), complex)
    modal = np.einsum("ar,ab,br->r", vectors, mass, vectors)
    for m, other in enumerate(neighbours):
        other_jacobians, other_mass, other_stiffness, other_damping = other.matrices()
        change = (poles[:, None, None] ** 2 * (other_mass - mass) + poles[:, None, None] * (other_damping - damping)
                  + (other_stiffness - stiffness)) / step
        right = np.einsum("rab,br->ra", change, vectors)
        d_poles[m] = -np.einsum("ar,ra->r", vectors, right) / size
        vector = -np.einsum("rab,rb->ar", inverse[:, :n, :n], right + d_poles[m][:, None] * sides)
        d_motions[m] = np.einsum("cia,ar->cir", (other_jacobians - jacobians) / step, vectors)
        d_motions[m] += np.einsum("cia,ar->cir", jacobians, vector)
        rate_change = (2 * poles[:, None, None] * (other_mass - mass) + (other_damping - damping)) / step
        d_constants[m] = (2 * d_poles[m] * modal + np.einsum("ar,rab,br->r", vectors, rate_change, vectors)) / size
    return d_poles, d_motions, d_constants


def _real_slopes(machine: RigidMachine, neighbours: Sequence[RigidMachine], step: float
                 ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return what `pole_slopes` does, for real modes, by differences: their ratios follow the shapes in all joints at once."""
    poles, motions, vectors = solve_real(machine)
    shape = (len(neighbours), *motions.shape)
    d_poles, d_motions = np.empty((len(neighbours), len(poles)), complex), np.empty(shape, complex)
    d_constants = np.empty_like(d_poles)
    for m, other in enumerate(neighbours):
        other_poles, other_motions, other_vectors = solve_real(other)
        sign = np.where(np.einsum("ar,ar->r", vectors, other_vectors) < 0, -1.0, 1.0)
        d_poles[m] = (other_poles - poles) / step
        d_motions[m] = (sign * other_motions - motions) / step
        d_constants[m] = np.log(other_poles.imag / poles.imag) / step
    return d_poles, d_motions, d_constants


def tree_order(parents: Sequence[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return (parent, child) pairs with every parent before its children."""
    left, placed, result = list(parents), {"ground"}, []
    while left:
        ready = [pair for pair in left if pair[0] in placed]
        if not ready:
            ready = left[:1]
        for pair in ready:
            left.remove(pair)
            placed.add(pair[1])
            result.append(pair)
    return result
