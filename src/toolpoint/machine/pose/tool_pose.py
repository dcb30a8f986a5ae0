"""Place of a machine's tool against its work at a pose, and the pose that brings it there: robots, five-axis machines."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail
from toolpoint.kinematics import Pose
from toolpoint.kinematics.arms.inverse import InverseSolution, ToolOnWork, solve_all_inverse, solve_inverse, tool_on_work
from toolpoint.machine.description.machine import GROUND
from toolpoint.machine.parts.model import Machine
from toolpoint.spatial import transform as tf


def tool_pair(machine: Machine) -> ToolOnWork:
    """Return the tool and the work of a machine: tool point and direction, and table point (else the machine's origin)."""
    description = machine.description
    if description.tool is None:
        fail("tool", "none", "must name the point where the tool cuts", remedy="add 'tool: NAME' to the machine file")
    link, tip = _place(machine, description.tool)
    if description.table is None:
        return ToolOnWork(link, tip, np.array(description.tool_axis))
    return ToolOnWork(link, tip, np.array(description.tool_axis), *_place(machine, description.table))


def _place(machine: Machine, name: str) -> tuple[int, FloatArray]:
    point = machine.description.points[name]
    point_place = np.array(point.at)
    if point.body == GROUND:
        return -1, point_place
    link = machine.link(point.body)
    return link, tf.move(machine.body_frames[link], point_place[None])[0]


def tool_place(machine: Machine, pose: Pose | None = None) -> tuple[FloatArray, FloatArray]:
    """Return the tool's tip from the table point, m, and the direction of its axis, in the table's axes, (n_poses, 3) each."""
    return tool_on_work(machine.chain, pose or {}, tool_pair(machine))


def pose_for(machine: Machine, tip: ArrayLike, direction: ArrayLike | None = None, *, turn: float | None = None,
             start: Mapping[str, float] | None = None) -> InverseSolution:
    """Return the pose that brings the tip (m) and the tool's direction to a target in the table's axes, see `solve_inverse`."""
    return solve_inverse(machine.chain, tool_pair(machine), tip, direction=direction, turn=turn, start=start)


def poses_for(machine: Machine, tip: ArrayLike, direction: ArrayLike | None = None, *, turn: float | None = None
              ) -> list[InverseSolution]:
    """Return all poses that a grid of starts leads to, see `solve_all_inverse`."""
    return solve_all_inverse(machine.chain, tool_pair(machine), tip, direction=direction, turn=turn)
