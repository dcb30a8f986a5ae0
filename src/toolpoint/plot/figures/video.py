"""Figures of a video: the picture at rest with its points and shapes, and the spectrum of the point that is clicked."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import ComplexArray, FloatArray, IndexArray
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.plot.page.charts import ClickedSeries
from toolpoint.studies.video.response_error import ResponseError
from toolpoint.vision.displacement.result import DisplacementField

POINT_TRACE = "measured points"  # trace of `picture_points`, by which `point_spectra` finds a clicked point
# Points that can be clicked; spectral lines that each keeps. The page holds the spectra of all points.
MAX_CLICKED_POINTS, MAX_SPECTRUM_LINES = 80, 880
MAX_SHOWN_CURVES = 8  # of an error over parameters; the others appear by a click in the legend


def picture_points(picture: bytes, shape: tuple[int, int], field: DisplacementField, *, chosen: Sequence[int]) -> go.Figure:
    """Return the picture at rest (a PNG or JPEG file) with the chosen windows as points that can be clicked.

    shape : rows and columns of the picture; chosen : numbers of windows, from 0. A point carries its place in `chosen`.
    """
    chart = _picture_chart(picture, shape)
    centres = field.windows.centres[list(chosen)]
    words = [f"point {k + 1}: {field.quality[k]}, {_sigma(field, k)} px a frame" for k in chosen]
    chart.add_scatter(x=centres[:, 0], y=centres[:, 1], mode="markers", name=POINT_TRACE, customdata=list(range(len(chosen))),
                      text=words, hovertemplate="%{text}<extra></extra>",
                      marker={"size": 8, "color": COLOURS[1], "line": {"width": 1, "color": "white"}})
    return chart


def picture_shape(picture: bytes, shape: tuple[int, int], centres: FloatArray, *, shape_values: ComplexArray,
                  title: str = "") -> go.Figure:
    """Return the picture at rest with the shape of one mode as lines from each window's centre.

    shape : rows and columns of the picture; centres : (n, 2) columns and rows, pixels; shape_values : (n, 2) complex, to the
    right and down, of any scale. The longest component is drawn as a twentieth of the picture's longer side.
    """
    chart = _picture_chart(picture, shape, title)
    # Turned to the phase at which the sum of squared real parts is largest.
    real_shape = shape_values * np.exp(-0.5j * np.angle((shape_values**2).sum()))
    # The longest arrow is a twentieth of the picture: shapes are some thousandths of a pixel, and would not be seen.
    arrows = real_shape.real * (0.05 * max(shape) / max(float(np.abs(real_shape.real).max()), 1e-12))
    x, y = (np.stack([centres[:, i], centres[:, i] + arrows[:, i], np.full(len(centres), np.nan)], axis=1).ravel() for i in (0,
                                                                                                                             1))
    chart.add_scatter(x=np.round(x, 1), y=np.round(y, 1), mode="lines", line={"color": COLOURS[1], "width": 1.5},
                      hoverinfo="skip",
                      name="shape")
    chart.add_scatter(x=np.round(centres[:, 0] + arrows[:, 0], 1), y=np.round(centres[:, 1] + arrows[:, 1], 1), mode="markers",
                      marker={"size": 3, "color": COLOURS[1]}, hoverinfo="skip", name="tip")
    return chart


def point_spectra(field: DisplacementField, chosen: Sequence[int], follows: str, *, first: int, highest: float,
                  name: str = "spectra") -> ClickedSeries:
    """Return the amplitude spectrum of every chosen point, pixels to the right and down, shown when the point is clicked.

    follows : name of the chart that is clicked; first : frame at which the spectrum begins, from 0; highest : Hz. Of more than
    `MAX_SPECTRUM_LINES` lines the largest of every few neighbours is kept, which the caption says: peaks stay, up to `highest`.
    """
    values = field.values[first:, list(chosen)]
    spectra = 2 * np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0)) / len(values)
    frequency = np.fft.rfftfreq(len(values), 1 / field.frame_rate)
    keep = np.flatnonzero((frequency > 0) & (frequency <= highest))
    neighbours = -(-keep.size // MAX_SPECTRUM_LINES)
    chart = figure("", 340)
    chart.update_xaxes(title_text="Frequency, Hz")
    chart.update_yaxes(title_text="Amplitude, px", type="log")
    sets = []
    for n, k in enumerate(chosen):
        lines = largest_of_neighbours(spectra[keep, n].max(axis=1), neighbours)
        sets.append((f"point {k + 1} ({field.quality[k]})", frequency[keep][lines],
                     [np.maximum(spectra[keep, n, i][lines], 1e-6) for i in range(2)]))
    pooled = f" The largest of every {neighbours} lines is drawn." if neighbours > 1 else ""
    return ClickedSeries(chart, follows, POINT_TRACE, ("right", "down"), COLOURS[:2], sets,
                         "Spectrum of the point last clicked." + pooled, name)


def largest_of_neighbours(values: FloatArray, neighbours: int) -> IndexArray:
    """Return the places of the largest of every `neighbours` values (n,), in rising order; all places where that is 1."""
    starts = np.arange(0, values.size, max(neighbours, 1))
    return np.array([start + int(np.argmax(values[start:start + neighbours])) for start in starts.tolist()], dtype=np.int64)


def spread_points(field: DisplacementField, max_points: int = MAX_CLICKED_POINTS) -> list[int]:
    """Return the numbers, from 0, of up to `max_points` windows that see motion, evenly spaced in their order."""
    visible = np.flatnonzero(field.windows.sight > 0)
    return visible[np.unique(np.linspace(0, visible.size - 1,
                                         min(max_points, visible.size)).astype(int))].tolist() if visible.size else []


def _sigma(field: DisplacementField, k: int) -> str:
    """Return the standard deviation of a window's displacement in one frame, pixels, as text: mean power of both ways."""
    return f"{np.sqrt(np.trace(field.covariance[k]) / 2):.2g}"


