r"""Equations of loop closure and task, solved by Newton's method with exact Jacobians, for batches of poses.

Unknowns are the passive steps, and with a task the axes that it stands in place of. Elastic directions of a loop count as
equations of little weight: they hold exactly where they can, else they share the strain while locked ones still hold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from toolpoint._check import BoolArray, FloatArray, fail, suggestion
from toolpoint.kinematics.axis import AXES
from toolpoint.kinematics.looped_tree import LoopedTree
from toolpoint.kinematics.steps import advance
from toolpoint.kinematics.task import Task

ELASTIC_WEIGHT = 1e-4  # of the stiffest elastic direction over a locked one: locked ones hold, elastic ones share the strain
MAX_NEWTON_CORRECTION = 0.12  # rad, or of the chain's length: first correction after a predicted step, so that the mode is kept
MIN_CONTINUATION_FRACTION = 1 / 512  # of the way from the reference pose: smallest step of the continuation
MAX_CORRECTION_COUNT = 6  # corrections by Newton's method after a predicted step
MODE_STEP_TOLERANCE = 1e-11  # rad, or of the length: a step of Newton's method after which the next is below rounding
CLOSURE_SINGULAR_RATIO = 1e-10  # of the largest singular value: smaller ones are left out of pseudo-inverses


@dataclass(frozen=True, eq=False)
class Solution:
    """Step values (P, n_steps) of a batch of poses, reached fraction of the way (P,), reasons where a pose is unreachable.

    notes : of every pose, a remark such as of a strained loop, empty where there is none.
    """

    values: FloatArray
    part: FloatArray
    reasons: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())

    def judged(self, judgements: Sequence[Sequence[str]], notes: Sequence[str]) -> Solution:
        """Return the solution with the first reason of every pose, and with notes."""
        reasons = tuple(next((text for text in texts if text), "") for texts in zip(self.reasons, *judgements, strict=True))
        return replace(self, reasons=reasons, notes=tuple(notes))


@dataclass(frozen=True, eq=False)
class Closure:
    """Equations of a chain: all loops, and a task where there is one."""

    chain: LoopedTree
    task: Task | None

    @cached_property
    def unknowns(self) -> FloatArray:
        """Motion of every step per unknown, shape (n_steps, n_unknowns)."""
        chain = self.chain
        passive = np.eye(len(chain.steps))[:, list(chain.passive_steps)]
        if self.task is None:
            return passive
        names = [axis.name for axis in chain.driven_axes]
        return np.concatenate([passive, chain.coupling[:, [names.index(name) for name in self.task.axes]]], axis=1)

    @cached_property
    def scale(self) -> FloatArray:
        """Weight of a unit of every unknown: 1 for rad, 1/length for m, shape (n_unknowns,)."""
        turns = np.array([step.turns for step in self.chain.steps])
        rotates = np.abs(self.unknowns[turns]).max(axis=0, initial=0.0)
        slides = np.abs(self.unknowns[~turns]).max(axis=0, initial=0.0) / self.chain.length
        return np.maximum(rotates, slides)

    @cached_property
    def signs(self) -> FloatArray:
        """+1 where a step moves the child's side of a loop alone, -1 the parent's, shape (n_loops, n_steps)."""
        chain = self.chain
        nothing = np.zeros(len(chain.steps))
        on = [nothing if link < 0 else chain.on_path[link].astype(float) for loop in chain.loops
              for link in (loop.child, loop.parent)]
        differences = [on[2 * i] - on[2 * i + 1] for i in range(len(chain.loops))]
        return np.array(differences).reshape(len(chain.loops), len(chain.steps))

    @cached_property
    def weights(self) -> FloatArray:
        """Weight of every row: 1/length for m, 1 for rad; elastic directions by the root of their stiffness, times 1e-4."""
        rows: list[float] = []
        length = self.chain.length
        for loop in self.chain.loops:
            unit = np.array([1 / length] * 3 + [1.0] * 3)
            if loop.elastic and loop.stiffness is not None:
                size = np.diag(loop.stiffness) * np.array([length**2] * 3 + [1.0] * 3)
                root = np.sqrt(size / max(float(size.max()), 1e-300))
                for name in loop.elastic:
                    unit[AXES.index(name)] *= ELASTIC_WEIGHT * max(float(root[AXES.index(name)]), 1e-3)
            rows += [unit[i] for i in loop.rows]
        if self.task is not None:
            rows += [1 / length if kind in "xyz" else 1.0 for kind in ("x", "y", "z", "tilt", "azimuth", "torsion")
                     if kind in self.task.kinds]
        return np.array(rows)

    def evaluate(self, values: FloatArray, targets: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return weighted residuals (P, m) and their derivatives to all steps (P, m, n_steps)."""
        chain = self.chain
        moved = chain.displacements_of(chain.motions_of(values))
        twists = chain.twists_of(values, moved)
        rows: list[FloatArray] = []
        rates: list[FloatArray] = []
        for loop, sign in zip(chain.loops, self.signs, strict=True):
            # The gap's rate is that of the child's side against the parent's, both about the origin of the parent's side.
            base, relative = loop.relative(moved)
            kept = list(loop.rows)
            active = np.flatnonzero(sign)
            turn, origin = base[:, :3, :3], base[:, :3, 3]
            part = twists[:, active] * sign[active, None]
            velocity = (part[:, :, :3] - np.cross(origin[:, None], part[:, :, 3:])) @ turn
            rate = loop.gap_rate(relative, np.swapaxes(velocity, -1, -2), np.swapaxes(part[:, :, 3:] @ turn, -1, -2))
            full = np.zeros((len(values), len(kept), len(chain.steps)))
            full[:, :, active] = rate[:, kept]
            rows.append(loop.gap(relative)[:, kept])
            rates.append(full)
        if self.task is not None:
            rows.append(self.task.residual(moved, targets))
            rates.append(self.task.rate(moved, twists * chain.on_path[self.task.link][:, None], targets))
        if not rows:
            return np.zeros((len(values), 0)), np.zeros((len(values), 0, len(chain.steps)))
        return np.concatenate(rows, axis=1) * self.weights, np.concatenate(rates, axis=1) * self.weights[:, None]

    def gaps(self, values: FloatArray) -> list[FloatArray]:
        """Return the gap of every loop, m and rad, shape (P, 6) each."""
        moved = self.chain.displacements_of(self.chain.motions_of(values))
        return [loop.gap(loop.relative(moved)[1]) for loop in self.chain.loops]

    @cached_property
    def start(self) -> FloatArray:
        """Values of all steps at the reference pose in the chain's assembly mode, its loops closed, shape (1, n_steps)."""
        chain = self.chain
        values = np.zeros((1, len(chain.steps)))
        if not chain.mode:
            return values
        if chain.mode not in chain.modes:
            fail("assembly mode", repr(chain.mode), f"must be of {', '.join(chain.modes) or 'none'}",
                 remedy=suggestion(chain.mode, chain.modes))
        for step, value in chain.modes[chain.mode].items():
            values[0, step] = value
        return self.settle(values, chain.mode)

    @cached_property
    def _chain_start(self) -> FloatArray:
        # The assembly mode closes the loops alone: with a task the axes would move as well.
        return self.start if self.task is None else Closure(self.chain, None).start

    @cached_property
    def solved_as(self) -> str:
        """Kind of the linear equations: ``square``, ``tall`` (more equations than unknowns) or, rank deficient,
        ``pseudo-inverse``."""
        matrix = self.evaluate(self._chain_start, self._rest_targets())[1][0] @ self.unknowns / self.scale
        rows, columns = matrix.shape
        rank = int(np.linalg.matrix_rank(matrix, tol=1e-9 * max(float(np.abs(matrix).max(initial=0.0)), 1e-300)))
        if rank < columns:
            return "pseudo-inverse"
        return "square" if rows == columns else "tall"

    def _rest_targets(self) -> dict[str, FloatArray]:
        if self.task is None:
            return {}
        chain = self.chain
        read = self.task.read(chain.displacements_of(chain.motions_of(self._chain_start)))
        return {kind: read[kind] for kind in self.task.kinds}

    def correct(self, rate: FloatArray, residual: FloatArray) -> FloatArray:
        """Return the change of the unknowns (P, n_unknowns) that removes residuals (P, m) to first order, of least size."""
        matrix = rate @ self.unknowns / self.scale
        if self.solved_as != "pseudo-inverse":
            try:
                if self.solved_as == "square":
                    return np.linalg.solve(matrix, -residual[..., None])[..., 0] / self.scale
                # More equations than unknowns (elastic loops share their strain): least squares, without squaring the
                # condition.
                q, r = np.linalg.qr(matrix)
                return np.linalg.solve(r, -np.swapaxes(q, -1, -2) @ residual[..., None])[..., 0] / self.scale
            except np.linalg.LinAlgError:
                pass  # a pose of the batch is exactly singular: the least change that helps is taken there
        return -(np.linalg.pinv(matrix, rcond=CLOSURE_SINGULAR_RATIO) @ residual[..., None])[..., 0] / self.scale

    def determinant_sign(self, rate: FloatArray) -> FloatArray:
        """Return the sign of the determinant of the equations, zero where they are not square, shape (P,)."""
        return np.sign(np.linalg.det(rate @ self.unknowns)) if self.solved_as == "square" else np.zeros(len(rate))

    def rates(self, values: FloatArray) -> FloatArray:
        """Return the rate of every step per rate of every driven axis at closed loops, shape (P, n_steps, n_driven)."""
        chain = self.chain
        coupling = np.broadcast_to(chain.coupling, (len(values), *chain.coupling.shape))
        if not chain.loops or not chain.passive:
            return coupling
        _, rate = Closure(chain, None).evaluate(values, {})
        # Differentiated closure: J_passive rates = -J coupling. In weighted unknowns, so that least norm does not prefer
        # metres or radians.
        passive = np.linalg.pinv(rate @ self.unknowns / self.scale, rcond=CLOSURE_SINGULAR_RATIO) @ rate @ coupling
        return coupling - self.unknowns @ (passive / self.scale[:, None])

    def settle(self, values: FloatArray, mode: str) -> FloatArray:
        """Return the closed step values nearest to start values (1, n_steps), for a named assembly mode."""
        matrix = self.unknowns / self.scale
        for _ in range(60):
            residual, rate = self.evaluate(values, {})
            change = -(np.linalg.pinv(rate @ matrix, rcond=CLOSURE_SINGULAR_RATIO) @ residual[..., None])[..., 0]
            size = float(np.abs(change).max(initial=0.0))
            # At most 0.3 rad a step: start values are written by hand and may be far from closing.
            step = change * min(1.0, 0.3 / max(size, 1e-300)) @ matrix.T
            values = advance(self.chain.steps, self.chain.balls, values, change=step)
            if size < MODE_STEP_TOLERANCE:
                break
        if float(np.abs(residual).max(initial=0.0)) > 1e-8:
            fail("assembly mode", repr(mode), "does not close from its start values at the reference pose",
                 remedy="give start values nearer to that way of assembling the loops")
        return values


