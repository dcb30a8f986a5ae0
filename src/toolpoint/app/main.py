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
from toolpoint.app import console, cutting_commands, machine_commands, model_commands
from toolpoint.app.options import JSON as _JSON
from toolpoint.app.options import OUTPUT as _OUTPUT
from toolpoint.app.options import POSE as _POSE


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


for _command in (machine_commands.demo, machine_commands.report, machine_commands.modes, machine_commands.check,
                 machine_commands.frequency_map, machine_commands.schema, model_commands.identify, model_commands.joints,
                 model_commands.update, model_commands.correlate, model_commands.sensitivity, cutting_commands.lobes,
                 cutting_commands.turn, cutting_commands.mill, cutting_commands.map_chatter, cutting_commands.speeds,
                 cutting_commands.calibrate):
    cli.add_command(_command)


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
