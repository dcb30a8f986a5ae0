"""Exports of a room that are loaded on first use: a command that finds a fault in a file must not wait for what computes."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any


def export_lazily(room: str, names: Mapping[str, Sequence[str]]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a room's `__init__`.

    Parameters
    ----------
    room : str
        Its `__name__`.
    names : mapping
        Names by the module that holds them, written from the room on (``"axis.motor": ("TorqueMotor",)``), or whole where it
        lies elsewhere. ``"read as read_frf"`` exports under another name: needed where a function is called like a module of
        the room, which would hide it. A module without names is exported itself.
    """
    home: dict[str, tuple[str, str]] = {}
    for module, entries in names.items():
        path = module if module.startswith("toolpoint.") else f"{room}.{module}"
        home |= {entry.split(" as ")[-1]: (path, entry.split(" as ")[0]) for entry in entries} or {module: (path, "")}

    def load(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        path, verb = home[name]
        module = importlib.import_module(path)
        return getattr(module, verb) if verb else module

    return load, lambda: sorted(home)
