"""ClosedChain: a tree whose passive joints are solved so that its loops close and its tool meets a task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail
from toolpoint.kinematics.chain import Pose
from toolpoint.kinematics.closure import Closure, Solution, solve_closure
from toolpoint.kinematics.looped_tree import LoopedTree
from toolpoint.kinematics.reach import first_fault, gap_reasons, limit_reasons, strain_notes


@dataclass(frozen=True, eq=False)
class ClosedChain(LoopedTree):
    """Tree of links with loops that close at every pose, and a task in whose coordinates it may be commanded.

    Parameters
    ----------
    loops : sequence of LoopClosure
    task : Task, optional
        Its coordinates are axes of the chain; a pose names them, or the axes that they stand in place of, never both.
    names : names of the joints, for messages
    limits : mapping of passive step (its index among all) to (lower, upper), m or rad
    modes : mapping of the name of an assembly mode to start values of passive steps (index to m or rad) at the reference pose
    mode : str
        The assembly mode in use; the reference pose as described where empty.
    length : float
        By which rotations are weighed against lengths, m.

    Examples
    --------
    A parallelogram of crank, coupler and rocker: the rocker turns as the crank does, the coupler not at all.

    >>> from toolpoint.kinematics import Axis, Drive, LoopClosure, Step
    >>> from toolpoint.spatial.transform import transform
    >>> frames = [transform(None, place) for place in ([0, 0, 0], [0, 0.1, 0], [0.2, 0, 0])]
    >>> loop = LoopClosure("pin", parent=2, child=1, frame=transform(None, [0.2, 0.1, 0]), free=("rz",))
    >>> chain = ClosedChain((-1, 0, -1), frames, (Axis("C", (Drive(0, "rz"),)),), (Step(1, 5), Step(2, 5)), loops=(loop,))
    >>> chain.step_values({"C": 0.3})[0].round(9).tolist()
    [0.3, -0.3, 0.3]
    """

    @cached_property
    def closure(self) -> Closure:
        """The equations with the passive steps unknown."""
        return Closure(self, None)

    @cached_property
    def task_closure(self) -> Closure:
        """The equations with the passive steps and the axes of the task unknown."""
        return Closure(self, self.task)

    @cached_property
    def start(self) -> FloatArray:
        """Values of all steps at the reference pose in the assembly mode in use, shape (1, n_steps)."""
        return self.closure.start

    def with_mode(self, mode: str) -> ClosedChain:
        """Return the chain in another assembly mode."""
        changed = replace(self, mode=mode)
        # Solved here, so that this call refuses a mode that does not exist, and not the first pose that is asked.
        _ = changed.start
        return changed

    def is_task_pose(self, pose: Pose) -> bool:
        """Whether a pose is given in coordinates of the task; one that mixes them with the axes they replace is refused."""
        if self.task is None:
            return False
        named = [name for name in pose if name in self.task.coordinates]
        both = [name for name in pose if name in self.task.axes]
        if named and both:
            fail("pose", f"{', '.join(named)} and {', '.join(both)}", "must not be given together",
                 remedy=f"{', '.join(self.task.coordinates)} stand in place of {', '.join(self.task.axes)}")
        return bool(named)

    def solve(self, pose: Pose, *, start: FloatArray | None = None) -> Solution:
        """Solve for the step values of a batch of poses; every pose that cannot be reached has its reason.

        Each pose is followed from the reference pose (or from `start`, (1 or P, n_steps)) along a straight line of its
        coordinates in steps that Newton's method takes with small corrections, so the assembly mode is kept.
        """
        batch = self.batch(pose)
        count = len(next(iter(batch.values()))) if batch else 1
        is_task = self.is_task_pose(pose)
        closure = self.task_closure if is_task else self.closure
        begin = np.broadcast_to(self.start if start is None else start, (count, len(self.steps)))
        # Axes that a pose leaves out are at rest: every row is complete, and the way to it does not depend on what was
        # solved before.
        goal = np.stack([np.broadcast_to(batch.get(axis.name, np.array([axis.reference_position])), (count,))
                         for axis in self.driven_axes],
                        axis=-1) if self.driven_axes else np.zeros((count, 0))
        targets = self._targets(batch, count) if is_task else {}
        solution = solve_closure(closure, begin, goal, targets=targets)
        reasons = [limit_reasons(self, solution), gap_reasons(self, solution, closure)]
        return solution.judged(reasons, strain_notes(self, solution, closure))

    def _targets(self, batch: Mapping[str, FloatArray], count: int) -> dict[str, FloatArray]:
        assert self.task is not None
        reference_positions = {axis.name: axis.reference_position for axis in self.axes}
        return {kind: np.broadcast_to(batch.get(name, np.array([reference_positions[name]])), (count,))
                for name, kind in self.task.coordinates.items()}

    def step_values(self, pose: Pose) -> FloatArray:
        """Return the values of all steps, shape (n_poses, n_steps); raises for the first pose that cannot be."""
        return self.settled(pose)[0]

    def settled(self, pose: Pose) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the step values of a batch of poses and notes on them; raises ToolpointError for an unreachable pose."""
        solution = self.solve(pose)
        first_fault(self, pose, solution)
        return solution.values, tuple(dict.fromkeys(note for note in solution.notes if note))[:3]

    def follow(self, path: Pose) -> FloatArray:
        """Return the step values along a path of poses, each followed from the one before, shape (n_poses, n_steps).

        Raises ToolpointError where the way from one pose to the next meets a singular pose or a loop cannot close, naming both.
        """
        batch = self.batch(path)
        count = len(next(iter(batch.values()))) if batch else 1
        values = [np.asarray(self.start)]
        # One pose after the other: a batch would start all at one place, and those beyond a fork could end in another
        # assembly mode.
        for i in range(count):
            pose = {name: positions[i:i + 1] for name, positions in batch.items()}
            solution = self.solve(pose, start=values[-1])
            if solution.reasons[0]:
                start_words = "the reference pose" if i == 0 else f"pose {i} of the path"
                first_fault(self, pose, replace(solution, reasons=(f"from {start_words}: {solution.reasons[0]}",)))
            values.append(solution.values)
        return np.concatenate(values[1:])

    def task_rates(self, pose: Pose) -> FloatArray:
        """Return the rate of the task's residual coordinates per rate of the axes that it stands in place of, (P, k, k).

        Rows are place (m/s) and the tool's turning across and about its axis (rad/s); its inverse gives the rates of the legs.
        """
        task = self.task
        if task is None:
            fail("task", "none", "must be given", remedy="describe the coordinates of the tool under 'task'")
        values = self.step_values(pose)
        moved = self.displacements_of(self.motions_of(values))
        names = [axis.name for axis in self.driven_axes]
        rates = self.closure.rates(values)[:, :, [names.index(name) for name in task.axes]]
        # Rates of the closed loops with the legs as drives: the task's own equations have the legs as unknowns.
        twists = self.twists_of(values, moved) * self.on_path[task.link][:, None]
        read = task.read(moved)
        return task.rate(moved, twists, {kind: read[kind] for kind in task.kinds}) @ rates

    def reachable(self, pose: Pose) -> tuple[BoolArray, list[str]]:
        """Return which poses of a batch are reachable, (P,), and the reason of each that is not (empty text where it is)."""
        solution = self.solve(pose)
        return np.array([not reason for reason in solution.reasons]), list(solution.reasons)

    def positions(self, pose: Pose) -> FloatArray:
        """Return positions of the driven axes, solved where a pose is given in the task's coordinates, (n_poses, n_driven)."""
        if not self.is_task_pose(pose):
            return super().positions(pose)
        return self.positions_of(self.step_values(pose))

    def coordinates(self, pose: Pose) -> dict[str, FloatArray]:
        """Return the position of every axis and every coordinate of the task at a batch of poses, m or rad, (n_poses,) each."""
        values = self.step_values(pose)
        result = dict(zip((axis.name for axis in self.driven_axes), self.positions_of(values).T, strict=True))
        if self.task is not None:
            read = self.task.read(self.displacements_of(self.motions_of(values)))
            result |= {name: read[kind] for name, kind in self.task.coordinates.items()}
        return result

    def rates_at(self, values: FloatArray) -> FloatArray:
        """Return the rate of every step per rate of every driven axis at closed loops, shape (n_poses, n_steps, n_driven)."""
        return self.closure.rates(values)
