"""A picture of the points of a test: front, side and top, those measured and those struck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, TEMPLATE
from toolpoint.vibration import Dof

VIEWS = (("front", 0, 2), ("side", 1, 2), ("top", 0, 1))
STRUCK = "#c0392b"


def point_views(places: Mapping[str | int, FloatArray], measured: Sequence[str | int], struck: Sequence[Dof]) -> go.Figure:
    """Return three views of all places (m), those measured with their names, and those struck with their directions."""
    chart = make_subplots(rows=1, cols=3, subplot_titles=[name for name, _, _ in VIEWS], horizontal_spacing=0.07)
    every = np.array(list(places.values()))
    for column, (_, across, up) in enumerate(VIEWS, start=1):
        chart.add_scatter(x=every[:, across], y=every[:, up], mode="markers", name="could be measured", showlegend=column == 1,
                          marker={"size": 5, "color": "rgba(127,127,127,0.35)"}, hoverinfo="skip", row=1, col=column)
        at = np.array([places[name] for name in measured])
        chart.add_scatter(x=at[:, across], y=at[:, up], mode="markers+text", name="sensor here", showlegend=column == 1,
                          text=[str(name) for name in measured], textposition="top center",
                          marker={"size": 10, "color": COLOURS[0]}, hovertemplate="%{text}<extra></extra>", row=1, col=column)
        at = np.array([places[dof.point] for dof in struck])
        chart.add_scatter(x=at[:, across], y=at[:, up], mode="markers", name="strike here", showlegend=column == 1,
                          text=[str(dof) for dof in struck], marker={"size": 15, "symbol": "star", "color": STRUCK},
                          hovertemplate="%{text}<extra></extra>", row=1, col=column)
        chart.update_xaxes(title_text=f"{'xyz'[across]}, m", row=1, col=column)
        chart.update_yaxes(title_text=f"{'xyz'[up]}, m", row=1, col=column)
    chart.update_layout(template=TEMPLATE, height=480, legend={"orientation": "h", "y": -0.2})
    return chart
