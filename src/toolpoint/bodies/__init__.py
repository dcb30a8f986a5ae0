"""Bodies: masses that move, and the interfaces where others hold on to them. Names below are loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.bodies.body import Body, Interface
    from toolpoint.bodies.inertia import MassProperties

__all__ = ["Body", "Interface", "MassProperties"]

__getattr__, __dir__ = export_lazily(__name__, {"body": ("Body", "Interface"), "inertia": ("MassProperties",)})
