"""Polar plot of a circular test in the manner of a ballbar: radial deviation around the circle, quadrant peaks marked."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.plot.figures.theme import COLOURS, MARK, figure, plain

_MAX_TURN_POINTS = 1440  # points of a turn: the outermost of every quarter degree is drawn
_RINGS_EACH_SIDE = 2  # rings beside the nominal circle, inwards and outwards
_NOMINAL_RING_RADIUS = 4.5  # radius of the nominal circle in steps between rings


def ballbar_plot(points: Mapping[str, ArrayLike], radius: float, peaks: ArrayLike | None = None, *,
                 axes: tuple[str, ...] = ("X", "Y"), title: str = "") -> go.Figure:
    """Return radial deviations from the nominal circle about the origin, enlarged to a scale that the rings name.

    Parameters
    ----------
    points : mapping of name to (n, 2) floats
        Places on at least one turn, m.
    radius : float
        Nominal, m.
    peaks : (4,) floats, optional
        Quadrant peaks at 0, 90, 180, 270 deg (m), written at their places.
    axes : two names
        Of the axes of the circle, the first one at 0 deg.
    """
    size = positive("radius", radius)
    turns = {name: _turn(name, value, size) for name, value in points.items()}
    if not turns:
        fail("points", "none", "must be at least one turn")
    step = _round_step(max(float(np.abs(deviation).max()) for _, deviation in turns.values()) / _RINGS_EACH_SIDE)
    chart = figure(title, 560)
    _rings(chart, step)
    for k, (name, (angle, deviation)) in enumerate(turns.items()):
        drawn_radius = _NOMINAL_RING_RADIUS + deviation / step
        chart.add_scatter(x=drawn_radius * np.cos(angle), y=drawn_radius * np.sin(angle), name=plain(name), mode="lines",
                          line={"color": COLOURS[k % len(COLOURS)], "width": 1.6},
                          customdata=np.stack([np.degrees(angle) % 360, 1e6 * deviation], axis=1),
                          hovertemplate="%{customdata[0]:.0f}°: %{customdata[1]:.2f} µm")
    if peaks is not None:
        _peaks(chart, floats("peaks", peaks, (4,)), axes)
    axis_limit = _NOMINAL_RING_RADIUS + _RINGS_EACH_SIDE + 3.2
    chart.update_xaxes(range=[-axis_limit, axis_limit], visible=False, constrain="domain")
    chart.update_yaxes(range=[-axis_limit, axis_limit], visible=False, scaleanchor="x", constrain="domain")
    chart.update_layout(width=640, margin={"l": 8, "r": 8, "t": 40, "b": 8})
    return chart


def _turn(name: str, value: ArrayLike, radius: float) -> tuple[FloatArray, FloatArray]:
    """Return angle (rad) and radial deviation (m), thinned so that of every step the largest deviation is kept."""
    places = floats(f"points[{name!r}]", value, (None, 2))
    angle, deviation = np.unwrap(np.arctan2(places[:, 1], places[:, 0])), np.hypot(*places.T) - radius
    if len(angle) <= _MAX_TURN_POINTS:
        return angle, deviation
    groups = np.array_split(np.arange(len(angle)), _MAX_TURN_POINTS)
    kept = np.array([group[np.argmax(np.abs(deviation[group]))] for group in groups])
    return angle[kept], deviation[kept]


def _round_step(size: float) -> float:
    """Return 1, 2 or 5 times a power of ten, not below a size."""
    power = 10.0 ** np.floor(np.log10(max(size, 1e-9)))
    return float(next(k * power for k in (1, 2, 5, 10) if k * power >= size * (1 - 1e-9)))


def _rings(chart: go.Figure, step: float) -> None:
    turn = np.linspace(0, 2 * np.pi, 181)
    for k in range(-_RINGS_EACH_SIDE, _RINGS_EACH_SIDE + 1):
        line = {"color": MARK, "width": 1.2 if k == 0 else 0.6, "dash": "solid" if k == 0 else "dot"}
        chart.add_scatter(x=(_NOMINAL_RING_RADIUS + k) * np.cos(turn), y=(_NOMINAL_RING_RADIUS + k) * np.sin(turn),
                          mode="lines", line=line, hoverinfo="skip",
                          showlegend=False)
        place = np.radians(45)
        chart.add_annotation(x=(_NOMINAL_RING_RADIUS + k) * np.cos(place), y=(_NOMINAL_RING_RADIUS + k) * np.sin(place),
                             showarrow=False, font={"size": 10},
                             text=f"{1e6 * k * step:+g} µm" if k else "0", bgcolor="rgba(127,127,127,0.15)")
    axis_length = _NOMINAL_RING_RADIUS + _RINGS_EACH_SIDE + 0.2
    for angle in range(0, 360, 90):
        x, y = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        chart.add_scatter(x=[0, axis_length * x], y=[0, axis_length * y], mode="lines", line={"color": MARK, "width": 0.6},
                          hoverinfo="skip",
                          showlegend=False)


def _peaks(chart: go.Figure, peaks: FloatArray, axes: tuple[str, ...]) -> None:
    text_radius = _NOMINAL_RING_RADIUS + _RINGS_EACH_SIDE + 0.4
    for words, angle, peak, anchor in zip([f"{plain(name)}{sign}" for sign in "+−" for name in axes], (0, 90, 180, 270), peaks,
                                          (("left", "middle"), ("center", "bottom"), ("right", "middle"), ("center", "top")),
                                          strict=True):
        chart.add_annotation(x=text_radius * np.cos(np.radians(angle)), y=text_radius * np.sin(np.radians(angle)),
                             showarrow=False,
                             text=f"<b>{words}</b><br>{1e6 * peak:.1f} µm", font={"size": 11}, xanchor=anchor[0],
                             yanchor=anchor[1])
