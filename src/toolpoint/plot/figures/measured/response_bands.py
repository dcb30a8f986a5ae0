"""Magnitudes of responses with their 95 % intervals as bands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure, logarithmic_ticks, plain


def magnitude_bands(frequency: FloatArray, curves: Mapping[str, tuple[FloatArray, FloatArray, FloatArray]], *, title: str = "",
                    quantity: str = "Receptance, m/N") -> go.Figure:
    """Return magnitudes over frequency with bands.

    Parameters
    ----------
    frequency : (n_f,) floats, Hz
    curves : name to (magnitude, lower end, upper end), (n_f,) each, in the unit of `quantity`, the axis' title
    """
    chart = figure(title, 460)
    for k, (name, (middle, lower_end, upper_end)) in enumerate(curves.items()):
        colour = COLOURS[k % len(COLOURS)]
        outline = np.concatenate([frequency, frequency[::-1]])
        chart.add_scatter(x=outline, y=np.concatenate([upper_end, lower_end[::-1]]), fill="toself", line={"width": 0},
                          opacity=0.3,
                          fillcolor=colour, showlegend=False, hoverinfo="skip", legendgroup=str(k))
        chart.add_scatter(x=frequency, y=middle, name=plain(name), line={"color": colour, "width": 1.4}, legendgroup=str(k),
                          hovertemplate="%{x:.5g} Hz<br>%{y:.4g} " + quantity.rpartition(", ")[2])
    chart.update_xaxes(title_text="Frequency, Hz")
    positive_values = np.concatenate([part[0][part[0] > 0] for part in curves.values()])
    chart.update_yaxes(type="log", title_text=quantity,
                       dtick=logarithmic_ticks(float(positive_values.min()), float(positive_values.max())))
    return chart
