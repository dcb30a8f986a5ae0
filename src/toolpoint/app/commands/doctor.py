"""Commands about the program itself: what it stands on here, and completion of commands in a shell."""

from __future__ import annotations

import sys

import click

from toolpoint.app.options import JSON


@click.command()
@JSON
def doctor(as_json: bool) -> None:
    """Versions, threads, caches, extras and the browser: what is there, what is missing, and what to do about it."""
    from toolpoint.app.frame import frame
    from toolpoint.studies.environment import examine_environment

    with frame(None, as_json) as run:
        result = examine_environment()
    run.show(result)
    if not result.is_whole:
        sys.exit(1)


@click.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print what makes SHELL complete commands, options and files: eval "$(toolpoint completion bash)" in its start-up file."""
    from click.shell_completion import get_completion_class

    from toolpoint.app.main import cli

    complete = get_completion_class(shell)
    assert complete is not None
    click.echo(complete(cli, {}, "toolpoint", "_TOOLPOINT_COMPLETE").source())
