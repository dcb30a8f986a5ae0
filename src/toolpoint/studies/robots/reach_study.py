"""Study of all poses that bring the tool to a place: distance from singular poses, holding forces, natural frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import ClosedChain
from toolpoint.kinematics.arms.branch_choice import BranchChoice
from toolpoint.kinematics.singularity import SINGULAR_CONDITION_NUMBER, nearest_singularity, pose_condition
from toolpoint.machine.assembly.inverse_dynamics import axis_mass_matrix, gravity_force
from toolpoint.machine.description.gravity import gravity_of
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.tool_pose import pose_for, poses_for, tool_pair, tool_place
from toolpoint.studies.machines.branch_words import name_branches
from toolpoint.studies.machines.pose_words import pose_words
from toolpoint.studies.machines.reach import arm_of, branch_names, reach_places, refuse_branch
from toolpoint.studies.robots.own_coordinates import OwnCoordinates, leg_pose, own_coordinates, tool_words
from toolpoint.studies.text_table import text_table

_MIN_PRINTED_MISS = 1e-9  # m: below, a miss is rounding


@dataclass(frozen=True, eq=False)
class ReachedPose:
    """Pose that reaches the place.

    branch : of the arm; condition : number of its Jacobian; singular : axis, distance along it to the nearest singular pose (m
    or rad), and its kind; holding : of every axis against gravity, N, N m; inertia : of every axis, kg, kg m^2; frequency : Hz;
    miss : from the place, m; own : its coordinates of the task.
    """

    pose: Mapping[str, float]
    branch: str
    condition: float
    singular: tuple[str, float, str] | None
    holding: FloatArray
    inertia: FloatArray
    frequency: FloatArray
    miss: float
    own: OwnCoordinates | None = None


@dataclass(frozen=True, eq=False)
class ReachStudy(NotebookText):
    """The poses of a place; `reason` where there is none; rates : axis speed per tool speed, where the machine has a task."""

    machine: Machine
    tip: FloatArray
    poses: tuple[ReachedPose, ...]
    reason: str
    rates: float | None

    def table(self) -> str:
        """Return the poses as text."""
        title = f"{self.machine.name}: tip at " + ", ".join(f"{1e3 * v:.5g}" for v in np.round(self.tip, 12) + 0.0) + " mm"
        if not self.poses:
            return f"{title}: {self.reason}"
        rows = [[each.branch or str(i + 1), pose_words(self.machine, each.pose), f"{each.condition:.3g}",
                 _singular_words(self.machine, each),
                 " ".join(f"{v:.1f}" for v in each.holding), " ".join(f"{v:.3g}" for v in each.inertia),
                 " ".join(f"{f:.2f}" for f in each.frequency)] for i, each in enumerate(self.poses)]
        header = ["branch", "axes", "condition", "nearest singular pose", "holds N, N m", "inertia kg, kg m^2", "Hz"]
        extra = [line for number, each in enumerate(self.poses, 1) for line in self._own_lines(number, each)]
        extra += [] if self.rates is None else [f"largest axis speed per tool speed: {self.rates:.4g}"]
        if not self.poses[0].holding.size:
            extra.append("what axes hold and their inertia are not computed with bodies of finite elements: "
                         "take rigid members or beams")
        return "\n".join([text_table(title, header, rows), *extra])

    def _own_lines(self, number: int, each: ReachedPose) -> list[str]:
        """Return the machine's own coordinates, its parasitic shift, and a miss that is no rounding."""
        name = each.branch or f"pose {number}"
        lines = []
        if each.own is not None:
            lines = [f"{name}: {each.own.words}; {tool_words(self.machine, each.pose)}",
                     f"{name}: parasitic shift of {each.own.point} from the reference pose: {each.own.shift_words}"]
        if each.miss > _MIN_PRINTED_MISS:
            lines.append(f"{name}: {1e6 * each.miss:.3g} µm from the place: it has more coordinates than the machine has axes")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Return the poses as plain data; m, rad, SI."""
        return {"tip": self.tip.tolist(), "reason": self.reason, "poses": [
            {"coordinates": None if each.own is None else dict(each.own.values),
             "parasitic_shift": None if each.own is None else dict(each.own.shift), "pose": dict(each.pose),
             "branch": each.branch, "condition": each.condition,
             "singular": None if each.singular is None else list(each.singular), "holding": each.holding.tolist(),
             "inertia": each.inertia.tolist(), "frequency_hz": each.frequency.tolist(),
             "miss_m": each.miss} for each in self.poses]}


def study_reach(machine: Machine, tip: ArrayLike, direction: ArrayLike | None = None, *, turn: float = 0.0, modes: int = 4,
                branch: str = "") -> ReachStudy:
    """Return all poses that bring the tool's tip to a place with its axis along a direction.

    tip : m, from the table point; branch : of an arm, see `reach_places`, all of them where left out.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     AxisDescription,
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": AxisDescription("slide", "x")},
    ...                                    {"tip": PointDescription("head", (0.0, 0.0, -0.2))}, tool="tip"))
    >>> study_reach(machine, (0.1, 0.0, -0.2), modes=1).poses[0].pose
    {'X': 0.1}
    """
    target = floats("tip", tip, (3,))
    arm, reached = arm_of(machine), list[tuple[dict[str, float], str]]()
    reason = ""
    if arm is not None:
        for name in _choose_branches(machine, target, direction, turn=turn, branch=branch):
            reach = reach_places(machine, target[None], direction, turn=turn, branch=name)
            reached += [(dict(pose), name) for pose in reach.poses if pose is not None]
        if not reached:
            reason = reach_places(machine, target[None], direction, turn=turn, branch=branch).reasons[0]
    else:
        if branch:
            refuse_branch(branch)
        axes = len(machine.chain.driven_axes)
        # Fewer than five axes cannot hold a direction as well as a place, fewer than six no turn about it.
        way = direction if direction is not None or axes < 5 else tool_pair(machine).direction
        spin = turn if axes >= 6 and way is not None else None
        reached = [(dict(each.pose), "") for each in poses_for(machine, target, way, turn=spin)]
        if not reached:
            reason = pose_for(machine, target, way, turn=spin).status
    return ReachStudy(machine, target, tuple(_describe_pose(machine, target, pose, name, modes) for pose, name in reached),
                      reason,
                      _task_rates(machine, reached[0][0]) if reached else None)


def study_pose(machine: Machine, pose: Mapping[str, float], *, modes: int = 4) -> ReachStudy:
    """Return the study of a pose, given by the axes or in the coordinates of the machine's task; see `study_reach`.

    Examples
    --------
    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import (
    ...     AxisDescription,
    ...     BodyDescription,
    ...     InertiaDescription,
    ...     JointDescription,
    ...     MachineDescription,
    ...     PointDescription,
    ... )
    >>> joint = JointDescription("ground", "head", stiffness={"y": 2e7})
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": joint}, {"X": AxisDescription("slide", "x")},
    ...                                    {"tip": PointDescription("head", (0.0, 0.0, -0.2))}, tool="tip"))
    >>> study_pose(machine, {"X": 0.1}, modes=1).tip.tolist()
    [0.1, 0.0, -0.2]
    """
    legs = leg_pose(machine, pose)
    # The coordinates themselves say where the tool is; axes that lead to another assembly mode would show as a miss.
    tip = tool_place(machine, {name: np.array([value]) for name, value in pose.items()})[0][0]
    names = name_branches(machine, {name: np.array([value]) for name, value in legs.items()})
    return ReachStudy(machine, tip, (_describe_pose(machine, tip, legs, names[0] if names else "", modes),), "",
                      _task_rates(machine, legs))


def _choose_branches(machine: Machine, tip: FloatArray, direction: ArrayLike | None, *, turn: float, branch: str) -> list[str]:
    """Return the requested branches on which a place is reached, or the one of the least turn of the wrist."""
    choice = BranchChoice.parsed(branch)
    if choice.is_least:
        return [name for name in reach_places(machine, tip[None], direction, turn=turn, branch=branch).branches if name]
    return [name for name in branch_names(machine, tip, direction, turn=turn) if choice.allows(name)]


def _describe_pose(machine: Machine, tip: FloatArray, pose: dict[str, float], branch: str, modes: int) -> ReachedPose:
    """Return all figures of one pose that reaches a place (tip, m, from the table point)."""
    link = tool_pair(machine).tool
    batch = {name: np.array([value]) for name, value in pose.items()}
    condition = float(pose_condition(machine.chain, batch, link).lost_motion[0])
    singular_poses = [(axis.name, *hit) for axis in machine.chain.driven_axes
                      if (hit := nearest_singularity(machine.chain, pose, axis.name, link=link)) is not None]
    # Inverse dynamics holds for rigid bodies.
    elastic = any(body.modal_count for body in machine.bodies)
    none = np.zeros(0)
    gravity = gravity_of(machine.description)
    return ReachedPose(
        pose, branch, condition, min(singular_poses, key=lambda hit: abs(hit[1])) if singular_poses else None,
        none if elastic else gravity_force(machine, batch, gravity)[0],
        none if elastic else np.diagonal(axis_mass_matrix(machine, batch)[0]), natural_frequencies(machine, batch, modes)[0],
        float(np.linalg.norm(tool_place(machine, batch)[0][0] - tip)), own_coordinates(machine, pose))


def _singular_words(machine: Machine, each: ReachedPose) -> str:
    """Return the singular pose that is nearest along one axis in words, or that the pose itself is singular."""
    if each.condition >= SINGULAR_CONDITION_NUMBER:
        return "this pose is singular"
    if each.singular is None:
        return "none along an axis"
    axis = next(axis for axis in machine.chain.driven_axes if axis.name == each.singular[0])
    return f"{each.singular[2]} at {axis.words(each.singular[1])} along {axis.name}"


def _task_rates(machine: Machine, pose: Mapping[str, float]) -> float | None:
    """Largest axis speed per speed of the tool's coordinates, of a machine that is posed in them."""
    chain = machine.chain
    if not isinstance(chain, ClosedChain) or chain.task is None:
        return None
    rates = chain.task_rates({name: np.array([value]) for name, value in pose.items()})[0]
    # Axis speeds give tool speeds: the smallest singular value needs the fastest axes.
    smallest = float(np.linalg.svd(rates, compute_uv=False)[-1])
    if smallest == 0:
        fail("pose", "singular", "the task's coordinates do not follow the axes there")
    return 1 / smallest
