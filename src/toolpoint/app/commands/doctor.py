"""Commands about the program itself: what it stands on here, and completion of commands in a shell."""

from __future__ import annotations

from typing import Annotated, Literal

import click

from toolpoint import studies
from toolpoint.app.declare import Argument, command
from toolpoint.app.frame import Frame


@command(page=False)
def doctor(run: Frame) -> None:
    """Versions, threads, caches, extras and the browser: what is there, what is missing, and what to do about it."""
    result = studies.examine_environment()
    run.show(result)
    if not result.is_whole:
        raise SystemExit(1)


@command()
def completion(shell: Annotated[Literal["bash", "zsh", "fish"], Argument()]) -> None:
    """Print what makes SHELL complete commands, options and files: eval "$(toolpoint completion bash)" in its start-up file."""
    from click.shell_completion import get_completion_class

    from toolpoint.app.main import cli

    complete = get_completion_class(shell)
    assert complete is not None
    click.echo(complete(cli, {}, "toolpoint", "_TOOLPOINT_COMPLETE").source())
