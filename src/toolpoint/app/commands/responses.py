"""Commands about what an identified machine answers: frf, next-test."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, NEW_FILE, OUTPUT, POSE, POSES, REPLACE, lines_of
from toolpoint.app.record_options import RecordOptions, measure, record_options


@click.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@POSES
@click.option("--at", "outputs", multiple=True, metavar="POINT:DIRECTION",
              help="Response seen here, e.g. tool-table:+x or 7:+z; several times. Tool against table where left out.")
@click.option("--force", "inputs", multiple=True, metavar="POINT:DIRECTION",
              help="Force here; where it is seen, where left out.")
@click.option("--lines", callback=lines_of, metavar="LOW:HIGH:NUMBER",
              help="Lines in Hz, for example 5:400:1600; over all modes where left out.")
@click.option("--save", type=NEW_FILE, help="Save the responses here: .h5, .uff, .mat, .npz or .csv; of a machine one pose.")
@record_options
@REPLACE
@OUTPUT
@JSON
def frf(files: Sequence[Path], poses: Sequence[dict[str, float]], outputs: Sequence[str], inputs: Sequence[str], lines: Any,
        save: Path | None, output: Path, as_json: bool, **options: Any) -> None:
    """Frequency responses: of a machine file at poses, or of the records of a hammer test.

    FILES are one machine file (YAML): responses of the tool against the table, with 95 % intervals where its numbers were
    identified. Or records of hammer hits (universal 58, CSV, LVM, WAV, TDMS, MATLAB, NumPy, HDF5), one hit a file or many, or a
    test file (YAML with 'test' and 'records'): every hit is judged, and good ones give the responses.
    """
    records = RecordOptions(**options)
    if is_machine(files):
        if records.given:
            raise ToolpointError(f"{records.given[0]}: is for records of a hammer test; {files[0]} is a machine file")
        _respond(files[0], poses, outputs, inputs=inputs, lines=lines, save=save, output=output, as_json=as_json)
        return
    for name, value in (("--pose", poses), ("--at", outputs), ("--force", inputs), ("--lines", lines)):
        if value is not None and len(value):
            raise ToolpointError(f"{name}: is for a machine file; {files[0]} is a record of a hammer test")
    measure(files, records, save=save, output=output, as_json=as_json)


def is_machine(files: Sequence[Path]) -> bool:
    """Return whether the only file is a YAML file that is no test."""
    from toolpoint.io.suffixes import YAML

    if len(files) > 1 or files[0].suffix.lower() not in YAML:
        return False
    from toolpoint.io.yaml.file_kinds import kind_of

    return kind_of(files[0]) != "test"


def _respond(machine: Path, poses: Sequence[dict[str, float]], outputs: Sequence[str], *, inputs: Sequence[str], lines: Any,
             save: Path | None, output: Path, as_json: bool) -> None:
    from toolpoint.app.poses import machine_at

    if save is not None:
        from toolpoint.io.measured import frf_writing

        frf_writing.check_writable(save)
    if save is not None and len(poses) > 1:
        raise ToolpointError(f"--save {save}: {len(poses)} poses; a file of responses holds one; call once for each")
    with frame(output, as_json, steps=0) as run, run.progress("intervals") as progress:
        built = machine_at(machine, *poses)

        from toolpoint.pages.machines.machine_responses import responses_page
        from toolpoint.studies.machines.machine_responses import study_responses_of_machine

        result = study_responses_of_machine(
            built, list(poses) or None, list(outputs) or None, inputs=list(inputs) or None,
            frequency=lines, progress=progress)
    run.save(responses_page(result, run.warnings))
    if save is not None:
        from toolpoint.io.measured import frf_writing

        frf_writing.write(result.frfs[0], save)
    run.show(result, result.notes, {"Responses": save})


@click.command("next-test")
@click.argument("machine", type=FILE)
@POSE
@click.option("--axis", "axes", multiple=True, metavar="X=-300mm:300mm:5", help="Poses that could be tested next; several "
                                                                                "times.")
@click.option("--frequency-deviation", default=1e-4, show_default=True, help="Relative, of measured frequencies.")
@click.option("--shape-deviation", default=0.02, show_default=True, help="Of shapes, over the greatest motion of the mode.")
@JSON
def next_test(machine: Path, pose: dict[str, float] | None, axes: Sequence[str], frequency_deviation: float,
              shape_deviation: float, as_json: bool) -> None:
    """Which point, direction or pose, measured next, would narrow the tool's compliance at a pose most."""
    import itertools

    from toolpoint.app.poses import grid, machine_at

    with frame(None, as_json) as run, run.progress("slopes") as progress:
        built = machine_at(machine, pose)
        positions = grid(built, axes, "--axis") if axes else {}
        poses = [dict(zip(positions, map(float, row), strict=True)) for row in itertools.product(*positions.values())]

        from toolpoint.studies.machines.next_test import rank_tests

        result = rank_tests(built, pose, poses if axes else (), frequency_deviation=frequency_deviation,
                            shape_deviation=shape_deviation, progress=progress)
    run.show(result)
