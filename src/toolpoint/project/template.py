"""Folder of a new project: a commented project file and the folders that it names; nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

from toolpoint import io
from toolpoint._check import ToolpointError

FOLDERS = ("records", "responses", "programs")


def write_folder(folder: str | Path) -> Path:
    """Make the folder of a project and return its project file.

    Raises ToolpointError for a folder that holds a project already, and for a name that is a file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_folder(Path(folder, "mill")).name
    'project.yaml'
    """
    place = Path(folder)
    if place.exists() and not place.is_dir():
        raise ToolpointError(f"{place}: is a file; name a folder that is not there yet")
    if (place / "project.yaml").exists():
        raise ToolpointError(f"{place}: holds a project already; nothing is overwritten: name another folder")
    for name in FOLDERS:
        (place / name).mkdir(parents=True, exist_ok=True)
    return io.write_template(place / "project.yaml", "project")
