"""Files that are whole at any moment: written to a draft beside their place, flushed, renamed."""

from __future__ import annotations

import os
import shutil
from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write a text file by a draft; a kill leaves the old file or the new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name}.{os.getpid()}.draft")
    try:
        with draft.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


def remove_tree(folder: Path) -> None:
    """Remove a folder of drafts with all that is in it."""
    shutil.rmtree(folder, ignore_errors=True)


def remove_drafts(state: Path) -> None:
    """Remove all drafts that a killed process left in the folder of a project's state."""
    remove_tree(state / "drafts")
    for draft in state.rglob("*.draft"):
        draft.unlink(missing_ok=True)


def list_files(folder: Path) -> list[str]:
    """Return the files in a folder and the folders in it, relative to it, sorted."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
