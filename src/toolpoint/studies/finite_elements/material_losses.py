r"""Damped modes of a finite-element machine, coupled by the loss factors of its materials.

In the undamped modes :math:`\Phi` (unit modal mass, :math:`\Lambda = \omega^2`) the losses are
:math:`D = \Phi^T (\sum_s \eta_s K_s) \Phi + 2 \zeta_J \Lambda`, with :math:`\zeta_J` the ratio of the joints; the modes are the
eigenvectors of :math:`\Lambda + i D`. What modes left out would do is bounded by second order. As
:math:`0 \le D_K \le \hat\eta K`, also :math:`D_K K^{-1} D_K \le \hat\eta D_K`, so

.. math:: |\Delta\omega_j| / \omega_j \le s_j / 2, \quad |\Delta\eta_j| \le \hat\eta s_j / (1 - \omega_j^2 / \omega_n^2), \quad
   s_j = \frac{\hat\eta D_{jj} - \sum_k D_{kj}^2 / \omega_k^2}{\omega_j^2 (1 - \omega_j^2 / \omega_n^2)}

with the sum over the n modes kept (Kato, Perturbation Theory, II.2). The diagonal of D alone is the modal strain energy method
(Johnson, Kienholz, AIAA J. 20 (1982)).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.studies.finite_elements.whole_machine import FiniteElementMachine
from toolpoint.vibration import Modes, SecondOrderSystem
from toolpoint.vibration.damped_modes import solve_as_damped
from toolpoint.vibration.sparse import EigenPairs

MIN_DOUBTED_BOUND = 0.05  # change of a mode's damping by modes left out, over that damping: larger ones are doubted
MIN_CORRECTED_BOUND = 0.005  # the same: from here deflections under the losses are solved too
MIN_DEFLECTION = 1e-10  # squared mass norm of a deflection, over the largest: smaller ones are rounding


def modal_losses(machine: FiniteElementMachine, pairs: EigenPairs) -> FloatArray:
    """Return the imaginary part of the materials' stiffness in the modes, Phi^T D_K Phi, (n_modes, n_modes), rad^2/s^2."""
    losses = np.zeros((pairs.count, pairs.count))
    for part, model in machine.parts.items():
        shape = machine.shape_of(part, pairs)
        for name in model.set_names:
            if (factor := model.materials[name].loss_factor) > 0:
                losses += factor * model.projected(name, shape)[0]
    return (losses + losses.T) / 2


def solve_losses(machine: FiniteElementMachine, pairs: EigenPairs, joints: float) -> Modes:
    """Return the modes at the named points, complex where materials' losses couple them.

    joints : damping ratio of every mode that joints give, beside the materials. Where modes left out count, the deflections
    under the losses' own forces, K^-1 D_K Phi, are solved with the modes.
    """
    real = machine.point_modes(pairs, joints)
    materials = modal_losses(machine, pairs)
    if not materials.any():
        return real
    shape, squares = np.asarray(real.shape), np.diag(pairs.squares)
    if adds_deflections(machine, pairs):
        basis, squares, materials = _with_deflections(machine, pairs)
        shape = machine.point_rows(basis)[0]
    losses = materials + 2 * joints * squares
    system = SecondOrderSystem(np.eye(len(squares)), squares, structural_damping=losses, output_map=shape, outputs=real.dofs,
                               inputs=real.dofs)
    modes = solve_as_damped(system)
    first = np.argsort(modes.frequency)[:pairs.count]
    return replace(modes.selected(first), notes=tuple(dict.fromkeys((*real.notes, *modes.notes))))


