"""Commands about a model and its test: joints, update, correlate, sensitivity."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import click

from toolpoint.app.options import JSON, OUTPUT, POSE, POSES
from toolpoint.app.options import band as band_of


def _pairs(ctx: click.Context, parameter: click.Parameter, value: Sequence[str]) -> dict[str, str]:
    result = {}
    for part in value:
        test, equals, model = part.partition("=")
        if not equals or not test.strip() or not model.strip():
            raise click.BadParameter(f"{part!r}: write TEST=MODEL, for example 12=spindle_nose")
        result[test.strip()] = model.strip()
    return result


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--geometry", required=True, type=click.Path(path_type=Path),
              help="Universal file, CSV (point,x,y,z in m), or machine YAML.")
@click.option("--components", required=True, type=click.Path(path_type=Path),
              help="YAML: which points belong to which component, the chain, masses where known.")
@click.option("--machine", "machine_file", type=click.Path(path_type=Path), help="Write the identified machine here.")
@click.option("--coordinate-deviation", default=0.0, show_default=True,
              help="Standard deviation of the points' coordinates, mm; it enters all intervals.")
@click.option("--band", callback=band_of, metavar="LOW:HIGH", help="Part of the lines to use, Hz.")
@OUTPUT
@JSON
def joints(files: Sequence[Path], geometry: Path, components: Path, machine_file: Path | None, coordinate_deviation: float,
           band: tuple[float, float] | None, output: Path, as_json: bool) -> None:
    """Joints of a machine from measured FRFs or saved modes: where, how free, how stiff; and a machine file that runs."""
    from toolpoint.app import joints as work

    run = work.joints(files, geometry, components, machine_file, band, output, as_json, 1e-3 * coordinate_deviation)
    if as_json:
        click.echo(json.dumps({"joints": [one.as_dict() for one in run.joints.joints], "status": run.joints.status}))


@click.command()
@click.argument("machine", type=click.Path(path_type=Path))
@click.option("--modes", multiple=True, type=click.Path(path_type=Path),
              help="Measured modes, saved by identify (HDF5); several times for several measurements.")
@click.option("--frf", multiple=True, type=click.Path(path_type=Path),
              help="Measured FRFs (universal, HDF5, MATLAB, text); with several poses one file for each.")
@click.option("--parameter", "paths", multiple=True, metavar="joints.NAME.stiffness.rx",
              help="Parameter to update; all joint stiffnesses where none is named.")
@POSES
@click.option("--samples", default=0, metavar="STEPS", show_default="none", type=click.IntRange(min=0),
              help="Sample the posterior by so many steps of every walker, for example 2000 (extra 'bayes').")
@click.option("--seed", default=1, show_default=True, help="Seed of the samples.")
@click.option("--machine", "machine_file", type=click.Path(path_type=Path), help="Write the updated machine here.")
@OUTPUT
@JSON
def update(machine: Path, modes: tuple[Path, ...], frf: tuple[Path, ...], paths: tuple[str, ...],
           poses: tuple[dict[str, float], ...], samples: int, seed: int, machine_file: Path | None, output: Path,
           as_json: bool) -> None:
    """The machine that agrees with measured modes or responses: what the data can tell is moved, the rest is named.

    Measurements at several poses: --modes a.h5 --pose X=0 --modes b.h5 --pose X=0.2
    """
    from toolpoint.app import update as work

    run = work.update_machine(machine, modes, frf, paths, poses, machine_file, output, as_json, samples, seed)
    if as_json:
        drawn = run.samples
        click.echo(json.dumps({"values": run.update.fit.values, "status": run.update.fit.status} | (
            {} if drawn is None else {"samples": drawn.status, "intervals": {n: drawn.interval(n) for n in drawn.names}})))


@click.command()
@click.argument("machine", type=click.Path(path_type=Path))
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--geometry", type=click.Path(path_type=Path), help="Universal file, CSV (point,x,y,z in m), or machine YAML.")
@click.option("--components", type=click.Path(path_type=Path),
              help="YAML: which measured points ride on which body of the machine; otherwise points are paired by place.")
@click.option("--pair", "pairs", multiple=True, callback=_pairs, metavar="TEST=MODEL",
              help="A measured point and the machine's point that it is; at least three fix the registration.")
@click.option("--furthest", default=50.0, show_default=True, help="Points further apart stay single, mm.")
@click.option("--before", type=click.Path(path_type=Path), help="The machine before updating, shown beside.")
@click.option("--lowest-mac", default=0.5, show_default=True, help="Modes below are not paired.")
@click.option("--band", callback=band_of, metavar="LOW:HIGH", help="Part of the lines to use, Hz.")
@POSE
@OUTPUT
@JSON
def correlate(machine: Path, files: tuple[Path, ...], geometry: Path | None, components: Path | None, pairs: dict[str, str],
              furthest: float, before: Path | None, lowest_mac: float, band: tuple[float, float] | None,
              pose: dict[str, float] | None, output: Path, as_json: bool) -> None:
    """A test (measured FRFs or saved modes) beside a machine: points, MAC, COMAC, FRAC; where and by how much they differ."""
    from toolpoint.app import correlate as work

    run = work.correlate_files(machine, files, geometry, components, pairs, 1e-3 * furthest, before, pose, band, lowest_mac,
                               output, as_json)
    if as_json:
        click.echo(json.dumps(work.as_dict(run.now)))


@click.command()
@click.argument("machine", type=click.Path(path_type=Path))
@click.option("--parameter", "paths", multiple=True, metavar="joints.NAME.stiffness.rx",
              help="Parameter to study; all stiffnesses, dampers, masses and densities where none is named.")
@click.option("--count", default=6, show_default=True, help="How many of the lowest modes.")
@click.option("--change", default=10.0, show_default=True, help="Change of a parameter that MAC values are given for, %.")
@POSE
@OUTPUT
@JSON
def sensitivity(machine: Path, paths: tuple[str, ...], count: int, change: float, pose: dict[str, float] | None, output: Path,
                as_json: bool) -> None:
    """What every joint stiffness, damper, mass and density does to frequencies, damping and shapes: alone and per part."""
    from toolpoint.app import sensitivity as work

    found = work.sensitivity(machine, paths, count, 1e-2 * change, pose, output, as_json)
    if as_json:
        click.echo(json.dumps({"frequency_hz": found.frequencies.tolist(), "relative_sensitivity": {
            path: row.tolist() for path, row in zip(found.paths, found.frequency, strict=True)}}))
