"""toolpoint: machine-tool dynamics from the hammer test to the chatter limit.

Names below are loaded on first use, so that importing the package is quick and needs no display.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

_NOUNS = ("Dof", "Frf", "Modes", "Record", "SecondOrderSystem", "StateSpace")
_REMARKS = ("ToolpointError", "ToolpointWarning")  # theirs brings NumPy, which a command takes Ctrl-C before
_ROOMS = ("spatial", "vibration", "signals", "vision", "modal_identification", "joint_identification", "updating",
          "kinematics", "bodies",
          "joints", "cutting", "drives", "machine", "studies", "io", "plot", "app")

if TYPE_CHECKING:
    from toolpoint._check import ToolpointError, ToolpointWarning
    from toolpoint.vibration import Dof, Frf, Modes, Record, SecondOrderSystem, StateSpace

__all__ = ["Dof", "Frf", "Modes", "Record", "SecondOrderSystem", "StateSpace", "ToolpointError", "ToolpointWarning"]


def __getattr__(name: str) -> Any:
    if name in _NOUNS:
        return getattr(importlib.import_module("toolpoint.vibration"), name)
    if name in _REMARKS:
        return getattr(importlib.import_module("toolpoint._check"), name)
    if name in _ROOMS:
        return importlib.import_module(f"toolpoint.{name}")
    raise AttributeError(f"module 'toolpoint' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_NOUNS, *_REMARKS, *_ROOMS})
