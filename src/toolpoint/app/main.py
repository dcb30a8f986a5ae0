"""The command line `toolpoint`."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from typing import Any

import click

import toolpoint
from toolpoint._check import ToolpointError, suggestion
from toolpoint._threads import hold_process
from toolpoint.app.interrupt import INTERRUPT_EXIT_CODE
from toolpoint.app.questions import COMMANDS_OF_QUESTION, GROUPED_COMMANDS, GROUPS, LINE_OF_COMMAND

# Module of every command; it is loaded when its command is asked for. The function has the command's name, with _ for -.
_COMMANDS_OF_MODULE = {
    "acquisition": ("devices",),
    "cutting": ("lobes", "turn", "mill", "map-chatter", "speeds", "calibrate", "rcsa"),
    "condition": ("drift",),
    "demos": ("demo",),
    "drives": ("drive", "servo-data"),
    "files": ("new", "samples", "check", "convert", "schema", "doctor", "completion"),
    "listening": ("listen",),
    "machining": ("machining",),
    "machines": ("report", "modes", "map", "campbell", "base"),
    "models": ("identify", "joints", "update", "correlate", "compare", "sensitivity"),
    "operation": ("operational", "traverse", "axis-test"),
    "projects": ("run", "tried"),
    "robots": ("robot", "reach", "region", "export", "accuracy", "screen", "improve"),
    "testing": ("plan", "frf", "tap", "next-test"),
    "videos": ("video",),
    "workbench": ("serve", "add", "change"),
}
# By name, without an import: help and completion must not load what fifty commands need.
MODULE_OF_COMMAND = {command: module for module, commands in _COMMANDS_OF_MODULE.items() for command in commands}
# Where the command's name is a name of Python, or of the frame.
_FUNCTION_OF_COMMAND = {"map": "frequency_map", "run": "run_project", "tried": "report_cut", "change": "change_numbers",
                        "add": "add_parts"}

GROUP_QUESTION = "More commands, in groups: toolpoint GROUP --help"
MAX_HELP_WIDTH = 120  # letters of a line of help, on a terminal that is so wide


class _CommandGroup(click.Group):
    """Group of rarely needed commands: the same commands as beside it."""

    def __init__(self, name: str, words: str, commands: tuple[str, ...]) -> None:
        super().__init__(name=name, help=words)
        self.names = commands

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.names)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        return cli.get_command(ctx, name) if name in self.names else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each command with its line."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, LINE_OF_COMMAND[name]) for name in self.names])


class _Commands(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted([*MODULE_OF_COMMAND, *GROUPS])

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands by the question that they answer, a line each, then the groups of the others."""
        for question, lines in COMMANDS_OF_QUESTION.items():
            with formatter.section(question):
                formatter.write_dl([entry for entry in lines.items() if entry[0] not in GROUPED_COMMANDS])
        with formatter.section(GROUP_QUESTION):
            formatter.write_dl([(name, ", ".join(names)) for name, (_, names) in GROUPS.items()])

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name in GROUPS:
            return _CommandGroup(name, *GROUPS[name])
        if name not in MODULE_OF_COMMAND:
            return None
        # One command's module alone: all of them would load half of the package before an option is read.
        module = importlib.import_module(f"toolpoint.app.commands.{MODULE_OF_COMMAND[name]}")
        command: click.Command = getattr(module, _FUNCTION_OF_COMMAND.get(name, name.replace("-", "_")))
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            hint = suggestion(args[0], [*MODULE_OF_COMMAND, *GROUPS]) if args else ""
            raise click.UsageError(f"{error.message} {hint}".strip(), ctx) from None


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": MAX_HELP_WIDTH})
@click.version_option(toolpoint.__version__, prog_name="toolpoint")
def cli() -> None:
    """Machine-tool dynamics: from measured vibration and a machine file to modes, tool-point responses and chatter limits."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Frame the command line; a wrong input ends with its message and exit code 2, never with a traceback."""
    if arguments is None:  # a process of its own
        hold_process()
        os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # else every installed package is searched for plugins
    try:
        cli.main(args=None if arguments is None else list(arguments), prog_name="toolpoint", standalone_mode=False)
    except ToolpointError as error:
        _error(str(error))
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(0)
    except OSError as error:
        _error(f"{error.filename or 'a file'}: {error.strerror or error}; check the name and the folder")
        sys.exit(2)
    except (click.Abort, KeyboardInterrupt):
        _error("interrupted; finished parts of a study are kept where it was given a --folder")
        sys.exit(INTERRUPT_EXIT_CODE)


def _error(message: str) -> None:
    from toolpoint.app import console

    console.error(message)
