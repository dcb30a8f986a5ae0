"""Workbench: a project in a browser on the tester's own machine; all that it does a command and a Python call do too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.workbench.export import export_workbench
    from toolpoint.workbench.serving.server import Workbench, serve

__all__ = ["Workbench", "export_workbench", "serve"]

__getattr__, __dir__ = export_lazily(__name__, {
    "export": ("export_workbench",),
    "serving.server": ("Workbench", "serve"),
})