def solve_closure(closure: Closure, start: FloatArray, goal: FloatArray, *, targets: Mapping[str, FloatArray]) -> Solution:
    """Follow every pose from its start to a goal along a straight line of the commanded coordinates.

    start : (P, n_steps); goal : (P, n_driven) positions of the driven axes; targets : of the task, by kind, (P,) each.
    """
    chain = closure.chain
    count = len(start)
    start_positions = chain.positions_of(start)
    free = closure.unknowns.shape[1]
    if free == 0:
        change = (goal - start_positions) @ chain.coupling.T
        return Solution(start + change, np.ones(count), ("",) * count)
    begin = {} if closure.task is None else _read(closure, start)
    # Axes that the task solves for are unknowns: they have no travel of their own.
    held = np.zeros(len(chain.driven_axes), bool)
    if closure.task is not None:
        held[[k for k, axis in enumerate(chain.driven_axes) if axis.name in closure.task.axes]] = True
    travel = np.where(held, 0.0, goal - start_positions)
    return _follow(closure, start.copy(), _Way(travel, begin, targets))


@dataclass(frozen=True, eq=False)
class _Way:
    """Straight line of the commanded coordinates: travel of the driven axes (P, n_driven), begin and end of the task."""

    travel: FloatArray
    begin: Mapping[str, FloatArray]
    end: Mapping[str, FloatArray]

    def targets(self, indices: np.ndarray, part: FloatArray) -> dict[str, FloatArray]:
        """Return the targets of the poses `indices` after a part of the way."""
        return {kind: (1 - part) * self.begin[kind][indices] + part * goal[indices] for kind, goal in self.end.items()}


