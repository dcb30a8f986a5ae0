"""Reasons of unreachable poses: travel, tilt of a joint, a gap in a locked direction; forces in strained elastic loops."""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.kinematics.axis import AXES
from toolpoint.kinematics.chain import Pose
from toolpoint.kinematics.closure import Closure, Solution
from toolpoint.kinematics.looped_tree import LoopedTree

LOOP_GAP_TOLERANCE = 1e-8  # of the chain's length, or rad: gap left by rounding, and by files with ten digits


def limit_reasons(chain: LoopedTree, solution: Solution) -> list[str]:
    """Return for every pose the first axis or passive joint beyond its limits, empty where all are within."""
    reasons = [""] * len(solution.values)
    axis_positions = chain.positions_of(solution.values)
    checks = [(axis.name, axis_positions[:, k], axis.lower, axis.upper, axis.is_rotary)
              for k, axis in enumerate(chain.driven_axes)]
    checks += [(chain.step_name(step), solution.values[:, step], *limits, chain.steps[step].turns)
               for step, limits in chain.limits.items()]
    moved = chain.displacements_of(chain.motions_of(solution.values))
    for loop in chain.loops:
        if np.isfinite(loop.largest_tilt):
            checks.append((f"{loop.name} tilt", loop.tilt(loop.relative(moved)[1]), -np.inf, loop.largest_tilt, True))
    for name, checked, lower, upper, turns in checks:
        # m or rad: a limit that is asked for must be reachable, whatever rounding makes of it.
        slack = 1e-9
        for i in np.flatnonzero((checked < lower - slack) | (checked > upper + slack)):
            reasons[i] = reasons[i] or f"{name} would be at {_shown(checked[i], turns)}, beyond {_span(lower, upper, turns)}"
    return reasons


def _shown(value: float, turns: bool) -> str:
    return f"{np.degrees(value):.4g} deg" if turns else f"{value:.6g} m"


def _span(lower: float, upper: float, turns: bool) -> str:
    if np.isinf(lower):
        return _shown(upper, turns)
    return f"{_shown(lower, turns)} .. {_shown(upper, turns)}"


def gap_reasons(chain: LoopedTree, solution: Solution, closure: Closure) -> list[str]:
    """Return for every pose the loop that does not close in a locked direction, empty where all close."""
    reasons = [""] * len(solution.values)
    for loop, gap in zip(chain.loops, closure.gaps(solution.values), strict=True):
        locked = [i for i in loop.rows if AXES[i] not in loop.elastic]
        size = np.where(np.arange(6) < 3, chain.length, 1.0)
        is_open = (np.abs(gap[:, locked]) > LOOP_GAP_TOLERANCE * size[locked]).any(axis=1)
        for i in np.flatnonzero(is_open):
            reasons[i] = reasons[i] or _gap_words(chain, loop.name, gap[i], locked)
    return reasons


def _gap_words(chain: LoopedTree, name: str, gap: FloatArray, locked: list[int]) -> str:
    part = np.zeros(6)
    part[locked] = gap[locked]
    slide, turn = 1e3 * float(np.linalg.norm(part[:3])), 1e3 * float(np.linalg.norm(part[3:]))
    weighted = np.abs(part) / np.where(np.arange(6) < 3, chain.length, 1.0)
    directions = ", ".join(AXES[i] for i in np.flatnonzero(weighted > 0.1 * weighted.max()))
    return (f"loop joint {name} is torn open by {slide:.4g} mm and {turn:.4g} mrad in locked directions ({directions}); let "
            f"one axis drive both sides of the loop, or free {directions} in {name}, or directions of other joints of the loop")


def strain_notes(chain: LoopedTree, solution: Solution, closure: Closure) -> list[str]:
    """Return for every pose the strain of its elastic loops and the force of it in words, empty where there is none."""
    notes = [""] * len(solution.values)
    if not any(loop.elastic for loop in chain.loops):
        return notes
    for loop, gap in zip(chain.loops, closure.gaps(solution.values), strict=True):
        ways = [AXES.index(name) for name in loop.elastic]
        if not ways or loop.stiffness is None:
            continue
        size = np.where(np.arange(6) < 3, chain.length, 1.0)
        for i in np.flatnonzero((np.abs(gap[:, ways]) > LOOP_GAP_TOLERANCE * size[ways]).any(axis=1)):
            part = np.where(np.isin(np.arange(6), ways), gap[i], 0.0)
            force = loop.stiffness @ part
            pull, moment = np.linalg.norm(force[:3]), np.linalg.norm(force[3:])
            text = (f"loop joint {loop.name} is strained by {1e3 * np.linalg.norm(part[:3]):.4g} mm and "
                    f"{1e3 * np.linalg.norm(part[3:]):.4g} mrad at this pose, which takes {pull:.4g} N and {moment:.4g} N m in "
                    "its springs alone; the modes are those of the unstrained joints")
            notes[i] = notes[i] or text
    return notes


def first_fault(chain: LoopedTree, pose: Pose, solution: Solution) -> None:
    """Raise ToolpointError for the first unreachable pose of a batch."""
    for i, reason in enumerate(solution.reasons):
        if reason:
            _refuse(chain, pose, i, reason)


def _refuse(chain: LoopedTree, pose: Pose, index: int, reason: str) -> NoReturn:
    words = []
    for name, value in pose.items():
        values = np.atleast_1d(value)
        words.append(f"{name} {chain.axis(name).words(float(values[index if values.size > 1 else 0]))}")
    raise ToolpointError(f"pose {', '.join(words) or 'at rest'}: {reason}", argument="pose")
