"""Poses along a straight segment of places that one branch of the machine can follow, without a jump of an axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats
from toolpoint.kinematics.arms.spherical_wrist import ArmBranch
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.arm_reach import ArmReach, Pose
from toolpoint.studies.machines.reach import MAX_AXIS_STEP, place_solver, tool_at

# m between the places at which a segment is followed; between them no rotary axis moves further than allowed
FOLLOWING_STEP = 0.01
OUT_OF_REACH = "out of reach in part"
NO_BRANCH = "reached whole on no single branch of the arm"
JUMP = f"an axis turns further than {MAX_AXIS_STEP:g} rad between places {1e3 * FOLLOWING_STEP:g} mm apart"


@dataclass(frozen=True, eq=False)
class SegmentPoses:
    """Poses of the samples of a segment on one branch (empty for machines without); `reason` where there are none."""

    branch: str = ""
    poses: tuple[Pose, ...] = ()
    reason: str = ""


class SegmentFollower:
    """Follows segments with the tool along a direction; arguments as of `reach_places`."""

    def __init__(self, machine: Machine, direction: ArrayLike | None, *, turn: float, branch: str, point: str) -> None:
        pair = tool_at(machine, point)
        goal = pair.direction if direction is None else floats("direction", direction, (3,))
        if not np.linalg.norm(goal) > 0:
            fail("direction", "length 0", "must not be zero")
        self.solver = place_solver(machine, pair, goal / np.linalg.norm(goal), turn=turn, branch=branch)
        axes = machine.chain.driven_axes
        self.reference = {axis.name: axis.reference_position for axis in axes}
        self.rotary = [axis.name for axis in axes if axis.is_rotary]

    def follow(self, places: FloatArray) -> SegmentPoses:
        """Return the poses of evenly spaced places (n, 3) of a segment, or why it cannot be followed.

        Of several branches that can be, the one that turns the wrist least where that is asked for, else the one nearest to
        rest. Between the places the segment is followed every 10 mm at least.
        """
        spacing = float(np.linalg.norm(places[1] - places[0]))
        # Without rotary axes nothing can jump between two places.
        parts = max(int(np.ceil(spacing / FOLLOWING_STEP - 1e-6)), 1) if self.rotary else 1
        share = np.arange((len(places) - 1) * parts + 1)[:, None] / ((len(places) - 1) * parts)
        dense = places[0] + share * (places[-1] - places[0])
        if isinstance(self.solver, ArmReach):
            return self._along_branches(self.solver, dense, parts)
        return self._by_iteration(dense, parts)

    def _along_branches(self, solver: ArmReach, dense: FloatArray, parts: int) -> SegmentPoses:
        """Return the poses on the branch that can be followed best along places (n, 3); every `parts`-th is a sample."""
        at_places = [dict[str, ArmBranch]()] * len(dense)
        # Most segments that are not reached leave the workspace at an end.
        for i in sorted(range(len(dense)), key=lambda i: min(i, len(dense) - 1 - i)):
            at_places[i] = {each.name: each for each in solver.branches(dense[i])
                            if each.within_limits and solver.choice.allows(each.name)}
            if not at_places[i]:
                return SegmentPoses(reason=OUT_OF_REACH)
        # Only a branch that reaches every place can be followed without passing a singular pose.
        names = [name for name in at_places[0] if all(name in inside for inside in at_places)]
        if not names:
            return SegmentPoses(reason=NO_BRANCH)
        followed = [(name, path) for name in names
                    if (path := self._path(solver, [inside[name] for inside in at_places])) is not None]
        if not followed:
            return SegmentPoses(reason=JUMP)
        reference = np.array(list(self.reference.values()))

        def cost(path: FloatArray) -> float:
            if solver.choice.is_least:
                return max(solver.wrist_turn(row) for row in path)
            return float(np.linalg.norm(path - reference, axis=1).mean())

        name, path = min(followed, key=lambda each: (cost(each[1]), each[0]))
        return SegmentPoses(name, tuple(dict(zip(solver.names, row.tolist(), strict=True)) for row in path[::parts]))

    def _path(self, solver: ArmReach, branches: Sequence[ArmBranch]) -> FloatArray | None:
        """Return positions (n, 6) of a branch along a segment, begun nearest to rest at either end; None for a jump."""
        # Whole turns of the axes follow from the end that is begun at: a path may be free of jumps from one end only.
        for sense in (1, -1):
            last, rows = np.array(list(self.reference.values())), list[FloatArray]()
            for branch in branches[::sense]:
                last = solver.nearest(branch, last)
                rows.append(last)
            path = np.array(rows[::sense])
            if np.abs(np.diff(path, axis=0)).max() <= MAX_AXIS_STEP:
                return path
        return None

    def _by_iteration(self, dense: FloatArray, parts: int) -> SegmentPoses:
        """Return the poses of a machine without branches, each place begun at the pose of the one before."""
        last: Pose = self.reference
        poses: list[Pose] = []
        for place in dense:
            pose, _, _ = self.solver(place, last)
            if pose is None:
                return SegmentPoses(reason=OUT_OF_REACH)
            if poses and any(abs(pose[name] - last[name]) > MAX_AXIS_STEP for name in self.rotary):
                return SegmentPoses(reason=JUMP)
            poses.append(pose)
            last = pose
        return SegmentPoses("", tuple(poses[::parts]))