def adds_deflections(machine: FiniteElementMachine, pairs: EigenPairs) -> bool:
    """Whether modes left out change the damping of the lower half of the modes by more than `MIN_CORRECTED_BOUND`."""
    return bool(bound_modes_alone(machine, pairs)[1, :max(pairs.count // 2, 1)].max() > MIN_CORRECTED_BOUND)


def _with_deflections(machine: FiniteElementMachine, pairs: EigenPairs) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return M-orthonormal shapes (size, m) that span modes and deflections, their stiffness and losses, (m, m), rad^2/s^2.

    m is at most twice the number of modes: deflections that are rounding are left out. The stiffness is diagonal.
    """
    forces = np.zeros_like(pairs.vectors)
    for part, model in machine.parts.items():
        rows = slice(machine.starts[part], machine.starts[part] + model.size)
        for name, stiffness in model.stiffness_parts.items():
            forces[rows] += model.materials[name].loss_factor * (stiffness @ pairs.vectors[rows])
    stiffness, mass = machine.matrices
    deflections = np.asarray(machine.inverse.solve(forces))
    for _ in range(2):  # twice: once leaves rounding of the modes
        deflections -= pairs.vectors @ (pairs.vectors.T @ (mass @ deflections))
    scale, turn = np.linalg.eigh(deflections.T @ (mass @ deflections))
    kept = scale > MIN_DEFLECTION * scale.max()
    basis = np.hstack([pairs.vectors, deflections @ (turn[:, kept] / np.sqrt(scale[kept]))])
    losses = np.zeros((basis.shape[1],) * 2)
    for part, model in machine.parts.items():
        shape = basis[machine.starts[part]:machine.starts[part] + model.size]
        losses += sum((model.materials[name].loss_factor * model.projected(name, shape)[0] for name in model.set_names), 0.0)
    projected = basis.T @ (stiffness @ basis)
    squares, vectors = np.linalg.eigh((projected + projected.T) / 2)
    turned = vectors.T @ losses @ vectors
    return basis @ vectors, np.diag(squares), (turned + turned.T) / 2


def bound_left_out(machine: FiniteElementMachine, pairs: EigenPairs) -> FloatArray:
    """Return bounds of the effect of modes left out of the losses, (2, n_modes): on frequency and on damping, relative.

    Where deflections are solved with the modes, the next order counts: the largest loss factor times as much.
    """
    bound = bound_modes_alone(machine, pairs)
    return bound * _largest_loss(machine) if adds_deflections(machine, pairs) else bound


def _largest_loss(machine: FiniteElementMachine) -> float:
    """Return the largest loss factor of all materials of a machine."""
    return max((part.materials[name].loss_factor for part in machine.parts.values() for name in part.set_names), default=0.0)


def bound_modes_alone(machine: FiniteElementMachine, pairs: EigenPairs) -> FloatArray:
    """Return bounds of the effect of modes left out, (2, n_modes), where the modes alone are solved.

    The first row is the relative change of frequency, the second that of the damping by materials (see the module). Bounds of
    the last mode are infinite, as the next one may be as low; without losses left out they are zero.
    """
    materials = modal_losses(machine, pairs)
    largest = _largest_loss(machine)
    own_loss = np.diag(materials)
    left_out = np.maximum(largest * own_loss - (materials**2 / pairs.squares[:, None]).sum(axis=0), 0.0)
    separation = np.maximum(1 - pairs.squares / pairs.squares[-1], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        shift = left_out / (pairs.squares * separation)
        damping = largest * shift / separation * pairs.squares / own_loss
    return np.where(left_out > 0, [shift / 2, damping], 0.0)


def question_losses(bound: FloatArray) -> list[Doubt]:
    """Return a doubt about the mode with the largest bound of damping, none below `MIN_DOUBTED_BOUND`.

    bound : (2, n_modes) of `bound_left_out`.
    """
    mode = int(bound[1].argmax()) if bound.size else 0
    if not bound.size or bound[1, mode] < MIN_DOUBTED_BOUND:
        return []
    frequency, damping = 100 * bound[:, mode]
    return [Doubt("damping", f"losses of materials couple mode {mode + 1} with modes left out: its damping, and limits with "
                  f"it, may change by up to {damping:.2g} %, its frequency by {frequency:.2g} %", "solve more modes",
                  figure=float(bound[1, mode]))]
