"""Components file of a project as text that a person edits: a draft with the measured points, checked before it is kept."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.io.template_files import read_template
from toolpoint.machine.components import Components
from toolpoint.machine.description.project_plan import ProjectDescription
from toolpoint.project.engine.drafts import write_whole
from toolpoint.project.entering import add_part
from toolpoint.project.folder import PROJECT_FILE

COMPONENTS_FILE = "components.yaml"  # of a project that names none yet
MAX_LISTED_POINTS = 60  # in the head of a draft, by name


def draft_components(folder: str | Path, described: ProjectDescription | None = None) -> str:
    """Return the text of a project's components file; where there is none yet a template, headed by the measured points.

    described : the content of project.yaml, read where left out.

    >>> import tempfile
    >>> from toolpoint.project import write_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     project = write_folder(Path(folder, "mill")).parent
    ...     "components:" in draft_components(project)
    True
    """
    root = Path(folder)
    described = described or io.read_project(root / PROJECT_FILE)
    if described.components is not None and _lies_within(root, described.components):
        with contextlib.suppress(OSError, UnicodeDecodeError):
            return (root / described.components).read_text(encoding="utf-8")
    has_points = described.geometry is not None and _lies_within(root, described.geometry)
    head = _points_in_words(root / str(described.geometry)) if has_points else []
    return "\n".join([*head, read_template("components")])


def _lies_within(root: Path, name: str) -> bool:
    """Return whether a file lies in the project's folder, links followed: a page may neither show nor write another."""
    return (root / name).resolve().is_relative_to(root.resolve())


def _points_in_words(file: Path) -> list[str]:
    """Return comment lines with the names of the points and the box that they lie in; none for a file that cannot be read."""
    try:
        points = io.read_test_geometry(file).points
    except (ToolpointError, OSError):
        return []
    places = np.array([np.asarray(place, float) for place in points.values()])
    names = list(map(str, points))
    unlisted = len(names) - MAX_LISTED_POINTS
    listed = ", ".join(names[:MAX_LISTED_POINTS]) + (f" and {unlisted} more" if unlisted > 0 else "")
    spans = ", ".join(f"{axis} {lower:.3g} to {upper:.3g} m" for axis, lower, upper in zip(
        "xyz", places.min(axis=0), places.max(axis=0), strict=True))
    return [f"# {len(names)} points of {file.name}: {listed}", f"# They lie within {spans}."]


def _check_points(components: Components, file: Path) -> None:
    """Refuse components with points that were not measured."""
    known_points = set(map(str, io.read_test_geometry(file).points))
    unknown = [f"{point} (of {name})" for name, points in components.points.items() for point in points
               if str(point) not in known_points]
    if unknown:
        raise ToolpointError(f"{file.name} has no point {', '.join(unknown)}; its points are named in the head of the draft")


def write_components(folder: str | Path, text: str) -> str:
    """Write the components file of a project, enter it in project.yaml, and return its name.

    Raises ToolpointError, and writes nothing, where the text has a fault; the message names line and key.
    """
    root = Path(folder)
    described = io.read_project(root / PROJECT_FILE)
    name = described.components or COMPONENTS_FILE
    if not _lies_within(root, name):
        raise ToolpointError(f"components: {name} lies outside the project; copy it into its folder and enter it from there")
    draft = root / f".{Path(name).name}.draft.yaml"
    try:
        draft.write_text(text, encoding="utf-8")
        _, components = io.read_kind(draft, "components")
        if described.geometry is not None:
            _check_points(components, root / described.geometry)
    except ToolpointError as error:
        raise ToolpointError(f"{name}: not entered\n{str(error).replace(str(draft), name)}") from None
    finally:
        draft.unlink(missing_ok=True)
    write_whole(root / name, text)
    add_part(root, "components", name)
    return name
