"""Interval of the limit of the most doubtful block from the machine's identified numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine import Machine
from toolpoint.studies.cuts.limit_spread import LimitSpread, sample_limits
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.margins import PlaceMargins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver
from toolpoint.studies.machining.tool_tips import ToolTips

_COMPLIANCE_LINES = 400  # on which the greatest compliance is looked up


@dataclass(frozen=True)
class LimitInterval:
    """95 % interval of a limit (m) of the block in a line of the program, and whether it holds the depth that is cut."""

    line: int
    words: str
    holds_depth: bool

    @property
    def doubts(self) -> list[Doubt]:
        """Doubt about the verdict of a block whose depth lies in the interval of its limit."""
        if not self.holds_depth:
            return []
        return [Doubt("verdict", f"line {self.line}: its depth lies within the interval of its limit; {self.words}",
                      "cut with more in hand, or measure what the interval comes from")]


def find_limit_interval(machine: Machine, poses: Sequence[ToolDynamics], arcs: PlaceArcs, *, margins: PlaceMargins,
                        pose: np.ndarray,
                        laid: ProgramPath, piece: np.ndarray, setup: MachiningSetup, tips: ToolTips,
                        work: Sequence[ToolDynamics] = ()) -> LimitInterval | None:
    """Return the interval at the place nearest to its limit; nothing where no place has one, or the file no identified numbers.

    poses : dynamics of every pose; pose : index of the pose of every place of the removal; tips : those that were struck have
    nothing of the machine's numbers, so places of their tools are left out; work : of the work at every pose, as it is.
    """
    distance = np.abs(np.log(np.where(margins.limit > 0, margins.limit, np.nan) / arcs.depth))
    distance[~np.isfinite(distance) | np.isin(laid.tool[laid.moves.block[piece[arcs.place]]], list(tips.struck))] = np.inf
    if not np.isfinite(distance).any():
        return None
    m = int(np.argmin(distance))
    block = int(laid.moves.block[piece[arcs.place[m]]])
    stand = poses[int(pose[arcs.place[m]])].pose
    part = work[int(pose[arcs.place[m]]):][:1]
    arc, depth = (float(arcs.entry[m]), float(arcs.exit[m])), float(arcs.depth[m])

    def solver_of(sample: Machine) -> StabilitySolver:
        return StabilitySolver(setup, [machine_dynamics(sample, stand)], tips, part)

    def limits(sample: Machine) -> FloatArray:
        return solver_of(sample).chart(int(laid.tool[block]), 0, arc, angle=float(arcs.angle[m]),
                                       speeds=laid.speed[block:block + 1],
                                       depth=depth).limit

    def compliance(sample: Machine) -> FloatArray:
        plane = solver_of(sample).problem(int(laid.tool[block]), 0).plane
        frequency_min, frequency_max = plane.span
        lines = np.linspace(0.5 * frequency_min, 2 * frequency_max, _COMPLIANCE_LINES)
        return np.asarray(np.log(np.abs(np.real(plane.response(lines))).max(keepdims=True).ravel()))

    spread = sample_limits(machine, limits, compliance, rng=np.random.default_rng(0))
    if spread is None:
        return None
    return _interval(spread, float(margins.limit[m]), depth, line=int(laid.path.line[block]), error=float(margins.error[m]))


def _interval(spread: LimitSpread, limit: float, depth: float, *, line: int, error: float) -> LimitInterval:
    half_width = spread.factor * spread.lowest
    if not np.isfinite(half_width):
        return LimitInterval(line, f"line {line}: a machine drawn from the identified numbers has no limit there", True)
    holds = limit * np.exp(-half_width) - error <= depth <= limit * np.exp(half_width) + error
    return LimitInterval(line, f"line {line}, the block nearest to its limit: {spread.words(limit, error)}", bool(holds))
