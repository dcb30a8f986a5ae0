"""Charts of step tests: set point and response over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.figures.thinning import thin_curve
from toolpoint.studies.servos.step_test import DISPLAY_UNITS, StepTest

if TYPE_CHECKING:
    import plotly.graph_objects as go

_QUANTITIES = {"current": "q current", "velocity": "Velocity", "position": "Position"}
_SETTLED_BAND = 0.02  # of the step, drawn as a band about its height


def plot_step(test: StepTest) -> go.Figure:
    """Return set point and response of a step over time, with the band of 2 % within which it has settled."""
    scale, unit = DISPLAY_UNITS[test.unit]
    chart = figure("", 340)
    height = scale * test.height
    chart.add_hrect(y0=height * (1 - _SETTLED_BAND), y1=height * (1 + _SETTLED_BAND), line_width=0,
                    fillcolor="rgba(127,127,127,0.15)")
    chart.add_scatter(x=1e3 * test.time[[0, -1]], y=[height, height], name="set point", mode="lines",
                      line={"color": "rgba(127,127,127,0.9)", "dash": "dash", "width": 1})
    time, response = thin_curve(1e3 * test.time, scale * test.response)
    chart.add_scatter(x=time, y=response, name="response", mode="lines", line={"color": COLOURS[0]})
    if test.figures is not None:
        settled = 1e3 * test.figures.settling_time
        chart.add_scatter(x=[settled], y=[float(np.interp(settled, time, response))], name="settled", mode="markers",
                          marker={"color": COLOURS[1], "size": 8})
    chart.update_xaxes(title_text="Time from the step, ms")
    chart.update_yaxes(title_text=f"{_QUANTITIES[test.setting.level]}, {unit}")
    return chart
