"""Pages of the public names of every room, with their docstrings."""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path

ROOMS = ("vibration", "signals", "modal_identification", "joint_identification", "updating", "spatial", "kinematics", "bodies",
         "joints", "substructuring", "machine", "cutting", "drives", "vision", "studies", "io", "plot", "project")


def _entries(room: str) -> list[str]:
    module = importlib.import_module(f"toolpoint.{room}")
    lines = []
    for name in sorted(getattr(module, "__all__", ())):
        value = getattr(module, name)
        home = f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', '')}"
        if inspect.isclass(value):
            lines += [f".. autoclass:: {home}", "   :members:", ""]
        elif inspect.isfunction(value):
            lines += [f".. autofunction:: {home}", ""]
    return lines


def write_api(folder: Path) -> None:
    """Write the page of every room and the page that lists them."""
    for room in ROOMS:
        title = f"toolpoint.{room}"
        words = (importlib.import_module(title).__doc__ or "").split("\n\n")[0]
        page = [title, "=" * len(title), "", words, "", *_entries(room)]
        (folder / f"api_{room}.rst").write_text("\n".join(page), encoding="utf-8")
    pages = "\n".join(f"api_{room}" for room in ROOMS)
    (folder / "api.md").write_text("# Python\n\nThe public names of every room; each says shapes, units, errors, equation and "
                                   f"source.\n\n```{{toctree}}\n:maxdepth: 1\n\n{pages}\n```\n", encoding="utf-8")
