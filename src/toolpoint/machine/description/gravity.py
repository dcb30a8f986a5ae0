"""Gravity of a machine: against its `up`, where its file gives a size alone or nothing."""

from __future__ import annotations

import numpy as np

from toolpoint.machine.description.body import Vector
from toolpoint.machine.description.machine import MachineDescription

STANDARD_GRAVITY = 9.80665  # m/s^2, ISO 80000-3


def downwards(size: float, up: Vector) -> Vector:
    """Return gravity of a size (m/s^2) against a unit direction, + 0 so that no component is -0."""
    x, y, z = (-size * np.asarray(up, float) + 0.0).tolist()
    return x, y, z


def gravity_vector(values: tuple[float, ...] | None, up: Vector) -> Vector | None:
    """Return gravity as a file states it: three numbers, or its size alone, which acts against `up`; None where it does not."""
    if values is None:
        return None
    if len(values) == 1:
        return downwards(values[0], up)
    x, y, z = values
    return x, y, z


def gravity_of(description: MachineDescription) -> Vector:
    """Return the gravity that a machine states, m/s^2 in its frame; else the standard one against its `up`."""
    return downwards(STANDARD_GRAVITY, description.up) if description.gravity is None else description.gravity
