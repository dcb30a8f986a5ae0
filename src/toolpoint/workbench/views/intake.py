"""Files that were handed over: what each seems to be, and into the project with them once that is confirmed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from toolpoint import project
from toolpoint._check import fail
from toolpoint.project.entering import FILE_KINDS
from toolpoint.workbench.state.access import check_file_name
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.views.view import command_line

INCOMING_FOLDER = "incoming"  # of the project: files that were handed over and are not entered yet
MAX_SHOWN_FILES = 12  # names of files in a shown command


def list_incoming(desk: Desk) -> list[dict[str, Any]]:
    """Return the files that were handed over with what they seem to be."""
    folder = desk.folder / INCOMING_FOLDER
    files = sorted(path for path in folder.glob("*") if path.is_file() and not path.name.startswith("."))
    guesses = [project.guess_kind(file) for file in files]
    return [{"file": guess.file.name, "bytes": guess.file.stat().st_size, "kind": guess.kind, "words": guess.words,
             "is_sure": guess.is_sure} for guess in guesses]


def enter_files(desk: Desk, kinds: Mapping[str, str]) -> dict[str, Any]:
    """Move files that were handed over to their places and enter them in project.yaml; say the command that does the same."""
    folder = desk.folder / INCOMING_FOLDER
    names = [check_file_name(name) for name in kinds]
    absent = [name for name in names if not (folder / name).is_file()]
    if absent or not names:
        fail("files", ", ".join(absent) or "none", "must wait to be entered", remedy="hand them over first")
    guesses = {name: project.guess_kind(folder / name).kind for name in names}
    entered = project.add_files(desk.folder, [folder / name for name in names], dict(kinds), move=True)
    chosen = [f"--kind={name}={kind}" for name, kind in kinds.items() if kind != guesses[name]]
    source_names = [str(Path("FROM") / name) for name in names]
    return {"places": list(entered.places), "parts": [f"{place}: {value}" for place, value in entered.parts],
            "doubts": [doubt.replace(str(desk.folder), ".") for doubt in entered.doubts],
            "commands": [command_line("add", ".", *_shortened(source_names), *chosen)],
            "calls": ["project.add_files('.', files)"]}


def _shortened(names: list[str]) -> list[str]:
    return names if len(names) <= MAX_SHOWN_FILES else [*names[:MAX_SHOWN_FILES], "..."]


def kinds_in_words() -> dict[str, str]:
    """Return the kinds of files in words, for the list on the page."""
    return {kind: words for kind, (_, words) in FILE_KINDS.items()}
