"""Commands about measurements, and a model beside its test: identify, joints, update, correlate, sensitivity."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from toolpoint._check import ToolpointError
from toolpoint.app.frame import frame
from toolpoint.app.naming import naming_options
from toolpoint.app.options import BAND, FILE, GEOMETRY, JSON, NEW_FILE, OUTPUT, POSE, POSES, QUANTITY, REPLACE
from toolpoint.app.pole_choice import Choice, CommandOfChoice, choice_options

LEGEND = ("share: part of the responses at its frequency that a mode carries, with those that overlap and look like it; "
          "* stands out, ? doubtful")


def _pairs(ctx: click.Context, parameter: click.Parameter, value: Sequence[str]) -> dict[str, str]:
    result = {}
    for part in value:
        test, equals, model = part.partition("=")
        if not equals or not test.strip() or not model.strip():
            raise click.BadParameter(f"{part!r}: write TEST=MODEL, for example 12=spindle_nose")
        result[test.strip()] = model.strip()
    return result


@click.command(cls=CommandOfChoice)
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--geometry", type=FILE, help=GEOMETRY)
@click.option("--lines", "drawn", type=FILE, help="Lines between points: CSV (points that a line runs through), or universal.")
@click.option("--method", default="refined", show_default=True, help="Identification method.")
@BAND
@QUANTITY
@naming_options
@click.option("-m", "--modes", "modes_file", type=NEW_FILE, help="Save the modes here (HDF5).")
@choice_options
@REPLACE
@OUTPUT
@JSON
def identify(files: Sequence[Path], geometry: Path | None, drawn: Path | None, method: str, band: tuple[float, float] | None,
             quantity: str | None, naming: dict[str, Any], modes_file: Path | None, choice: Choice, output: Path,
             as_json: bool) -> None:
    """Modes of measured FRFs (universal, HDF5, MATLAB, NumPy or text files), with confidence intervals and a page.

    An output that ends in .h5 is where the modes are saved; the page then goes to its default folder.
    """
    from toolpoint.app import console
    from toolpoint.io.binary import hdf5
    from toolpoint.io.measured import frf_files, geometry_files

    if output.suffix == ".h5":
        modes_file, output = output, Path("toolpoint-report")
    if modes_file is not None and not modes_file.parent.is_dir():
        raise ToolpointError(f"{modes_file}: the folder {modes_file.parent} does not exist; create it first")
    if drawn is not None and geometry is None:
        raise ToolpointError(f"--lines {drawn}: given without --geometry; lines need the places of their points")
    with frame(output, as_json, steps=3) as run:
        run.step("reading")
        frf = frf_files.read(files, quantity=quantity, **naming)
        shape = None if geometry is None else geometry_files.read(geometry)
        shape = shape if shape is None or drawn is None else geometry_files.read_lines(drawn, shape)
        run.step("identification")

        from toolpoint.pages.measured.identification import identification_page
        from toolpoint.studies.measured.identification import identify_modes

        result = identify_modes(frf, method, band, choice=choice.read())
        run.step("page")
        run.save(identification_page(result, shape, [file.name for file in files], warnings=run.warnings,
                                     command=choice.command))
        if modes_file is not None:
            hdf5.write(result.modes, modes_file)
    if as_json:
        run.show(result)
        return
    console.text("\n".join([result.table(), LEGEND, result.status]))
    run.warnings += [note for note in frf.notes if not any(console.spell_options(note) in text for text in run.warnings)]
    if modes_file is not None:
        console.text(f"Modes saved: {modes_file}")
    run.show_rest()


@click.command()
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--geometry", required=True, type=FILE, help=GEOMETRY)
@click.option("--components", required=True, type=FILE,
              help="YAML: which points belong to which component, the chain, masses where known.")
@click.option("--machine", "written", type=NEW_FILE, help="Write the identified machine here.")
@click.option("--coordinate-deviation", type=float,
              help="Standard deviation of the points' coordinates, mm, in place of that of the component file.")
@BAND
@REPLACE
@OUTPUT
@JSON
def joints(files: Sequence[Path], geometry: Path, components: Path, written: Path | None, coordinate_deviation: float | None,
           band: tuple[float, float] | None, output: Path, as_json: bool) -> None:
    """Joints of a machine from measured FRFs or saved modes: where, how free, how stiff; and a machine file that runs."""
    from toolpoint.io.measured import geometry_files
    from toolpoint.io.yaml import component_file, machine_file

    with frame(output, as_json, steps=4) as run:
        run.step("reading")
        shape, described = geometry_files.read(geometry), component_file.read(components)
        run.step("modes")
        modes, doubts = _modes_of(files, band)
        run.step("joints")

        from toolpoint.pages.measured.joints import joints_page
        from toolpoint.studies.measured.joint_study import study_joints

        deviation = None if coordinate_deviation is None else 1e-3 * coordinate_deviation
        result = study_joints(modes, shape, described, coordinate_deviation=deviation, channel_doubts=doubts)
        if written is not None and result.machine is not None:
            machine_file.write(result.machine, written)
            # What is written is read back and run before it is called the machine of the test.
            result = result.compared(machine_file.read(written))
        run.step("page")
        run.save(joints_page(result, run.warnings))
    run.warnings = [text for text in run.warnings if not text.startswith("doubtful")]
    run.show(result, written={"Machine file": written if result.machine is not None else None})
    if written is not None and result.machine is None:
        raise ToolpointError(f"--machine {written}: not written, because {result.missing}")


def _modes_of(files: Sequence[Path], band: tuple[float, float] | None) -> tuple[Any, tuple[str, ...]]:
    """Return the saved modes of the only file, or those identified from responses with the doubts of their channels."""
    from toolpoint.io.measured import frf_files, mode_files

    if len(files) == 1 and mode_files.holds_modes(files[0]):
        return mode_files.read(files[0]), ()
    frf = frf_files.read(files)

    from toolpoint.studies.measured.identification import identify_modes

    # All lines: what a tester of joints leaves out, he says himself.
    result = identify_modes(frf, band=band or (float(frf.frequency[0]), float(frf.frequency[-1])))
    return result.modes, result.doubts


@click.command()
@click.argument("machine", type=FILE)
@click.option("--modes", multiple=True, type=FILE,
              help="Measured modes, saved by identify (HDF5); several times for several measurements.")
@click.option("--frf", multiple=True, type=FILE,
              help="Measured FRFs (universal, HDF5, MATLAB, text); with several poses one file for each.")
@click.option("--parameter", "paths", multiple=True, metavar="joints.NAME.stiffness.rx",
              help="Parameter to update; all joint stiffnesses where none is named.")
@POSES
@click.option("--samples", default=0, metavar="STEPS", show_default="none", type=click.IntRange(min=0),
              help="Sample the posterior by so many steps of every walker, for example 2000 (extra 'bayes').")
@click.option("--seed", default=1, show_default=True, help="Seed of the samples.")
@click.option("--machine", "written", type=NEW_FILE, help="Write the updated machine here.")
@REPLACE
@OUTPUT
@JSON
def update(machine: Path, modes: tuple[Path, ...], frf: tuple[Path, ...], paths: tuple[str, ...],
           poses: tuple[dict[str, float], ...], samples: int, seed: int, written: Path | None, output: Path,
           as_json: bool) -> None:
    """The machine that agrees with measured modes or responses: what the data can tell is moved, the rest is named.

    Measurements at several poses: --modes a.h5 --pose X=0 --modes b.h5 --pose X=0.2
    """
    from toolpoint.app.poses import machine_at
    from toolpoint.io.yaml import machine_file

    with frame(output, as_json, steps=3) as run:
        run.step("reading")
        built, measured = machine_at(machine, *poses), _measurements(modes, frf, poses)

        from toolpoint.pages.measured.update import update_page
        from toolpoint.studies.measured.measured_update import update_machine

        run.step("updating")
        what = ", ".join(path.name for path in (*modes, *frf))
        result = update_machine(built, measured, paths, samples=samples, seed=seed, what=what)
        if written is not None:
            machine_file.write(result.machine.description, written)
        run.step("page")
        run.save(update_page(result, run.warnings))
    run.show(result, written={"Machine file": written})


def _measurements(modes: Sequence[Path], frf: Sequence[Path], poses: Sequence[dict[str, float]]) -> list[Any]:
    """Read the measurements of files and poses given in order.

    One pose or none: all response files are one measurement, joined by the modes where there is one file of them; more
    files of modes are repeated measurements. Several poses: one file of modes, of responses, or of each, for every pose.
    """
    from toolpoint.io.measured import frf_files, mode_files

    if not modes and not frf:
        raise ToolpointError("update: neither --modes nor --frf given; needs at least one measurement")
    for name, files in (("--modes", modes), ("--frf", frf)):
        if len(poses) > 1 and files and len(files) != len(poses):
            raise ToolpointError(f"{name}: {len(files)} files for {len(poses)} poses; must be one for each, in "
                                 f"their order, or none ({name} a.h5 --pose X=0 {name} b.h5 --pose X=0.2)")
    read = [mode_files.read(path) for path in modes]
    responses = [frf_files.read(path) for path in frf] if len(poses) > 1 else []
    joined = frf_files.read(frf) if frf and len(poses) <= 1 else None

    from toolpoint.studies.measured.measured_update import Measurement

    if len(poses) > 1:
        return [Measurement(read[k] if read else None, responses[k] if responses else None, pose)
                for k, pose in enumerate(poses)]
    pose = poses[0] if poses else None
    if len(read) <= 1:
        return [Measurement(read[0] if read else None, joined, pose)]
    return [*(Measurement(part, None, pose) for part in read), *([] if joined is None else [Measurement(None, joined, pose)])]


@click.command()
@click.argument("machine", type=FILE)
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option("--geometry", type=FILE, help=GEOMETRY)
@click.option("--components", type=FILE,
              help="YAML: which measured points ride on which body of the machine; otherwise points are paired by place.")
@click.option("--pair", "pairs", multiple=True, callback=_pairs, metavar="TEST=MODEL",
              help="A measured point and the machine's point that it is; at least three fix the registration.")
@click.option("--furthest", default=50.0, show_default=True, help="Points further apart stay single, mm.")
@click.option("--before", type=FILE, help="The machine before updating, shown beside.")
@click.option("--lowest-mac", default=0.5, show_default=True, help="Modes below are not paired.")
@BAND
@POSE
@OUTPUT
@JSON
def correlate(machine: Path, files: tuple[Path, ...], geometry: Path | None, components: Path | None, pairs: dict[str, str],
              furthest: float, before: Path | None, lowest_mac: float, band: tuple[float, float] | None,
              pose: dict[str, float] | None, output: Path, as_json: bool) -> None:
    """A test (measured FRFs or saved modes) beside a machine: points, MAC, COMAC, FRAC; where and by how much they differ."""
    from toolpoint.app.poses import machine_at
    if components is not None and geometry is None:
        raise ToolpointError("--components: needs --geometry for the positions of the points")
    with frame(output, as_json, steps=3) as run:
        run.step("reading")
        built, first = machine_at(machine, pose), None if before is None else machine_at(before, pose)

        from toolpoint.io.measured import frf_files, geometry_files, mode_files
        from toolpoint.io.yaml import component_file

        saved = [file for file in files if mode_files.holds_modes(file)]
        responses = [file for file in files if file not in saved]
        measured = mode_files.read(saved[-1]) if saved else None, frf_files.read(responses) if responses else None
        shape = None if geometry is None else geometry_files.read(geometry)
        owner = None if components is None else component_file.read(components).points
        run.step("correlation")

        from toolpoint.pages.measured.correlation import correlation_page
        from toolpoint.studies.measured.measured_comparison import compare_with_test, gather_test

        test = gather_test(*measured, geometry=shape, band=band, owner=owner)
        result = compare_with_test(built, test, pose=pose, known=pairs, furthest=1e-3 * furthest, before=first,
                                   lowest_mac=lowest_mac)
        run.step("page")
        run.save(correlation_page(result, run.warnings))
    run.show(result)


@click.command()
@click.argument("machine", type=FILE)
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
    from toolpoint.app.poses import machine_at

    with frame(output, as_json, steps=2) as run:
        run.step("sensitivities")
        built = machine_at(machine, pose)

        from toolpoint.pages.machines.sensitivity import sensitivity_page
        from toolpoint.studies.machines.sensitivity_study import study_sensitivity

        result = study_sensitivity(built, paths or None, min(count, built.size), pose=pose)
        run.step("page")
        run.save(sensitivity_page(result, built, 1e-2 * change, pose=pose, warnings=run.warnings))
    run.show(result)
