"""What the terminal shows: tables, progress, and errors without a traceback."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from toolpoint._check import ToolpointWarning

OUT = Console(highlight=False)
ERR = Console(stderr=True, highlight=False)


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; the first column to the left, the others to the right."""
    made = Table(title=title, title_justify="left", title_style="bold")
    for i, name in enumerate(header):
        made.add_column(name, justify="left" if i == 0 else "right")
    for row in rows:
        made.add_row(*row)
    OUT.print(made)


def error(message: str) -> None:
    """Print an error as plain text: file contents in it must not be read as markup."""
    ERR.print("error: " + message, markup=False, style="red", soft_wrap=True)


@contextmanager
def steps(total: int, quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Show progress through a number of named steps; call the given function at the start of each."""
    with Progress(SpinnerColumn(), TextColumn("{task.description:<34}"), BarColumn(), MofNCompleteColumn(),
                  TimeElapsedColumn(), console=ERR, transient=True, disable=quiet) as progress:
        task = progress.add_task("", total=total)
        done = -1

        def step(name: str) -> None:
            nonlocal done
            done += 1
            progress.update(task, description=name, completed=done)
        yield step
        progress.update(task, completed=total)


@contextmanager
def counted(name: str, quiet: bool = False) -> Iterator[Callable[[int, int], None]]:
    """Show progress of a study; pass the given function as its `progress`."""
    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=ERR,
                  transient=True, disable=quiet) as progress:
        task = progress.add_task(name, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Collect ToolpointWarnings as text, so that a command can print them and put them on its page."""
    texts: list[str] = []
    original = warnings.showwarning

    def keep(message: Any, category: type[Warning], *rest: Any) -> None:
        if issubclass(category, ToolpointWarning):
            if str(message) not in texts:
                texts.append(str(message))
        else:
            original(message, category, *rest)
    with warnings.catch_warnings():
        warnings.simplefilter("always", ToolpointWarning)
        warnings.showwarning = keep  # type: ignore[assignment]
        yield texts


def interactive() -> bool:
    """Return whether a person watches the terminal."""
    return sys.stderr.isatty()
