"""Commands about what an identified machine answers: frf, next-test."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.options import FILE, JSON, OUTPUT, PATH, POSE, POSES, lines_of


@click.command()
@click.argument("machine", type=FILE)
@POSES
@click.option("--at", "outputs", multiple=True, metavar="POINT:DIRECTION",
              help="Response seen here, e.g. tool-table:+x or 7:+z; several times. Tool against table where left out.")
@click.option("--force", "inputs", multiple=True, metavar="POINT:DIRECTION",
              help="Force here; where it is seen, where left out.")
@click.option("--lines", callback=lines_of, metavar="LOW:HIGH:NUMBER",
              help="Lines in Hz, for example 5:400:1600; over all modes where left out.")
@click.option("--save", type=PATH, help="Save the responses here: universal (.uff) or HDF5 (.h5) file, one pose.")
@OUTPUT
@JSON
def frf(machine: Path, poses: Sequence[dict[str, float]], outputs: Sequence[str], inputs: Sequence[str], lines: Any,
        save: Path | None, output: Path, as_json: bool) -> None:
    """Frequency responses of a machine at poses, tool against table, with 95 % intervals where its numbers were identified."""
    from toolpoint.app.poses import machine_at

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
        write_responses(result.frfs[0], save)
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


def write_responses(response: object, path: Path) -> None:
    """Write responses as the suffix says: HDF5 or universal."""
    from toolpoint.io import hdf5, uff
    from toolpoint.io.suffixes import HDF5, UNIVERSAL
    from toolpoint.vibration import Frf

    assert isinstance(response, Frf)
    if path.suffix.lower() in HDF5:
        hdf5.write(response, path)
    elif path.suffix.lower() in UNIVERSAL:
        uff.write(path, response)
    else:
        raise ToolpointError(f"--save {path}: the name must end in .h5 or .uff")
