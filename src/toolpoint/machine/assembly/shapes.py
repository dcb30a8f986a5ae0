"""Mode shapes of whole bodies: the rigid motion of every body in every mode, for drawing and for part studies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics import Pose
from toolpoint.machine.assembly.system import equations
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import Placement, place_machine
from toolpoint.vibration.eigen import mass_normalised, natural_omega


@dataclass(frozen=True, eq=False)
class BodyShapes:
    """Undamped modes at one pose.

    place : where everything stands; frequency : (n_modes,), Hz; twists : (n_links, 6, n_modes), motion (v, w) of every
    body in machine axes about the machine's origin, for unit modal mass.
    """

    place: Placement
    frequency: FloatArray
    twists: FloatArray


def body_shapes(machine: Machine, pose: Pose | None = None, modes: int | None = None) -> BodyShapes:
    """Return the lowest undamped modes at one pose as motions of the bodies; all modes where `modes` is left out."""
    place = place_machine(machine, pose)
    mass, stiffness, _, _, basis = equations(place)
    squares, vectors = mass_normalised(mass[0], stiffness[0])
    vectors = vectors[:, :modes] if basis is None else basis[0] @ vectors[:, :modes]
    frequency = natural_omega(squares, mass[0], stiffness[0])[:modes] / (2 * np.pi)
    return BodyShapes(place, frequency, place.jacobians[0] @ vectors)
