"""Campbell diagrams: frequencies over the spindle speed with the lines of excitation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import fail, floats, increasing
from toolpoint.plot.figures.theme import COLOURS, MARK, figure

# Symbol of the sense of whirl: -1 backward, 0 neither, +1 forward.
_WHIRL_SYMBOLS = {-1: "triangle-left", 0: "circle", 1: "triangle-right"}


def campbell_diagram(speeds: ArrayLike, frequency: ArrayLike, whirl: ArrayLike, *, orders: Sequence[float] = (1.0,),
                     title: str = "") -> go.Figure:
    """Return frequencies over the spindle speed; forward whirl points right, backward left.

    Parameters
    ----------
    speeds : (n,) floats
        rev/min.
    frequency, whirl : (n, m) floats
        Hz; +1 forward, -1 backward, 0 neither.
    orders : floats
        Excitations per revolution, drawn as lines.
    """
    checked_speeds = increasing("speeds", floats("speeds", speeds))
    values, sense = floats("frequency", frequency, (checked_speeds.size, None)), floats("whirl", whirl,
                                                                                        (checked_speeds.size, None))
    if values.shape != sense.shape:
        fail("whirl", f"shape {sense.shape}", f"must be that of frequency, {values.shape}")
    chart = figure(title, 460)
    for k in range(values.shape[1]):
        chart.add_scatter(x=checked_speeds, y=values[:, k], name=f"mode {k + 1}", mode="lines+markers",
                          line={"color": COLOURS[k % len(COLOURS)], "width": 2},
                          marker={"size": 7, "symbol": [_WHIRL_SYMBOLS[int(s)] for s in sense[:, k]]},
                          hovertemplate="%{x:.6g} rev/min<br>%{y:.4f} Hz")
    frequency_top = 1.1 * float(values.max())
    for order in orders:
        # The line of an order ends where it leaves the chart at its top.
        end = min(float(checked_speeds[-1]), 60 * frequency_top / order)
        chart.add_scatter(x=[checked_speeds[0], end], y=[order * checked_speeds[0] / 60, order * end / 60], mode="lines",
                          name=f"{order:g} per revolution", line={"color": MARK, "width": 1, "dash": "dash"}, hoverinfo="skip")
    chart.update_xaxes(title_text="Spindle speed, rev/min")
    chart.update_yaxes(title_text="Natural frequency, Hz", range=[0, float(np.ceil(frequency_top))])
    return chart
