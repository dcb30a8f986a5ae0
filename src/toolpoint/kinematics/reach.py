"""Why a pose cannot be: travel, tilt of a joint, a gap in a locked direction; and what force an elastic loop would need."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.kinematics.axis import AXES

if TYPE_CHECKING:
    from toolpoint.kinematics.chain import Pose
    from toolpoint.kinematics.closed import ClosedChain
    from toolpoint.kinematics.closure import Closure, Solution

GAP = 1e-8  # of the chain's length and in rad: what rounding leaves, and files with ten digits
STRAIN = 1e-8


def limit_reasons(chain: ClosedChain, solution: Solution) -> list[str]:
    """Return for every pose the first axis or passive joint beyond its limits, empty where all are within."""
    reasons = [""] * len(solution.values)
    positions = chain.positions_of(solution.values)
    checks = [(axis.name, positions[:, k], axis.lower, axis.upper, axis.is_rotary)
              for k, axis in enumerate(chain.driven_axes)]
    checks += [(chain.step_name(step), solution.values[:, step], *limits, chain.steps[step].turns)
               for step, limits in chain.limits.items()]
    moved = chain.displacements_of(chain.motions_of(solution.values))
    for loop in chain.loops:
        if np.isfinite(loop.largest_tilt):
            checks.append((f"{loop.name} tilt", loop.tilt(loop.relative(moved)[1]), -np.inf, loop.largest_tilt, True))
    for name, at, low, high, turns in checks:
        slack = 1e-9
        for i in np.flatnonzero((at < low - slack) | (at > high + slack)):
            reasons[i] = reasons[i] or f"{name} would be at {_shown(at[i], turns)}, beyond {_span(low, high, turns)}"
    return reasons


def _shown(value: float, turns: bool) -> str:
    return f"{np.degrees(value):.4g} deg" if turns else f"{value:.6g} m"


def _span(low: float, high: float, turns: bool) -> str:
    if np.isinf(low):
        return _shown(high, turns)
    return f"{_shown(low, turns)} .. {_shown(high, turns)}"


def gap_reasons(chain: ClosedChain, solution: Solution, closure: Closure) -> list[str]:
    """Return for every pose the loop that does not close in a locked direction, empty where all close."""
    reasons = [""] * len(solution.values)
    for loop, gap in zip(chain.loops, closure.gaps(solution.values), strict=True):
        locked = [i for i in loop.rows if AXES[i] not in loop.elastic]
        size = np.where(np.arange(6) < 3, chain.length, 1.0)
        is_open = (np.abs(gap[:, locked]) > GAP * size[locked]).any(axis=1)
        for i in np.flatnonzero(is_open):
            reasons[i] = reasons[i] or _gap_words(chain, loop.name, gap[i], locked)
    return reasons


def _gap_words(chain: ClosedChain, name: str, gap: FloatArray, locked: list[int]) -> str:
    part = np.zeros(6)
    part[locked] = gap[locked]
    slide, turn = 1e3 * float(np.linalg.norm(part[:3])), 1e3 * float(np.linalg.norm(part[3:]))
    weighed = np.abs(part) / np.where(np.arange(6) < 3, chain.length, 1.0)
    worst = ", ".join(AXES[i] for i in np.flatnonzero(weighed > 0.1 * weighed.max()))
    return (f"loop joint {name} is torn open by {slide:.4g} mm and {turn:.4g} mrad in locked directions ({worst}); let one "
            f"axis drive both sides of the loop, or free {worst} in {name}, or directions of other joints of the loop")


def strain_notes(chain: ClosedChain, solution: Solution) -> list[str]:
    """Return for every pose what its elastic loops would have to be strained by, and with which force, empty where nothing."""
    notes = [""] * len(solution.values)
    if not any(loop.elastic for loop in chain.loops):
        return notes
    for loop, gap in zip(chain.loops, chain.closure.gaps(solution.values), strict=True):
        ways = [AXES.index(name) for name in loop.elastic]
        if not ways or loop.stiffness is None:
            continue
        size = np.where(np.arange(6) < 3, chain.length, 1.0)
        for i in np.flatnonzero((np.abs(gap[:, ways]) > STRAIN * size[ways]).any(axis=1)):
            part = np.where(np.isin(np.arange(6), ways), gap[i], 0.0)
            force = loop.stiffness @ part
            pull, moment = np.linalg.norm(force[:3]), np.linalg.norm(force[3:])
            text = (f"loop joint {loop.name} is strained by {1e3 * np.linalg.norm(part[:3]):.4g} mm and "
                    f"{1e3 * np.linalg.norm(part[3:]):.4g} mrad at this pose, which takes {pull:.4g} N and {moment:.4g} N m in "
                    "its springs alone; the modes are those of the unstrained joints")
            notes[i] = notes[i] or text
    return notes


def first_fault(chain: ClosedChain, pose: Pose, solution: Solution) -> None:
    """Raise for the first pose of a batch that cannot be."""
    for i, reason in enumerate(solution.reasons):
        if reason:
            _refuse(chain, pose, i, reason)


def _refuse(chain: ClosedChain, pose: Pose, at: int, reason: str) -> NoReturn:
    words = []
    for name, value in pose.items():
        values = np.atleast_1d(value)
        words.append(f"{name} {chain.axis(name).words(float(values[at if values.size > 1 else 0]))}")
    raise ToolpointError(f"pose {', '.join(words) or 'at rest'}: {reason}", argument="pose")
