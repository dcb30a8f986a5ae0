"""Positions of the named points of a machine at a pose."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.placement import place_machine


def point_positions(machine: Machine, pose: Mapping[str, float] | None = None) -> dict[str | int, FloatArray]:
    """Return the positions (3,) of the machine's named points at a pose, m, in machine axes."""
    place = place_machine(machine, pose)
    return {name: np.array(place.position(point)[0]) for name, point in machine.description.points.items()}
