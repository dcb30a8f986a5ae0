"""Catalogue of the views: which a project has, and the function of each, loaded when it is asked for."""

from __future__ import annotations

import importlib
import threading
from collections.abc import Mapping
from typing import Any

from toolpoint._check import ToolpointError, one_of
from toolpoint.project import Project
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views.view import WorkbenchView

# Name of a view, in the order of the page: module and function.
VIEWS = {"project": ("project_view", "view_project"), "machine": ("machine_view", "view_machine"),
         "lobes": ("lobes_view", "view_lobes"), "modes": ("hammer_views", "view_modes"),
         "blows": ("hammer_views", "view_blows"), "record": ("recording_view", "view_record"),
         "servo": ("motion_views", "view_servo"), "program": ("motion_views", "view_program"),
         "advice": ("advice_view", "view_advice"), "compare": ("compare_view", "view_compare"),
         "report": ("pages_view", "view_report")}
MACHINE_DEEDS = {"look": ("machine_view", "look_at_machine"), "limit": ("lobes_view", "limit_deed"),
                 "curve": ("lobes_view", "curve_deed"), "interval": ("lobes_view", "interval_deed"),
                 "band": ("lobes_view", "band_deed"), "map": ("workspace_map", "map_deed"),
                 "limit_map": ("workspace_map", "limit_map_deed"),
                 "sound": ("cut_sound", "sound_deed"), "difference": ("advice_view", "difference_deed")}

# Rooms load their modules on first use. Two threads that do so at once may each see a half-loaded module of the other, so the
# first call of every function is made alone; later ones are not held.
_first_calls = threading.RLock()
_called = set[tuple[str, str]]()


def list_views(desk: Desk) -> dict[str, Any]:
    """Return the names of the views that have something to show, in their order, and the name of the project."""
    if not desk.has_project:
        return {"name": desk.folder.name, "views": ["project"]}
    project = desk.project()
    return {"name": project.description.name, "views": [name for name in VIEWS if name == "project" or _has(name, project)]}


def _has(name: str, project: Project) -> bool:
    """Whether a project has what a view shows."""
    places = {step.name: [project.folder / path for path in step.output_paths] for step in project.chain.steps}
    files = {step: paths for step, paths in places.items() if any(path.is_file() for path in paths)}
    if name == "machine":
        return _has_machine(project)
    if name == "compare":
        return _has_machine(project) or len(project.states) > 1
    if name == "lobes":
        has_tip = any("tip_x" in step.inputs and (project.folder / str(step.inputs["tip_x"])).is_file()
                      for step in project.chain.steps)
        return bool(project.description.cuts) and (
            _has_machine(project) or has_tip or project.description.coupling is not None)
    if name == "record":
        return True
    if name == "blows":
        return any(path.name == "hits.json" for paths in files.values() for path in paths)
    first = {"modes": "modes/", "advice": "changes", "servo": "contour/", "program": "program/"}.get(name)
    return bool(files) if first is None else any(step.startswith(first) for step in files)


def _has_machine(project: Project) -> bool:
    try:
        return project.machine_file.is_file()
    except ToolpointError:
        return False


def view_of(desk: Desk, name: str, options: Mapping[str, str] | None = None) -> WorkbenchView:
    """Return a view by name; options : of those that take some."""
    view: WorkbenchView = _call(VIEWS[one_of("view", name, VIEWS)], desk, **dict(options or {}))
    return view


def machine_deed(desk: Desk, deed: str, request: MachineRequest) -> Any:
    """Return what a deed of the machine view gives for one state of the page."""
    return _call(MACHINE_DEEDS[one_of("deed", deed, MACHINE_DEEDS)], desk, request)


def save(desk: Desk, name: str, values: Mapping[str, float]) -> str:
    """Write the machine with changed numbers to a new file of the project; return its place."""
    place: str = _call(("machine_view", "save_machine"), desk, name, values)
    return place


def page_of(desk: Desk, name: str) -> str:
    """Return an existing page of the project as HTML."""
    text: str = _load(("pages_view", "page_text"))(desk, name)
    return text


def _call(place: tuple[str, str], *arguments: Any, **options: Any) -> Any:
    """Call a function of the views; the first call of each is made alone."""
    if place in _called:
        return _find(place)(*arguments, **options)
    with _first_calls:
        result = _load(place)(*arguments, **options)
        _called.add(place)
        return result


def _load(place: tuple[str, str]) -> Any:
    """Return a function of the views, no other being loaded meanwhile."""
    with _first_calls:
        return _find(place)


def _find(place: tuple[str, str]) -> Any:
    return getattr(importlib.import_module(f"toolpoint.workbench.views.{place[0]}"), place[1])