def _picture_chart(picture: bytes, shape: tuple[int, int], title: str = "") -> go.Figure:
    """Return a chart with the picture as its background, one unit a pixel, rows downwards; shape : rows and columns."""
    rows, columns = shape
    chart = figure(title, int(min(620, max(320, 900 * rows / columns))))
    source = "data:image/jpeg;base64," + base64.b64encode(picture).decode()
    chart.add_layout_image({"source": source, "xref": "x", "yref": "y", "x": -0.5, "y": -0.5, "sizex": columns, "sizey": rows,
                            "sizing": "stretch", "layer": "below"})
    chart.update_xaxes(range=[-0.5, columns - 0.5], showgrid=False, zeroline=False, title_text="Column, px", constrain="domain")
    chart.update_yaxes(range=[rows - 0.5, -0.5], showgrid=False, zeroline=False, title_text="Row, px", scaleanchor="x",
                       constrain="domain")
    chart.update_layout(showlegend=False)
    return chart


def plot_response_error(error: ResponseError) -> go.Figure:
    """Return the error of the responses over the factor of each joint parameter; what moves it most first."""
    chart = figure("", 420)
    for rank, i in enumerate(error.ranking.tolist()):
        name = error.paths[i].removeprefix("joints.")
        chart.add_scatter(x=error.factors, y=100 * error.error[i], mode="lines+markers", name=name,
                          visible=True if rank < MAX_SHOWN_CURVES else "legendonly",
                          line={"color": COLOURS[rank % len(COLOURS)]},
                          hovertemplate="%{x:.3g} times<br>%{y:.3g} %<extra>" + name + "</extra>")
    chart.update_xaxes(title_text="Factor of the parameter", type="log")
    chart.update_yaxes(title_text="Error of the responses, %", rangemode="tozero")
    chart.update_layout(legend={"orientation": "h", "y": -0.35, "yanchor": "top", "x": 0})
    return chart
