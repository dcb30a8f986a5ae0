"""Figures and pages from the nouns: charts, animated shapes, reports. Each part is loaded on first use."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_HOME = {
    "AnimatedShapes": "animated_shapes", "Box": "scene", "Cell": "parts", "Chart": "parts", "ClickedSeries": "parts",
    "Listing": "parts",
    "Notes": "parts", "Report": "report", "Scene": "scene", "ShapeView": "shape_view", "StabilityCurve": "lobes",
    "StabilityIntervals": "lobes", "Table": "parts", "Text": "parts", "bode": "frf", "coherence": "frf",
    "frequency_curves": "pose_map", "frequency_map": "pose_map", "mac_matrix": "correlation", "nyquist": "frf",
    "real_imaginary": "frf", "stability_chart": "lobes",
}

if TYPE_CHECKING:
    from toolpoint.plot.animated_shapes import AnimatedShapes
    from toolpoint.plot.correlation import mac_matrix
    from toolpoint.plot.frf import bode, coherence, nyquist, real_imaginary
    from toolpoint.plot.lobes import StabilityCurve, StabilityIntervals, stability_chart
    from toolpoint.plot.parts import Cell, Chart, ClickedSeries, Listing, Notes, Table, Text
    from toolpoint.plot.pose_map import frequency_curves, frequency_map
    from toolpoint.plot.report import Report
    from toolpoint.plot.scene import Box, Scene
    from toolpoint.plot.shape_view import ShapeView

__all__ = [
    "AnimatedShapes", "Box", "Cell", "Chart", "ClickedSeries", "Listing", "Notes", "Report", "Scene", "ShapeView",
    "StabilityCurve",
    "StabilityIntervals", "Table", "Text", "bode", "coherence", "frequency_curves", "frequency_map", "mac_matrix",
    "nyquist", "real_imaginary", "stability_chart",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"toolpoint.plot.{_HOME[name]}"), name)
    raise AttributeError(f"module 'toolpoint.plot' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOME})
