r"""Servo along a five-axis program under its cutting forces: deviation of the tip across its path in the work.

The tip moves by :math:`J (q - q_s)` beside its path, q the positions of the axes, linear and rotary, q_s their set points as
late as the servo is, J of the pose that belongs to these. Axes that are not in the drive file are taken as equally late.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint._doubt import Doubt
from toolpoint.drives.accuracy.lag import delay, estimate_lag
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.axis_jerk import AxisMotion
from toolpoint.drives.program.command import Command
from toolpoint.drives.simulation.simulate import ServoResult
from toolpoint.machine import Machine
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.machining.errors.servo_course import (
    MAX_SERVO_TIME,
    ServoCourse,
    axis_of_largest,
    drive_use,
    with_remarks,
)
from toolpoint.studies.machining.five_axes.axis_course import LINEAR_LETTERS, AxisCourse
from toolpoint.studies.machining.five_axes.axis_times import StepTimes
from toolpoint.studies.machining.five_axes.tool_directions import ROTARY_LETTERS
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.servos.drive_experiment import simulate_set_points, smooth_set_points
from toolpoint.studies.servos.drive_structure import structure_of

AXIS_LETTERS = LINEAR_LETTERS + "".join(ROTARY_LETTERS)
_GAP_TIME, _GAP_SPEED = 0.3, 0.5  # s and m/s (rad/s): of moves between steps whose way is not known
MIN_KNOT_GAP = 1e-9  # s, between two knots of set points: nearer ones are one
_NO_SAMPLES = np.zeros(0)


@dataclass(frozen=True, eq=False)
class TurnedServoCourse(ServoCourse):
    """Motion of the servo along a five-axis program; at the samples that cut, (n,): step under way, and deviation (n, 3) of the
    tip across its path in the work, m, without the cutting force and with what the motors yield under it."""

    step: IndexArray = field(default_factory=lambda: np.zeros(0, np.int64))
    deviation: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True, eq=False)
class _Timeline:
    """Knots of the set points: time (k,), positions of X, Y, Z, A, B and C (k, 6), their speeds; step that ends at each, -1 for
    none."""

    time: FloatArray
    position: FloatArray
    speed: FloatArray
    step: np.ndarray

    def step_at(self, time: FloatArray) -> np.ndarray:
        """Return the step under way at times; -1 between steps."""
        return self.step[np.minimum(np.searchsorted(self.time, time, side="left"), self.time.size - 1)]


def follow_turned(laid: ProgramPath, removed: TurnedRemoval, force: FloatArray, *, drives: DriveDescription | None,
                  course: AxisCourse | None, times: StepTimes, machine: Machine | None) -> TurnedServoCourse | Doubt | None:
    """Return the motion of the servo along a five-axis program; None without drives, a doubt where it is not computed.

    force : (places, 3) mean cutting force on the tool along its own axes, N.

    Raises ToolpointError for an unstable servo.
    """
    if drives is None:
        return None
    if course is None:
        return Doubt("servo", "not simulated: what X, Y and Z do while the tool turns is known of a machine with these axes "
                     "alone", "give `machine`")
    timeline = _lay_time(laid, course, times)
    if timeline.time[-1] > MAX_SERVO_TIME:
        return Doubt("servo", f"not simulated: the program lasts {timeline.time[-1]:.0f} s, at most {MAX_SERVO_TIME:g} s are",
                     "cut the program to the part of interest")
    with_ends = any(axis.ends is not None for axis in drives.axes.values())
    servo = build_servo(drives, structure_of(drives, machine if with_ends else None))
    columns = [AXIS_LETTERS.index(name.upper()) for name in drives.axes]
    command = _command(timeline, columns, servo.controllers[0].position.sample_time)
    step = servo.controllers[0].sample_times[0] / drives.substeps
    assert removed.frame is not None
    # By virtual work: J^T takes a force at the tip to the axes, as J takes their motions to the tip.
    work_force = np.einsum("nij,nj->ni", removed.frame, force)
    slopes = course.slopes[removed.piece, np.where(removed.at_start, 0, 1)]
    axis_force = np.einsum("nia,ni->na", slopes, work_force)
    instants = np.arange(round(command.duration / step) + 1) * step
    load = _at_places(timeline, removed, axis_force[:, columns], instants)
    runs = [simulate_set_points(drives, servo, command, load=each) for each in (None, load)]
    largest = np.zeros(laid.path.count)
    along = [column for column in columns if column < len(LINEAR_LETTERS)]
    np.maximum.at(largest, laid.moves.block[removed.piece], np.abs(axis_force[:, along]).max(axis=1, initial=0.0))
    sampled = _Sampled(laid, removed, course, timeline, columns, command)
    return with_remarks(_course(sampled, servo, drives, runs, force=largest), laid, drives,
                        notes=_notes(drives, course))


def check_drives(drives: DriveDescription | None, machine: Machine | None) -> None:
    """Refuse drives of axes that do not stand in the machine, or are linear there and behind a reducer, or the reverse."""
    if drives is None:
        return
    turns = {} if machine is None else {axis.name.upper(): axis.is_rotary for axis in machine.chain.axes}
    for name, axis in drives.axes.items():
        letter, has_reducer = name.upper(), axis.mechanics.kind == "reducer"
        if letter not in AXIS_LETTERS or (turns and letter not in turns):
            fail("drives", f"axis {name}", f"must be one of {', '.join(turns) if turns else ', '.join(AXIS_LETTERS)}")
        if has_reducer != (letter not in LINEAR_LETTERS):
            fail("drives", f"axis {name}: mechanics {axis.mechanics.kind}", "must be reducer for A, B and C, and for no other "
                 "axis")


def _notes(drives: DriveDescription, course: AxisCourse) -> tuple[str, ...]:
    driven = {name.upper() for name in drives.axes}
    lacks = [f"axis {letter} is not in the drive file and is taken in step with the others" for letter in LINEAR_LETTERS
             if letter not in driven]
    turning = [letter for k, letter in enumerate(ROTARY_LETTERS) if np.ptp(course.rotary[:, :, k]) > 0 and letter not in driven]
    if turning:
        lacks.append(f"{', '.join(turning)}: rotary axes are not in the drive file and are taken in step with X, Y and Z, as "
                     "late as these: their own errors are not in the contour")
    if driven & set(ROTARY_LETTERS):
        lacks.append("Errors of rotary axes are counted at the tip; by how much they lean the edge is not.")
    return tuple(lacks)


def _lay_time(laid: ProgramPath, course: AxisCourse, times: StepTimes) -> _Timeline:
    """Return the knots: ends of steps, dwells, and moves between steps that do not meet."""
    block, path = laid.moves.block, laid.path
    begin, end = course.positions[:, 0], course.positions[:, 1]
    gap = np.zeros(len(begin))
    gap[1:] = np.abs(begin[1:] - end[:-1]).max(axis=1)
    pause = np.where(gap > 1e-9, _GAP_TIME + gap / _GAP_SPEED, 0.0)
    ends_block = np.append(block[1:] != block[:-1], True)
    dwell = np.where(ends_block, path.dwell[block], 0.0)
    if isinstance(times.plan, AxisMotion):
        return _knots_of_motion(times.plan, pause, dwell)
    ratio = np.ones(len(begin) + 1) if times.plan is None else times.plan.ratio
    # Where the tool stops the knots have no speed, whatever the steps beside them have.
    ratio = np.where(times.stops == 2, 0.0, ratio)
    rate = (end - begin) / times.nominal[:, None]
    # The mean of both rates at a joint: the spline's speed is continuous, as set points are.
    joint = np.concatenate([rate[:1], (rate[1:] + rate[:-1]) / 2, rate[-1:]]) * ratio[:, None]
    # Four knots a step: where the pause before it ends, where it ends, where the dwell behind it ends.
    finish = np.cumsum(pause + times.times + dwell)
    time = np.stack([finish - dwell - times.times, finish - dwell, finish], axis=1)
    position, speed = np.stack([begin, end, end], axis=1), np.stack([joint[:-1], joint[1:], joint[1:]], axis=1)
    speed[dwell > 0, 1:] = 0.0
    step = np.stack([np.full(len(begin), -1), np.arange(len(begin)), np.full(len(begin), -1)], axis=1)
    flat_time = time.ravel()
    # A spline takes no knot twice: without a pause or dwell the three knots of a step are one or two.
    kept = np.append(True, np.diff(flat_time) > MIN_KNOT_GAP)
    first = np.zeros(1)
    start = flat_time[0] > 0
    return _Timeline(np.concatenate([first, flat_time[kept]]) if start else flat_time[kept],
                     np.concatenate([begin[:1], position.reshape(-1, 6)[kept]]) if start else position.reshape(-1, 6)[kept],
                     np.concatenate([np.zeros((1, 6)), speed.reshape(-1, 6)[kept]]) if start else speed.reshape(-1, 6)[kept],
                     np.concatenate([[-1], step.ravel()[kept]]) if start else step.ravel()[kept])


def _knots_of_motion(motion: AxisMotion, pause: FloatArray, dwell: FloatArray) -> _Timeline:
    """Return the knots of a motion within jerks: its law's, its joints, and rests before (`pause`) and behind steps (s)."""
    count = motion.times.size
    joint = np.concatenate([[0.0], np.cumsum(motion.times)])
    step = np.clip(np.searchsorted(joint, motion.time, side="right") - 1, 0, count - 1)
    is_inside = (motion.time > joint[step] + MIN_KNOT_GAP) & (motion.time < joint[step + 1] - MIN_KNOT_GAP)
    numbers = np.arange(count)
    # Three kinds of knots: starts of steps, which end a rest, those inside, and ends of steps.
    late = np.cumsum(pause) + np.concatenate([[0.0], np.cumsum(dwell[:-1])])
    law_time = np.concatenate([joint[:-1], motion.time[is_inside], joint[1:]])
    owner = np.concatenate([numbers, step[is_inside], numbers])
    position, speed, _, _ = motion.sample(law_time)
    speed[:count][np.append(False, dwell[:-1] > 0)] = 0.0
    label = np.concatenate([np.full(count, -1), owner[count:]])
    time = law_time + late[owner]
    waits = np.flatnonzero(dwell > 0)
    end = speed.shape[0] - count + waits
    speed[end] = 0.0
    rows = [(np.concatenate([time, time[end] + dwell[waits]]), np.concatenate([position, position[end]]),
             np.concatenate([speed, speed[end]]), np.concatenate([label, np.full(waits.size, -1)]))]
    if time[0] > MIN_KNOT_GAP:
        rows.insert(0, (np.zeros(1), position[:1], np.zeros((1, position.shape[1])), np.full(1, -1)))
    all_time, all_position, all_speed, all_labels = (np.concatenate(column) for column in zip(*rows, strict=True))
    # A step's end goes before the next one's start, so that the knot that is kept names the step.
    order = np.lexsort((-all_labels, np.round(all_time / MIN_KNOT_GAP)))
    kept = order[np.append(True, np.diff(all_time[order]) > MIN_KNOT_GAP)]
    return _Timeline(all_time[kept], all_position[kept], all_speed[kept], all_labels[kept])


