"""Mode shapes of whole bodies: the rigid motion of every body in every mode, for drawing and for studies of parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.modal_damping import ENERGY_DAMPING, reference_loss
from toolpoint.machine.assembly.system import equations, mass_matrix
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.vibration.eigen import mass_normalised, natural_omega

RIGID_FREQUENCY_FRACTION = 1e-6  # of the highest frequency: below, a mode is a motion without stiffness


@dataclass(frozen=True, eq=False)
class BodyShapes:
    """Undamped modes at one pose.

    place : where everything stands; frequency : (n_modes,), Hz; twists : (n_links, 6, n_modes), motion (v, w) of every
    body in machine axes about the machine's origin, for unit modal mass; vectors : (n, n_modes), the shapes in the tree's
    coordinates; damping_ratio : (n_modes,), what the description states for every mode, or the dampers at work in the undamped
    shape, and the structural losses of joints and materials: phi^T C phi/(2 w) + phi^T D phi/(2 w^2), exact for small ones;
    structural_ratio : (n_modes,), the second part alone.
    """

    place: Placement
    frequency: FloatArray
    twists: FloatArray
    vectors: FloatArray
    damping_ratio: FloatArray
    structural_ratio: FloatArray

    def mechanisms(self) -> tuple[str, ...]:
        """Return the coordinate that moves most (by its inertia) in every mode at 0 Hz, which no joint holds."""
        machine = self.place.machine
        names = np.array(machine.coordinates)
        inertia = np.sqrt(np.diagonal(mass_matrix(self.place)[0]))[:, None]
        is_rigid = self.frequency <= RIGID_FREQUENCY_FRACTION * max(float(self.frequency.max(initial=0.0)), 1.0)
        inertial_motion = np.abs(self.vectors[:, is_rigid]) * inertia
        is_joint = np.array([".mode" not in name for name in names])
        if not (is_rigid.any() and is_joint.any()):
            return ()
        return tuple(dict.fromkeys(names[is_joint][inertial_motion[is_joint].argmax(axis=0)].tolist()))

    def bending(self, link: int) -> FloatArray:
        """Return the amplitudes (n_modal, n_modes) of an elastic body's own coordinates."""
        return self.vectors[list(self.place.machine.modal_columns[link])]


def body_shapes(machine: Machine, pose: Pose | None = None, modes: int | None = None) -> BodyShapes:
    """Return the lowest undamped modes at one pose as motions of the bodies; all modes where `modes` is left out."""
    place = place_machine(machine, pose)
    mass, stiffness, viscous, structural, basis = equations(place)
    squares, shapes = mass_normalised(mass[0], stiffness[0])
    omega, shapes = natural_omega(squares, mass[0], stiffness[0])[:modes], shapes[:, :modes]
    stated_ratio = machine.description.damping_ratio
    structural_ratio = _work(shapes, structural[0], 2 * omega**2)
    damping_ratio = structural_ratio + (_work(shapes, viscous[0], 2 * omega) if stated_ratio is None
                                        else np.full(omega.shape, stated_ratio))
    if machine.description.modal_damping not in ("", ENERGY_DAMPING):
        damping_ratio = _work(shapes, reference_loss(machine, mass_matrix(place_machine(machine))), 2 * omega**2)
    vectors = shapes if basis is None else basis[0] @ shapes
    return BodyShapes(place, omega / (2 * np.pi), place.jacobians[0] @ vectors, vectors, damping_ratio, structural_ratio)


def _work(shapes: FloatArray, matrix: FloatArray, denominator: FloatArray) -> FloatArray:
    """Return phi^T A phi over a denominator, 0 where that vanishes: a motion without stiffness has no ratio."""
    work = np.einsum("im,ij,jm->m", shapes, matrix, shapes)
    is_vanishing = denominator <= 1e-9 * denominator.max(initial=1e-300)
    return np.where(is_vanishing, 0.0, work / np.where(is_vanishing, 1.0, denominator))
