r"""Condition numbers of poses by kind of singularity, and the nearest singular pose along an axis.

With all steps s of the joints the loops ask J ds = 0. *Actuation*: the columns of the passive steps lose rank, so the machine
can move with its axes held. *Constraint*: J as a whole loses rank, so the joints gain a motion that no axis commands. *Lost
motion*: axes move and the tool does not follow in some direction. Rows and columns are weighed by a length, so that metres and
radians compare. Source: Zlatanov, Bonev, Gosselin, Constraint singularities of parallel mechanisms, ICRA 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, FloatArray, ToolpointError, fail, positive
from toolpoint.kinematics.chain import Pose
from toolpoint.kinematics.closed import ClosedChain
from toolpoint.kinematics.closure import Closure
from toolpoint.kinematics.tree import TreeChain

KINDS = ("actuation", "constraint", "lost motion")
SINGULAR_CONDITION_NUMBER = 1e6  # condition number from which a pose counts as singular
MAX_EDGE_INVERSE_CONDITION = 0.02  # inverse condition number at the edge of reach, below which the edge is a singular pose


@dataclass(frozen=True, eq=False)
class PoseCondition:
    """Condition numbers (P,) of each kind at poses, infinite where singular; `length` (m) weighs metres against rad."""

    actuation: FloatArray
    constraint: FloatArray
    lost_motion: FloatArray
    length: float

    def reasons(self, limit: float = SINGULAR_CONDITION_NUMBER) -> list[str]:
        """Return the kinds of singularity of every pose in words, empty where it has none."""
        numbers = np.stack([self.actuation, self.constraint, self.lost_motion], axis=-1)
        return [", ".join(f"singular pose ({kind}, condition number {row[k]:.3g} with lengths over {self.length:.3g} m)"
                          for k, kind in enumerate(KINDS) if not row[k] < limit) for row in numbers]


def pose_condition(chain: TreeChain, pose: Pose, link: int | None = None, *, length: float | None = None) -> PoseCondition:
    """Return the condition numbers of a chain at a batch of poses.

    Parameters
    ----------
    chain : TreeChain or ClosedChain
    pose : mapping of axis name to positions
    link : int, optional
        The link of the tool, for lost motion; left out of account where left out.
    length : float, optional
        m; the size of the chain where left out.

    Raises
    ------
    ToolpointError
        For a pose that is unreachable, and a length that is not positive.

    Examples
    --------
    A planar arm of two links of 1 m, stretched: the tip's rates for both axes are parallel.

    >>> from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow, arm_chain
    >>> arm = arm_chain([ArmRow("A", a=1.0), ArmRow("B", a=1.0)])
    >>> bool(pose_condition(arm, {"A": 0.0, "B": 1.5}, link=1).lost_motion[0] < 10)
    True
    """
    size = positive("length", length if length is not None else getattr(chain, "length", 1.0))
    values = chain.step_values(pose)
    actuation: FloatArray = np.ones(len(values))
    constraint: FloatArray = np.ones(len(values))
    if isinstance(chain, ClosedChain) and chain.loops and chain.passive:
        actuation, constraint = _loop_conditions(chain, values, size)
    lost_motion: FloatArray = np.ones(len(values))
    if link is not None and chain.driven_axes:
        lost_motion = _tool_condition(chain, pose, link, size)
    return PoseCondition(actuation, constraint, lost_motion, size)


def _loop_conditions(chain: ClosedChain, values: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    closure = Closure(chain, None)
    # Elastic directions count like locked ones here: they hold a loop together as well.
    rows = np.array([1 / length if way < 3 else 1.0 for loop in chain.loops for way in loop.rows])
    rate = closure.evaluate(values, {})[1] * (rows / closure.weights)[:, None]
    step_scale = np.array([1.0 if step.turns else 1 / length for step in chain.steps])
    rank = _ranks(closure, chain, step_scale)
    passive = np.linalg.svd(rate[:, :, list(chain.passive_steps)] / step_scale[list(chain.passive_steps)], compute_uv=False)
    all_steps = np.linalg.svd(rate / step_scale, compute_uv=False)
    return _condition_numbers(passive, rank[0]), _condition_numbers(all_steps, rank[1])


def _ranks(closure: Closure, chain: ClosedChain, step_scale: FloatArray) -> tuple[int, int]:
    """Return the ranks of both matrices at the reference pose: redundant equations are no singular pose."""
    rate = closure.evaluate(np.asarray(chain.start), {})[1][0] / step_scale
    ranks = []
    for matrix in (rate[:, list(chain.passive_steps)], rate):
        singular = np.linalg.svd(matrix, compute_uv=False)
        ranks.append(int((singular > 1e-9 * singular.max(initial=0.0)).sum()))
    return ranks[0], ranks[1]


def _condition_numbers(singular: FloatArray, rank: int) -> FloatArray:
    """Return largest over rank-th singular value of every pose, infinite where the latter is rounding, (P,)."""
    if rank == 0:
        return np.ones(len(singular))
    with np.errstate(divide="ignore"):
        return np.asarray(singular[:, 0] / np.where(singular[:, rank - 1] < 1e-15 * singular[:, 0], 0.0, singular[:, rank - 1]))


def _tool_condition(chain: TreeChain, pose: Pose, link: int, length: float) -> FloatArray:
    twists = chain.axis_twists(pose, link)
    active = np.abs(twists).max(axis=(0, 2)) > 0
    weights = np.array([1 / length] * 3 + [1.0] * 3)
    scale = np.array([1.0 if axis.is_rotary else 1 / length for axis in chain.driven_axes])[active]
    matrix = np.swapaxes(twists[:, active] * weights / scale[:, None], -1, -2)
    singular = np.linalg.svd(matrix, compute_uv=False)
    return _condition_numbers(singular, min(int(active.sum()), 6))


def nearest_singularity(chain: TreeChain, pose: Pose, axis: str, *, link: int | None = None, samples: int = 121
                        ) -> tuple[float, str] | None:
    """Return the distance (m or rad) along an axis from a pose to the nearest singular one within its travel, and its kind.

    The inverse condition number is sampled over the travel and its minima are refined; None where none is singular. Where the
    travel ends before the chain does, that end counts as out of reach, not as singular.
    """
    axes_by_name = {each.name: each for each in chain.axes}
    if axis not in axes_by_name:
        fail("axis", repr(axis), f"must be of {', '.join(axes_by_name)}")
    part = axes_by_name[axis]
    start = float(np.atleast_1d(pose.get(axis, part.reference_position))[0])
    reach = np.pi if part.is_rotary else 4 * float(getattr(chain, "length", 1.0))
    position_min, position_max = max(part.lower, start - reach), min(part.upper, start + reach)
    positions = np.linspace(position_min, position_max, samples)
    inverse = _inverse_conditions(chain, (pose, axis), positions, link)
    results = [_refine_minimum(chain, (pose, axis), (positions[i - 1], positions[i + 1]), link)
               for i in range(1, samples - 1) if _is_local_minimum(inverse, i)]
    is_unreachable: BoolArray = np.asarray(np.isnan(inverse).all(axis=1))
    for i in np.flatnonzero(is_unreachable[1:] != is_unreachable[:-1]):
        span = (positions[i + 1], positions[i]) if is_unreachable[i] else (positions[i], positions[i + 1])
        results.append(_reach_edge(chain, (pose, axis), span, link))
    singular = [(abs(position - start), kind) for position, kind in results if kind]
    return min(singular) if singular else None


def _reach_edge(chain: TreeChain, line: tuple[Pose, str], span: tuple[float, float], link: int | None) -> tuple[float, str]:
    """Return the edge of reach along an axis, and the kind of singular pose there; empty where a limit ends the travel."""
    (pose, axis), (inside, outside) = line, span
    assert isinstance(chain, ClosedChain)
    values = chain.solve({**pose, axis: inside}).values
    for _ in range(4):  # each attempt goes on to within 1/512 of what was left
        solution = chain.solve({**pose, axis: outside}, start=values)
        if solution.part[0] >= 1:
            break
        inside, values = inside + float(solution.part[0]) * (outside - inside), solution.values
    row = _inverse_condition(chain, {**pose, axis: inside}, link)
    # Near such an end the condition falls with the root of the distance, so rounding leaves more of it than elsewhere.
    return (inside, KINDS[int(np.nanargmin(row))] if not np.isnan(row).all() and np.nanmin(row) < MAX_EDGE_INVERSE_CONDITION
            else "")


def _is_local_minimum(inverse: FloatArray, i: int) -> bool:
    # Flat stretches, whose values differ by rounding only, are no dips.
    return bool((inverse[i] < (1 - 1e-9) * np.minimum(inverse[i - 1], inverse[i + 1])).any())


def _inverse_conditions(chain: TreeChain, line: tuple[Pose, str], positions: FloatArray, link: int | None) -> FloatArray:
    """Return the inverse condition numbers of each kind at positions of an axis, (n_positions, 3), nan where unreachable."""
    (pose, axis), result = line, np.full((len(positions), 3), np.nan)
    good = np.ones(len(positions), bool)
    if isinstance(chain, ClosedChain):
        good, _ = chain.reachable({**pose, axis: positions})
    if good.any():
        condition = pose_condition(chain, {**pose, axis: positions[good]}, link)
        result[good] = 1 / np.stack([condition.actuation, condition.constraint, condition.lost_motion], axis=-1)
    return result


def _inverse_condition(chain: TreeChain, pose: Pose, link: int | None) -> FloatArray:
    try:
        condition = pose_condition(chain, pose, link)
    except ToolpointError:
        return np.full(3, np.nan)
    return 1 / np.array([condition.actuation[0], condition.constraint[0], condition.lost_motion[0]])


def _refine_minimum(chain: TreeChain, line: tuple[Pose, str], span: tuple[float, float], link: int | None) -> tuple[float, str]:
    """Minimise the inverse condition number by golden section; the kind is empty where the minimum is above 1e-5."""
    (pose, axis), (lower, upper) = line, span
    golden = (np.sqrt(5) - 1) / 2

    def value(position: float) -> float:
        row = _inverse_condition(chain, {**pose, axis: position}, link)
        return 0.0 if np.isnan(row).all() else float(np.nanmin(row))

    for _ in range(48):
        left, right = upper - golden * (upper - lower), lower + golden * (upper - lower)
        lower, upper = (lower, right) if value(left) < value(right) else (left, upper)
    position = (lower + upper) / 2
    row = _inverse_condition(chain, {**pose, axis: position}, link)
    if np.isnan(row).all() or np.nanmin(row) > 1e-5:
        return position, ""
    return position, KINDS[int(np.nanargmin(row))]
