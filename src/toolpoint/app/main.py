"""The command line `toolpoint`."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Any

import click

import toolpoint
from toolpoint._check import ToolpointError, suggestion
from toolpoint.app import (
    accuracy_commands,
    console,
    coupling_commands,
    cutting_commands,
    demo_commands,
    drive_commands,
    machine_commands,
    model_commands,
    response_commands,
    robot_commands,
    video_commands,
)


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


for _command in (demo_commands.demo, machine_commands.report, machine_commands.modes, machine_commands.check,
                 machine_commands.frequency_map, machine_commands.campbell,
                 response_commands.frf, response_commands.next_test, machine_commands.schema, model_commands.identify,
                 model_commands.joints,
                 model_commands.update, model_commands.correlate, model_commands.sensitivity, cutting_commands.lobes,
                 cutting_commands.turn, cutting_commands.mill, cutting_commands.map_chatter, cutting_commands.speeds,
                 cutting_commands.calibrate, coupling_commands.rcsa, drive_commands.drive,
                 drive_commands.servo_data, video_commands.video, robot_commands.robot, robot_commands.reach,
                 robot_commands.region, robot_commands.export, accuracy_commands.accuracy, accuracy_commands.screen,
                 accuracy_commands.improve):
    cli.add_command(_command)


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