def _command(timeline: _Timeline, columns: list[int], sample_time: float) -> Command:
    """Return the set points of the driven axes: cubic between the knots, then smoothed as a control does."""
    from scipy.interpolate import CubicHermiteSpline

    spline = CubicHermiteSpline(timeline.time, timeline.position[:, columns], timeline.speed[:, columns])
    time = np.arange(int(np.ceil(timeline.time[-1] / sample_time)) + 1) * sample_time
    clipped = np.minimum(time, timeline.time[-1])
    position, speed, acceleration = (spline(clipped, order) for order in (0, 1, 2))
    speed[time > timeline.time[-1]], acceleration[time > timeline.time[-1]] = 0.0, 0.0
    return smooth_set_points(Command(position, sample_time, speed, acceleration))


def _at_places(timeline: _Timeline, removed: TurnedRemoval, values: FloatArray, instants: FloatArray) -> FloatArray:
    """Return values (n, m) of the places of a removal, between them linear, at instants (k,), s."""
    knot = np.full(int(timeline.step.max()) + 1, -1)
    has_step = timeline.step >= 0
    knot[timeline.step[has_step]] = np.flatnonzero(has_step)
    end = np.maximum(knot[removed.piece], 0)
    time = np.where(removed.at_start, timeline.time[np.maximum(end - 1, 0)], timeline.time[end])
    return np.stack([np.interp(instants, time, column, left=0.0, right=0.0) for column in values.T], axis=1)


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Program beside its set points: path, removal, course of the axes, knots, columns of the driven axes, set points."""

    laid: ProgramPath
    removed: TurnedRemoval
    course: AxisCourse
    timeline: _Timeline
    columns: list[int]
    command: Command

    def tip_deviation(self, result: ServoResult, output: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Return the deviation of the tip in the work (n, 3), m, of axes (n, columns), and the step under way (n,)."""
        step = self.timeline.step_at(result.time - self._lag(result))
        moved = np.einsum("nia,na->ni", self.course.slopes[np.maximum(step, 0), 1][:, :, self.columns], output)
        return moved, step

    def _lag(self, result: ServoResult) -> float:
        """Return by how much the tables are behind the knots, s: smoothed set points are later by half of their window."""
        expected = np.column_stack([np.interp(result.time, self.timeline.time, column)
                                    for column in self.timeline.position[:, self.columns].T])
        actual = result.output("table") + self.command.position[0]
        return estimate_lag(result.time, expected * self.lever, actual * self.lever)

    @property
    def lever(self) -> FloatArray:
        """Motion of the tip over that of each driven axis, (columns,), root mean square: axes in m and rad count alike."""
        size = np.sqrt((self.course.slopes[:, 1] ** 2).sum(axis=1).mean(axis=0))[self.columns]
        return np.where(size > 0, size, 1.0)

    def deviation(self, result: ServoResult) -> tuple[FloatArray, np.ndarray]:
        """Return the deviation of the tip across its path (n, 3), m, and the step under way (n,)."""
        set_point = np.column_stack([np.interp(result.time, self.command.time, column) for column in self.command.position.T])
        actual = result.output("table") + self.command.position[0]
        late = delay(result.time, set_point, estimate_lag(result.time, set_point * self.lever, actual * self.lever))
        moved, step = self.tip_deviation(result, actual - late)
        return self.across(moved, step), step

    def across(self, moved: FloatArray, step: IndexArray) -> FloatArray:
        """Return the part of motions of the tip (n, 3), m, that lies across the path of its step."""
        way = self.removed.moves.rows[np.maximum(step, 0), 3:6] - self.removed.moves.rows[np.maximum(step, 0), 0:3]
        size = np.linalg.norm(way, axis=1, keepdims=True)
        unit = way / np.where(size > 0, size, 1.0)
        return np.asarray(moved - (moved * unit).sum(axis=1, keepdims=True) * unit)


