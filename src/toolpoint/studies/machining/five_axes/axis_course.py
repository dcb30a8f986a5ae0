r"""Positions of a machine's own axes along a five-axis program: X, Y and Z that bring the tip to its place at every turn.

With its rotary axes at rest the tip's place p in the work is affine in the linear axes q: :math:`p = p_0 + J (q - q_0)`, so
that they are solved for all steps at once, also beyond their travels. Machines whose linear axes turn the tool have no such
course.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.studies.machining.five_axes.tool_directions import ROTARY_LETTERS, RotaryAxes
from toolpoint.studies.machining.five_axes.turned_path import TurnedPath

LINEAR_LETTERS = "XYZ"
_AXIS_SLOPE_STEP = 0.01  # m, of a linear axis from its position at the program's zero
_AXIS_TURN_STEP = 1e-4  # rad, of a rotary axis to both sides of its position
_PLACE_TOLERANCE = 1e-8  # m, between a place and that of the solved axes
_STEPS_AT_ONCE = 20_000  # whose poses are computed together: 0.2 GB
_TRAVEL_TOLERANCE = 1e-9  # m


@dataclass(frozen=True, eq=False)
class AxisCourse:
    """Positions of the axes at both ends of every step, m and rad.

    linear : (n, 2, 3) of X, Y and Z; rotary : (n, 2, 3) of A, B and C, zero for those that the machine lacks; slopes :
    (n, 2, 3, 6) motion of the tip in the work over that of X, Y, Z, A, B and C (columns), each alone; zero for those that the
    machine lacks.
    """

    linear: FloatArray
    rotary: FloatArray
    slopes: FloatArray

    @property
    def positions(self) -> FloatArray:
        """Positions of X, Y, Z, A, B and C, (n, 2, 6)."""
        return np.concatenate([self.linear, self.rotary], axis=2)


def find_axis_course(rotary: RotaryAxes, turned: TurnedPath) -> AxisCourse | None:
    """Return the course of the axes; none for a machine whose X, Y and Z do not move the tip alone and evenly."""
    axes = {axis.name: axis for axis in rotary.machine.chain.axes}
    if any(letter not in axes or axes[letter].is_rotary for letter in LINEAR_LETTERS):
        return None
    tips, angles = turned.moves.tips.reshape(-1, 3), turned.angles_at_ends.reshape(-1, 3)
    linear, slopes = np.zeros(tips.shape), np.zeros((len(tips), 3, 6))
    for first in range(0, len(tips), _STEPS_AT_ONCE):
        part = slice(first, first + _STEPS_AT_ONCE)
        linear[part], slopes[part] = _solve(rotary, tips[part], angles[part])
    middle = len(tips) // 2
    if not _is_affine(rotary, tips[middle], angles[middle], linear[middle]):
        return None
    shape = (len(turned.moves.tips), 2, 3)
    return AxisCourse(linear.reshape(shape), turned.angles_at_ends.reshape(shape), slopes.reshape(*shape, 6))


def _solve(rotary: RotaryAxes, tips: FloatArray, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return X, Y and Z (n, 3), m, that bring the tip to its places, and the slopes of the tip over all axes (n, 3, 6)."""
    start = _start(rotary)
    origin = tool_place(rotary.machine, dict(rotary.setup.zero))[0][0]
    reference, slopes = _affine(rotary, angles)
    moved = np.linalg.solve(slopes, (origin + tips - reference)[..., None])[..., 0]
    turned = np.zeros((len(tips), 3, 3))
    for k, (lower, upper) in zip(rotary.indices, rotary.limits, strict=True):
        ends = np.stack([np.maximum(angles[:, k] - _AXIS_TURN_STEP, lower), np.minimum(angles[:, k] + _AXIS_TURN_STEP, upper)])
        places = []
        for end in ends:
            at_end = angles.copy()
            at_end[:, k] = end
            other_reference, other_slopes = _affine(rotary, at_end)
            places.append(other_reference + np.einsum("nij,nj->ni", other_slopes, moved))
        turned[:, :, k] = (places[1] - places[0]) / (ends[1] - ends[0])[:, None]
    return start + moved, np.concatenate([slopes, turned], axis=2)


def _start(rotary: RotaryAxes) -> FloatArray:
    return np.array([rotary.setup.zero.get(letter, 0.0) for letter in LINEAR_LETTERS])


def _affine(rotary: RotaryAxes, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the tip (n, 3), m, with X, Y and Z at the program's zero, and its slopes over them (n, 3, 3)."""
    start = _start(rotary)
    reference = _tip(rotary, angles, start)
    columns = []
    for k, letter in enumerate(LINEAR_LETTERS):
        axis = next(axis for axis in rotary.machine.chain.axes if axis.name == letter)
        shift = np.zeros(3)
        shift[k] = _AXIS_SLOPE_STEP if start[k] + _AXIS_SLOPE_STEP <= axis.upper else -_AXIS_SLOPE_STEP
        columns.append((_tip(rotary, angles, start + shift) - reference) / shift[k])
    return reference, np.stack(columns, axis=2)


def _tip(rotary: RotaryAxes, angles: FloatArray, linear: FloatArray) -> FloatArray:
    """Return the tip in the work, (n, 3) m, with X, Y and Z (3,) at rest and A, B and C (n, 3) turned."""
    pose: dict[str, ArrayLike] = dict(zip(LINEAR_LETTERS, linear.tolist(), strict=True))
    pose |= {ROTARY_LETTERS[k]: angles[:, k] for k in rotary.indices}
    return tool_place(rotary.machine, {**rotary.setup.zero, **pose})[0]


def _is_affine(rotary: RotaryAxes, tip: FloatArray, angles: FloatArray, linear: FloatArray) -> bool:
    """Whether solved axes bring the tip to its place; True beyond the travels, where the chain is not asked."""
    axes = {axis.name: axis for axis in rotary.machine.chain.axes}
    if any(not axes[letter].lower <= value <= axes[letter].upper for letter, value in zip(LINEAR_LETTERS, linear, strict=True)):
        return True
    origin = tool_place(rotary.machine, dict(rotary.setup.zero))[0][0]
    return bool(np.abs(_tip(rotary, angles[None], linear)[0] - origin - tip).max() < _PLACE_TOLERANCE)


def question_travels(rotary: RotaryAxes, course: AxisCourse, *, line: np.ndarray, rapid: np.ndarray) -> list[Doubt]:
    """Return a grave doubt for every linear axis whose travel the program leaves while it cuts.

    line, rapid : (n,) of the steps.
    """
    axes = {axis.name: (axis.lower, axis.upper) for axis in rotary.machine.chain.axes}
    doubts = []
    for k, letter in enumerate(LINEAR_LETTERS):
        lower, upper = axes[letter]
        places = course.linear[:, 1, k]
        excess = np.where(rapid, -1.0, np.maximum(lower - places, places - upper))
        farthest = int(np.argmax(excess))
        if excess[farthest] > _TRAVEL_TOLERANCE:
            doubts.append(Doubt(f"travel of {letter}", f"line {line[farthest]} goes to {1e3 * places[farthest]:.4g} mm with "
                                f"the tool turned, {1e3 * excess[farthest]:.4g} mm beyond {1e3 * lower:g} .. {1e3 * upper:g} "
                                "mm", "place the part otherwise with `zero`", grave=True))
    return doubts
