"""`toolpoint drive`: a drive file and a program, a circle, a map or a unit."""

from __future__ import annotations

import json
from pathlib import Path

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, POSE, REPLACE

Pose = dict[str, float] | None
Circle = tuple[float, float] | None


def _circle(ctx: click.Context, parameter: click.Parameter, value: str | None) -> Circle:
    if not value:
        return None
    try:
        radius, feed = (float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write RADIUS,FEED in mm and mm/min, for example 50,4000") from None
    if radius <= 0 or feed <= 0:
        raise click.BadParameter(f"{value!r}: radius and feed must be above zero")
    return 1e-3 * radius, 1e-3 / 60 * feed


@click.command()
@click.argument("drives", required=False, type=FILE)
@click.option("--program", type=FILE, help="G-code (ISO and the common Siemens words), mm.")
@click.option("--circle", callback=_circle, metavar="RADIUS,FEED", help="A circular test instead, mm and mm/min.")
@click.option("--machine", type=FILE, help="Machine file whose structure the drives push against.")
@POSE
@click.option("--map", "grid", multiple=True, metavar="X=-0.3:0.3:7",
              help="Margins and bandwidth over positions of the machine, with --circle its deviation too; one or two axes.")
@click.option("--ideal", multiple=True, metavar="AXIS", help="An axis of the program that DRIVES lacks and that follows "
              "without error; without it such an axis may only position.")
@click.option("--feed", type=click.FloatRange(0, min_open=True), metavar="MM/MIN",
              help="Feed of cuts before the program's first F.")
@click.option("--fmu", type=NEW_FILE, help="Write the servo as a co-simulation unit (FMI 2.0) here.")
@click.option("--fmu-sources", is_flag=True, help="The unit with its C sources only: no compiler needed here.")
@click.option("--schema", is_flag=True, help="Print the JSON schema of drive files, for editors.")
@REPLACE
@OUTPUT
@JSON
def drive(drives: Path | None, program: Path | None, circle: Circle, machine: Path | None, pose: Pose, grid: tuple[str, ...],
          ideal: tuple[str, ...], feed: float | None,
          fmu: Path | None, fmu_sources: bool, schema: bool, output: Path, as_json: bool) -> None:
    """Contour error, torque and loops of a servo along a program or a circle; DRIVES is a YAML file of axes and control.
    Rotary axes (kind reducer) have no path of their own: without one their loops are told."""
    if schema:
        from toolpoint.io.yaml.drive_file import json_schema

        click.echo(json.dumps(json_schema(), indent=2))
        return
    if drives is None:
        raise click.UsageError("Missing argument 'DRIVES': a YAML file of axes and control.")
    if grid:
        _map(drives, machine, grid, circle, output, as_json)
        return
    if fmu is not None:
        _export(drives, fmu, machine, pose, fmu_sources)
        if program is None and circle is None:
            return
    if program is None and circle is None and _loops(drives, as_json):
        return
    if (program is None) == (circle is None):
        raise ToolpointError("drive: give either --program FILE or --circle RADIUS,FEED")
    _run(drives, program, circle, machine, pose, ideal, feed, output, as_json)


@click.command("servo-data")
@click.argument("file", type=FILE)
@click.option("--unit", "units", multiple=True, metavar="COLUMN=UNIT", help="Unit of a column of a table that names none.")
@click.option("--sample-time", type=click.FloatRange(0, min_open=True), help="s; of a table without a time column.")
@OUTPUT
@JSON
def servo_data(file: Path, units: tuple[str, ...], sample_time: float | None, output: Path, as_json: bool) -> None:
    """Friction, K_v, following error, loop margins or positioning from a controller's record FILE (Sinumerik, TNCscope, TwinCAT
    Scope, ISO 230-2 runs, tables)."""
    from toolpoint.io import read_servo_data

    named = dict(part.split("=", 1) for part in units if "=" in part)
    if len(named) != len(units):
        raise ToolpointError("--unit: write COLUMN=UNIT, for example --unit 'pos=mm'")
    with frame(output, as_json, steps=2) as run:
        run.step("reading")
        record = read_servo_data(file, named, sample_time)

        from toolpoint.pages.servos.servo_data import servo_data_page
        from toolpoint.studies import judge_servo_data

        result = judge_servo_data(record, source=file.name)
        run.step("page")
        run.save(servo_data_page(result, warnings=run.warnings))
    run.show(result)


def _loops(drives: Path, as_json: bool) -> bool:
    """Print the loops of rotary axes, which have no path of their own; return whether all are rotary."""
    from toolpoint.io.yaml import drive_file

    description = drive_file.read(drives)
    if any(axis.mechanics.kind != "reducer" for axis in description.axes.values()):
        return False
    from toolpoint.drives import build_servo, compute_loops

    with frame(None, as_json) as run:
        loops = compute_loops(build_servo(description))
    run.show(loops)
    return True


def _run(drives: Path, program: Path | None, circle: Circle, machine: Path | None, pose: Pose, ideal: tuple[str, ...],
         feed: float | None, output: Path, as_json: bool) -> None:
    """Simulate a program (G-code) or a circle (radius m, feed m/s)."""
    from toolpoint.io.yaml import drive_file

    with frame(output, as_json, steps=4) as run:
        run.step("reading")
        description = drive_file.read(drives)

        from toolpoint.app.poses import machine_at
        from toolpoint.io import read_program

        built = None if machine is None else machine_at(machine, pose)
        moves = None if program is None else read_program(program, feed=None if feed is None else feed * 1e-3 / 60)
        path = None if moves is None else moves.path

        from toolpoint.pages.servos.drive_experiment import drive_page
        from toolpoint.studies.servos.drive_experiment import run_drives

        result = run_drives(description, path=path, circle=circle, machine=built, pose=pose, ideal=ideal,
                            remarks=() if moves is None else moves.notes, progress=run.step)
        run.step("page")
        run.save(drive_page(result, source_text=drives.read_text(encoding="utf-8-sig"), warnings=run.warnings))
    run.warnings[:0] = result.notes
    run.show(result)


def _map(drives: Path, machine: Path | None, axes: tuple[str, ...], circle: Circle, output: Path, as_json: bool) -> None:
    """Map a servo over a grid of poses, one or two axes."""
    from toolpoint.app.poses import grid
    from toolpoint.io.yaml import drive_file, machine_file

    if machine is None:
        raise ToolpointError("--map: a map needs the machine; give --machine FILE")
    description, built = drive_file.read(drives), machine_file.read(machine)
    positions = grid(built, axes, "--map")

    from toolpoint.pages.servos.servo_map import servo_map_page
    from toolpoint.studies.servos.servo_map import map_servo

    with frame(output, as_json) as run, run.progress("poses") as progress:
        result = map_servo(description, machine=built, grid=positions, circle=circle, progress=progress)
    run.save(servo_map_page(result, warnings=run.warnings))
    run.show(result)


def _export(drives: Path, unit: Path, machine: Path | None, pose: Pose, sources_only: bool) -> None:
    """Write the servo as a functional mock-up unit (FMI 2.0, co-simulation)."""
    from toolpoint.app.poses import machine_at
    from toolpoint.drives.build import build_servo
    from toolpoint.io import fmu
    from toolpoint.io.yaml import drive_file
    from toolpoint.studies.servos.drive_structure import structure_of

    with frame(None, False) as run:
        description = drive_file.read(drives)
        built = None if machine is None else machine_at(machine, pose)
        servo = build_servo(description, structure_of(description, built, pose))
    if any(axis.mechanics.nut_moves for axis in description.axes.values()):
        run.warnings.append("nut_moves: the unit keeps every nut at its nut_position")
    fmu.write(servo, unit, description.name, substeps=description.substeps, binary=not sources_only)
    run.show_rest(written={"Unit": unit})
