"""Poses that bring a tool to places: arms in closed form with all their branches, other machines by iteration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint._notebook import NotebookText
from toolpoint.kinematics import Axis, Drive, TreeChain
from toolpoint.kinematics.arms.inverse import ToolOnWork, solve_inverse
from toolpoint.kinematics.arms.spherical_wrist import SphericalWrist
from toolpoint.kinematics.singularity import pose_condition
from toolpoint.machine.description import GROUND
from toolpoint.machine.parts.model import Machine
from toolpoint.machine.pose.tool_pose import tool_pair
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.arm_reach import ArmReach, Pose, tool_target

MAX_AXIS_STEP = 0.35  # rad between neighbouring places of a path: a larger one is a jump


@dataclass(frozen=True, eq=False)
class Reach(NotebookText):
    """Poses of places.

    places : (n, 3), m, from the table point (the machine's origin without one); poses : one for each place, None where it
    cannot be; branches : names of the arm's branches, empty where the machine has none; reasons : why a place cannot be, else
    empty.
    """

    places: FloatArray
    poses: tuple[Pose | None, ...]
    branches: tuple[str, ...]
    reasons: tuple[str, ...]

    @property
    def reached(self) -> np.ndarray:
        """Mask of the places that can be reached, (n,) bools."""
        return np.array([pose is not None for pose in self.poses])

    def batch(self) -> dict[str, FloatArray]:
        """Return the reachable poses as one batch: axis name to positions."""
        poses = [pose for pose in self.poses if pose is not None]
        return {name: np.array([pose[name] for pose in poses]) for name in poses[0]} if poses else {}

    def __repr__(self) -> str:
        return f"Reach({int(self.reached.sum())} of {len(self.poses)} places)"


def reach_places(machine: Machine, places: ArrayLike, direction: ArrayLike | None = None, *, turn: float = 0.0,
                 branch: str = "",
                 start: Pose | None = None, point: str = "", follow: bool = False) -> Reach:
    """Return poses that bring the tool's tip to places with its axis along a direction.

    Parameters
    ----------
    machine : Machine
        Names its tool point.
    places : (n, 3) floats
        m, from the table point in its axes.
    direction : (3,) floats, optional
        Of the tool's axis, away from the work; that at the reference pose where left out.
    turn : float
        rad, about the tool's axis, from the axes that the smallest turn of z onto the direction gives.
    branch : str
        Of an arm, for example ``front up no flip``, ``front, elbow up`` or ``front up, wrist turned least``; the one nearest
        to the start where left out.
    start : pose, optional
        At rest where left out.
    point : str
        Another point of the tool's body in place of the tip, for example the wrist.
    follow : bool
        Whether the places are a path: each pose is the one nearest to that of the place before, on the branch of the first.
    """
    targets = floats("places", places, (None, 3)).reshape(-1, 3)
    pair = tool_at(machine, point)
    goal = pair.direction if direction is None else floats("direction", direction, (3,))
    if not np.linalg.norm(goal) > 0:
        fail("direction", "length 0", "must not be zero")
    goal = goal / np.linalg.norm(goal)
    solver = place_solver(machine, pair, goal, turn=turn, branch=branch)
    last_pose = {axis.name: axis.reference_position for axis in machine.chain.driven_axes} | dict(start or {})
    poses: list[Pose | None] = []
    names, reasons = [], []
    for place in targets:
        pose, name, reason = solver(place, last_pose)
        poses.append(pose)
        names.append(name)
        reasons.append(reason)
        if follow and pose is not None:
            # The first place that is reached decides the branch of the whole path.
            if name and not any(names[:-1]):
                solver = place_solver(machine, pair, goal, turn=turn, branch=name)
            last_pose = dict(pose)
    return Reach(targets, tuple(poses), tuple(names), tuple(reasons))


def branch_names(machine: Machine, place: ArrayLike, direction: ArrayLike | None = None, *, turn: float = 0.0, point: str = ""
                 ) -> list[str]:
    """Return the branches of an arm that reach a place within limits; none for machines that are no arms."""
    pair = tool_at(machine, point)
    arm = arm_of(machine)
    if arm is None:
        return []
    goal = pair.direction if direction is None else floats("direction", direction, (3,)) / np.linalg.norm(direction)
    target = tool_target(pair, floats("place", place, (3,)), goal, turn=turn)
    return [each.name for each in arm.inverse(target) if each.within_limits]


def arm_of(machine: Machine) -> SphericalWrist | None:
    """Return the closed-form geometry of a machine whose tool hangs on six turning joints with a spherical wrist, else None.

    Bodies that are fixed to the links are left out: they do not move against them.
    """
    chain = machine.chain
    description = machine.description
    if description.tool is None or description.points[description.tool].body == GROUND or machine.loops:
        return None
    moving = {step.joint for step in chain.steps}
    path, link = list[int](), machine.link(description.points[description.tool].body)
    while link >= 0:
        path.insert(0, link)
        link = chain.parents[link]
    # Six moving links in series to the tool, and no other axis.
    joints = [link for link in path if link in moving]
    if len(joints) != 6 or len(chain.steps) != 6 or (description.table is not None and _is_moving(machine, description.table)):
        return None
    axes = tuple(Axis(axis.name,
                      tuple(Drive(joints.index(drive.joint), drive.direction, drive.factor) for drive in axis.drives),
                      axis.lower, axis.upper, axis.reference_position, axis.turns) for axis in chain.driven_axes)
    try:
        return SphericalWrist.of(TreeChain(tuple(range(-1, 5)), chain.frames[joints], axes))
    except ToolpointError:
        return None


def _is_moving(machine: Machine, point: str) -> bool:
    return machine.description.points[point].body != GROUND


def tool_at(machine: Machine, point: str = "") -> ToolOnWork:
    """Return the tool on its work, with another point of the tool's body in place of the tip where one is named."""
    pair = tool_pair(machine)
    if not point:
        return pair
    points = machine.description.points
    if point not in points:
        fail("point", f"no {point!r}", f"must be of {', '.join(points)}")
    other = points[point]
    if machine.link(other.body) < 0:
        fail("point", f"{point} on the ground", "must be on a body that moves with the tool")
    link = machine.link(other.body)
    tip = tf.move(machine.body_frames[link], np.array([other.at]))[0]
    return ToolOnWork(link, tip, pair.direction, pair.table, pair.origin)


class _Iterative:
    """Inverse kinematics by iteration from the start; branches have no names here."""

    def __init__(self, chain: TreeChain, pair: ToolOnWork, direction: FloatArray, turn: float) -> None:
        self.chain, self.pair, self.direction = chain, pair, direction
        # Five axes cannot take up a turn about the tool: it is left free there.
        self.turn = turn if len(chain.driven_axes) >= 6 else None
        self.leans = sum(axis.is_rotary for axis in chain.driven_axes) > 0

    def __call__(self, place: FloatArray, start: Pose) -> tuple[Pose | None, str, str]:
        solution = solve_inverse(self.chain, self.pair, place, direction=self.direction if self.leans else None,
                                 turn=self.turn if self.leans else None, start=start)
        return (dict(solution.pose), "", "") if solution.is_reached else (None, "", solution.status)


def place_solver(machine: Machine, pair: ToolOnWork, direction: FloatArray, *, turn: float, branch: str
                 ) -> ArmReach | _Iterative:
    """Return the inverse kinematics of a machine's tool: closed form for arms, iteration for others, which have no branches."""
    arm = arm_of(machine)
    if arm is not None:
        return ArmReach(arm, pair, direction, turn=turn, branch=branch)
    if branch:
        refuse_branch(branch)
    return _Iterative(machine.chain, pair, direction, turn)


def refuse_branch(branch: str) -> NoReturn:
    """Raise the ToolpointError of a branch requested from a machine without branches."""
    fail("`branch`", repr(branch), "is for arms of six turning joints with a spherical wrist", remedy="leave it out")


def path_faults(machine: Machine, reach: Reach, lengths: Sequence[float], *, largest_step: float = MAX_AXIS_STEP,
                largest_condition: float = 1e3) -> list[str]:
    """Return the reasons why the poses of a path cannot be followed.

    Places out of reach, singular poses (by the condition number of the tool's Jacobian), and jumps of an axis (rad) between
    neighbours.
    """
    faults = [f"at {1e3 * length:.4g} mm of the path ({_place_words(place)}): {reason}"
              for length, place, reason in zip(lengths, reach.places, reach.reasons, strict=True) if reason]
    if faults:
        return faults
    batch = reach.batch()
    condition = pose_condition(machine.chain, batch, tool_pair(machine).tool).lost_motion
    # The negated comparison counts an infinite or undefined condition number as singular.
    for k in np.flatnonzero(~(condition < largest_condition))[:1]:
        faults.append(f"at {1e3 * lengths[k]:.4g} mm of the path ({_place_words(reach.places[k])}): singular pose, condition "
                      f"number {condition[k]:.3g}")
    for name, values in batch.items():
        step = np.abs(np.diff(values))
        if step.size and step.max() > largest_step:
            k = int(step.argmax())
            faults.append(f"axis {name} turns by {np.degrees(step[k]):.4g} deg between {1e3 * lengths[k]:.4g} and "
                          f"{1e3 * lengths[k + 1]:.4g} mm of the path: a singular pose lies between, "
                          "or the places are too far apart")
    return faults


def _place_words(place: FloatArray) -> str:
    return ", ".join(f"{1e3 * v:.5g}" for v in place) + " mm"
