"""Servo along a programmed path or a circle: contour error at scale, table and tool point, torque, loops, circular test."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, fail
from toolpoint._doubt import Doubt, mark_notes
from toolpoint._notebook import NotebookText
from toolpoint.drives.accuracy.contour import ContourError
from toolpoint.drives.accuracy.metrology import CircularTest, circular_test, quadrant_peaks
from toolpoint.drives.build import build_servo
from toolpoint.drives.controller.loop_doubts import doubt_gains
from toolpoint.drives.controller.loops import ServoLoops, compute_loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.jerk_profile import JerkLimits
from toolpoint.drives.program.path import Path, full_turns
from toolpoint.drives.program.planner import plan_motion, smooth_command
from toolpoint.drives.simulation.moving_nut import simulate_moving_nut
from toolpoint.drives.simulation.simulate import ServoResult, simulate
from toolpoint.machine import Machine
from toolpoint.studies.servos.drive_contour import SPACE, is_cutting, match_axes, measure_contour
from toolpoint.studies.servos.drive_structure import question_structure, structure_of

PLACES = ("scale", "table", "tool")
# Moving mean of the set points, and what is simulated after the last of them, s.
_SMOOTHING_TIME, _SETTLING_TIME = 0.01, 0.3
# s; samples of the second turn; reached over requested feed
_MAX_PROGRAM_DURATION, _MIN_CIRCLE_SAMPLES, _MIN_REACHED_FEED_RATIO = 1800.0, 40, 0.98
# s of motion from which the time of its simulation is estimated; of the piece that is timed
LONG_MOTION_TIME, TIMED_PIECE_TIME = 60.0, 1.0
CONTOUR_TIME_RATIO = 2.0  # of the time of the simulation that contour errors take after it
# Share of a circle's radius beside which the axes run from which on the servo is doubted.
_MAX_RADIUS_DEVIATION = 0.02


@dataclass(frozen=True, eq=False)
class CircleTurn:
    """One whole turn of a circular test; axes : of the circle, the first one at 0 deg.

    points : (n, 2) at scale, table and tool, m; radius : nominal, m; peaks : at 0, 90, 180 and 270 deg at the tool, outward
    over the median radius, m.
    """

    points: Mapping[str, FloatArray]
    radius: float
    peaks: FloatArray
    axes: tuple[str, ...] = ("X", "Y")


@dataclass(frozen=True, eq=False)
class DriveExperiment(NotebookText):
    """A simulated program: servo, histories, contour error at scale, table and tool point, loops; and a circular test.

    `errors` maps ``scale``, ``table`` and ``tool`` to their contour errors, `cutting` to the instants at which they count
    (elsewhere the axes position in rapids); `circle` is None where no circle was run; `remarks` stand before the figures.
    """

    drives: DriveDescription
    servo: Servo
    result: ServoResult
    errors: Mapping[str, ContourError]
    loops: ServoLoops
    circle: CircularTest | None
    cutting: Mapping[str, np.ndarray]
    remarks: tuple[str, ...] = ()
    turn: CircleTurn | None = None

    @property
    def status(self) -> str:
        """State of the simulation, and what to try next."""
        return self.result.status

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions of the simulation, in words."""
        return (*self.remarks, *self.result.notes)

    @property
    def doubts(self) -> list[Doubt]:
        """Loops that are hardly stable, gains that no axis has, and a circle that the axes do not come near."""
        names = [axis.name for axis in self.servo.plant.axes]
        doubts = [*self.loops.doubts, *doubt_gains(names, self.servo.controllers)]
        if self.circle is not None and self.turn is not None:
            deviation = max(abs(self.circle.radial_max), abs(self.circle.radial_min)) / self.turn.radius
            if deviation > _MAX_RADIUS_DEVIATION:
                doubts.append(Doubt("circular test", f"the axes run {100 * deviation:.0f} % of the radius beside the circle",
                                    "gains too low for this feed, or lead or units are wrong", figure=deviation))
        return doubts

    def largest_error(self, place: str, *, rapid: bool = False) -> float | None:
        """Return the largest contour error of the cutting moves (or of the rapids) at a place, m; None where there are none."""
        judged = self.cutting[place] ^ rapid
        return float(self.errors[place].length[judged].max()) if judged.any() else None

    def rows(self) -> list[tuple[str, str]]:
        """Return the main quantities and their values as words."""
        rows = [("duration", f"{self.result.time[-1]:.3f} s")]
        for name, error in self.errors.items():
            cut, rapid = error.length[self.cutting[name]], error.length[~self.cutting[name]]
            words = f"{1e6 * cut.max():.2f} µm largest, {1e6 * np.sqrt((cut**2).mean()):.2f} µm rms" if cut.size else \
                "none: no cutting move"
            rows.append((f"contour error, {name}", words))
            if rapid.size:
                rows.append((f"  {name}, on rapids", f"{1e6 * rapid.max():.2f} µm largest"))
        for axis in self.result.axes:
            torque = np.abs(self.result.signal("torque_set", axis)).max()
            rows.append((f"torque set point, {axis}", f"{torque:.3f} N m largest"))
        if self.circle is not None:
            test = self.circle
            rows.append(("circular test (second turn)", f"G {1e6 * test.deviation:.2f} µm, F_max {1e6 * test.radial_max:.2f}, "
                         f"F_min {1e6 * test.radial_min:.2f} µm"))
        if self.turn is not None:
            peaks = ", ".join(f"{1e6 * peak:.1f}" for peak in self.turn.peaks)
            rows.append(("quadrant peaks at 0, 90, 180, 270°", f"{peaks} µm"))
        return [*rows, ("state", self.status)]

    def table(self) -> str:
        """Return the quantities, and below them the margins and bandwidths of the loops."""
        return "\n".join([*mark_notes([*self.doubts, *self.remarks], "note: "),
                          *(f"{name:36s} {value}" for name, value in self.rows()), self.loops.margin_table()])

    def to_dict(self) -> dict[str, Any]:
        """Return the largest contour errors, the circular deviation, the status and the notes as plain values, m.

        Errors of cuts and of rapids; None where there are none.
        """
        return {"contour_error_m": {name: self.largest_error(name) for name in self.errors},
                "contour_error_rapid_m": {name: self.largest_error(name, rapid=True) for name in self.errors},
                "doubts": list(self.doubts), "notes": list(self.remarks),
                "circular_deviation_m": None if self.circle is None else self.circle.deviation, "status": self.status}


