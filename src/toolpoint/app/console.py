"""What the terminal shows: tables, progress, and errors without a traceback."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from toolpoint._check import ToolpointWarning


class _Lines(Console):
    """A console that leaves the wrapping of plain lines to the terminal: paths and tables in a log stay whole."""

    def print(self, *objects: Any, **options: Any) -> None:
        if all(isinstance(part, str) for part in objects):
            options.setdefault("soft_wrap", True)
        super().print(*objects, **options)


# Emoji codes are off: 'machine.yaml:100:7' names a place.
OUT = _Lines(highlight=False, emoji=False)
ERR = _Lines(stderr=True, highlight=False, emoji=False)
ASCII = str.maketrans(dict.fromkeys("┏┳┓┡╇┩└┴┘", "+") | dict.fromkeys("━─", "-") | dict.fromkeys("┃│", "|"))


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; words and the first column to the left, numbers to the right."""
    made = Table(title=title, title_justify="left", title_style="bold")
    for i, name in enumerate(header):
        made.add_column(name, justify="left" if i == 0 or _is_words([row[i] for row in rows]) else "right")
    for row in rows:
        made.add_row(*row)
    OUT.print(made)


def _is_words(cells: Sequence[str]) -> bool:
    return any(len(cell) > 1 and " " in cell and cell[0].isalpha() for cell in cells)


def text(lines: str) -> None:
    """Print plain text as it is; where the terminal knows no lines for tables, with plain signs."""
    plain = spelled(lines)
    OUT.print(plain.translate(ASCII) if OUT.options.ascii_only else plain, markup=False)


def warning(message: str) -> None:
    """Print a warning beside the result."""
    ERR.print("warning: " + spelled(message), markup=False, style="yellow")


def error(message: str) -> None:
    """Print an error as plain text: file contents in it must not be read as markup."""
    ERR.print("error: " + spelled(message), markup=False, style="red", soft_wrap=True)


def spelled(text: str) -> str:
    """Return a message with the arguments of Python that it names (`frf_x`) spelled as options (--frf-x)."""
    return re.sub(r"`([a-z][a-z_]*)`", lambda match: "--" + match[1].replace("_", "-"), text)


@contextmanager
def steps(total: int, quiet: bool = False) -> Iterator[Callable[[str], None]]:
    """Show progress through a number of named steps; call the given function at the start of each."""
    with Progress(SpinnerColumn(), TextColumn("{task.description:<34}"), BarColumn(), MofNCompleteColumn(),
                  TimeElapsedColumn(), console=ERR, transient=True, disable=quiet or not interactive()) as progress:
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
            if spelled(str(message)) not in texts:
                texts.append(spelled(str(message)))
        else:
            original(message, category, *rest)
    with warnings.catch_warnings():
        warnings.simplefilter("always", ToolpointWarning)
        warnings.showwarning = keep  # type: ignore[assignment]
        yield texts


def interactive() -> bool:
    """Return whether a person watches the terminal."""
    return sys.stderr.isatty()
