"""Mode shapes of whole bodies: the rigid motion of every body in every mode, for drawing and for part studies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.modal_damping import ENERGY, reference_loss
from toolpoint.machine.assembly.system import equations, mass_matrix
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.vibration.eigen import mass_normalised, natural_omega

STILL = 1e-6  # of the highest frequency: below, a mode is a motion without stiffness


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
        """Return the coordinate that moves most (by its inertia) in every mode at 0 Hz: what nothing holds."""
        machine = self.place.machine
        names = np.array(machine.coordinates)
        inertia = np.sqrt(np.diagonal(mass_matrix(self.place)[0]))[:, None]
        still = self.frequency <= STILL * max(float(self.frequency.max(initial=0.0)), 1.0)
        share = np.abs(self.vectors[:, still]) * inertia
        joints = np.array([".mode" not in name for name in names])
        if not (still.any() and joints.any()):
            return ()
        return tuple(dict.fromkeys(names[joints][share[joints].argmax(axis=0)].tolist()))

    def bending(self, link: int) -> FloatArray:
        """Return the amplitudes (n_modal, n_modes) of an elastic body's own coordinates."""
        return self.vectors[list(self.place.machine.modal_columns[link])]


def body_shapes(machine: Machine, pose: Pose | None = None, modes: int | None = None) -> BodyShapes:
    """Return the lowest undamped modes at one pose as motions of the bodies; all modes where `modes` is left out."""
    place = place_machine(machine, pose)
    mass, stiffness, viscous, structural, basis = equations(place)
    squares, shapes = mass_normalised(mass[0], stiffness[0])
    omega, shapes = natural_omega(squares, mass[0], stiffness[0])[:modes], shapes[:, :modes]
    ratio = machine.description.damping_ratio
    lost = _work(shapes, structural[0], 2 * omega**2)
    whole = lost + (_work(shapes, viscous[0], 2 * omega) if ratio is None else np.full(omega.shape, ratio))
    if machine.description.modal_damping not in ("", ENERGY):
        whole = _work(shapes, reference_loss(machine, mass_matrix(place_machine(machine))), 2 * omega**2)
    vectors = shapes if basis is None else basis[0] @ shapes
    return BodyShapes(place, omega / (2 * np.pi), place.jacobians[0] @ vectors, vectors, whole, lost)


def _work(shapes: FloatArray, matrix: FloatArray, over: FloatArray) -> FloatArray:
    """Return phi^T A phi over a size, 0 where that vanishes: a motion without stiffness has no ratio."""
    work = np.einsum("im,ij,jm->m", shapes, matrix, shapes)
    still = over <= 1e-9 * over.max(initial=1e-300)
    return np.where(still, 0.0, work / np.where(still, 1.0, over))
