"""The door of every reader: regular files only, and nothing but a ToolpointError for what a damaged file does to it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from toolpoint._check import ToolpointError

P = ParamSpec("P")
R = TypeVar("R")


def check_regular(path: Path) -> None:
    """Raise ToolpointError where a path is a device, a pipe or a socket: reading one may never end."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ToolpointError(f"{path}: a device, pipe or socket; must be a file on disk; copy its content to one")


def door(kind: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Return a decorator for a reader of files of a kind, whose first argument is the path.

    A reader names the faults that it knows; what a damaged file raises beyond them, deep in a parser, becomes a
    ToolpointError with the parser's words (the first exception is kept as its cause). Faults of the call itself (a wrong
    keyword) pass as they are.
    """
    def decorate(reader: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(reader)
        def read(*args: P.args, **kwargs: P.kwargs) -> R:
            source: Any = args[0] if args else None
            if isinstance(source, (str, Path)):
                check_regular(Path(source))
            try:
                return reader(*args, **kwargs)
            except (ToolpointError, Warning):
                raise
            except Exception as error:
                inside = error.__traceback__ and error.__traceback__.tb_next
                if not inside:
                    raise
                raise ToolpointError(f"{getattr(source, 'path', source)}: not a whole {kind} ({_words(error)}); it is damaged, "
                                     "cut off or something else; save it again") from error
        return read
    return decorate


def _words(error: Exception) -> str:
    if isinstance(error, (RecursionError, MemoryError)):
        return "nested too deeply" if isinstance(error, RecursionError) else "more numbers than the memory holds"
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0][:160]}" if lines else type(error).__name__


def new_files(folder: Path, names: Sequence[str], kind: str) -> list[Path]:
    """Return files of these names in a folder, which is made; one that is there already is an error before any is written."""
    files = [folder / f"{name}.{kind}" for name in names]
    taken = [file for file in files if file.exists()]
    if taken:
        raise ToolpointError(f"{taken[0]}: exists already; nothing was written; choose another folder")
    folder.mkdir(parents=True, exist_ok=True)
    return files
