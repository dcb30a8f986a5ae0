"""`toolpoint drive`: a drive file and a program in, contour error, torque and loops out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.app import console
from toolpoint.drives import (
    Axis,
    Controller,
    Coulomb,
    JerkLimits,
    LuGre,
    Path,
    PositionLoop,
    Servo,
    Stribeck,
    Structure,
    TorqueMotor,
    VelocityLoop,
    circular_test,
    contour_error,
    four_dof_axis,
    loops,
    planned,
    plant,
    plausibility,
    rigid_axis,
    simulate,
    two_mass_axis,
)
from toolpoint.drives.command import Command
from toolpoint.drives.contour import ContourError
from toolpoint.drives.loops import ServoLoops
from toolpoint.drives.metrology import CircularTest
from toolpoint.drives.planner import smoothed
from toolpoint.drives.simulate import ServoResult
from toolpoint.io import drive_yaml, gcode, machine_yaml
from toolpoint.machine import Machine, assemble
from toolpoint.plot import Chart, Listing, Notes, Report, Table
from toolpoint.plot.drives import enlarged_path, histories, loop_bode
from toolpoint.vibration import eigen

_PLACES = ("scale", "table", "tool")
_WINDOW = 3e-3
_FREED = 1e-9


@dataclass(frozen=True, eq=False)
class DriveRun:
    """A simulated program: result, contour error at scale, table and tool point, loops, and a circular test if it was one."""

    servo: Servo
    result: ServoResult
    errors: dict[str, ContourError]
    loops: ServoLoops
    circle: CircularTest | None


def servo_of(drives: drive_yaml.Drives, machine: Machine | None = None, pose: Mapping[str, float] | None = None) -> Servo:
    """Return the servo that a drive file describes, on a machine's structure where its axes are ball screws.

    Doubtful friction warns with its critical feed.
    """
    axes, controllers = [], []
    for name, axis in drives.axes.items():
        ratio = axis.mechanics.lead / (2 * np.pi)
        law = _friction(axis.friction)
        if isinstance(law, (Stribeck, LuGre)):
            plausibility(law, axis.velocity.gain, ratio)
        axes.append(Axis(name, TorqueMotor(), _mechanics(axis.mechanics, ratio, law)))
        velocity = VelocityLoop(axis.velocity.gain, axis.velocity.integral_time or np.inf, axis.velocity.sample_time,
                                limit=axis.velocity.limit or np.inf)
        position = PositionLoop(axis.position.gain, axis.position.sample_time, axis.position.velocity_feedforward,
                                feedback=axis.position.feedback)
        controllers.append(Controller(position, velocity, ratio))
    return Servo(plant(axes, _structure(drives, machine, pose)), tuple(controllers))


def _structure(drives: drive_yaml.Drives, machine: Machine | None, pose: Mapping[str, float] | None) -> Structure | None:
    ends = {name: axis.ends for name, axis in drives.axes.items() if axis.ends is not None}
    if not ends:
        if machine is not None:
            raise ToolpointError("--machine: no axis of the drive file is a ball screw with 'ends' on a machine; leave it out, "
                                 "or describe where the drives hold on")
        return None
    if machine is None:
        raise ToolpointError(f"--machine: missing; axis {next(iter(ends))} of the drive file ends at points of a machine")
    # The drives carry these directions now; a stiffness of zero would make them free and change the joint's kind.
    free = machine.with_values({end.replaces: _FREED * machine.value(end.replaces) for end in ends.values()})
    labels = list(dict.fromkeys(label for end in ends.values() for label in (end.base, end.table, end.tool)))
    modes = eigen.undamped(assemble(free, pose, labels, modal_damping=False))
    if machine.description.damping_ratio is not None:
        modes = modes.with_damping(machine.description.damping_ratio)
    boundaries = {f"{name}.{side}": getattr(end, side) for name, end in ends.items() for side in ("base", "table")}
    return Structure.from_modes(modes, boundaries, {name: end.tool for name, end in ends.items()})


def _mechanics(part: Any, ratio: float, law: Any) -> Any:
    if part.kind == "rigid":
        return rigid_axis(part.inertia, ratio, 0.0, law)
    if part.kind == "ball-screw":
        return four_dof_axis(part.inertia, part.screw_inertia, part.screw_mass, None, ratio,
                             (part.coupling_stiffness, part.coupling_damping), (part.bearing_stiffness, part.bearing_damping),
                             (part.nut_stiffness, part.nut_damping), guide_damping=part.guide_damping, shaft_friction=law)
    return two_mass_axis(part.inertia, part.table_mass, ratio, part.stiffness, part.damping, shaft_friction=law)


def _friction(part: Any) -> Any:
    if part.law == "none":
        return None
    if part.law == "coulomb":
        return Coulomb(part.coulomb, part.viscous)
    if part.law == "stribeck":
        return Stribeck(part.coulomb, part.static, part.stribeck_velocity, part.viscous)
    return LuGre(part.bristle_stiffness, part.bristle_damping, part.coulomb, part.static, part.stribeck_velocity, part.viscous)


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
    with console.steps(4, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        described = drive_yaml.read(drives)
        servo = servo_of(described, None if machine is None else machine_yaml.read(machine), pose)
        path = circle_path(*circle) if circle is not None else Path(**gcode.read(program).path_arrays)  # type: ignore[arg-type]
        step("set points")
        command = _command(path, described, servo)
        step("simulation")
        run = _run(servo, path, command, circle)
        step("page")
        text = FilePath(drives).read_text(encoding="utf-8-sig")
        saved = _page(described, run, text, warnings).save(output)
    if not quiet:
        for row in _rows(run):
            console.OUT.print(f"{row[0]:36s} {row[1]}", markup=False)
        console.OUT.print(run.loops.table, markup=False)
        for words in dict.fromkeys([*run.result.notes, *warnings]):
            console.ERR.print("warning: " + words, markup=False, style="yellow")
        console.OUT.print(f"Page written: {saved}", markup=False)
    return run


def _command(path: Path, described: drive_yaml.Drives, servo: Servo) -> Command:
    limits = JerkLimits(described.limits.speed, described.limits.acceleration, described.limits.jerk)
    plan = planned(path, limits, corner_tolerance=described.corner_tolerance)
    sample = servo.controllers[0].position.sample_time
    made = plan.command(sample, len(servo.controllers))
    return smoothed(made, 0.01).extended(0.3)


def _run(servo: Servo, path: Path, command: Command, circle: tuple[float, float] | None) -> DriveRun:
    shifted = Command(command.position - command.position[0], command.sample_time, command.velocity, command.acceleration)
    result = simulate(servo, shifted, every=4)
    moved = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(command.position, axis=0), axis=1))])
    progress = np.minimum(np.interp(result.time, command.time, moved), path.lengths.sum())
    origin = command.position[0]
    errors = {name: contour_error(path, _in_space(result.output(name) + origin), progress, _WINDOW) for name in _PLACES}
    test = None
    if circle is not None:
        # The second turn, without run-up and stop.
        length = 2 * np.pi * circle[0]
        inside = (progress > 1.05 * length) & (progress < 1.95 * length)
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


def _page(described: drive_yaml.Drives, run: DriveRun, text: str, warnings: list[str]) -> Report:
    report = Report(described.name, "Feed drives and servo along a programmed path.", subtitle=described.source)
    report = report.with_section("Result", Table(["quantity", "value"], _rows(run)))
    report = report.with_section("Path with enlarged error", Chart(enlarged_path(run.errors)))
    for words, made in histories(run.result, run.errors).items():
        report = report.with_section(words, Chart(made))
    bodes = [Chart(loop_bode(level, k, axis)) for k, axis in enumerate(run.result.axes)
             for level in (run.loops.velocity, run.loops.position)]
    report = report.with_section("Loops", Listing("Margins and bandwidth", run.loops.table), *bodes)
    notes = list(dict.fromkeys([*warnings, *run.result.notes]))
    return report.with_section("Inputs and assumptions", *([Notes(notes, "warning")] if notes else []),
                               Notes(described.assumptions, "assumed"), Listing("Drive file", text))
