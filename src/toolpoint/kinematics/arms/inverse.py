"""Inverse kinematics of any chain by iteration within limits: the tool's tip and direction relative to the work.

For five-axis machines, robots and whatever has no closed form. The turn about the tool may be prescribed or left free: then it
is the redundancy of milling, and the solution nearest to the start is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from toolpoint._check import FloatArray, ToolpointError, fail, floats
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.kinematics.tree import TreeChain
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf
from toolpoint.spatial.rotation import skew

MAX_START_COUNT = 13  # starts of the iteration, the given one among them
INVERSE_TOLERANCE = 1e-9  # rad, or of the size of the machine: residual of a pose that reaches its target
# The same for more coordinates than axes: a place and a direction that were rounded to 0.01 mm do not fit each other better,
# and no machine of this size positions better.
OVERDETERMINED_TOLERANCE = 1e-5  # rad, or of the size of the machine


@dataclass(frozen=True, eq=False)
class ToolOnWork:
    """Tool and work on a chain at its reference pose, in the machine frame.

    tool, table : numbers of the links that carry tool and work, -1 for the ground; tip : (3,) of the tool, m; direction : (3,)
    of the tool's axis, of any length; origin : (3,) point of the work from which places are measured, m.
    """

    tool: int
    tip: FloatArray
    direction: FloatArray
    table: int = -1
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("tip", "direction", "origin"):
            put(self, name, floats(f"ToolOnWork.{name}", getattr(self, name), (3,)))
        put(self, "direction", self.direction / np.linalg.norm(self.direction))

    def placed(self, chain: TreeChain, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return tip (P, 3), tool axes (P, 3, 3) and work axes (P, 3, 3) for step values (P, n_steps).

        The tip is measured from the work's point, m. Tip and tool axes (columns, z the tool's direction) are in the work's
        axes; those are in the machine frame.
        """
        moved = chain.displacements_of(chain.motions_of(values))
        ground = np.broadcast_to(np.eye(4), (len(values), 4, 4))
        tool, work = (ground if link < 0 else moved[:, link] for link in (self.tool, self.table))
        from_machine = np.swapaxes(work[:, :3, :3], -1, -2)
        offset = tf.move(tool, self.tip[None])[:, 0] - tf.move(work, self.origin[None])[:, 0]
        axes = from_machine @ tool[:, :3, :3] @ smallest_turn(self.direction)
        return (from_machine @ offset[..., None])[..., 0], axes, work[:, :3, :3]


@dataclass(frozen=True, eq=False)
class InverseSolution:
    """Inverse solution: positions of the driven axes by name, m or rad; remaining errors of place (m) and orientation (rad).

    status : ``reached``, or what is left and what to try. Where no pose could be solved the mapping is empty and both errors
    are infinite.
    """

    pose: Mapping[str, float]
    place_error: float
    orientation_error: float
    status: str

    @property
    def is_reached(self) -> bool:
        """Whether the target is met."""
        return self.status == "reached"


def tool_on_work(chain: TreeChain, pose: Mapping[str, ArrayLike], pair: ToolOnWork) -> tuple[FloatArray, FloatArray]:
    """Return the tool's tip from the work's point, m, and its direction, both in the work's axes, shape (n_poses, 3) each."""
    place, axes, _ = pair.placed(chain, chain.step_values(pose))
    return place, axes[:, :, 2]


def solve_inverse(
    chain: TreeChain, pair: ToolOnWork, tip: ArrayLike, *, direction: ArrayLike | None = None, turn: float | None = None,
    start: Mapping[str, float] | None = None,
) -> InverseSolution:
    """Solve for positions of the driven axes, within limits, that bring tip and direction of the tool to a target on the work.

    Parameters
    ----------
    chain : TreeChain or ClosedChain
    pair : ToolOnWork
    tip : (3,) floats
        From the work's point in its axes, m.
    direction : (3,) floats, optional
        Of the tool's axis in the work's axes; free where left out.
    turn : float, optional
        Turn about the tool, rad, from the axes that the smallest turn of z onto the direction gives; free where left out.
    start : mapping of axis name to position, optional
        At rest where left out; of several solutions the near one is found. Where it leads nowhere, other starts are tried.

    The status is ``reached``, or says what is left and what to try. Where more coordinates are asked for than there are axes (a
    head of three freedoms, place and direction), the nearest pose is reached within 1e-5 of the machine's size and 1e-5 rad.

    Examples
    --------
    >>> from toolpoint.kinematics import cartesian
    >>> pair = ToolOnWork(tool=2, tip=[0, 0, 0], direction=[0, 0, 1])
    >>> solution = solve_inverse(cartesian(("X", "Y", "Z"), ()), pair, [0.1, 0.2, 0.3])
    >>> solution.status, {name: round(value, 9) for name, value in solution.pose.items()}
    ('reached', {'X': 0.1, 'Y': 0.2, 'Z': 0.3})
    """
    goal = _Goal.of(chain, pair, tip, direction=direction, turn=turn)
    reference = np.array([dict(start or {}).get(axis.name, axis.reference_position) for axis in chain.driven_axes], float)
    lower, upper = goal.bounds()
    best: InverseSolution | None = None
    for start_positions in _starts(chain, np.clip(reference, lower, upper))[:MAX_START_COUNT]:
        solution = _solve(goal, start_positions, lower, upper)
        if best is None or solution.place_error + solution.orientation_error < best.place_error + best.orientation_error:
            best = solution
        if best.is_reached:
            return best
    assert best is not None
    return best


