"""The terminal: where text goes, and how progress looks. Loaded when something is shown, not with every command."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn


class _Lines(Console):
    """A console that leaves the wrapping of plain lines to the terminal: paths and tables in a log stay whole."""

    def print(self, *objects: Any, **options: Any) -> None:
        if all(isinstance(part, str) for part in objects):
            options.setdefault("soft_wrap", True)
        super().print(*objects, **options)


# Emoji codes are off: 'machine.yaml:100:7' names a place.
OUT = _Lines(highlight=False, emoji=False)
ERR = _Lines(stderr=True, highlight=False, emoji=False)


def progress_bars() -> Progress:
    """Return the bars of a command's steps, or of a study's parts."""
    return Progress(SpinnerColumn(), TextColumn("{task.description:<34}"), BarColumn(), MofNCompleteColumn(),
                    TimeElapsedColumn(), console=ERR, transient=True)