def _read(closure: Closure, values: FloatArray) -> dict[str, FloatArray]:
    chain, task = closure.chain, closure.task
    assert task is not None
    return task.read(chain.displacements_of(chain.motions_of(values)))


def _follow(closure: Closure, values: FloatArray, way: _Way) -> Solution:
    count = len(values)
    part, step = np.zeros(count), np.ones(count)
    active = np.arange(count)
    # Predictor-corrector continuation: an accepted step doubles, a refused one is taken again with a quarter.
    hand = closure.determinant_sign(closure.evaluate(values, way.targets(active, part))[1])
    while active.size:
        goal = np.minimum(1.0, part[active] + step[active])
        moved, accepted = _attempt(closure, values[active], way, active, (part[active], goal, hand[active]))
        values[active[accepted]] = moved[accepted]
        part[active[accepted]] = goal[accepted]
        step[active] = np.where(accepted, 2 * step[active], step[active] / 4)
        active = active[(part[active] < 1) & (step[active] >= MIN_CONTINUATION_FRACTION)]
    reasons = tuple("" if p >= 1 else _stop_reason(float(p)) for p in part)
    return Solution(values, part, reasons)


def _stop_reason(part: float) -> str:
    return (f"cannot be reached from the reference pose: the way there ends after {100 * part:.0f} %, at a singular pose or "
            "where the loops can no longer close")


