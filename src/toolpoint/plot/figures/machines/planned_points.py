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
STRUCK_COLOUR = "#c0392b"
NAME_DISTANCE_FRACTIONS = 0.14, 0.08  # of the span across and up: names closer than this would touch on a phone


def point_views(places: Mapping[str | int, FloatArray], measured: Sequence[str | int], struck: Sequence[Dof]) -> go.Figure:
    """Return three views of all places (m), those measured with their names, and those struck with their directions.

    Where names would lie on each other one is written; all show on hover.
    """
    chart = make_subplots(rows=3, cols=1, subplot_titles=[name for name, _, _ in VIEWS], vertical_spacing=0.09)
    all_places = np.array(list(places.values()))
    for row, (_, across, up) in enumerate(VIEWS, start=1):
        plane = all_places[:, [across, up]]
        chart.add_scatter(x=plane[:, 0], y=plane[:, 1], mode="markers", name="could be measured", showlegend=row == 1,
                          marker={"size": 5, "color": "rgba(127,127,127,0.35)"}, hoverinfo="skip", row=row, col=1)
        measured_places = np.array([places[name] for name in measured])[:, [across, up]]
        names = [str(name) for name in measured]
        chart.add_scatter(x=measured_places[:, 0], y=measured_places[:, 1], mode="markers+text", name="sensor here",
                          showlegend=row == 1,
                          text=_separate_names(names, measured_places, np.ptp(plane, axis=0)), textposition="top center",
                          customdata=names,
                          marker={"size": 10, "color": COLOURS[0]}, hovertemplate="%{customdata}<extra></extra>",
                          row=row, col=1)
        struck_places = np.array([places[dof.point] for dof in struck])[:, [across, up]]
        chart.add_scatter(x=struck_places[:, 0], y=struck_places[:, 1], mode="markers", name="strike here", showlegend=row == 1,
                          text=[str(dof) for dof in struck], marker={"size": 15, "symbol": "star", "color": STRUCK_COLOUR},
                          hovertemplate="%{text}<extra></extra>", row=row, col=1)
        chart.update_xaxes(title_text=f"{'xyz'[across]}, m", row=row, col=1)
        chart.update_yaxes(title_text=f"{'xyz'[up]}, m", row=row, col=1)
    chart.update_layout(template=TEMPLATE, height=1150, margin={"t": 90}, legend={"y": 1.04})
    return chart


def _separate_names(names: Sequence[str], positions: FloatArray, span: FloatArray) -> list[str]:
    """Return the names, empty where another written one is too close."""
    written: list[int] = []
    for k in range(len(names)):
        steps = np.abs(positions[written] - positions[k]) / np.maximum(span, 1e-9)
        if not written or ((steps[:, 0] > NAME_DISTANCE_FRACTIONS[0]) | (steps[:, 1] > NAME_DISTANCE_FRACTIONS[1])).all():
            written.append(k)
    return [name if k in written else "" for k, name in enumerate(names)]
