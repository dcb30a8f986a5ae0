"""`toolpoint drive`: a drive file and a program, a circle, a map or a unit; each one call, then the console and the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from toolpoint._check import ToolpointError
from toolpoint.app import console
from toolpoint.app.poses import grid as grid_of
from toolpoint.app.poses import machine_at
from toolpoint.drives.build import build_servo
from toolpoint.io import fmu
from toolpoint.io.program import read_path
from toolpoint.io.yaml import drive_file, machine_file
from toolpoint.pages.drive_experiment import drive_page
from toolpoint.pages.servo_map import servo_map_page
from toolpoint.studies.drive_experiment import DriveExperiment, drive_experiment
from toolpoint.studies.drive_structure import structure_of
from toolpoint.studies.servo_map import ServoMap, servo_map

OUTPUT = Path("toolpoint-report")


def drive(
    drives: Path, program: Path | None = None, circle: tuple[float, float] | None = None, *, machine: Path | None = None,
    pose: Mapping[str, float] | None = None, output: Path = OUTPUT, quiet: bool = False,
) -> DriveExperiment:
    """Simulate a program (G-code) or a circle (radius m, feed m/s), print the errors, and write the page."""
    if (program is None) == (circle is None):
        raise ToolpointError("drive: give either --program FILE or --circle RADIUS,FEED")
    with console.steps(4, quiet) as step, console.collected_warnings() as warnings:
        step("reading")
        description = drive_file.read(drives)
        built = None if machine is None else machine_at(machine, pose)
        path = None if program is None else read_path(program)
        result = drive_experiment(description, path=path, circle=circle, machine=built, pose=pose, progress=step)
        step("page")
        saved = drive_page(result, source_text=drives.read_text(encoding="utf-8-sig"), warnings=warnings).save(output)
    if not quiet:
        console.OUT.print(result.table(), markup=False)
        _close([*result.notes, *warnings], saved)
    return result


def drive_map(drives: Path, machine: Path | None, axes: Sequence[str], *, circle: tuple[float, float] | None = None,
              output: Path = OUTPUT, quiet: bool = False) -> ServoMap:
    """Map a servo over a grid of poses (``X=-0.3:0.3:7``, one or two axes), print its table and write its page."""
    if machine is None:
        raise ToolpointError("--map: a map needs the machine; give --machine FILE")
    description, built = drive_file.read(drives), machine_file.read(machine)
    grid = grid_of(built, axes, "--map")
    with console.collected_warnings() as warnings, console.counted("poses", quiet or not console.interactive()) as progress:
        result = servo_map(description, machine=built, grid=grid, circle=circle, progress=progress)
    saved = servo_map_page(result, warnings=warnings).save(output)
    if not quiet:
        console.table(repr(result), ["quantity", "axis", "smallest", "largest"], result.rows())
        _close(warnings, saved)
    return result


def export(drives: Path, unit: Path, *, machine: Path | None = None, pose: Mapping[str, float] | None = None,
           sources_only: bool = False) -> None:
    """Write the servo of a drive file as a functional mock-up unit (FMI 2.0, co-simulation)."""
    description = drive_file.read(drives)
    built = None if machine is None else machine_at(machine, pose)
    with console.collected_warnings() as warnings:
        servo = build_servo(description, structure_of(description, built, pose))
    if any(axis.mechanics.nut_moves for axis in description.axes.values()):
        warnings.append("nut_moves: the unit keeps every nut at its nut_position")
    fmu.write(servo, unit, description.name, substeps=description.substeps, binary=not sources_only)
    _warn(warnings)
    console.OUT.print(f"Unit written: {unit}", markup=False)


def _close(warnings: Iterable[str], page: Path) -> None:
    _warn(warnings)
    console.OUT.print(f"Page written: {page}", markup=False)


def _warn(warnings: Iterable[str]) -> None:
    for words in dict.fromkeys(warnings):
        console.ERR.print("warning: " + words, markup=False, style="yellow")
