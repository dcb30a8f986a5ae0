"""Figures of screenings: two metrics of all variants against each other, effects with their intervals; errors and error
spheres along a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure, plain

SPHERE_OUTLINE_CORNERS = 36  # of a drawn error sphere


def variant_scatter(x: FloatArray, y: FloatArray, *, labels: Sequence[str], names: tuple[str, str],
                    base: int | None = 0) -> go.Figure:
    """Return all variants as points of two metrics; `base` is the machine as it is."""
    chart = figure("", 460)
    numbers = _labels_apart(x, y)
    variants = [i for i in range(len(labels)) if i != base]
    chart.add_scatter(x=x[variants], y=y[variants], mode="markers+text", text=[numbers[i] for i in variants],
                      textposition="top center",
                      name="variants", marker={"size": 8, "color": COLOURS[0]}, customdata=[plain(labels[i]) for i in variants],
                      hovertemplate="%{customdata}<br>%{x:.5g}, %{y:.5g}<extra></extra>")
    if base is not None:
        chart.add_scatter(x=[x[base]], y=[y[base]], mode="markers", name=plain(labels[base]),
                          marker={"size": 13, "color": COLOURS[2], "symbol": "diamond"})
    chart.update_xaxes(title_text=plain(names[0]))
    chart.update_yaxes(title_text=plain(names[1]))
    return chart


def _labels_apart(x: FloatArray, y: FloatArray) -> list[str]:
    """Return a number for every point whose number would not run into one written before; the others say it on hover."""
    scaled_points = np.stack([values / max(float(np.nanmax(values) - np.nanmin(values)), 1e-300) for values in (x, y)], axis=1)
    written: list[int] = []
    # Outlying variants are numbered first: they are those asked about.
    for i in np.argsort(-np.abs(scaled_points - np.nanmedian(scaled_points, axis=0)).max(axis=1), kind="stable").tolist():
        label_distance = np.abs(scaled_points[written] - scaled_points[i]) / (0.09, 0.08) if written else np.full((1, 2), 9.0)
        if np.isfinite(scaled_points[i]).all() and (label_distance.max(axis=1) > 1).all():
            written.append(i)
    return [str(i) if i in written else "" for i in range(len(x))]


def effect_bars(names: Sequence[str], values: FloatArray, lower_ends: FloatArray, *, upper_ends: FloatArray,
                title: str) -> go.Figure:
    """Return effects as bars with their 95 % intervals, the first on top."""
    chart = figure("", max(240, 34 * len(names) + 120))
    has_interval = np.isfinite(lower_ends) & np.isfinite(upper_ends)
    chart.add_bar(x=values, y=[plain(name) for name in names], orientation="h", marker={"color": COLOURS[0]},
                  error_x={"type": "data", "symmetric": False, "array": np.where(has_interval, upper_ends - values, 0.0),
                           "arrayminus": np.where(has_interval, values - lower_ends, 0.0)}, name="effect")
    chart.update_yaxes(autorange="reversed")
    chart.update_xaxes(title_text=plain(title))
    return chart


def error_curves(length: FloatArray, values: FloatArray, *, names: Sequence[str], quantity: str) -> go.Figure:
    """Return errors over the way along a side: (n,) mm and (n, k)."""
    chart = figure("", 380)
    for k, name in enumerate(names):
        chart.add_scatter(x=length, y=values[:, k], name=plain(name), mode="lines",
                          line={"width": 1, "color": COLOURS[k % len(COLOURS)]})
    chart.update_xaxes(title_text="Way along the side, mm")
    chart.update_yaxes(title_text=plain(quantity))
    return chart


def error_spectrum(frequency: FloatArray, amplitude: FloatArray, *, names: Sequence[str], quantity: str,
                   tooth: float) -> go.Figure:
    """Return amplitudes over frequency with the tooth-passing line marked."""
    chart = figure("", 380)
    for k, name in enumerate(names):
        chart.add_scatter(x=frequency, y=amplitude[:, k], name=plain(name), mode="lines",
                          line={"width": 1, "color": COLOURS[k % len(COLOURS)]})
    chart.add_vline(x=tooth, line={"dash": "dot", "width": 1}, annotation_text="tooth passing")
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text=plain(quantity), type="log")
    return chart


def sphere_path(courses: Sequence[FloatArray], centres: FloatArray, radii: FloatArray, *, axes: tuple[str, str], scale: float,
                quantity: str) -> go.Figure:
    """Return error spheres along a path, seen along its normal: courses (k, 2) and centres (n, 2) in mm, radii (n,) in um.

    Circles are the radii drawn `scale` times larger; `quantity` names them on the colour scale.
    """
    chart = figure("", 480)
    for k, course in enumerate(courses):
        chart.add_scatter(x=course[:, 0], y=course[:, 1], mode="lines", name="path", showlegend=k == 0, hoverinfo="skip",
                          line={"width": 1, "color": COLOURS[0]})
    turn = np.linspace(0.0, 2 * np.pi, SPHERE_OUTLINE_CORNERS + 1)
    # Not a number ends a circle: one trace draws all of them.
    outline = np.stack([np.append(np.cos(turn), np.nan), np.append(np.sin(turn), np.nan)], axis=1)
    circles = (centres[:, None] + 1e-3 * scale * radii[:, None, None] * outline).reshape(-1, 2)
    chart.add_scatter(x=circles[:, 0], y=circles[:, 1], mode="lines", name="error spheres", hoverinfo="skip",
                      line={"width": 1, "color": COLOURS[2]})
    chart.add_scatter(x=centres[:, 0], y=centres[:, 1], mode="markers", name="their centres", showlegend=False,
                      marker={"size": 6, "color": radii, "colorscale": "Viridis", "showscale": True,
                              "colorbar": {"title": {"text": plain(quantity)}, "thickness": 14}},
                      hovertemplate="%{marker.color:.4g} µm<extra></extra>")
    chart.update_xaxes(title_text=plain(axes[0]))
    chart.update_yaxes(title_text=plain(axes[1]), scaleanchor="x", scaleratio=1)
    return chart
