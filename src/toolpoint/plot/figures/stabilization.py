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
                  *, title: str = "") -> go.Figure:
    """Return the poles of all orders over frequency, by stability, with the indicator behind them.

    Parameters
    ----------
    diagram : Diagram
    indicator : Indicator, optional
        Drawn on its own logarithmic axis (CMIF).
    shapes : sequence of int, optional
        For every pole the number of its shape in a view of the page, -1 where there is none: a click then shows it.
    """
    chart = figure(title, 560)
    if indicator is not None:
        chart.add_scatter(x=indicator.frequency, y=indicator.values[:, 0], name="CMIF", yaxis="y2", mode="lines",
                         line={"color": "rgba(127,127,127,0.6)", "width": 1}, hoverinfo="skip")
    number = np.full(diagram.poles.size, -1) if shapes is None else np.asarray(shapes)
    for level, name in enumerate(LEVELS):
        at = diagram.level == level
        if not at.any():
            continue
        chart.add_scatter(
            x=diagram.frequency[at], y=diagram.order[at], name=name, mode="markers",
            marker={"symbol": _SYMBOLS[level], "color": COLOURS[level % len(COLOURS)], "size": 5 + level},
            customdata=[[int(n), float(d)] for n, d in zip(number[at], 100 * diagram.damping_ratio[at], strict=True)],
            hovertemplate="%{x:.3f} Hz<br>order %{y}<br>damping %{customdata[1]:.3f} %<extra>" + plain(name) + "</extra>")
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Model order")
    chart.update_layout(yaxis2={"overlaying": "y", "side": "right", "type": "log", "showgrid": False, "title": {"text": "CMIF"},
                               "exponentformat": "power"}, legend={"orientation": "h", "y": -0.2})
    return chart


def indicators(first: Indicator, title: str = "") -> go.Figure:
    """Return all curves of a mode indicator function over frequency, logarithmic."""
    chart = figure(title, 380)
    for i in range(first.values.shape[1]):
        chart.add_scatter(x=first.frequency, y=first.values[:, i], name=f"singular value {i + 1}", mode="lines",
                         line={"color": COLOURS[i % len(COLOURS)], "width": 1.5})
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="CMIF", type="log", exponentformat="power")
    return chart
