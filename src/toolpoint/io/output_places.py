"""Places of outputs, tested before anything is computed: what cannot be written is refused at once, not after an hour."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from toolpoint._check import ToolpointError

PAGE_ENDINGS = (".html", ".htm")


def check_file_place(path: Path) -> None:
    """Raise ToolpointError where a file could not be written: its folder is not there, is none, or takes no files."""
    if os.path.isdir(path):
        raise ToolpointError(f"{path}: is a folder; must be the name of a file; write a name behind it")
    if not os.path.isdir(path.parent):
        raise ToolpointError(f"{path}: the folder {path.parent} does not exist; create it first")
    _try_folder(path, path.parent)


def check_page_place(path: Path) -> None:
    """Raise ToolpointError where a page could not be written: into this folder, or as this file where it ends in .html."""
    if path.suffix.lower() in PAGE_ENDINGS:
        if os.path.isdir(path):
            raise ToolpointError(f"{path}: is a folder; must be the name of a file, or of a folder without .html")
        check_folder_place(path.parent)
    else:
        check_folder_place(path)


def check_folder_place(path: Path) -> None:
    """Raise ToolpointError where a folder could not be made, or takes no files."""
    existing = path
    while not os.path.exists(existing) and existing != existing.parent:
        existing = existing.parent
    if not os.path.isdir(existing):
        raise ToolpointError(f"{path}: {'is' if existing == path else f'{existing} is'} a file; must be a folder; choose "
                             "another name")
    _try_folder(path, existing)


def _try_folder(path: Path, folder: Path) -> None:
    """Write and remove a file: permissions alone do not tell of full disks, read-only systems and names that are too long."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            path.lstat()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ToolpointError(f"{path}: nothing can be written in {folder} ({reason}); choose another name or folder") from None
