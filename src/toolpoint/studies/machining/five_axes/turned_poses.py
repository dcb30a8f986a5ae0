"""Poses of a machine along a five-axis program: places near each other, with rotary axes near each other, are one pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.machine.pose.tool_pose import pose_for, tool_place
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.five_axes.tool_directions import ROTARY_LETTERS, RotaryAxes

TURNED_POSE_STEP, TURNED_POSE_TURN = 0.1, np.radians(10.0)  # m and rad: within them the dynamics are one pose's
MAX_POSES = 40  # of a program: beyond it the steps are doubled


def find_turned_poses(rotary: RotaryAxes, removed: TurnedRemoval, angles: FloatArray, *, line: np.ndarray
                      ) -> tuple[np.ndarray, Sequence[ToolDynamics], float]:
    """Return the pose of every place, the dynamics of each pose, and by how much the stated steps were widened.

    angles : (n, 3) of A, B and C at every place, rad; line : (n,) of the program, for messages.

    Raises ToolpointError, with its line, for a place that the machine does not reach.
    """
    cuts, factor = removed.reach > 0, 1.0
    while True:
        sizes = np.concatenate([removed.tip / TURNED_POSE_STEP, angles / TURNED_POSE_TURN], axis=1)
        cells = np.rint(sizes / factor).astype(int)
        cells[~cuts] = cells[np.argmax(cuts)]
        unique, pose = np.unique(cells, axis=0, return_inverse=True)
        if len(unique) <= MAX_POSES:
            break
        factor *= 2
    pose = pose.reshape(-1)
    machine, zero = rotary.machine, dict(rotary.setup.zero)
    origin = tool_place(machine, zero)[0][0]
    dynamics, start = list[ToolDynamics](), zero
    for k in range(len(unique)):
        members = np.flatnonzero((pose == k) & cuts)
        middle = np.concatenate([removed.tip[members], angles[members] * TURNED_POSE_STEP / TURNED_POSE_TURN], axis=1)
        place = int(members[np.argmin(np.linalg.norm(middle - middle.mean(axis=0), axis=1))])
        turned = {ROTARY_LETTERS[i]: float(angles[place, i]) for i in rotary.indices}
        assert removed.frame is not None
        solution = pose_for(machine, origin + removed.tip[place], removed.frame[place][:, 2], start={**start, **turned})
        if not solution.is_reached:
            words = ", ".join(f"{1e3 * value:.4g}" for value in removed.tip[place])
            raise ToolpointError(f"machine: the tool does not come to {words} mm in line {line[place]}: {solution.status}")
        start = dict(solution.pose)
        dynamics.append(machine_dynamics(machine, start))
    return pose, dynamics, factor
