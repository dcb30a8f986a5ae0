"""The command line `toolpoint`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

import toolpoint
from toolpoint._check import ToolpointError, suggestion
from toolpoint.app import console, cutting_commands, model_commands
from toolpoint.app.options import JSON as _JSON
from toolpoint.app.options import OUTPUT as _OUTPUT
from toolpoint.app.options import POSE as _POSE
from toolpoint.app.options import band as _band


class _Commands(click.Group):
    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            hint = suggestion(args[0], self.commands) if args else ""
            raise click.UsageError(f"{error.message} {hint}".strip(), ctx) from None


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(toolpoint.__version__, prog_name="toolpoint")
def cli() -> None:
    """Machine-tool dynamics: from measured vibration and a machine file to modes, tool-point responses and chatter limits."""


for _command in (model_commands.joints, model_commands.update, model_commands.correlate, model_commands.sensitivity,
                 cutting_commands.lobes, cutting_commands.turn, cutting_commands.mill, cutting_commands.map_chatter,
                 cutting_commands.speeds, cutting_commands.calibrate):
    cli.add_command(_command)


@cli.command()
@_OUTPUT
def demo(output: Path) -> None:
    """A published three-axis machining centre: modes, tool-point responses, stability lobes, and a page of them."""
    from toolpoint.app import run

    run.demo(output)


@cli.command()
@click.argument("machine", required=False, type=click.Path(path_type=Path))
@_POSE
@click.option("--frf", multiple=True, type=click.Path(path_type=Path),
              help="Measured FRFs: universal, HDF5, MATLAB, or text (Hz, real, imaginary); several text files, driving "
                   "point first.")
@click.option("--quantity", type=click.Choice(["receptance", "mobility", "accelerance"]),
              help="What FRF files hold that do not say; text: receptance where left out.")
@click.option("--band", callback=_band, metavar="LOW:HIGH", help="Part of the measured lines to use, Hz.")
@_OUTPUT
def report(machine: Path | None, pose: dict[str, float] | None, frf: Sequence[Path], quantity: str | None,
           band: tuple[float, float] | None, output: Path) -> None:
    """The page of your machine (YAML) and of your measured FRFs; either may be left out."""
    from toolpoint.app import run

    run.report(machine, pose, frf, output, quantity, band)


@cli.command()
@click.argument("machine", type=click.Path(path_type=Path))
@_POSE
@click.option("--count", type=click.IntRange(1), default=12, show_default=True, help="How many of the lowest modes.")
@_JSON
def modes(machine: Path, pose: dict[str, float] | None, count: int, as_json: bool) -> None:
    """Natural frequencies of a machine file at a pose."""
    from toolpoint.app import run

    found = run.modes(machine, pose, count)
    if as_json:
        click.echo(json.dumps({"frequency_hz": found.tolist()}))
        return
    console.table(machine.name, ["mode", "frequency Hz"], [[str(i + 1), f"{f:.4f}"] for i, f in enumerate(found)])


@cli.command()
@click.argument("machine", type=click.Path(path_type=Path))
@_JSON
def check(machine: Path, as_json: bool) -> None:
    """Check a machine file: all its faults at once, or what it holds."""
    from toolpoint.app import run
    from toolpoint.cutting.build import words

    found = run.check(machine)
    cut = None if found.description.cutting is None else words(found.description.cutting)
    if as_json:
        click.echo(json.dumps({"ok": True, "coordinates": found.size, "cutting": cut}))
        return
    click.echo(repr(found))
    if cut is not None:
        click.echo(f"cutting: {cut}")


@cli.command("map")
@click.argument("machine", type=click.Path(path_type=Path))
@click.option("--axis", "axes", multiple=True, required=True, metavar="X=-300mm:300mm:21",
              help="Axis with first position, last position and number of positions (m or rad without a unit); several times.")
@click.option("--count", type=click.IntRange(1), default=6, show_default=True, help="How many of the lowest modes.")
@click.option("--workers", default=0, show_default=True, help="Worker processes (extra 'cluster'); 0 is this process.")
@click.option("--folder", type=click.Path(path_type=Path), help="Keep finished parts here and resume from them.")
@_OUTPUT
@_JSON
def map_(machine: Path, axes: Sequence[str], count: int, workers: int, folder: Path | None, output: Path,
         as_json: bool) -> None:
    """Natural frequencies over a grid of axis positions; of chatter limits see map-chatter."""
    from toolpoint.app import maps

    found = maps.frequency_map(machine, axes, count, workers, folder, quiet=as_json)
    if as_json:
        click.echo(json.dumps(maps.plain(found)))
        return
    path = maps.page(found, machine).save(output)
    for words in maps.failures(found):
        console.ERR.print("warning: " + words, markup=False, style="yellow")
    console.table(repr(found), ["mode", "spread Hz"], [[str(i + 1), f"{s:.4f}"] for i, s in enumerate(found.spread())])
    console.OUT.print(f"Page written: {path}")


@cli.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--geometry", type=click.Path(path_type=Path), help="Universal file, CSV (point,x,y,z in m), or machine YAML.")
@click.option("--method", default="refined", show_default=True, help="Identification method.")
@click.option("--band", callback=_band, metavar="LOW:HIGH", help="Part of the lines to use, Hz.")
@click.option("--quantity", type=click.Choice(["receptance", "mobility", "accelerance"]),
              help="What the files hold, where they do not say.")
@click.option("-m", "--modes", "modes_file", type=click.Path(path_type=Path), help="Save the modes here (HDF5).")
@_OUTPUT
@_JSON
def identify(files: Sequence[Path], geometry: Path | None, method: str, band: tuple[float, float] | None,
             quantity: str | None, modes_file: Path | None, output: Path, as_json: bool) -> None:
    """Modes of measured FRFs (universal, HDF5, MATLAB or text files), with confidence intervals and a page.

    An output that ends in .h5 is where the modes are saved; the page then goes to its default folder.
    """
    from toolpoint.app import identify as work

    if output.suffix == ".h5":
        modes_file, output = output, Path("toolpoint-report")
    found = work.identify_files(files, geometry, modes_file, output, method, band, quantity, quiet=as_json)
    if as_json:
        click.echo(json.dumps(work.plain(found), allow_nan=False))


def _circle(ctx: click.Context, parameter: click.Parameter, value: str | None) -> tuple[float, float] | None:
    if not value:
        return None
    try:
        radius, feed = (float(part) for part in value.split(","))
    except ValueError:
        raise click.BadParameter(f"{value!r}: write RADIUS,FEED in mm and mm/min, for example 50,4000") from None
    if radius <= 0 or feed <= 0:
        raise click.BadParameter(f"{value!r}: radius and feed must be above zero")
    return 1e-3 * radius, 1e-3 / 60 * feed


@cli.command()
@click.argument("drives", required=False, type=click.Path(path_type=Path))
@click.option("--program", type=click.Path(path_type=Path), help="G-code (ISO and the common Siemens words), mm.")
@click.option("--circle", callback=_circle, metavar="RADIUS,FEED", help="A circular test instead, mm and mm/min.")
@click.option("--machine", type=click.Path(path_type=Path), help="Machine file whose structure the drives push against.")
@_POSE
@click.option("--map", "grid", multiple=True, metavar="X=-0.3:0.3:7",
              help="Margins and bandwidth over positions of the machine, with --circle its deviation too; one or two axes.")
@click.option("--fmu", type=click.Path(path_type=Path), help="Write the servo as a co-simulation unit (FMI 2.0) here.")
@click.option("--fmu-sources", is_flag=True, help="The unit with its C sources only: no compiler needed here.")
@click.option("--schema", is_flag=True, help="Print the JSON schema of drive files, for editors.")
@_OUTPUT
@_JSON
def drive(drives: Path | None, program: Path | None, circle: tuple[float, float] | None, machine: Path | None,
          pose: dict[str, float] | None, grid: tuple[str, ...], fmu: Path | None, fmu_sources: bool, schema: bool,
          output: Path, as_json: bool) -> None:
    """Contour error, torque and loops of a servo along a program or a circle; DRIVES is a YAML file of axes and control."""
    from toolpoint.app import drive as work

    if schema:
        from toolpoint.io.yaml.drive_file import json_schema

        click.echo(json.dumps(json_schema(), indent=2))
        return
    if drives is None:
        raise click.UsageError("Missing argument 'DRIVES': a YAML file of axes and control.")
    if fmu is not None and not grid:
        work.export(drives, fmu, machine=machine, pose=pose, sources_only=fmu_sources)
        if program is None and circle is None:
            return
    if grid:
        result: Any = work.drive_map(drives, machine, grid, circle=circle, output=output, quiet=as_json)
    else:
        result = work.drive(drives, program, circle, machine=machine, pose=pose, output=output, quiet=as_json)
    if as_json:
        click.echo(json.dumps(result.to_dict()))


@cli.command()
def schema() -> None:
    """The JSON schema of machine files, for editors that check YAML while it is typed."""
    from toolpoint.io.yaml.machine_schema import json_schema

    click.echo(json.dumps(json_schema(), indent=2))


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; a wrong input ends with its message and exit code 2, never with a traceback."""
    try:
        cli.main(args=None if arguments is None else list(arguments), prog_name="toolpoint", standalone_mode=False)
    except ToolpointError as error:
        console.error(str(error))
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(0)
    except OSError as error:
        console.error(f"{error.filename or 'a file'}: {error.strerror or error}; check the name and the folder")
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        console.error("interrupted; finished parts of a study are kept where it was given a --folder")
        sys.exit(130)
