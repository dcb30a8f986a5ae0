"""Commands about a machine file: report, modes, check, map, schema."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import Result, frame
from toolpoint.app.naming import naming_options
from toolpoint.app.options import BAND, FILE, JSON, OUTPUT, PATH, POSE, QUANTITY, lines_of

if TYPE_CHECKING:
    from toolpoint.machine import Machine


@click.command()
@click.argument("machine", required=False, type=FILE)
@POSE
@click.option("--frf", multiple=True, type=FILE,
              help="Measured FRFs: universal, HDF5, MATLAB, NumPy, or text (Hz, real, imaginary); several text files, driving "
                   "point first.")
@QUANTITY
@naming_options
@BAND
@OUTPUT
def report(machine: Path | None, pose: dict[str, float] | None, frf: Sequence[Path], quantity: str | None,
           naming: dict[str, Any], band: tuple[float, float] | None, output: Path) -> None:
    """The page of your machine (YAML) and of your measured FRFs; either may be left out."""
    from toolpoint.app import console
    from toolpoint.app.dynamics import read_responses

    if machine is None and not frf:
        raise ToolpointError("report: neither a machine file nor --frf given; needs at least one of them")
    if machine is None and pose:
        raise ToolpointError("--pose: needs a machine file to be applied to")
    results, cut = list[Result](), None
    with frame(output, False, steps=6) as run:
        run.step("reading")
        built = _read_machine(machine, pose)
        before = len(run.warnings)
        responses = read_responses(frf, quantity, naming) if frf else None
        of_responses = run.warnings[before:]

        from toolpoint.pages.machines.machine import machine_page
        from toolpoint.pages.measured.responses import with_measured
        from toolpoint.plot import Report
        from toolpoint.studies.cuts.measured_response import study_responses
        from toolpoint.studies.machines.machine_report import study_machine

        page = Report("Measured frequency responses", subtitle=", ".join(file.name for file in frf))
        if built is not None and machine is not None:
            cut = built.description.cutting
            results.append(studied := study_machine(built, pose, step=run.step))
            page = machine_page(studied, machine.read_text(encoding="utf-8-sig"), machine.name,
                                problems=[text for text in run.warnings if text not in of_responses])
        notes: tuple[str, ...] = ()
        if responses is not None:
            run.step("measured responses")
            before = len(run.warnings)
            results.append(measured := study_responses(responses, cut, band))
            page, notes = with_measured(page, measured, [*of_responses, *run.warnings[before:]]), measured.notes
        run.step("page")
        run.save(page)
    for result in results:
        console.text(result.table())
    run.show_rest(notes)
    if built is not None:
        console.suggest(*_next(built, str(machine)))


def _read_machine(file: Path | None, pose: dict[str, float] | None) -> Machine | None:
    if file is None:
        return None
    from toolpoint.app.poses import machine_at

    return machine_at(file, pose)


def _next(machine: Any, file: str) -> list[str]:
    """Return the commands that look at the machine elsewhere: over its first axis, and at the end of its travel."""
    axis = next((axis for axis in machine.chain.axes if abs(axis.lower) + abs(axis.upper) < 1e3), None)
    if axis is None:
        return [f"sensitivity {file}"]
    low, high = (axis.words(end).replace(" ", "") for end in (axis.lower, axis.upper))
    lobes = [] if machine.description.cutting is None else [f"lobes {file} --pose {axis.name}={high}"]
    return [f"map {file} --axis {axis.name}={low}:{high}:21", *lobes]


@click.command()
@click.argument("machine", type=FILE)
@POSE
@click.option("--count", type=click.IntRange(1), default=12, show_default=True, help="How many of the lowest modes.")
@click.option("--mass", "mass_file", type=FILE, help="Mass matrix, where MACHINE is a file of a stiffness matrix alone.")
@click.option("--matrices", "names", metavar="K,M", help="Names of stiffness and mass in files that hold several matrices.")
@click.option("--units", type=click.Choice(["m-kg-s", "mm-t-s"]), default="m-kg-s", show_default=True,
              help="Of the matrices: newtons a metre and kilograms, or newtons a millimetre and tonnes.")
@JSON
def modes(machine: Path, pose: dict[str, float] | None, count: int, mass_file: Path | None, names: str | None,
          units: Literal["m-kg-s", "mm-t-s"], as_json: bool) -> None:
    """Natural frequencies of a machine file at a pose, or of stiffness and mass matrices (.full, .op4, .pch, .mtx, .hb)."""
    from toolpoint.io.suffixes import MATRICES

    if mass_file is not None or machine.suffix.lower() in MATRICES:
        _show_matrix_modes(machine, mass_file, count, as_json, names=names, units=units)
        return
    if names is not None or units != "m-kg-s":
        raise click.UsageError(f"{machine} is a machine file: --matrices and --units are of files of matrices")
    from toolpoint.app.poses import machine_at

    with frame(None, as_json) as run:
        built = machine_at(machine, pose)

        from toolpoint.studies.machines.machine_modes import solve_modes

        result = solve_modes(built, pose, count)
    run.show(result)


def _show_matrix_modes(stiffness: Path, mass: Path | None, count: int, as_json: bool, *, names: str | None,
                       units: Literal["m-kg-s", "mm-t-s"]) -> None:
    from toolpoint.io import read_matrices
    from toolpoint.studies import solve_matrix_modes

    with frame(None, as_json) as run:
        pair = None
        if names is not None:
            first, comma, second = (word.strip() for word in names.partition(","))
            if not comma or not first or not second or "," in second:
                raise click.UsageError(f"--matrices {names!r}: must be two names with a comma between them, such as KAA,MAA")
            pair = first, second
        result = solve_matrix_modes(read_matrices(stiffness, mass, names=pair, units=units), count)
    run.show(result, result.notes)


@click.command("map")
@click.argument("machine", type=FILE)
@click.option("--axis", "axes", multiple=True, required=True, metavar="X=-300mm:300mm:21",
              help="Axis with first position, last position and number of positions (m or rad without a unit); several times.")
@click.option("--count", type=click.IntRange(1), default=6, show_default=True, help="How many of the lowest modes.")
@click.option("--quantity", type=click.Choice(["frequency", "static", "dynamic", "response"]), default="frequency",
              show_default=True, help="Natural frequencies; static or dynamic stiffness, or responses, of tool against work.")
@click.option("--lines", callback=lines_of, metavar="LOW:HIGH:NUMBER", help="Lines of the responses in Hz, for example "
              "5:400:1600; over the lowest twelve modes where left out.")
@click.option("--workers", default=0, show_default=True, help="Worker processes (extra 'cluster'); 0 is this process.")
@click.option("--folder", type=PATH, help="Keep finished parts here and resume from them.")
@OUTPUT
@JSON
def frequency_map(machine: Path, axes: Sequence[str], count: int, quantity: str, lines: Any, workers: int,
                  folder: Path | None, output: Path, as_json: bool) -> None:
    """Natural frequencies, or the tool's stiffness or responses, over a grid of axis positions; chatter limits: map-chatter."""
    from toolpoint.app.poses import grid
    from toolpoint.io.yaml import machine_file

    if lines is not None and quantity != "response":
        raise click.UsageError(f"--lines: is for --quantity response; {quantity} has none")

    built = machine_file.read(machine)
    positions = grid(built, axes, "--axis")

    from toolpoint.pages.machines.frequency_map import map_page
    from toolpoint.studies.execute import Dask, Serial
    from toolpoint.studies.machines.pose_map import PoseMap, pose_map
    from toolpoint.studies.machines.response_map import ResponseMap, response_map
    from toolpoint.studies.machines.stiffness_map import StiffnessMap, stiffness_map

    engine = Dask(workers) if workers else Serial()
    with frame(None if as_json else output, as_json) as run, run.progress("blocks of poses", folder) as progress:
        result: PoseMap | StiffnessMap | ResponseMap
        if quantity == "response":
            result = response_map(built, positions, lines, engine=engine, folder=folder, progress=progress)
        elif quantity == "frequency":
            result = pose_map(built, positions, count, engine=engine, folder=folder, progress=progress)
        else:
            result = stiffness_map(built, positions, quantity, engine=engine, folder=folder, progress=progress)
    if not as_json:
        run.save(map_page(result, machine.stem))
    run.warnings += result.failed()
    run.show(result, getattr(result, "notes", ()))


