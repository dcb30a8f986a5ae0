"""Chart of a shaker: force per volt of its coil over the frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.figures.thinning import thin_curve

if TYPE_CHECKING:
    import plotly.graph_objects as go


def plot_force_per_volt(frequency: FloatArray, forces: Mapping[str, ComplexArray]) -> go.Figure:
    """Return the size of forces per volt, N/V, by name over the lines (Hz)."""
    chart = figure("", 340)
    for k, (name, force) in enumerate(forces.items()):
        lines, size = thin_curve(frequency, np.abs(force))
        chart.add_scatter(x=lines, y=size, name=name, mode="lines", line={"color": COLOURS[k]})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Force per volt, N/V", type="log")
    return chart