def solve_all_inverse(chain: TreeChain, pair: ToolOnWork, tip: ArrayLike, *, direction: ArrayLike | None = None,
                      turn: float | None = None) -> list[InverseSolution]:
    """Return all distinct solutions within limits that a grid of starts leads to, see `solve_inverse`.

    Positions that differ by whole turns are distinct. Solutions far from all starts can be missed.
    """
    goal = _Goal.of(chain, pair, tip, direction=direction, turn=turn)
    lower, upper = goal.bounds()
    reference = np.clip(np.array([axis.reference_position for axis in chain.driven_axes], float), lower, upper)
    solutions: list[InverseSolution] = []
    for start_positions in _starts(chain, reference):
        solution = _solve(goal, start_positions, lower, upper)
        if solution.is_reached and all(_differs(solution, other) for other in solutions):
            solutions.append(solution)
    return solutions


def _differs(first: InverseSolution, second: InverseSolution) -> bool:
    """Whether two solutions differ by more than 1e-6 m or rad in some axis."""
    return any(abs(first.pose[name] - second.pose[name]) > 1e-6 for name in first.pose)


@dataclass(frozen=True, eq=False)
class _Goal:
    """Target of the iteration, as equations of the positions of the driven axes.

    tip : (3,) m, in the work's axes; axes : (3, 3) wanted axes of the tool in those of the work, None where the direction is
    free; with_turn : whether the turn about the tool is prescribed too; size : largest extent of the machine, m, which makes
    places and angles alike.
    """

    chain: TreeChain
    pair: ToolOnWork
    tip: FloatArray
    axes: FloatArray | None
    with_turn: bool
    size: float

    @classmethod
    def of(cls, chain: TreeChain, pair: ToolOnWork, tip: ArrayLike, *, direction: ArrayLike | None, turn: float | None
           ) -> _Goal:
        """Return the target with checked arguments, as `solve_inverse` takes them."""
        axes: FloatArray | None = None
        if direction is not None:
            unit = floats("direction", direction, (3,))
            length = float(np.linalg.norm(unit))
            if length == 0:
                fail("direction", "length 0", "must not be zero")
            axes = smallest_turn(unit / length) @ rot.about("z", turn or 0.0)
        elif turn is not None:
            fail("turn", "given without a direction", "turns about the tool's direction", remedy="give direction too")
        if not chain.driven_axes:
            fail("chain", "no axes", "must have axes that move it")
        places = np.concatenate([chain.frames[:, :3, 3], pair.tip[None], pair.origin[None]])
        size = float(np.ptp(places, axis=0).max()) or 1.0
        return cls(chain, pair, floats("tip", tip, (3,)), axes, turn is not None, size)

    @property
    def equations(self) -> int:
        """Number of prescribed coordinates: 3, 5 or 6; the residual has 6 rows for 5, of which one is redundant."""
        return 3 + (0 if self.axes is None else 3 if self.with_turn else 2)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return lower and upper limits of the driven axes, (n_driven,) each."""
        axes = self.chain.driven_axes
        return np.array([axis.lower for axis in axes]), np.array([axis.upper for axis in axes])

    def residual(self, positions: FloatArray) -> FloatArray:
        """Return error of place over `size`, and rotation vector of the error of orientation, (3,) or (6,)."""
        place, axes, _ = self.pair.placed(self.chain, self._values(positions))
        rows = [(place[0] - self.tip) / self.size]
        if self.axes is not None:
            rows.append(self._orientation(axes[0]))
        return np.concatenate(rows)

    def _values(self, positions: FloatArray) -> FloatArray:
        """Return the step values (1, n_steps) of positions of the driven axes (n_driven,)."""
        names = [axis.name for axis in self.chain.driven_axes]
        return self.chain.step_values(dict(zip(names, positions, strict=True)))

    def _orientation(self, axes: FloatArray) -> FloatArray:
        """Return the rotation vector (3,) from the wanted to the actual axes (3, 3) of the tool."""
        assert self.axes is not None
        if self.with_turn:
            return rot.to_vector(axes @ self.axes.T)
        # The rotation vector that brings one direction onto the other: its length is the angle, also near the opposite.
        d, goal = axes[:, 2], self.axes[:, 2]
        cross = np.cross(goal, d)
        sine = float(np.linalg.norm(cross))
        # For a small angle the cross product is the rotation vector itself.
        return cross * (np.arctan2(sine, float(d @ goal)) / sine if sine > 1e-12 else 1.0)

    def slope(self, positions: FloatArray) -> FloatArray:
        """Return the Jacobian of the residual, (3 or 6, n_driven); its rows of rotation are exact where the target is met."""
        chain, pair = self.chain, self.pair
        values = self._values(positions)
        moved = chain.displacements_of(chain.motions_of(values))
        twists, rates = chain.twists_of(values, moved)[0].T, chain.rates_at(values)[0]
        nothing = np.zeros((6, rates.shape[1]))
        tool, work = (nothing if link < 0 else twists * chain.on_path[link] @ rates for link in (pair.tool, pair.table))
        place, _, turned = pair.placed(chain, values)
        origin = pair.origin if pair.table < 0 else tf.move(moved[0, pair.table], pair.origin[None])[0]
        tip = turned[0] @ place[0] + origin
        relative = tool - work
        velocity = turned[0].T @ (relative[:3] - skew(tip) @ relative[3:])
        rows = [velocity / self.size]
        if self.axes is not None:
            turning = turned[0].T @ relative[3:]
            d = self.axes[:, 2]
            rows.append(turning if self.with_turn else turning - np.outer(d, d @ turning))
        return np.concatenate(rows)


def _starts(chain: TreeChain, first: FloatArray) -> Sequence[FloatArray]:
    """Return the given start (n_driven,), then at most 36 combinations of a few positions of the rotary axes."""
    rotary = [k for k, axis in enumerate(chain.driven_axes) if axis.is_rotary]
    # A few starts for each axis, so that the grid stays within some 36 solutions.
    count = {0: 1, 1: 8, 2: 6, 3: 4}.get(len(rotary), 2)
    starts = [first]
    for number in range(min(count ** len(rotary), 36)):
        start = first.copy()
        for k in rotary:
            axis = chain.driven_axes[k]
            lower, upper = max(axis.lower, -np.pi), min(axis.upper, np.pi)
            start[k] = lower + (upper - lower) * (number % count + 0.5) / count
            # The digits of the number to the base of `count` are the cells of the axes.
            number //= count
        starts.append(start)
    return starts


def _solve(goal: _Goal, begin: FloatArray, lower: FloatArray, upper: FloatArray) -> InverseSolution:
    """Solve by least squares within limits from one start (n_driven,), then by Newton's method; the status says how it went."""
    try:
        # A start must lie strictly inside the bounds, and may lie on a limit.
        fit = least_squares(goal.residual, begin, goal.slope, (lower - 1e-12, upper + 1e-12), xtol=1e-15,
                            ftol=1e-15, gtol=1e-15,
                            x_scale=np.where([axis.is_rotary for axis in goal.chain.driven_axes], 1.0, goal.size), max_nfev=30)
        positions = _polish(goal, fit.x, lower, upper)
    except ToolpointError as error:
        return InverseSolution({}, np.inf, np.inf, f"not reached: {error}")
    residual = goal.residual(positions)
    place, angle = float(np.linalg.norm(residual[:3])) * goal.size, float(np.linalg.norm(residual[3:]))
    pose = {axis.name: float(v) for axis, v in zip(goal.chain.driven_axes, positions, strict=True)}
    tolerance = OVERDETERMINED_TOLERANCE if goal.equations > len(positions) else INVERSE_TOLERANCE
    if place < tolerance * goal.size and angle < tolerance:
        return InverseSolution(pose, place, angle, "reached")
    held = [axis.name for axis, v in zip(goal.chain.driven_axes, positions, strict=True)
            if min(v - axis.lower, axis.upper - v) < 1e-6]
    why = f"; {', '.join(held)} at the end of travel" if held else ""
    residual_words = f"{1e3 * place:.3g} mm and {np.degrees(angle):.3g} deg are left{why}"
    remedy = "move the work, free the turn about the tool, or give a start on another branch"
    if goal.equations > len(positions):
        remedy = (f"{goal.equations} coordinates are asked of {len(positions)} axes: leave the direction out, or pose the "
                  "machine in its own coordinates")
    return InverseSolution(pose, place, angle, f"not reached: {residual_words}; {remedy}")


def _polish(goal: _Goal, positions: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Refine positions by full steps of Newton's method, each kept only where it reduces the residual."""
    size = float(np.abs(goal.residual(positions)).max())
    for _ in range(4):
        step = np.linalg.lstsq(goal.slope(positions), -goal.residual(positions), rcond=1e-12)[0]
        candidate = np.clip(positions + step, lower, upper)
        candidate_size = float(np.abs(goal.residual(candidate)).max())
        # Also where the new residual is not a number.
        if not candidate_size < size:
            break
        positions, size = candidate, candidate_size
    return positions