def _course(sampled: _Sampled, servo: Servo, drives: DriveDescription, runs: list[ServoResult], *, force: FloatArray
            ) -> TurnedServoCourse:
    """Return the course by blocks: samples while the tool cuts count; loads of the drives count always."""
    free, loaded = runs
    n, block = sampled.laid.path.count, sampled.laid.moves.block
    across, step = sampled.deviation(loaded)
    cuts = np.zeros(block.size, bool)
    cuts[sampled.removed.piece[sampled.removed.reach > 0]] = True
    mask = (step >= 0) & cuts[np.maximum(step, 0)]
    lead = np.array([axis.mechanics.lead for axis in servo.plant.axes])
    further, _ = sampled.tip_deviation(loaded, (loaded.output("angle") - free.output("angle")) * lead)
    contour, push, use = np.zeros(n), np.zeros(n), np.zeros(n)
    np.maximum.at(contour, block[step[mask]], np.linalg.norm(across[mask], axis=1))
    np.maximum.at(push, block[step[mask]], np.linalg.norm(further[mask], axis=1))
    share, under_way = drive_use(drives, loaded), block[np.maximum(step, 0)]
    np.maximum.at(use, under_way, share.max(axis=1))
    following, step_without = sampled.deviation(free)
    both = mask & (step_without >= 0)
    deviation = following[both] + sampled.across(further[both], step[both])
    flat = np.zeros((0, 2))
    return TurnedServoCourse(tuple(drives.axes), block[step[both]], _NO_SAMPLES, flat, flat, flat, _NO_SAMPLES, contour, push,
                             use, axis_of_largest(share, under_way, n), force, step=step[both], deviation=deviation)
