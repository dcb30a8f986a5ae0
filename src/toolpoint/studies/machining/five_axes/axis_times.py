"""Times and feeds of a five-axis program within the limits of the machine's axes, linear and rotary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.drives.program.axis_jerk import STATED_EXCESS, AxisMotion, MotionBounds, longest_window, move_within_axes
from toolpoint.drives.program.axis_limits import AxisTimes, plan_within_axes, sight_ceiling
from toolpoint.drives.program.path import Path
from toolpoint.studies.machining.five_axes.axis_course import AxisCourse
from toolpoint.studies.machining.five_axes.turned_path import TurnedPath
from toolpoint.studies.machining.program_path import sight_words
from toolpoint.studies.machining.setup import MachiningSetup

DEFAULT_CORNER_TOLERANCE = 1e-5  # m, by which linear axes round corners between blocks
CORNER_TURN = 1e-4  # rad, by which rotary axes do
_REACHED_SHARE = 0.9  # of the programmed feed, from which on it counts as reached
_JOINT_TOLERANCE = 1e-9  # m and rad, between the ends of two steps


@dataclass(frozen=True, eq=False)
class StepTimes:
    """Times of the steps (n,), s: nominal at the programmed feed, and planned; words about where they come from.

    plan : None where no axis has a limit; stops : (n + 1,) at the joints, see `plan_within_axes`.
    """

    nominal: FloatArray
    plan: AxisTimes | AxisMotion | None
    words: str
    stops: np.ndarray

    @property
    def times(self) -> FloatArray:
        """Times of the steps, s."""
        return self.nominal if self.plan is None else self.plan.times

    @property
    def peaks(self) -> FloatArray:
        """Largest ratio of speed to the programmed one in every step."""
        return np.ones(self.nominal.size) if self.plan is None else self.plan.peaks


def plan_steps(path: Path, turned: TurnedPath, course: AxisCourse | None, *, setup: MachiningSetup) -> StepTimes:
    """Return the times of the steps: within the limits of every axis where the setup has any and the axes are known."""
    lengths = np.linalg.norm(path.end - path.start, axis=1)
    way = np.where(lengths > 0, lengths, turned.turn)
    time = way / np.where(path.feed > 0, path.feed, 1.0) / np.maximum(turned.steps, 1)
    nominal = time[turned.moves.block]
    limits, turn = setup.planned, (setup.rotary_speed, setup.rotary_acceleration, setup.rotary_jerk)
    stops = _stops(path, turned)
    if course is None or not nominal.size or (limits is None and not np.isfinite(turn).any()):
        return StepTimes(nominal, None, "feeds are those programmed, at the tip; loads take the feed of the middle of the "
                         "cutting edge; limits of axes and of their accelerations are not in the times", stops)
    linear = (np.inf, np.inf, np.inf) if limits is None else (limits.speed, limits.acceleration, limits.jerk)
    tolerance = (setup.drives.corner_tolerance if setup.drives is not None else 0.0) or DEFAULT_CORNER_TOLERANCE
    bounds = MotionBounds(*(np.array([linear[k]] * 3 + [turn[k]] * 3) for k in range(3)))
    plan = _plan(course.positions, nominal, bounds, stops=stops, tolerance=np.array([tolerance] * 3 + [CORNER_TURN] * 3),
                 line=path.line[turned.moves.block], look_ahead=setup.look_ahead)
    words = [_words("X, Y, Z", *linear, scale=1e3, unit="mm")] if limits is not None else []
    words += [_words("A, B, C", *turn, scale=180 / np.pi, unit="°")]
    return StepTimes(nominal, plan, "feeds are the largest of each block within the limits of each axis ("
                     f"{'; '.join(words)}), corners between blocks rounded by {1e6 * tolerance:g} µm and {1e3 * CORNER_TURN:g} "
                     f"mrad{_jerk_words(plan)}; {sight_words(setup.look_ahead)}", stops)


def _plan(position: FloatArray, nominal: FloatArray, bounds: MotionBounds, *, stops: np.ndarray, tolerance: FloatArray,
          line: np.ndarray, look_ahead: int | None) -> AxisTimes | AxisMotion:
    """Return the times within speed and acceleration, and within the jerk of the axes that have one."""
    has_jerk = bool(np.isfinite(bounds.jerk).any())
    options = {"stops": stops, "corner_tolerance": tolerance}
    ceiling = None if look_ahead is None else sight_ceiling(
        position, nominal, speed=bounds.speed, acceleration=bounds.acceleration, line=line, blocks=look_ahead,
        window=longest_window(bounds) if has_jerk else 0.0, **options)
    if has_jerk:
        return move_within_axes(position, nominal, bounds, ceiling=ceiling, **options)
    return plan_within_axes(position, nominal, speed=bounds.speed, acceleration=bounds.acceleration, ceiling=ceiling, **options)


def _words(name: str, speed: float, acceleration: float, jerk: float, *, scale: float, unit: str) -> str:
    """Return the limits of axes in words; those that are not known are left out."""
    numbers = [(speed * scale * (60 if unit == "mm" else 1), f"{unit}/min" if unit == "mm" else f"{unit}/s"),
               (acceleration * scale, f"{unit}/s^2"), (jerk * scale, f"{unit}/s^3")]
    stated = [f"{value:g} {each}" for value, each in numbers if np.isfinite(value)]
    return f"{name} {', '.join(stated)}" if stated else f"{name} none"


def _jerk_words(plan: AxisTimes | AxisMotion) -> str:
    if isinstance(plan, AxisTimes):
        return "; jerk is not bounded"
    excess = 100 * STATED_EXCESS
    free = "" if np.isfinite(plan.limits.jerk).all() else "; jerk is not bounded of axes without a limit of it"
    return f"; no axis passes its speed, acceleration or jerk by more than {excess:g} %{free}"


def _stops(path: Path, turned: TurnedPath) -> np.ndarray:
    """Return 2 at joints of steps where all axes stand still, 1 at corners between blocks, 0 within a block, (n + 1,)."""
    motion = turned.moves
    stops = np.full(motion.block.size + 1, 2)
    if motion.block.size < 2:
        return stops
    is_joint = motion.block[1:] != motion.block[:-1]
    gap = np.linalg.norm(motion.tips[1:, 0] - motion.tips[:-1, 1], axis=1) + np.abs(
        np.nan_to_num(turned.angles_at_ends[1:, 0] - turned.angles_at_ends[:-1, 1])).max(axis=1)
    rests = is_joint & (path.stop[motion.block[:-1]] | path.rapid[motion.block[:-1]] | path.rapid[motion.block[1:]])
    stops[1:-1] = np.where(rests | (gap > _JOINT_TOLERANCE), 2, is_joint.astype(int))
    return stops


def question_feeds(times: StepTimes, turned: TurnedPath, path: Path, *, setup: MachiningSetup) -> list[Doubt]:
    """Return doubts about rotary axes without limits, and about cutting feeds that the axes do not reach."""
    turns = bool(np.abs(np.diff(np.nan_to_num(turned.angles_at_ends), axis=1)).max(initial=0.0) > 0)
    doubts = []
    if turns and not np.isfinite([setup.rotary_speed, setup.rotary_acceleration]).all():
        doubts.append(Doubt("feed", "rotary axes turn and have no limit of speed or acceleration here: real feeds may be lower",
                            "give `rotary_speed` and `rotary_acceleration`"))
    block = turned.moves.block
    is_cut = ~path.rapid[block]
    if times.plan is None or not is_cut.any():
        return doubts
    peak = np.zeros(path.count)
    np.maximum.at(peak, block[is_cut], times.peaks[is_cut])
    cutting = np.unique(block[is_cut])
    slowest = int(cutting[np.argmin(peak[cutting])])
    count = int((peak[cutting] < _REACHED_SHARE).sum())
    if count:
        doubts.append(Doubt("feed", f"{count} of {cutting.size} cutting blocks do not reach their feed, line "
                            f"{path.line[slowest]} only {100 * peak[slowest]:.0f} % of it, by the limits of the axes",
                            "loads are those of the feed that is reached", figure=1 - float(peak[slowest])))
    return doubts
