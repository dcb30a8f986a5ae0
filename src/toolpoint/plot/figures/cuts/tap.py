"""Figures of a tap test: limits with their interval, and speeds to use."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure, with_alpha


def limit_chart(speeds: FloatArray, limit: FloatArray, ends: tuple[FloatArray, FloatArray], *,
                rough: tuple[FloatArray, FloatArray], use: Sequence[tuple[float, float]]) -> go.Figure:
    """Return depth limits (m) over spindle speed with their 95 % interval, the rough curve, and speeds to use (rev/min, m)."""
    chart = figure("", 460)
    both = np.concatenate([speeds, speeds[::-1]])
    chart.add_scatter(x=both, y=1e3 * np.concatenate([ends[1], ends[0][::-1]]), fill="toself", line={"width": 0}, opacity=0.35,
                      fillcolor=with_alpha(COLOURS[0], 0.35), name="95 % interval", hoverinfo="skip")
    chart.add_scatter(x=rough[0], y=1e3 * rough[1], mode="lines", name="rough (single frequency)",
                      line={"color": "rgba(127,127,127,0.7)", "width": 1.2, "dash": "dot"},
                      hovertemplate="%{x:.0f} rev/min<br>%{y:.3g} mm<extra>rough</extra>")
    chart.add_scatter(x=speeds, y=1e3 * limit, mode="lines+markers", name="limit, exact at the dots",
                      line={"color": COLOURS[0], "width": 1.6}, marker={"size": 6},
                      hovertemplate="%{x:.0f} rev/min<br>%{y:.3g} mm<extra>exact</extra>")
    if use:
        chart.add_scatter(x=[speed for speed, _ in use], y=[1e3 * depth for _, depth in use], mode="markers+text",
                          name="use these", text=[f"{speed:.0f}" for speed, _ in use], textposition="top center",
                          marker={"symbol": "star", "size": 15, "color": "#27ae60"},
                          hovertemplate="%{x:.0f} rev/min<br>%{y:.3g} mm<extra>use</extra>")
    chart.update_xaxes(title_text="Spindle speed, rev/min")
    chart.update_yaxes(title_text="Axial depth of cut, mm", rangemode="tozero")
    return chart
