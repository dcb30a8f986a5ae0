"""Stabilization diagram and mode indicator charts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from toolpoint.modal_identification.judgement.indicators import Indicator
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.plot.figures.theme import COLOURS, figure, plain

if TYPE_CHECKING:
    import plotly.graph_objects as go

LEVELS = ("new", "stable frequency", "stable frequency and damping", "stable frequency, damping and shape")
_SYMBOLS = ("circle-open", "triangle-up-open", "diamond-open", "circle")


def stabilization(diagram: Diagram, indicator: Indicator | None = None, shapes: Sequence[int] | None = None,
                  *, modes: Sequence[float] = (), title: str = "") -> go.Figure:
    """Return the poles of all orders over frequency, by stability, with the indicator behind them.

    Parameters
    ----------
    diagram : Diagram
    indicator : Indicator, optional
        Drawn on its own logarithmic axis (CMIF).
    shapes : sequence of int, optional
        For every pole the number of its shape in a view of the page, -1 where there is none: a click then shows it.
    modes : sequence of float
        Frequencies (Hz) of the modes that were taken, drawn as triangles at the foot.
    """
    chart = figure(title, 560)
    if indicator is not None:
        chart.add_scatter(x=indicator.frequency, y=indicator.values[:, 0], name="CMIF", yaxis="y2", mode="lines",
                         line={"color": "rgba(127,127,127,0.6)", "width": 1}, hoverinfo="skip")
    number = np.full(diagram.poles.size, -1) if shapes is None else np.asarray(shapes)
    for level, name in enumerate(LEVELS):
        is_level = diagram.level == level
        if not is_level.any():
            continue
        chart.add_scatter(
            x=diagram.frequency[is_level], y=diagram.order[is_level], name=name, mode="markers",
            marker={"symbol": _SYMBOLS[level], "color": COLOURS[level % len(COLOURS)], "size": 5 + level},
            customdata=[[int(n), float(d)] for n,
                        d in zip(number[is_level], 100 * diagram.damping_ratio[is_level], strict=True)],
            hovertemplate="%{x:.3f} Hz<br>order %{y}<br>damping %{customdata[1]:.3f} %<extra>" + plain(name) + "</extra>")
    if len(modes):
        chart.add_scatter(x=list(modes), y=[0] * len(modes), name="mode taken", mode="markers",
                          customdata=[["mode", k] for k in range(len(modes))],
                          hovertemplate="%{x:.3f} Hz<extra>mode taken</extra>",
                          marker={"symbol": "triangle-up", "size": 12, "color": COLOURS[1]})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Model order", rangemode="tozero")
    chart.update_layout(legend={"orientation": "h", "y": -0.19, "yanchor": "top"})
    chart.update_layout(yaxis2={"overlaying": "y", "side": "right", "type": "log", "showgrid": False, "title": {"text": "CMIF"},
                               "exponentformat": "power", "dtick": 1})
    return chart