def run_drives(
    drives: DriveDescription, *, path: Path | None = None, circle: tuple[float, float] | None = None,
    plane: Sequence[str] = ("X", "Y"), machine: Machine | None = None, pose: Mapping[str, float] | None = None,
    ideal: Sequence[str] = (), remarks: Sequence[str] = (), progress: Callable[[str], None] | None = None,
) -> DriveExperiment:
    """Return the simulation of a servo along a path, or on a circle.

    Parameters
    ----------
    drives : DriveDescription
    path : Path, optional
        Lines and arcs, m and m/s.
    circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle about the origin, two turns of it, in the place of a path.
    plane : two names of axes
        Of the circle, which begins on the first one and turns towards the second.
    machine : Machine, optional
        Whose structure the drives push against, at a `pose` (axis name to m or rad).
    ideal : sequence of str
        Axes of the program (``Z``) that the drives lack and that shall follow without error; see
        `drive_contour.match_axes`, which takes those that only position as ideal of its own accord, and says so.
    remarks : sequence of str
        What was assumed of the program (`io` says it); it stands before the figures.
    progress : callable, optional
        Called with the name of every step at its start.

    Raises
    ------
    ToolpointError
        For an axis of the program that the drives lack, faults of the description, an unstable servo (with its margin), a
        program that lasts too long, a circle of too few samples, or neither path nor circle (or both).

    Examples
    --------
    Runs in ``examples/drive_a_circle.py``.
    """
    turning = [name for name, axis in drives.axes.items() if axis.mechanics.kind == "reducer"]
    if turning:
        fail("drives", f"{', '.join(turning)} behind a reducer", "must be linear axes: a program or a circle is their path",
             remedy="`toolpoint drive FILE` alone gives loops of rotary axes, `toolpoint accuracy --drives` what they do "
                    "to a path")
    if (path is None) == (circle is None):
        fail("path, circle", "both" if path else "neither", "must be one of the two")
    say = progress or (lambda name: None)
    servo = build_servo(drives, structure_of(drives, machine, pose))
    turned = _circle_columns(plane)
    if circle is not None and {name.upper() for name in drives.axes} <= set(SPACE) and (
            absent := [name for name in plane if name.upper() not in map(str.upper, drives.axes)]):
        fail("plane", ", ".join(absent), f"must be axes of the drive file: {', '.join(drives.axes)}")
    route = path if path is not None else full_turns(*(circle or (0.0, 0.0)), columns=turned)
    driven = match_axes(route, tuple(drives.axes), ideal=ideal)
    say("set points")
    command, place = set_points_of(route, drives, servo)
    chosen = list(driven.columns)
    driven_command = Command(command.position[:, chosen], command.sample_time, command.velocity[:, chosen],
                             command.acceleration[:, chosen])
    say(_simulation_words(drives, servo, driven_command))
    result = simulate_set_points(drives, servo, driven_command)
    places = np.interp(result.time, command.time, place)
    origin = command.position[0, chosen]
    errors = {name: measure_contour(route, result.time, places, actual=result.output(name) + origin, columns=chosen)
              for name in PLACES}
    pair = [chosen.index(column) for column in turned] if circle is not None else []
    test = None if circle is None else _second_turn(result, origin, places, circle=circle, pair=pair)
    cutting = {name: is_cutting(route, error) for name, error in errors.items()}
    turn = None if circle is None else replace(
        _whole_turn(result, origin, places, radius=circle[0], pair=pair), axes=tuple(name.upper() for name in plane))
    return DriveExperiment(drives, servo, result, errors, compute_loops(servo), test, cutting,
                           (*question_structure(drives, machine, pose), *driven.notes, *remarks), turn)


