"""Figures and pages from the nouns: charts, animated shapes, reports. Each part is loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.plot.figures.cuts.lobes import StabilityCurve, StabilityIntervals, stability_chart
    from toolpoint.plot.figures.machines.pose_map import frequency_curves, frequency_map
    from toolpoint.plot.figures.measured.correlation import mac_matrix
    from toolpoint.plot.figures.measured.frf import bode, coherence, nyquist, real_imaginary
    from toolpoint.plot.page.charts import Chart, ClickedSeries, InverseField, Lookup, TableFields
    from toolpoint.plot.page.parts import Listing, Notes, Picture, Text
    from toolpoint.plot.page.pole_picker import PolePicker
    from toolpoint.plot.page.tables import Cell, Table
    from toolpoint.plot.program_view.view import BlockLobes, BlockQuantity, ProgramView
    from toolpoint.plot.report import Report
    from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
    from toolpoint.plot.shape_view.scene import Box, Scene
    from toolpoint.plot.shape_view.view import ShapeView

__all__ = [
    "AnimatedShapes", "BlockLobes", "BlockQuantity", "Box", "Cell", "Chart", "ClickedSeries", "InverseField", "Listing",
    "Lookup", "Notes", "Picture", "PolePicker", "ProgramView", "Report", "Scene", "ShapeView", "StabilityCurve",
    "StabilityIntervals", "Table", "TableFields", "Text", "bode", "coherence", "frequency_curves", "frequency_map",
    "mac_matrix", "nyquist", "real_imaginary", "stability_chart",
]

__getattr__, __dir__ = export_lazily(__name__, {
    "figures.measured.correlation": ("mac_matrix",),
    "figures.measured.frf": ("bode", "coherence", "nyquist", "real_imaginary"),
    "figures.cuts.lobes": ("StabilityCurve", "StabilityIntervals", "stability_chart"),
    "figures.machines.pose_map": ("frequency_curves", "frequency_map"),
    "page.charts": ("Chart", "ClickedSeries", "InverseField", "Lookup", "TableFields"),
    "page.parts": ("Listing", "Notes", "Picture", "Text"),
    "page.pole_picker": ("PolePicker",),
    "page.tables": ("Cell", "Table"),
    "program_view.view": ("BlockLobes", "BlockQuantity", "ProgramView"),
    "report": ("Report",),
    "shape_view.animated_shapes": ("AnimatedShapes",),
    "shape_view.scene": ("Box", "Scene"),
    "shape_view.view": ("ShapeView",),
})
