"""A machine: its description, its parts, and its equations of motion at any pose. Names below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.machine.assembly.preload import static_equilibrium
    from toolpoint.machine.assembly.system import assemble
    from toolpoint.machine.description.machine import MachineDescription
    from toolpoint.machine.parts.build import build
    from toolpoint.machine.parts.model import Machine

__all__ = ["Machine", "MachineDescription", "assemble", "build", "static_equilibrium"]

__getattr__, __dir__ = export_lazily(__name__, {
    "assembly.preload": ("static_equilibrium",),
    "assembly.system": ("assemble",),
    "description.machine": ("MachineDescription",),
    "parts.build": ("build",),
    "parts.model": ("Machine",),
})