@click.command()
@click.argument("machine", type=FILE)
@click.option("--speeds", default="0:24000:25", show_default=True, metavar="FIRST:LAST:NUMBER", help="Spindle speeds, rev/min.")
@click.option("--count", type=click.IntRange(1), default=8, show_default=True, help="How many of the lowest modes.")
@click.option("--order", "orders", multiple=True, type=float, default=(1.0, 2.0), show_default=True,
              help="Excitations per revolution; several times.")
@POSE
@OUTPUT
@JSON
def campbell(machine: Path, speeds: str, count: int, orders: tuple[float, ...], pose: dict[str, float] | None, output: Path,
             as_json: bool) -> None:
    """Natural frequencies of a machine with spinning bodies over the spindle speed, whirl and critical speeds."""
    import numpy as np

    from toolpoint.app.poses import machine_at

    try:
        first, last, number = speeds.split(":")
        lines = np.linspace(float(first), float(last), int(number))
    except ValueError:
        raise click.BadParameter(f"--speeds {speeds!r}: write FIRST:LAST:NUMBER, for example 0:24000:25") from None
    with frame(output, as_json, steps=2) as run:
        run.step("modes at every speed")
        built = machine_at(machine, pose)

        from toolpoint.pages.machines.campbell import campbell_page
        from toolpoint.studies.machines.campbell import map_speeds

        result = map_speeds(built, lines, count, pose=pose, orders=orders)
        run.step("page")
        run.save(campbell_page(result))
    run.show(result)


@click.command()
@click.argument("kind", default="machine")
def schema(kind: str) -> None:
    """The JSON schema of a KIND of file, for editors that check YAML while it is typed.

    KIND is machine (the default), servo, choice (of `identify --choice`), components, test, shaft, plan or datasheet.
    """
    from toolpoint.io.yaml.file_kinds import json_schema

    click.echo(json.dumps(json_schema(kind), indent=2))
