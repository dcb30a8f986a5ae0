"""Pose in the machine's own coordinates (those of its task), and the parasitic shift of its other coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.task import ANGLES, COORDINATES, Task
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.tool_pose import tool_place

_ROUNDING_LIMITS = {"length": 1e-9, "angle": 1e-9}  # m, rad: below, a shift is rounding


@dataclass(frozen=True, eq=False)
class OwnCoordinates:
    """Coordinates of a task at a pose, by their names, m or rad.

    shift : coordinates that the task does not command, by kind, against the reference pose; point : whose coordinates they are.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    shift: Mapping[str, float] = field(default_factory=dict)
    point: str = ""

    @property
    def words(self) -> str:
        """The coordinates in words, ``Z -650 mm, tilt 20°``."""
        return ", ".join(_words(name, value, self.kinds[name]) for name, value in self.values.items())

    @property
    def shift_words(self) -> str:
        """The parasitic shift in words."""
        parts = [_words(kind, value, kind) for kind, value in self.shift.items()
                 if abs(value) > _ROUNDING_LIMITS["angle" if kind in ANGLES else "length"]]
        return ", ".join(parts) or "none"


def _words(name: str, value: float, kind: str) -> str:
    """Return a coordinate in words: places in mm, angles in degrees."""
    display_value = np.degrees(value) if kind in ANGLES else 1e3 * value
    return f"{name} {round(float(display_value), 6) + 0.0:.6g}{'°' if kind in ANGLES else ' mm'}"


def own_coordinates(machine: Machine, pose: Mapping[str, float]) -> OwnCoordinates | None:
    """Return the coordinates of a machine's task at a pose and its parasitic shift; None for a machine without a task."""
    chain, described = machine.chain, machine.description.task
    if not isinstance(chain, ClosedChain) or chain.task is None or described is None:
        return None
    task = chain.task
    current, reference = (task.read(chain.displacements_of(chain.motions_of(chain.step_values(
        {name: np.array([value]) for name, value in positions.items()})))) for positions in (pose, {}))
    kinds, uncommanded = dict(task.coordinates), free_coordinates(task)
    return OwnCoordinates({name: float(current[kind][0]) for name, kind in kinds.items()}, kinds,
                          {kind: float(current[kind][0] - reference[kind][0]) for kind in uncommanded}, described.point)


def free_coordinates(task: Task) -> list[str]:
    """Return the coordinates of a task's point that it leaves to the closure of the loops, by their kind."""
    kinds = [kind for kind in COORDINATES if kind not in task.kinds]
    # Without a tilt the azimuth of a tool that tilts by itself says nothing alone.
    return [kind for kind in kinds if kind != "azimuth"] if task.kinds & set(ANGLES) else kinds


def leg_pose(machine: Machine, pose: Mapping[str, float]) -> dict[str, float]:
    """Return the positions of all driven axes (legs, carriages) at a pose that may be given in the task's coordinates."""
    positions = machine.chain.positions({name: np.array([value]) for name, value in pose.items()})[0]
    return {axis.name: float(v) for axis, v in zip(machine.chain.driven_axes, positions, strict=True)}


def tool_words(machine: Machine, pose: Mapping[str, float]) -> str:
    """Return place of the tool's tip and direction of its axis at a pose in words, from the table."""
    tip, direction = (v[0] for v in tool_place(machine, {name: np.array([value]) for name, value in pose.items()}))
    return (f"tip at {', '.join(f'{1e3 * v:.6g}' for v in np.round(tip, 12) + 0.0)} mm, the tool's axis along "
            f"{', '.join(f'{v:.6g}' for v in np.round(direction, 12) + 0.0)}")