def set_points_of(path: Path, drives: DriveDescription, servo: Servo) -> tuple[Command, FloatArray]:
    """Return the set points of X, Y, Z, and the arc length of each along the programmed path (m)."""
    limits = JerkLimits(drives.limits.speed, drives.limits.acceleration, drives.limits.jerk)
    plan = plan_motion(path, limits, corner_tolerance=drives.corner_tolerance, corner=drives.corner,
                       look_ahead=drives.look_ahead)
    if plan.duration > _MAX_PROGRAM_DURATION:
        raise ToolpointError(f"drive: the program lasts {plan.duration:.4g} s; at most {_MAX_PROGRAM_DURATION:g} s are "
                             f"simulated in one "
                             "run; cut it, or raise the feed")
    step = servo.controllers[0].position.sample_time
    command = plan.command(step)
    place = Command(plan.progress(step, path)[:, None], step)
    return smooth_set_points(command), smooth_set_points(place).position[:, 0]


def smooth_set_points(command: Command) -> Command:
    """Return set points as a control smooths them, with a rest at the end."""
    return smooth_command(command, max(_SMOOTHING_TIME, command.sample_time)).extended(_SETTLING_TIME)


def _simulation_words(drives: DriveDescription, servo: Servo, command: Command) -> str:
    """Return the name of the step of simulation; of a long motion with the time that it will take, by a short piece of it."""
    if command.time[-1] < LONG_MOTION_TIME:
        return "simulation"
    count = round(TIMED_PIECE_TIME / command.sample_time) + 1
    piece = Command(command.position[:count], command.sample_time, command.velocity[:count], command.acceleration[:count])
    took = 0.0
    for _ in range(2):  # the first run compiles
        begin = time.perf_counter()
        simulate_set_points(drives, servo, piece)
        took = time.perf_counter() - begin
    total = (1 + CONTOUR_TIME_RATIO) * took * float(command.time[-1]) / TIMED_PIECE_TIME
    return f"simulation of {command.time[-1]:.0f} s of motion, about {total:.0f} s"


