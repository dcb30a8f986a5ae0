"""Workbench written to a folder that opens without a server: the views, and what a slider needs, computed beforehand."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.project.steps.plain_files import plain
from toolpoint.workbench.state.desk import Desk
from toolpoint.workbench.state.machine_request import MachineRequest
from toolpoint.workbench.views import catalogue
from toolpoint.workbench.views.pages_view import page_text, pages_of
from toolpoint.workbench.web.assets import LANGUAGES, SCRIPT_BUNDLE, SENTENCES, STYLE_BUNDLE, index_page, web_file

EXPORTED_FACTORS = (0.25, 0.5, 1 / np.sqrt(2), 1.0, np.sqrt(2), 2.0, 4.0)  # of every spring, one at a time
EXPORTED_POSITIONS = 5  # along every axis, one at a time
EXPORTED_SPEEDS = 11  # over the range of a cut
EXPORTED_CUT_VALUES = 7  # of every slider of a cut, at its asked speed, one at a time
MAX_EXPORTED_SPRINGS = 40  # springs with a slider; those that yield most
Progress = Callable[[str, int, int], None]
# As that of the server, but for scripts beside the page, which a browser takes from files only so.
FOLDER_POLICY = ("default-src 'none'; script-src 'self' file:; style-src 'self' file: 'unsafe-inline'; img-src data: blob:; "
                 "base-uri 'none'; form-action 'none'")


def export_workbench(folder: str | Path, target: str | Path, progress: Progress = lambda name, finished, total: None) -> Path:
    """Write the workbench of a project as a folder whose index.html opens in a browser without a server.

    Views are those of today's files; a slider of a spring, an axis or a speed takes the nearest of the states that were
    computed, one at a time, and says which. Pages that were never made are made.

    Raises ToolpointError for a target that is there, and for a folder without a project.

    Examples
    --------
    Runs in ``examples/share_a_project_as_a_folder.py``.
    """
    place, desk = Path(target), Desk(Path(folder).resolve())
    if place.exists():
        raise ToolpointError(f"{place}: is there already; nothing was written: name another folder")
    desk.project()
    draft = place.with_name(f".{place.name}.{os.getpid()}.draft")
    shutil.rmtree(draft, ignore_errors=True)
    try:
        (draft / "web").mkdir(parents=True)
        for name in (SCRIPT_BUNDLE, STYLE_BUNDLE, "export.js"):
            (draft / "web" / name).write_bytes(web_file(name))
        data = _content(desk, draft, progress)
        text = json.dumps(plain(data), separators=(",", ":"))
        (draft / "web" / "export_data.js").write_text(f"window.workbenchData={text};\n", encoding="utf-8")
        policy = f'<meta http-equiv="Content-Security-Policy" content="{FOLDER_POLICY}">'
        page = index_page(base="web/", first_scripts=("export_data.js", "export.js")).replace("<title>", policy + "\n<title>")
        (draft / "index.html").write_text(page, encoding="utf-8")
        os.replace(draft, place)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return place / "index.html"


def _content(desk: Desk, draft: Path, progress: Progress) -> dict[str, Any]:
    """Return words, views and states; pages are written beside."""
    listed = catalogue.list_views(desk)
    listed["views"].remove("record")  # a folder without a server records nothing
    views = {name: catalogue.view_of(desk, name).to_dict() for name in listed["views"]}
    pages = _write_pages(desk, draft, progress)
    states = _machine_states(desk, views["machine"]["data"], progress) if "machine" in views else []
    limits = _limit_states(desk, views["lobes"]["data"], progress) if "lobes" in views else []
    texts = (SENTENCES, *(f"words_{language}.json" for language in LANGUAGES))
    return {"words": {name: json.loads(web_file(name)) for name in texts},
            "list": listed, "views": views, "states": states, "limits": limits, "pages": pages}


def _write_pages(desk: Desk, draft: Path, progress: Progress) -> dict[str, str]:
    """Write the existing pages of the project; return their places by name. One that cannot be made is left out."""
    places: dict[str, str] = {}
    project_pages = pages_of(desk)
    (draft / "pages").mkdir()
    for number, name in enumerate(project_pages):
        progress("pages", number, len(project_pages))
        try:
            text = page_text(desk, name)
        except ToolpointError:
            continue
        file = f"pages/{number}.html"
        (draft / file).write_text(text, encoding="utf-8")
        places[name] = quote(file)
    return places


def _machine_states(desk: Desk, data: Mapping[str, Any], progress: Progress) -> list[dict[str, Any]]:
    """Return the machine in states of one changed number each: the saved one first."""
    springs = sorted(data["springs"], key=lambda spring: -(spring["share"] or 0.0))[:MAX_EXPORTED_SPRINGS]
    speed = data["cuts"][0]["speed_rpm"] if data["cuts"] else None
    requests = [MachineRequest(speed=speed)]
    requests += [MachineRequest({spring["path"]: spring["value"] * float(factor)}, speed=speed) for spring in springs
              for factor in EXPORTED_FACTORS if factor != 1.0]
    requests += [MachineRequest(pose={axis["name"]: float(position)}, speed=speed) for axis in data["axes"]
              for position in np.linspace(axis["lower"], axis["upper"], EXPORTED_POSITIONS)]
    states = []
    for number, request in enumerate(requests):
        progress("states of the machine", number, len(requests))
        try:
            answer = catalogue.machine_deed(desk, "look", request)
        except ToolpointError:  # a pose that the machine cannot take
            continue
        states.append({"values": dict(request.values), "pose": dict(request.pose), "answer": answer})
    return states


def _slider_values(slider: Mapping[str, Any]) -> FloatArray:
    """Return the values of a slider for which limits are computed; whole ones where it takes no others."""
    values: FloatArray = np.geomspace(slider["lower"], slider["upper"], EXPORTED_CUT_VALUES)
    return np.unique(np.round(values)) if slider.get("step") == 1 else values


def _limit_states(desk: Desk, data: Mapping[str, Any], progress: Progress) -> list[dict[str, Any]]:
    """Return the limits of every cut over its speeds, and with every number of it changed, one at a time."""
    states = []
    for cut in data["cuts"]:
        lower, upper = (float(end) for end in cut["speeds"])
        goal_speed = float(cut["speed_rpm"])
        requests: list[tuple[float, dict[str, float]]] = [(speed, {}) for speed in sorted(
            {*np.linspace(lower, upper, EXPORTED_SPEEDS).tolist(), goal_speed})]
        requests += [(goal_speed, {slider["key"]: float(value)}) for slider in cut["sliders"]
                     for value in _slider_values(slider)]
        for number, (speed, values) in enumerate(requests):
            progress(f"limits of {cut['name']}", number, len(requests))
            try:
                answer = catalogue.machine_deed(desk, "limit", MachineRequest(cut=cut["name"], speed=speed, cut_values=values))
            except ToolpointError:  # a cut that cannot be
                continue
            states.append({"cut": cut["name"], "speed": speed, "values": values, "limit": answer})
    return states
