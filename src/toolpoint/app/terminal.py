"""Terminal: consoles of text and progress. Loaded when something is shown, not with every command."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from toolpoint.app.first_use import COMPILING, is_compiling


class _Lines(Console):
    """A console that leaves the wrapping of plain lines to the terminal: paths and tables in a log stay whole."""

    def print(self, *objects: Any, **options: Any) -> None:
        if all(isinstance(part, str) for part in objects):
            options.setdefault("soft_wrap", True)
        super().print(*objects, **options)


class _FirstUse(ProgressColumn):
    """Says while kernels are compiled that this happens once."""

    max_refresh = 0.5

    def render(self, task: Task) -> Text:
        """Return the words, none where nothing is compiled or the part has ended."""
        return Text(COMPILING if is_compiling() and not task.finished else "")


# Emoji codes are off: 'machine.yaml:100:7' names a place.
OUTPUT_CONSOLE = _Lines(highlight=False, emoji=False)
ERROR_CONSOLE = _Lines(stderr=True, highlight=False, emoji=False)


def progress_bars() -> Progress:
    """Return the bars of a command's steps, or of a study's parts."""
    return Progress(SpinnerColumn(), TextColumn("{task.description:<34}"), BarColumn(), MofNCompleteColumn(),
                    # On the error stream, and gone at the end: what is piped elsewhere holds the result alone.
                    TimeElapsedColumn(), _FirstUse(), console=ERROR_CONSOLE, transient=True)