def simulate_set_points(drives: DriveDescription, servo: Servo, command: Command, *, load: FloatArray | None = None
                        ) -> ServoResult:
    """Return the histories from rest at the first point; with moving nuts the screws follow them.

    load : (n_steps, n_axes) floats, optional; force on every table, N, held over each step of the plant (not with moving nuts).
    """
    shifted = Command(command.position - command.position[0], command.sample_time, command.velocity, command.acceleration)
    substeps, interval = drives.substeps, 4 * drives.substeps
    moving = [axis.mechanics.nut_moves for axis in drives.axes.values()]
    if not any(moving):
        return simulate(servo, shifted, substeps=substeps, record_interval=interval, load=load)
    start = [axis.mechanics.nut_position or 0.0 for axis in drives.axes.values()]
    return simulate_moving_nut(lambda nuts: build_servo(drives, None, warn=False, nuts=nuts), start, shifted, moving=moving,
                               substeps=substeps, record_interval=interval)


def _circle_columns(plane: Sequence[str]) -> tuple[int, int]:
    """Return the columns of a path that a circle's two axes are; raises ToolpointError for others than two of X, Y, Z."""
    names = [name.upper() for name in plane]
    if len(names) != 2 or len(set(names)) != 2 or not set(names) <= set(SPACE):
        fail("plane", ", ".join(plane), "must be two of X, Y, Z")
    return SPACE.index(names[0]), SPACE.index(names[1])


def _second_turn(result: ServoResult, origin: FloatArray, progress: FloatArray, *, circle: tuple[float, float],
                 pair: Sequence[int]) -> CircularTest:
    """Return the circular test of the second turn at the tool point, without run-up and stop; pair : the servo's axes of it."""
    radius, feed = circle
    length = 2 * np.pi * radius
    # The second of the turns, without its ends: the first holds the way in, and the third the way out.
    inside = (progress > 1.05 * length) & (progress < 1.95 * length)
    if np.count_nonzero(inside) < _MIN_CIRCLE_SAMPLES:
        raise ToolpointError(f"circle {1e3 * radius:g},{6e4 * feed:g} (mm, mm/min): the second turn holds "
                             f"{np.count_nonzero(inside)} samples; needs {_MIN_CIRCLE_SAMPLES}; take a larger radius or a "
                             f"lower feed")
    reached = 0.9 * length / float(np.ptp(result.time[inside]))
    if reached < _MIN_REACHED_FEED_RATIO * feed:
        warnings.warn(f"the limits of the axes allow {6e4 * reached:.0f} mm/min on this circle, not the "
                      f"{6e4 * feed:.0f} mm/min asked for: the test is that of the lower feed", ToolpointWarning, stacklevel=3)
    return circular_test((result.output("tool") + origin)[inside][:, pair], radius)


def _whole_turn(result: ServoResult, origin: FloatArray, progress: FloatArray, *, radius: float, pair: Sequence[int]
                ) -> CircleTurn:
    """Return a turn that begins and ends between quadrants, so that all four reversals are inside it."""
    length = 2 * np.pi * radius
    inside = (progress >= 0.875 * length) & (progress <= 1.875 * length)
    points = {name: (result.output(name) + origin)[inside][:, pair] for name in PLACES}
    return CircleTurn(points, radius, quadrant_peaks(points["tool"], radius))
