r"""Forces of a robot on its base: at rest, and while axes stop with the power off; beside the maker's manual.

Recursive Newton-Euler of the rigid arm, stretched out as far as it goes. Every axis brakes evenly from its largest speed to
rest in the datasheet's stop time, in the sense that adds to gravity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics.chain import Pose
from toolpoint.machine.assembly.inverse_dynamics import base_reaction, gravity_force
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.robot.datasheet import RobotDatasheet


@dataclass(frozen=True)
class BaseLoad:
    """Reaction of the base: vertical and horizontal force, N; moments about a horizontal and the vertical axis, N m."""

    name: str
    vertical_force: float
    vertical_moment: float
    horizontal_force: float
    horizontal_moment: float

    def row(self) -> list[str]:
        """The four numbers as the manual orders them."""
        return [self.name, f"{self.vertical_moment:.1f}", f"{self.vertical_force:.1f}", f"{self.horizontal_moment:.1f}",
                f"{self.horizontal_force:.1f}"]


def stretch_arm(machine: Machine) -> dict[str, float]:
    """Return the pose of the second and third axes in which gravity turns hardest about the second (others at rest)."""
    axes = machine.chain.driven_axes
    grids = [np.linspace(max(axis.lower, -np.pi), min(axis.upper, np.pi), 61) for axis in axes[1:3]]
    second, third = (g.ravel() for g in np.meshgrid(*grids, indexing="ij"))
    pose = {axes[1].name: second, axes[2].name: third}
    moment = np.abs(base_reaction(machine, pose, gravity=(0.0, 0.0, -9.81))[:, 3:5])
    best = int(np.linalg.norm(moment, axis=-1).argmax())
    return {name: float(values[best]) for name, values in pose.items()}


def base_load(machine: Machine, name: str, pose: Pose, *, sheet: RobotDatasheet, acceleration: FloatArray | None = None,
              velocity: FloatArray | None = None) -> BaseLoad:
    """Return the base's reaction for a motion at a pose, moments about the mounting face on the first axis."""
    wrench = base_reaction(machine, pose, velocity, acceleration=acceleration, gravity=(0.0, 0.0, -sheet.gravity),
                           about=(0.0, 0.0, sheet.floor))[0]
    # Rounding of large moments that cancel would be printed as forces of 1e-12 N with a sign.
    wrench = np.where(np.abs(wrench) < 1e-9, 0.0, wrench)
    return BaseLoad(name, float(abs(wrench[2])), float(np.hypot(*wrench[3:5])), float(np.hypot(*wrench[:2])),
                    float(abs(wrench[5])))


def stop_loads(machine: Machine, sheet: RobotDatasheet, pose: Pose, *, stop_time: float | None = None) -> list[BaseLoad]:
    """Return the reactions while one axis stops, and while axes 2 and 3 stop together, each the worse of both senses."""
    time = stop_time or sheet.stop_time
    cases = [(axis.name, [i]) for i, axis in enumerate(sheet.axes[:3])]
    cases.append((" + ".join(axis.name for axis in sheet.axes[1:3]), [1, 2]))
    return [_largest_loads(machine, sheet, pose, name, which, time) for name, which in cases]


def _largest_loads(machine: Machine, sheet: RobotDatasheet, pose: Pose, name: str, which: list[int], time: float) -> BaseLoad:
    """Return the elementwise largest of the loads over all senses of motion: they need not occur together."""
    loads = []
    for number in range(2 ** len(which)):
        signs = [1.0 if number >> k & 1 else -1.0 for k in range(len(which))]
        speed = np.zeros(len(sheet.axes))
        speed[which] = [sign * sheet.axes[i].largest_speed for sign, i in zip(signs, which, strict=True)]
        for moving in (1.0, 0.0):  # as the stop begins, and as it ends
            loads.append(base_load(machine, name, pose, sheet=sheet, acceleration=-speed / time, velocity=moving * speed))
    fields = ("vertical_force", "vertical_moment", "horizontal_force", "horizontal_moment")
    return BaseLoad(name, *(max(getattr(load, field) for load in loads) for field in fields))


def stop_time_for(machine: Machine, sheet: RobotDatasheet, pose: Pose, *, axis: int, field: str, value: float) -> float:
    """Return the stop time (s) of an axis alone for which one of its loads has a value; infinite where even rest has more."""
    def load(time: float) -> float:
        return float(getattr(_largest_loads(machine, sheet, pose, "", [axis], time), field))

    shortest, longest = 1e-3, 10.0
    if load(longest) > value:
        return float("inf")
    for _ in range(60):
        middle = (shortest * longest) ** 0.5
        shortest, longest = (shortest, middle) if load(middle) < value else (middle, longest)
    return longest


def holding_torque(machine: Machine, sheet: RobotDatasheet, pose: Pose) -> FloatArray:
    """Return the torque of every axis against gravity at a pose, N m, (n_axes,)."""
    torque = gravity_force(machine, pose, (0.0, 0.0, -sheet.gravity))[0]
    # As above: an axis along gravity holds nothing, of either sign.
    return np.where(np.abs(torque) < 1e-9, 0.0, torque)
