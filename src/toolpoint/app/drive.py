"""`toolpoint drive`: a drive file and a program in, contour error, torque and loops out."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np

from toolpoint._check import FloatArray, ToolpointError, ToolpointWarning
from toolpoint.app import console
from toolpoint.app.drive_servo import servo_of, servo_on
from toolpoint.app.poses import machine_at
from toolpoint.drives import JerkLimits, Path, Servo, circular_test, contour_error, loops, planned, simulate
from toolpoint.drives.accuracy.contour import ContourError
from toolpoint.drives.accuracy.metrology import CircularTest
from toolpoint.drives.controller.loops import ServoLoops
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.planner import smoothed
from toolpoint.drives.simulation.moving_nut import simulate_moving_nut
from toolpoint.drives.simulation.simulate import ServoResult
from toolpoint.io import fmu
from toolpoint.io.program import gcode
from toolpoint.io.yaml import drive_file
from toolpoint.io.yaml.drive_schema import Drives
from toolpoint.plot import Chart, Listing, Notes, Report, Table
from toolpoint.plot.figures.drives import enlarged_path, histories, loop_bode

_PLACES = ("scale", "table", "tool")
_WINDOW = 3e-3
LONGEST, FEWEST, SLOWER = 1800.0, 40, 0.98


@dataclass(frozen=True, eq=False)
class DriveRun:
    """A simulated program: result, contour error at scale, table and tool point, loops, and a circular test if it was one."""

    servo: Servo
    result: ServoResult
    errors: dict[str, ContourError]
    loops: ServoLoops
    circle: CircularTest | None


def circle_path(radius: float, feed: float) -> Path:
    """Return two full turns about the origin, begun at (R, 0); m and m/s."""
    start, turn = np.array([[radius, 0.0, 0.0]] * 2), np.full(2, 2 * np.pi)
    return Path(np.array([1, 1]), start, start, np.zeros((2, 3)), turn, np.array([[0, 1]] * 2), np.full(2, feed),
                np.zeros(2, bool))


def drive(
    drives: str | FilePath, program: str | FilePath | None = None, circle: tuple[float, float] | None = None,
    output: str | FilePath = "toolpoint-report", quiet: bool = False, machine: str | FilePath | None = None,
    pose: Mapping[str, float] | None = None,
) -> DriveRun:
    """Simulate a program (G-code) or a circle (radius m, feed m/s), print the errors, and write the page.

    Raises ToolpointError for faults of the files, an unstable servo (with its margin), or neither program nor circle.
    """
    if (program is None) == (circle is None):
        raise ToolpointError("drive: give either --program FILE or --circle RADIUS,FEED")
    with console.steps(4, quiet) as step, console.collected_warnings() as warned:
        step("reading")
        described = drive_file.read(drives)
        servo = servo_of(described, None if machine is None else machine_at(machine, pose), pose)
        path = circle_path(*circle) if circle is not None else Path(**gcode.read(program).path_arrays)  # type: ignore[arg-type]
        step("set points")
        command = _command(path, described, servo)
        step("simulation")
        run = _run(described, servo, path, command, circle)
        step("page")
        text = FilePath(drives).read_text(encoding="utf-8-sig")
        saved = _page(described, run, text, warned).save(output)
    if not quiet:
        for row in _rows(run):
            console.OUT.print(f"{row[0]:36s} {row[1]}", markup=False)
        console.OUT.print(run.loops.table, markup=False)
        for words in dict.fromkeys([*run.result.notes, *warned]):
            console.ERR.print("warning: " + words, markup=False, style="yellow")
        console.OUT.print(f"Page written: {saved}", markup=False)
    return run


def _command(path: Path, described: Drives, servo: Servo) -> Command:
    limits = JerkLimits(described.limits.speed, described.limits.acceleration, described.limits.jerk)
    plan = planned(path, limits, corner_tolerance=described.corner_tolerance, corner=described.corner)
    sample = servo.controllers[0].position.sample_time
    if plan.duration > LONGEST:
        raise ToolpointError(f"drive: the program lasts {plan.duration:.4g} s; at most {LONGEST:g} s are simulated in one run; "
                             "cut it, or raise the feed")
    made = plan.command(sample, len(servo.controllers))
    return smoothed(made, 0.01).extended(0.3)


def export(drives: str | FilePath, unit: str | FilePath, machine: str | FilePath | None = None,
           pose: Mapping[str, float] | None = None, sources_only: bool = False) -> None:
    """Write the servo of a drive file as a functional mock-up unit (FMI 2.0, co-simulation)."""
    described = drive_file.read(drives)
    with console.collected_warnings() as warned:
        servo = servo_of(described, None if machine is None else machine_at(machine, pose), pose)
    if any(axis.mechanics.nut_moves for axis in described.axes.values()):
        warned.append("nut_moves: the unit keeps every nut at its nut_position")
    fmu.write(servo, unit, described.name, substeps=described.substeps, binary=not sources_only)
    for words in dict.fromkeys(warned):
        console.ERR.print("warning: " + words, markup=False, style="yellow")
    console.OUT.print(f"Unit written: {unit}", markup=False)


def _run(described: Drives, servo: Servo, path: Path, command: Command, circle: tuple[float, float] | None) -> DriveRun:
    shifted = Command(command.position - command.position[0], command.sample_time, command.velocity, command.acceleration)
    substeps, every = described.substeps, 4 * described.substeps
    if any(axis.mechanics.nut_moves for axis in described.axes.values()):
        start = [axis.mechanics.nut_position or 0.0 for axis in described.axes.values()]
        moving = [axis.mechanics.nut_moves for axis in described.axes.values()]
        at = lambda nuts: servo_on(described, None, False, nuts)
        result = simulate_moving_nut(at, start, shifted, moving=moving, substeps=substeps, every=every)
    else:
        result = simulate(servo, shifted, substeps=substeps, every=every)
    moved = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(command.position, axis=0), axis=1))])
    progress = np.minimum(np.interp(result.time, command.time, moved), path.lengths.sum())
    origin = command.position[0]
    errors = {name: contour_error(path, _in_space(result.output(name) + origin), progress, _WINDOW) for name in _PLACES}
    test = None
    if circle is not None:
        # The second turn, without run-up and stop.
        length = 2 * np.pi * circle[0]
        inside = (progress > 1.05 * length) & (progress < 1.95 * length)
        if np.count_nonzero(inside) < FEWEST:
            raise ToolpointError(f"--circle {1e3 * circle[0]:g},{6e4 * circle[1]:g}: the second turn holds "
                                 f"{np.count_nonzero(inside)} samples; needs {FEWEST}; take a larger radius or a lower feed")
        reached = 0.9 * length / float(np.ptp(result.time[inside]))
        if reached < SLOWER * circle[1]:
            warnings.warn(f"the limits of the axes allow {6e4 * reached:.0f} mm/min on this circle, not the "
                          f"{6e4 * circle[1]:.0f} mm/min asked for: the test is that of the lower feed", ToolpointWarning,
                          stacklevel=2)
        test = circular_test((result.output("tool") + origin)[inside][:, :2], circle[0])
    return DriveRun(servo, result, errors, loops(servo), test)


def _in_space(points: FloatArray) -> FloatArray:
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1])))


def _rows(run: DriveRun) -> list[tuple[str, str]]:
    rows = [("duration", f"{run.result.time[-1]:.3f} s")]
    for name, error in run.errors.items():
        size = error.length
        rms = np.sqrt((size**2).mean())
        rows.append((f"contour error, {name}", f"{1e6 * size.max():.2f} um largest, {1e6 * rms:.2f} um rms"))
    for axis in run.result.axes:
        torque = run.result.signal("torque_set", axis)
        rows.append((f"torque set point, {axis}", f"{np.abs(torque).max():.3f} N m largest"))
    if run.circle is not None:
        test = run.circle
        rows.append(("circular test (second turn)", f"G {1e6 * test.deviation:.2f} um, F_max {1e6 * test.radial_max:.2f}, "
                     f"F_min {1e6 * test.radial_min:.2f} um"))
    rows.append(("state", run.result.status))
    return rows


def _page(described: Drives, run: DriveRun, text: str, warnings: list[str]) -> Report:
    report = Report(described.name, "Feed drives and servo along a programmed path.", subtitle=described.source)
    report = report.with_section("Result", Table(["quantity", "value"], _rows(run)))
    report = report.with_section("Path with enlarged error", Chart(enlarged_path(run.errors)))
    for words, made in histories(run.result, run.errors).items():
        report = report.with_section(words, Chart(made))
    bodes = [Chart(loop_bode(level, k, axis)) for k, axis in enumerate(run.result.axes)
             for level in (run.loops.velocity, run.loops.position)]
    margins = [[loop, axis, *(f"{value:.1f}" if np.isfinite(value) else "none" for value in row)]
               for loop, axis, *row in run.loops.figures]
    report = report.with_section("Loops", Table(["loop", "axis", "gain margin dB", "phase margin °", "bandwidth Hz"], margins),
                                 *bodes)
    notes = list(dict.fromkeys([*warnings, *run.result.notes]))
    return report.with_section("Inputs and assumptions", *([Notes(notes, "warning")] if notes else []),
                               Notes(described.assumptions, "assumed"), Listing("Drive file", text))
