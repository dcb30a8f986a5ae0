"""A servo along a programmed path or a circle: contour error at scale, table and tool point, torque, loops, circular test."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning, fail
from toolpoint.drives.accuracy.contour import ContourError, contour_error
from toolpoint.drives.accuracy.metrology import CircularTest, circular_test
from toolpoint.drives.build import build_servo
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
from toolpoint.studies.drive_structure import structure_of

PLACES = ("scale", "table", "tool")
# How far (m) from the commanded place the foot of an actual point is looked for.
_WINDOW = 3e-3
_LONGEST, _FEWEST, _SLOWER = 1800.0, 40, 0.98


@dataclass(frozen=True, eq=False)
class DriveExperiment:
    """A simulated program: servo, histories, contour error at scale, table and tool point, loops; and a circular test.

    `errors` maps ``scale``, ``table`` and ``tool`` to their contour errors; `circle` is None where no circle was run.
    """

    drives: DriveDescription
    servo: Servo
    result: ServoResult
    errors: Mapping[str, ContourError]
    loops: ServoLoops
    circle: CircularTest | None

    @property
    def status(self) -> str:
        """What to know and try next."""
        return self.result.status

    @property
    def notes(self) -> tuple[str, ...]:
        """What the simulation rests on, in words."""
        return self.result.notes

    def rows(self) -> list[tuple[str, str]]:
        """Return quantity and value, as words, of what a person looks at first."""
        rows = [("duration", f"{self.result.time[-1]:.3f} s")]
        for name, error in self.errors.items():
            rms = np.sqrt((error.length**2).mean())
            rows.append((f"contour error, {name}", f"{1e6 * error.length.max():.2f} um largest, {1e6 * rms:.2f} um rms"))
        for axis in self.result.axes:
            torque = np.abs(self.result.signal("torque_set", axis)).max()
            rows.append((f"torque set point, {axis}", f"{torque:.3f} N m largest"))
        if self.circle is not None:
            test = self.circle
            rows.append(("circular test (second turn)", f"G {1e6 * test.deviation:.2f} um, F_max {1e6 * test.radial_max:.2f}, "
                         f"F_min {1e6 * test.radial_min:.2f} um"))
        return [*rows, ("state", self.status)]

    def table(self) -> str:
        """Return the quantities, and below them the margins and bandwidths of the loops."""
        return "\n".join([*(f"{name:36s} {value}" for name, value in self.rows()), self.loops.table()])

    def to_dict(self) -> dict[str, Any]:
        """Return the largest contour errors (m), the circular deviation (m) and the status as plain values."""
        return {"contour_error_m": {name: float(error.length.max()) for name, error in self.errors.items()},
                "circular_deviation_m": None if self.circle is None else self.circle.deviation, "status": self.status}


def run_drives(
    drives: DriveDescription, *, path: Path | None = None, circle: tuple[float, float] | None = None,
    machine: Machine | None = None, pose: Mapping[str, float] | None = None, progress: Callable[[str], None] | None = None,
) -> DriveExperiment:
    """Return what a servo does along a path, or on a circle.

    Parameters
    ----------
    drives : DriveDescription
    path : Path, optional
        Lines and arcs, m and m/s.
    circle : (float, float), optional
        Radius (m) and feed (m/s) of a circle about the origin, two turns of it, in the place of a path.
    machine : Machine, optional
        Whose structure the drives push against, at a `pose` (axis name to m or rad).
    progress : callable, optional
        Called with the name of every step at its start.

    Raises
    ------
    ToolpointError
        For faults of the description, an unstable servo (with its margin), a program that lasts too long, a circle of too
        few samples, or neither path nor circle (or both).
    """
    if (path is None) == (circle is None):
        fail("path, circle", "both" if path else "neither", "must be one of the two")
    say = progress or (lambda name: None)
    servo = build_servo(drives, structure_of(drives, machine, pose))
    route = path if path is not None else full_turns(*(circle or (0.0, 0.0)))
    say("set points")
    command = _command(route, drives, servo)
    say("simulation")
    result = _simulate(drives, servo, command)
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(command.position, axis=0), axis=1))])
    progress_m = np.minimum(np.interp(result.time, command.time, travelled), route.lengths.sum())
    origin = command.position[0]
    errors = {name: contour_error(route, _in_space(result.output(name) + origin), progress_m,
                                  window=_WINDOW) for name in PLACES}
    test = None if circle is None else _second_turn(result, origin, progress_m, *circle)
    return DriveExperiment(drives, servo, result, errors, compute_loops(servo), test)


def _command(path: Path, drives: DriveDescription, servo: Servo) -> Command:
    limits = JerkLimits(drives.limits.speed, drives.limits.acceleration, drives.limits.jerk)
    plan = plan_motion(path, limits, corner_tolerance=drives.corner_tolerance, corner=drives.corner)
    if plan.duration > _LONGEST:
        raise ToolpointError(f"drive: the program lasts {plan.duration:.4g} s; at most {_LONGEST:g} s are simulated in one "
                             "run; cut it, or raise the feed")
    command = plan.command(servo.controllers[0].position.sample_time, len(servo.controllers))
    return smooth_command(command, 0.01).extended(0.3)


def _simulate(drives: DriveDescription, servo: Servo, command: Command) -> ServoResult:
    """Return the histories from rest at the first point; with moving nuts the screws follow them."""
    shifted = Command(command.position - command.position[0], command.sample_time, command.velocity, command.acceleration)
    substeps, every = drives.substeps, 4 * drives.substeps
    moving = [axis.mechanics.nut_moves for axis in drives.axes.values()]
    if not any(moving):
        return simulate(servo, shifted, substeps=substeps, every=every)
    start = [axis.mechanics.nut_position or 0.0 for axis in drives.axes.values()]
    return simulate_moving_nut(lambda nuts: build_servo(drives, None, warn=False, nuts=nuts), start, shifted, moving=moving,
                               substeps=substeps, every=every)


def _second_turn(result: ServoResult, origin: FloatArray, progress: FloatArray, radius: float, feed: float) -> CircularTest:
    """Return the circular test of the second turn at the tool point, without run-up and stop."""
    length = 2 * np.pi * radius
    inside = (progress > 1.05 * length) & (progress < 1.95 * length)
    if np.count_nonzero(inside) < _FEWEST:
        raise ToolpointError(f"circle {1e3 * radius:g},{6e4 * feed:g} (mm, mm/min): the second turn holds "
                             f"{np.count_nonzero(inside)} samples; needs {_FEWEST}; take a larger radius or a lower feed")
    reached = 0.9 * length / float(np.ptp(result.time[inside]))
    if reached < _SLOWER * feed:
        warnings.warn(f"the limits of the axes allow {6e4 * reached:.0f} mm/min on this circle, not the "
                      f"{6e4 * feed:.0f} mm/min asked for: the test is that of the lower feed", ToolpointWarning, stacklevel=3)
    return circular_test((result.output("tool") + origin)[inside][:, :2], radius)


def _in_space(points: FloatArray) -> FloatArray:
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
