"""Folder of a new project: a commented project file and the folders that it names; nothing is overwritten."""

from __future__ import annotations

import json
from pathlib import Path

from toolpoint import io
from toolpoint._check import ToolpointError

FOLDERS = ("records", "responses", "programs")
TEMPLATE_TITLE = "name: My mill\n"  # line of the template that the folder's name takes the place of


def write_folder(folder: str | Path) -> Path:
    """Make the folder of a project and return its project file; the project is called as its folder.

    Raises ToolpointError for a folder that holds a project already, and for a name that is a file.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_folder(Path(folder, "milling centre 3"))
    ...     print(file.name, "|", file.read_text(encoding="utf-8").splitlines()[4])
    project.yaml | name: "milling centre 3"
    """
    place = Path(folder)
    if place.exists() and not place.is_dir():
        raise ToolpointError(f"{place}: is a file; name a folder that is not there yet")
    if (place / "project.yaml").exists():
        raise ToolpointError(f"{place}: holds a project already; nothing is overwritten: name another folder")
    for name in FOLDERS:
        (place / name).mkdir(parents=True, exist_ok=True)
    file = io.write_template(place / "project.yaml", "project")
    title = place.resolve().name
    if title:  # the root of a disk has no name
        # A text in quotes, as JSON writes it, is YAML too: a folder may be called 2026 or "a: b".
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace(TEMPLATE_TITLE, f"name: {json.dumps(title, ensure_ascii=False)}\n", 1), encoding="utf-8")
    return file
