"""Poses of a machine in a tilted plane, by its own chain: rotary axes bring the tool along the plane's axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.machine import Machine
from toolpoint.machine.pose.tool_pose import pose_for, tool_pair, tool_place
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.setup import MachiningSetup

TILTED_POSE_STEP = 0.1  # m: places of the tip within which the dynamics are taken as one pose's
_REFERENCE_TOLERANCE = 1e-9  # rad, of rotary axes at the program's zero


def find_tilted_poses(machine: Machine, removed: RemovedMaterial, setup: MachiningSetup, *, rotation: FloatArray
                 ) -> tuple[np.ndarray, Sequence[ToolDynamics], FloatArray]:
    """Return the pose of every place, the dynamics of each pose, and the angle from the tool's x to the plane's x there, rad.

    rotation : (3, 3) columns are the plane's axes in the work. The program's zero lies where the tool is at `setup.zero`, its
    axes along the machine's with rotary axes at zero. Of several poses the one nearest to the zero is taken.

    Raises ToolpointError where rotary axes do not stand at zero there, and where no pose within the travels is found.
    """
    check_zero(machine, setup)
    origin = tool_place(machine, dict(setup.zero))[0][0]
    cuts = removed.reach > 0
    cells = np.rint(removed.tip / TILTED_POSE_STEP).astype(int)
    cells[~cuts] = cells[np.argmax(cuts)]
    unique, pose = np.unique(cells, axis=0, return_inverse=True)
    pose = pose.reshape(-1)
    dynamics, angles, start = list[ToolDynamics](), list[float](), dict(setup.zero)
    for k in range(len(unique)):
        place = rotation @ removed.tip[(pose == k) & cuts].mean(axis=0)
        solution = pose_for(machine, origin + place, rotation[:, 2], start=start)
        if not solution.is_reached:
            words = ", ".join(f"{1e3 * value:.4g}" for value in place)
            raise ToolpointError(f"machine: the tool does not come to {words} mm along ({rotation[0, 2]:.4g}, "
                                 f"{rotation[1, 2]:.4g}, {rotation[2, 2]:.4g}): {solution.status}")
        start = dict(solution.pose)
        dynamics.append(machine_dynamics(machine, start))
        angles.append(plane_angle(machine, start, rotation))
    return pose, dynamics, np.array(angles)


def check_zero(machine: Machine, setup: MachiningSetup) -> None:
    """Refuse a program's zero where rotary axes do not stand at zero."""
    for axis in machine.chain.axes:
        if axis.is_rotary and abs(setup.zero.get(axis.name, 0.0)) > _REFERENCE_TOLERANCE:
            raise ToolpointError(f"zero: axis {axis.name} does not stand at zero; in tilted planes the program's axes are "
                                 "those of the machine with rotary axes at zero")


def plane_angle(machine: Machine, pose: dict[str, float], rotation: FloatArray) -> float:
    """Return the angle about the tool from its own x to the plane's x at a pose, rad."""
    pair = tool_pair(machine)
    moved = machine.chain.displacements(pose)[0]
    tool, work = (np.eye(3) if link < 0 else moved[link, :3, :3] for link in (pair.tool, pair.table))
    axes = smallest_turn(tool @ pair.direction)
    x = axes.T @ work @ rotation[:, 0]
    return float(np.arctan2(x[1], x[0]))
