"""Poses of an arm in closed form: the requested branch, or the branch whose axes move least from a start."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.kinematics.arms.branch_choice import BranchChoice
from toolpoint.kinematics.arms.inverse import ToolOnWork
from toolpoint.kinematics.arms.spherical_wrist import ArmBranch, SphericalWrist, move_tool
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf

Pose = Mapping[str, float]
_SAME_PLACE_TOLERANCE = 1e-10  # m: nearer places have the same branches


def tool_target(pair: ToolOnWork, place: FloatArray, direction: FloatArray, *, turn: float) -> FloatArray:
    """Return the displacement (4, 4) of the tool's link that brings tip and axes to their targets; the work is at rest."""
    tool_pose = tf.transform(smallest_turn(direction) @ rot.about("z", turn), place + pair.origin)
    return move_tool(tool_pose, tf.transform(smallest_turn(pair.direction), pair.tip))


class ArmReach:
    """Closed-form inverse kinematics at one direction and turn of the tool; branches of a place are computed once."""

    def __init__(self, arm: SphericalWrist, pair: ToolOnWork, direction: FloatArray, *, turn: float, branch: str) -> None:
        self.arm, self.pair, self.direction, self.turn = arm, pair, direction, turn
        self.branch, self.choice = branch, BranchChoice.parsed(branch)
        self.axes = arm.chain.driven_axes
        self.names = [axis.name for axis in self.axes]
        self._reference_positions = np.array([axis.reference_position for axis in self.axes])
        self._turns = np.array([2 * np.pi * np.arange(-2, 3) * axis.is_rotary for axis in self.axes])
        # A solution at the limit itself differs from it by rounding.
        self._limits = np.array([[[axis.lower - 1e-9], [axis.upper + 1e-9]] for axis in self.axes]).swapaxes(0, 1)
        # All targets have one orientation: they differ by the place alone.
        self._target_at_origin = tool_target(pair, np.zeros(3), direction, turn=turn)
        self._branches_by_place: dict[tuple[int, ...], list[ArmBranch]] = {}

    def branches(self, place: FloatArray, fourth: float = 0.0) -> list[ArmBranch]:
        """Return all branches at a place, within limits or not; fourth : angle of joint 4 where a straight wrist leaves it."""
        key = tuple(np.rint(place / _SAME_PLACE_TOLERANCE).astype(int).tolist())
        if key not in self._branches_by_place:
            target = self._target_at_origin.copy()
            target[:3, 3] += place
            branches = self.arm.inverse(target, turn_at_singular=fourth)
            # A straight wrist leaves joint 4 to the start: such branches hold for this call only.
            if any(each.note for each in branches):
                return branches
            self._branches_by_place[key] = branches
        return self._branches_by_place[key]

    def __call__(self, place: FloatArray, start: Pose) -> tuple[Pose | None, str, str]:
        """Return the pose of a place nearest to a start, its branch, and why there is none."""
        start_positions = np.array([start.get(name, 0.0) for name in self.names])
        branches = self.branches(place, float(self.arm.joint_angles(start_positions)[3]))
        if not branches:
            return None, "", "out of reach"
        allowed = [each for each in branches if self.choice.allows(each.name)]
        if not allowed:
            names = ", ".join(each.name for each in branches)
            return None, "", f"not on branch {self.branch!r}; reached on {names}"
        inside = [each for each in allowed if each.within_limits]
        if not inside:
            return None, "", "beyond the limits of " + self._beyond(allowed[0])
        if self.choice.is_least:
            best = min((self.wrist_turn(self.nearest(each, self._reference_positions)), each.name, each) for each in inside)[2]
            return dict(zip(self.names, self.nearest(best, start_positions).tolist(), strict=True)), best.name, ""
        _, name, values = min((float(np.linalg.norm(values - start_positions)), each.name, values.tolist())
                                     for each in inside for values in (self.nearest(each, start_positions),))
        return dict(zip(self.names, values, strict=True)), name, ""

    def nearest(self, branch: ArmBranch, start_positions: FloatArray) -> FloatArray:
        """Return the positions of a branch, each axis turned by whole turns towards a start, within its limits."""
        turned = branch.positions[:, None] + self._turns
        inside = (self._limits[0] <= turned) & (turned <= self._limits[1])
        distance = np.where(inside, np.abs(turned - start_positions[:, None]), np.inf)
        turned_positions = turned[np.arange(len(turned)), distance.argmin(axis=1)]
        return np.where(inside.any(axis=1), turned_positions, branch.positions)

    def wrist_turn(self, positions: FloatArray) -> float:
        """Return the turn of the three axes of the wrist from rest, rad."""
        return float(np.linalg.norm((positions - self._reference_positions)[3:]))

    def _beyond(self, branch: ArmBranch) -> str:
        return ", ".join(f"{axis.name} ({axis.words(value)}, {axis.span})"
                         for axis, value in zip(self.axes, branch.positions, strict=True)
                         if not axis.lower - 1e-9 <= value <= axis.upper + 1e-9)