def _attempt(closure: Closure, values: FloatArray, way: _Way, indices: np.ndarray,
             parts: tuple[FloatArray, FloatArray, FloatArray]
             ) -> tuple[FloatArray, BoolArray]:
    """Move poses from one part of the way to another, predicted by the Jacobian and corrected by Newton; return acceptance too.

    parts : before, after, and the hand of the equations, which changes only where a singular pose is passed.
    """
    chain, (fraction_before, fraction_after, hand) = closure.chain, parts
    driven = (way.travel[indices] * (fraction_after - fraction_before)[:, None]) @ chain.coupling.T
    targets = way.targets(indices, fraction_after)
    residual, rate = closure.evaluate(values, targets)
    predicted = residual + (rate @ driven[..., None])[..., 0]
    change = driven + closure.correct(rate, predicted) @ closure.unknowns.T
    values = advance(chain.steps, chain.balls, values, change=change)
    first = np.full(len(values), np.inf)
    for number in range(MAX_CORRECTION_COUNT):
        residual, rate = closure.evaluate(values, targets)
        delta = closure.correct(rate, residual)
        size = np.abs(delta * closure.scale).max(axis=-1)
        if number == 0:
            first = size
        # A correction of more than a radian is a failing pose: it stays, and is refused below, where it would overflow.
        step = np.where((size < 1)[:, None], delta, 0.0) @ closure.unknowns.T
        values = advance(chain.steps, chain.balls, values, change=step)
        # Convergence is quadratic: after a correction of 1e-7 the next would be below rounding.
        if number and (np.minimum(size, np.where(first > MAX_NEWTON_CORRECTION, 0.0, size)) < 1e-7).all():
            break
    return values, (first <= MAX_NEWTON_CORRECTION) & (size < 1e-6) & (closure.determinant_sign(rate) == hand)
