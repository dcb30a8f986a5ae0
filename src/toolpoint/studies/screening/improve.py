r"""Cheapest set of changes that brings an answer of the tool point to a goal, from exact slopes.

Cost is :math:`\sum_i c_i |x_i - x_{i,0}|` over shares x of the factors' ranges. It is minimised by linear programmes within a
region of trust that shrinks where the linear answer was wrong, begun at nothing and at the best single change; their corners
leave most changes at zero. What is promised is what the full model gives at the end, not what the slopes foretold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog

from toolpoint._check import FloatArray, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.machine.assembly.system import assemble
from toolpoint.machine.description import MachineDescription
from toolpoint.machine.description.variation import Factor, check_changes, resting_shares, vary
from toolpoint.machine.parts.build import build
from toolpoint.machine.parts.model import Machine
from toolpoint.studies.machines.energy_law import warn_of_energy_law
from toolpoint.studies.machines.tool_point import rotate_to_axes, tool_axes
from toolpoint.studies.screening.answers import Answer, TipSystem
from toolpoint.studies.text_table import text_table

Pose = Mapping[str, float]
_MAX_PROGRAMMES = 60  # linear programmes from one start
_IMPROVEMENT_TOLERANCE = 1e-6  # of shares, and of the answer by affine and full model
_REDUCED_TOLERANCE = 0.02  # the same of the answer with elastic bodies, whose full model is reduced anew
_GOAL_MARGIN = 2e-4  # relative, beyond the goal: rounding must not miss it


# Unit in which a goal is printed, by answer.
GOAL_UNITS = {"response peak": ("µm/N", 1e6), "static compliance": ("µm/N", 1e6), "depth limit": ("mm", 1e3),
              "position error": ("µm", 1e6)}
# Basis of an answer whose name alone does not give it.
BASIS = {"depth limit": "depth limit: the least over all speeds by the single-frequency solution; the exact chart (lobes) "
                        "differs by some per cent, at flip lobes by more, and the least of a range of speeds lies above it"}

@dataclass(frozen=True, eq=False)
class Improvement(NotebookText):
    """The cheapest changes for a goal.

    shares : (n,) of every factor's range; start_value, goal, value : the answer (worst of all poses); value is that of the full
    model; error : relative difference of the affine matrices from the full model there; interval : of the value over the draws
    of uncertain inputs, (2,), not numbers without; best_single : name and answer of the best that one change alone does at the
    same cost.
    """

    answer: str
    unit: str
    factors: tuple[Factor, ...]
    shares: FloatArray
    resting: FloatArray
    slopes: FloatArray
    start_value: float
    goal: float
    value: float
    error: float
    interval: FloatArray
    cost: float
    best_single: tuple[str, float]
    status: str

    def changes(self) -> list[str]:
        """Return a line on every factor that is changed."""
        moved = np.flatnonzero(np.abs(self.shares - self.resting) > _IMPROVEMENT_TOLERANCE)
        return [f"{self.factors[k].name}: {self.factors[k].words(float(self.shares[k]))}" for k in moved]

    def table(self) -> str:
        """Return the changes as text."""
        unit, scale = GOAL_UNITS.get(self.answer, (self.unit, 1.0))
        rows = [[f.name, f.words(float(s)), f"{f.cost * abs(s - r):.4g}", f"{scale * g:+.4g}"] for f, s, r, g in zip(
            self.factors, self.shares, self.resting, self.slopes, strict=True)]
        lower, upper = scale * self.interval
        sure = "" if np.isnan(lower) else f"; 95 % over the uncertain inputs {lower:.4g} .. {upper:.4g}"
        return "\n".join([
            text_table(f"To bring the {self.answer} from {scale * self.start_value:.4g} to {scale * self.goal:.4g} {unit}",
                       ["factor", "change", "cost", f"slope {unit} per range"], rows),
            f"the full model gives {scale * self.value:.4g} {unit} at a cost of {self.cost:.4g}{sure}",
            f"best single change of that cost: {self.best_single[0]}, {scale * self.best_single[1]:.4g} {unit}",
            *([BASIS[self.answer]] if self.answer in BASIS else []), self.status])

    def to_dict(self) -> dict[str, Any]:
        """Return the improvement as plain data."""
        return {"answer": self.answer, "unit": self.unit, "before": self.start_value, "goal": self.goal, "value": self.value,
                "error": self.error, "interval": [None if np.isnan(v) else float(v) for v in self.interval], "cost": self.cost,
                "shares": {f.name: float(s) for f, s in zip(self.factors, self.shares, strict=True)}, "changes": self.changes(),
                "slopes": {f.name: float(g) for f, g in zip(self.factors, self.slopes, strict=True)},
                "best_single": list(self.best_single), "basis": BASIS.get(self.answer, ""), "status": self.status}


def improve(machine: Machine, factors: Sequence[Factor], answer: Answer, *, goal: float, poses: Sequence[Pose] = ({},),
            doubts: Sequence[Factor] = (), draws: int = 0, rng: np.random.Generator | None = None) -> Improvement:
    """Return the cheapest changes of the factors that bring an answer, at its worst pose, to a goal.

    Parameters
    ----------
    machine : Machine
        Its matrices must be affine in the factors (stiffness, damping, mass, density), else ToolpointError.
    factors : sequence of Factor
        What may be changed, each with its range and the cost of all of it.
    answer : ResponsePeak, DepthLimit, PeriodicError or the like
    goal : float
        In the answer's unit: a lowest value where larger is better, else a highest.
    poses : sequence of poses
    doubts, draws, rng
        Uncertain inputs: how the promised value scatters over them.

    >>> from toolpoint.machine import build
    >>> from toolpoint.machine.description import BodyDescription, InertiaDescription, JointDescription, MachineDescription
    >>> from toolpoint.machine.description import PointDescription
    >>> head = BodyDescription(100.0, inertia=InertiaDescription(1.0, 1.0, 1.0))
    >>> slide = JointDescription("ground", "head", stiffness={"x": 1e7, "y": 4e7})
    >>> machine = build(MachineDescription("slide", {"head": head}, {"slide": slide}, points={"tip": PointDescription("head")},
    ...                                    tool="tip", damping_ratio=0.03))
    >>> from toolpoint.machine.description.variation import Factor
    >>> from toolpoint.studies.screening.answers import ResponsePeak
    >>> spring = Factor("spring", ("joints.slide.stiffness.x",), 1.0, 2.0)
    >>> result = improve(machine, [spring], ResponsePeak(static=True), goal=0.8e-7)  # 1 / 1e7 m/N as it is
    >>> round(result.value / result.goal, 3)
    1.0
    """
    description = machine.description
    check_changes(description, factors)
    positive("goal", goal)
    tip = [f"{description.tool}:{way}" for way in ("+x", "+y", "+z")] if description.tool else None
    warn_of_energy_law(machine, poses[0], tip)
    model = _AffineModel.of(machine, factors, poses)
    solver = _CostSearch(model, answer, goal, np.array([f.cost for f in factors]))
    start_value, slopes = solver.worst(model.resting)
    shares = solver.run()
    value = _full_value(description, factors, shares, answer, poses)
    estimate, _ = solver.worst(shares)
    error = abs(estimate / value - 1)
    if error > (_REDUCED_TOLERANCE if machine.reduced else _IMPROVEMENT_TOLERANCE):
        fail("factors", f"the full model differs by {error:.2g} at the solution", "the matrices must be affine in the factors",
             remedy="leave out sizes and places; stiffness, damping, mass and density are")
    met = value >= goal if answer.rises else value <= goal
    is_near = bool(machine.reduced) and abs(value / goal - 1) <= error
    interval = np.full(2, np.nan)
    if draws and rng is not None and doubts:
        check_changes(description, doubts)
        drawn = [_full_value(vary(description, doubts, rng.random(len(doubts)).tolist()), factors, shares, answer, poses)
                 for _ in range(draws)]
        interval = np.percentile(drawn, [2.5, 97.5])
    cost = solver.cost(shares)
    return Improvement(answer.name, answer.unit, tuple(factors), shares, model.resting, slopes, start_value, goal, value, error,
                       interval,
                       cost, _name_single(factors, solver.best_single(cost)), "the goal is met by the full model" if met else
                       f"the goal is met within {100 * error:.2g} %: elastic bodies reduced anew differ by that" if is_near else
                       "the goal cannot be met within the ranges; this is the best that they allow: widen them or ask for "
                       "less")


def _name_single(factors: Sequence[Factor], best: tuple[int, float]) -> tuple[str, float]:
    return ("none" if best[0] < 0 else factors[best[0]].name), best[1]


def _full_value(description: MachineDescription, factors: Sequence[Factor], shares: FloatArray, answer: Answer,
                poses: Sequence[Pose]
                ) -> float:
    full = build(vary(description, factors, shares.tolist()))
    values = np.concatenate([answer.evaluate(_tip_system(full, pose), None)[0] for pose in poses])
    return float(values.min() if answer.rises else values.max())


def _tip_system(machine: Machine, pose: Pose) -> TipSystem:
    description = machine.description
    if description.tool is None:
        fail("tool", "none", "must name the point where the tool cuts", remedy="add 'tool: NAME' to the machine file")
    point = description.tool if description.table is None else f"{description.tool}-{description.table}"
    batch = {name: np.array([value]) for name, value in pose.items()}
    system = assemble(machine, batch, [f"{point}:{way}" for way in ("+x", "+y", "+z")], modal_damping=False, joint_damping=True)
    if system.poses == ():
        maps = tool_axes(machine, None)[0].T @ system.output_map
    else:
        system = rotate_to_axes(system, tool_axes(machine, batch)).at_pose(0)
        maps = system.output_map
    zero = np.zeros_like(system.mass)
    loss = zero if system.structural_damping is None else system.structural_damping
    if description.damping_ratio is not None:
        loss = loss + 2 * description.damping_ratio * system.stiffness
    if not np.any(loss) and (system.damping is None or not np.any(system.damping)):
        fail("machine", "no damping", "its response would be infinite", remedy="give damping_ratio, or damping to joints")
    return TipSystem(system.mass, zero if system.damping is None else system.damping, loss, system.stiffness, maps.T)


@dataclass(frozen=True, eq=False)
class _AffineModel:
    """Matrices at every pose as a base and slopes per share of every factor."""

    resting: FloatArray
    bases: tuple[TipSystem, ...]
    slopes: tuple[TipSystem, ...]

    @classmethod
    def of(cls, machine: Machine, factors: Sequence[Factor], poses: Sequence[Pose]) -> _AffineModel:
        resting = np.array(resting_shares(factors))
        bases = tuple(_tip_system(machine, pose) for pose in poses)
        parts: list[list[TipSystem]] = []
        for k in range(len(factors)):
            end = resting.copy()
            end[k] = 1.0 if resting[k] < 0.5 else 0.0
            other = machine.rebuild(vary(machine.description, factors, end.tolist()))  # elastic bodies in the same shapes
            step = end[k] - resting[k]
            parts.append([_difference(_tip_system(other, pose), base, step) for pose, base in zip(poses, bases, strict=True)])
        stacked = tuple(_stack([row[i] for row in parts]) for i in range(len(poses)))
        return cls(resting, bases, stacked)

    def at(self, shares: FloatArray) -> tuple[TipSystem, ...]:
        step = shares - self.resting

        def moved(base: TipSystem, slope: TipSystem, term: str) -> FloatArray:
            return np.asarray(getattr(base, term) + np.tensordot(step, getattr(slope, term), 1))

        return tuple(TipSystem(moved(b, s, "mass"), moved(b, s, "damping"), moved(b, s, "loss"), moved(b, s, "stiffness"),
                               b.tip)
                     for b, s in zip(self.bases, self.slopes, strict=True))


def _difference(other: TipSystem, base: TipSystem, step: float) -> TipSystem:
    return TipSystem((other.mass - base.mass) / step, (other.damping - base.damping) / step, (other.loss - base.loss) / step,
                     (other.stiffness - base.stiffness) / step, base.tip)


def _stack(parts: Sequence[TipSystem]) -> TipSystem:
    return TipSystem(np.array([p.mass for p in parts]), np.array([p.damping for p in parts]), np.array([p.loss for p in parts]),
                     np.array([p.stiffness for p in parts]), parts[0].tip)


class _CostSearch:
    """Linear programmes within a region of trust; the answer in logarithms, so that goals are shares."""

    def __init__(self, model: _AffineModel, answer: Answer, goal: float, costs: FloatArray) -> None:
        self.model, self.answer, self.costs = model, answer, costs
        self.sense = 1.0 if answer.rises else -1.0
        self.goal = goal * (1 + self.sense * _GOAL_MARGIN)  # aimed at a little beyond, so that rounding does not miss it

    def cost(self, shares: FloatArray) -> float:
        """Return the cost of shares."""
        return float(self.costs @ np.abs(shares - self.model.resting))

    def answers(self, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the candidates of all poses (m,) and their slopes (m, n)."""
        rows = [self.answer.evaluate(system, slope) for system, slope in zip(self.model.at(shares), self.model.slopes,
                                                                             strict=True)]
        return np.concatenate([row[0] for row in rows]), np.concatenate([row[1] for row in rows])

    def worst(self, shares: FloatArray) -> tuple[float, FloatArray]:
        """Return value and slopes at the worst pose."""
        values, slopes = self.answers(shares)
        k = int((self.sense * values).argmin())
        return float(values[k]), slopes[k]

    def value(self, shares: FloatArray) -> float:
        """Return the answer alone."""
        values = np.concatenate([self.answer.evaluate(system, None)[0] for system in self.model.at(shares)])
        return float((self.sense * values).min() * self.sense)

    def gap(self, values: FloatArray) -> FloatArray:
        """Distance to the goal at every pose, in logarithms; not above zero where it is met."""
        return self.sense * (np.log(self.goal) - np.log(values))

    def run(self) -> FloatArray:
        """Return the cheapest shares that meet the goal, or those nearest to it."""
        starts = [self.model.resting, *self._single_starts()]
        ends = [self._from(start) for start in starts]
        gaps = [max(float(self.gap(self.answers(end)[0]).max()), 0.0) for end in ends]
        met = [end for end, miss in zip(ends, gaps, strict=True) if miss < 0.9 * _GOAL_MARGIN]
        if not met:
            return ends[int(np.argmin(gaps))]
        best = min(met, key=self.cost)
        number, value = self.best_single(self.cost(best))
        if number >= 0 and self.sense * (value - self.value(best)) > 0:  # one change alone does more for that: begin there
            improved = self._from(self._moved_alone(number, self.cost(best)))
            if float(self.gap(self.answers(improved)[0]).max()) < 0.9 * _GOAL_MARGIN and self.cost(improved) < self.cost(best):
                return improved
        return best

    def _moved_alone(self, k: int, cost: float) -> FloatArray:
        """Return the shares with one factor moved up or down at a cost, the better of both."""
        moved = []
        for sense in (-1.0, 1.0):
            shares = self.model.resting.copy()
            shares[k] = np.clip(shares[k] + sense * cost / self.costs[k], 0.0, 1.0)
            moved.append(shares)
        return max(moved, key=lambda shares: self.sense * self.value(shares))

    def _single_starts(self) -> list[FloatArray]:
        """Return each factor alone as far as the goal needs, or to its end: the three cheapest that meet the goal."""
        starts = []
        for k in range(len(self.costs)):
            for end in (0.0, 1.0):
                if abs(end - self.model.resting[k]) > _IMPROVEMENT_TOLERANCE and (start := self._alone(k, end)) is not None:
                    starts.append(start)
        return sorted(starts, key=self.cost)[:3]

    def _alone(self, k: int, end: float) -> FloatArray | None:
        def shares_at(share: float) -> FloatArray:
            shares = self.model.resting.copy()
            shares[k] += share * (end - shares[k])
            return shares

        def remaining_gap(share: float) -> float:
            return float(self.gap(np.array([self.value(shares_at(share))])).max())

        if remaining_gap(1.0) > 0:
            return None
        lower, upper = 0.0, 1.0
        for _ in range(12):
            middle = (lower + upper) / 2
            lower, upper = (lower, middle) if remaining_gap(middle) <= 0 else (middle, upper)
        return shares_at(upper)

    def _from(self, start: FloatArray) -> FloatArray:
        # A trust region: answers bend over the range of a change, so a linear step is believed over a quarter of it at
        # first.
        shares, trust = start.copy(), 0.25
        values, slopes = self.answers(shares)
        merit = self._merit(shares, values)
        for _ in range(_MAX_PROGRAMMES):
            step = self._programme(shares, values, slopes, trust)
            trial = np.clip(shares + step, 0.0, 1.0)
            fresh, fresh_slopes = self.answers(trial)
            gain = self._merit(trial, fresh)
            if gain < merit - 1e-12:
                trust = min(1.5 * trust, 1.0)
                shares, values, slopes, merit = trial, fresh, fresh_slopes, gain
            else:
                trust /= 3
            if trust < 1e-7:
                break
        return shares

    def _merit(self, shares: FloatArray, values: FloatArray) -> float:
        """Return the cost with a heavy weight on the distance to the goal."""
        return self.cost(shares) + 1e3 * float(self.costs.sum()) * max(float(self.gap(values).max()), 0.0)

    def _programme(self, shares: FloatArray, values: FloatArray, slopes: FloatArray, trust: float) -> FloatArray:
        """Return the step of least cost and slack over up and down moves from rest, the linear answer meeting the goal."""
        n, resting = len(shares), self.model.resting
        rate = self.sense * slopes / values[:, None]
        # x = rest + up - down; rate (x - shares) + slack >= gap
        matrix = np.hstack([-rate, rate, -np.ones((len(values), 1))])
        bound = -self.gap(values) + rate @ (resting - shares)
        box = np.hstack([np.eye(n), -np.eye(n), np.zeros((n, 1))])
        lower, upper = np.maximum(shares - trust, 0.0), np.minimum(shares + trust, 1.0)
        limits = [*((0.0, 1.0 - r) for r in resting), *((0.0, r) for r in resting), (0.0, None)]
        price = np.concatenate([self.costs, self.costs, [1e3 * self.costs.sum()]])
        solution = linprog(price, np.vstack([matrix, box, -box]), np.concatenate([bound, upper - resting, resting - lower]),
                           bounds=limits)
        if solution.x is None:
            return np.zeros(n)
        return resting + solution.x[:n] - solution.x[n:2 * n] - shares

    def best_single(self, cost: float) -> tuple[int, float]:
        """Return the number of the factor that alone does best at a cost (-1: none helps), and its answer."""
        best, name = self.value(self.model.resting), -1
        for k in range(len(self.costs)):
            value = self.value(self._moved_alone(k, cost))
            if self.sense * (value - best) > 0:
                best, name = value, k
        return name, best
