"""Error of studies that couple modes by their joints' losses where the file states `modal_damping: energy`."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from toolpoint._check import FileDoubt
from toolpoint._doubt import Doubt
from toolpoint.kinematics.chain import Pose
from toolpoint.machine import Machine
from toolpoint.machine.assembly.modal_damping import ENERGY_DAMPING
from toolpoint.machine.assembly.system import assemble
from toolpoint.vibration import Dof, SecondOrderSystem, eigen, frequency_response
from toolpoint.vibration.damped_modes import solve_as_damped

COMPARED_LINE_COUNT = 300  # lines between the modes at which both laws are compared
MIN_LAW_DIFFERENCE = 1e-3  # of a response: a smaller one is not reported


def question_energy_law(machine: Machine, pose: Pose | None = None, outputs: Sequence[Dof | str] | None = None
                        ) -> list[Doubt]:
    """Doubt responses of a machine whose modes are damped by energy where its joints' losses couple them instead.

    The figure is the largest difference of both responses at the modes and between them, over the response there.
    """
    if machine.description.modal_damping != ENERGY_DAMPING:
        return []
    stated = assemble(machine, pose, outputs)
    frequency = eigen.solve_undamped(stated).frequency
    moving = frequency[frequency > 1e-6 * frequency.max()]
    # Both laws differ most at the modes, where the difference is narrow: those are lines too.
    lines = np.unique(np.concatenate([np.geomspace(0.5 * moving.min(), 1.2 * moving.max(), COMPARED_LINE_COUNT), moving]))
    exact = frequency_response.direct(stated, lines).values
    with_losses = assemble(machine, pose, outputs, joint_damping=True)
    coupled = frequency_response.direct(with_losses, lines).values
    difference = np.linalg.norm(coupled - exact, axis=(1, 2)) / np.maximum(np.linalg.norm(exact, axis=(1, 2)), 1e-300)
    worst_line = int(difference.argmax())
    if difference[worst_line] < MIN_LAW_DIFFERENCE:
        return []
    pole_ratio = _pole_ratio(with_losses)
    return [Doubt("damping", "the file damps modes one by one (`modal_damping: energy`), this study couples them by the "
                  "losses of their joints, as it needs the slopes of matrices: responses differ by up to "
                  f"{100 * difference[worst_line]:.2g} % (at {lines[worst_line]:.4g} Hz), poles by up to "
                  f"{100 * pole_ratio:.2g} % in size, so that stiffnesses fitted to measured poles come out up to "
                  f"{200 * pole_ratio:.2g} % too small, which no interval holds",
                  "ask `frf` or `lobes` of the changed file for the response of the stated law",
                  figure=float(difference[worst_line]))]


def _pole_ratio(with_losses: SecondOrderSystem) -> float:
    """Return by how much a pole of s^2 M + K (1 + i eta) is larger than the natural frequency: (1 + eta^2)^(1/4) - 1."""
    loss_factors = 2 * solve_as_damped(with_losses).damping_ratio
    # The root of 1 + i eta has this modulus: by so much the pole lies farther out than the frequency without damping.
    return float(((1 + loss_factors**2) ** 0.25 - 1).max())


def warn_of_energy_law(machine: Machine, pose: Pose | None = None,
                       outputs: Sequence[Dof | str] | None = None) -> None:
    """Warn (`FileDoubt`) of what `question_energy_law` says, so that every result repeats it first."""
    for doubt in question_energy_law(machine, pose, outputs):
        warnings.warn(FileDoubt(doubt), stacklevel=3)
