"""Chart of modes over a traverse: windows with their intervals, the common course with its band, the machine's prediction."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from toolpoint.plot.figures.theme import COLOURS, figure, with_alpha
from toolpoint.studies.moving.traverse_study import TraverseStudy

COURSE_POINTS = 60  # of the drawn courses
BAND_OPACITY = 0.2


def draw_courses(study: TraverseStudy) -> go.Figure:
    """Return the change of every frequency over the value, per cent of its mean."""
    chart = figure("", 480)
    values = np.linspace(float(study.values.min()), float(study.values.max()), COURSE_POINTS)
    for k, (track, course) in enumerate(zip(study.tracks, study.frequency, strict=True)):
        colour = COLOURS[k % len(COLOURS)]
        mean = float(np.mean(track.frequency))
        windows = track.windows.astype(int)
        middle, half_width = course.at_values(values)
        edge = np.concatenate([middle + half_width, (middle - half_width)[::-1]])
        chart.add_scatter(x=np.concatenate([values, values[::-1]]), y=100 * (edge / mean - 1), fill="toself", mode="lines",
                          line={"width": 0}, fillcolor=with_alpha(colour, BAND_OPACITY), hoverinfo="skip", showlegend=False)
        chart.add_scatter(x=values, y=100 * (middle / mean - 1), mode="lines", line={"color": colour}, showlegend=False,
                          hoverinfo="skip")
        chart.add_scatter(x=study.values[windows], y=100 * (track.frequency / mean - 1), mode="markers",
                          name=f"{mean:.4g} Hz", marker={"color": colour, "size": 7},
                          error_y={"type": "data", "array": 196 * track.deviations[:, 0] / mean, "thickness": 1})
        if study.predicted is not None and np.isfinite(study.predicted.frequency[k]).any():
            predicted = study.predicted.frequency[k] / np.nanmean(study.predicted.frequency[k])
            chart.add_scatter(x=study.values, y=100 * (predicted - 1), mode="lines", line={"color": colour, "dash": "dash"},
                              name=f"{mean:.4g} Hz, machine file")
    chart.update_xaxes(title_text=study.quantity)
    chart.update_yaxes(title_text="Frequency against its mean, %")
    chart.update_layout(legend={"orientation": "h", "y": -0.19, "yanchor": "top"})
    return chart
