"""Figures over the workspace: natural frequencies, or any other quantity, over one axis or over two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, increasing
from toolpoint.plot.figures.theme import COLOURS, figure, plain

MIN_SMOOTHED_POSITIONS = 7  # positions of an axis below which a map is not smoothed
_MIN_COLOUR_SPAN = 0.2  # of the value in the middle: a map of smaller differences does not use all colours


def frequency_curves(
    position: ArrayLike,
    frequency: ArrayLike,
    *,
    axis: str = "X",
    unit: str = "m",
    names: Sequence[str] = (),
    quantity: str = "Natural frequency, Hz",
    title: str = "",
) -> go.Figure:
    """Return each mode's frequency over the position of one axis.

    Parameters
    ----------
    position : (p,) floats
        Axis positions, increasing, in `unit`.
    frequency : (p, m) floats
        One column a mode; NaN at a pose that failed leaves a gap.
    axis, unit : str
        Name and unit of the axis.
    names : m str, optional
        Mode names; mode 1, 2 ... where none are given.
    quantity : str
        Title of the value axis with its unit.

    >>> figure = frequency_curves([0.0, 0.1, 0.2], [[40.0, 60.0], [41.0, 61.0], [43.0, 60.0]])
    >>> len(figure.data)  # one curve a mode
    2
    """
    positions = increasing("position", floats("position", position))
    values = floats("frequency", frequency, (positions.size, None), finite=False)
    if values.ndim != 2:
        fail("frequency", f"shape {values.shape}", f"must be ({positions.size}, modes)")
    words = _column_names(names, values.shape[1])
    chart = figure(title, 420)
    for i, name in enumerate(words):
        chart.add_scatter(x=positions, y=values[:, i], name=name, mode="lines+markers" if positions.size <= 40 else "lines",
                         line={"color": COLOURS[i % len(COLOURS)], "width": 2}, marker={"size": 5},
                         hovertemplate=f"{plain(axis)} %{{x:.4g}} {plain(unit)}<br>%{{y:.5g}}")
    chart.update_xaxes(title_text=f"{plain(axis)}, {plain(unit)}")
    chart.update_yaxes(title_text=plain(quantity))
    return chart


def frequency_map(
    x: ArrayLike,
    y: ArrayLike,
    frequency: ArrayLike,
    *,
    axes: tuple[str, str] = ("X", "Y"),
    units: tuple[str, str] = ("m", "m"),
    names: Sequence[str] = (),
    quantity: str = "Natural frequency, Hz",
    title: str = "",
    reasons: Mapping[tuple[int, ...], str] | None = None,
    is_logarithm: bool = False,
) -> go.Figure:
    """Return a map over two axes, one mode at a time with buttons to change it, its lowest and highest pose marked.

    Fewer than `MIN_SMOOTHED_POSITIONS` positions of an axis are drawn as cells with their values, nothing between them; more as
    contours with a dot at every pose that was computed.

    Parameters
    ----------
    x, y : (nx,), (ny,) floats
        Axis positions, increasing, in `units`.
    frequency : (nx, ny, m) floats
        NaN marks a pose that failed: it is drawn as a cross and not interpolated over.
    axes, units, names, quantity : as for `frequency_curves`
    reasons : mapping of (i, j) to text, optional
        Why poses failed; shown at their crosses.
    is_logarithm : bool
        The values are logarithms: their colours go from the lowest to the highest.

    Otherwise the colours span at least `_MIN_COLOUR_SPAN` of the value in the middle, so that a difference of 3 % looks small.

    >>> figure = frequency_map([0.0, 0.1], [0.0, 0.2], np.array([[[40.0], [41.0]], [[42.0], [43.0]]]))
    >>> figure.data[0].type
    'heatmap'
    """
    across, along = increasing("x", floats("x", x)), increasing("y", floats("y", y))
    values = floats("frequency", frequency, (across.size, along.size, None), finite=False)
    if values.ndim != 3 or across.size < 2 or along.size < 2:
        fail("frequency", f"shape {values.shape}", "must be (nx, ny, modes) with nx and ny of 2 or more",
             remedy="for one axis use frequency_curves")
    words = _column_names(names, values.shape[2])
    chart = figure(title, 500)
    hover_text = (f"{plain(axes[0])} %{{x:.4g}} {plain(units[0])}, {plain(axes[1])} %{{y:.4g}} {plain(units[1])}<br>%{{z:.5g}}"
                  "<extra></extra>")
    for i, name in enumerate(words):
        trace = {"x": across, "y": along, "z": values[:, :, i].T, "name": name, "visible": i == 0, "colorscale": "Viridis",
                 "colorbar": {"title": {"text": plain(quantity), "side": "right"}, "thickness": 14},
                 "hovertemplate": hover_text, **({} if is_logarithm else _colour_range(values[:, :, i]))}
        if max(across.size, along.size) < MIN_SMOOTHED_POSITIONS:
            chart.add_heatmap(**trace, text=_cell_texts(values[:, :, i]), texttemplate="%{text}", xgap=1, ygap=1)
        elif is_coarse(across.size, along.size):
            chart.add_heatmap(**trace)  # a gap between hundreds of lines would be all that is seen
        else:
            chart.add_contour(**trace, connectgaps=False, line={"width": 0.6},
                              contours={"showlabels": True, "labelfont": {"size": 11, "color": "white"}})
    size = 0 if max(across.size, along.size) < MIN_SMOOTHED_POSITIONS else 17  # cells have the sign beside their number
    for i in range(len(words)):
        _extremes(chart, (across, along), values[:, :, i], is_shown=i == 0, size=size)
    if not is_coarse(across.size, along.size):
        x, y = np.meshgrid(across, along, indexing="ij")
        chart.add_scatter(x=x.ravel(), y=y.ravel(), mode="markers", name="poses computed", hoverinfo="skip",
                         marker={"size": 3, "color": "rgba(255,255,255,0.75)", "line": {"width": 0.5, "color": "#333"}})
    _crosses(chart, (across, along), values, reasons or {})
    chart.update_xaxes(title_text=f"{plain(axes[0])}, {plain(units[0])}", **_ticks(across))
    chart.update_yaxes(title_text=f"{plain(axes[1])}, {plain(units[1])}", **_ticks(along))
    chart.update_layout(legend={"y": -0.22, "yanchor": "top"}, showlegend=True)
    set_column_buttons(chart, words)
    return chart


def _colour_range(values: FloatArray) -> dict[str, float]:
    """Return the ends of the colours where the differences of a column are small beside its values, else nothing."""
    if np.isnan(values).all():
        return {}
    lowest, highest = float(np.nanmin(values)), float(np.nanmax(values))
    middle = (lowest + highest) / 2
    half_width = _MIN_COLOUR_SPAN * abs(middle) / 2
    return {} if highest - lowest >= 2 * half_width else {"zmin": middle - half_width, "zmax": middle + half_width}


def _cell_texts(values: FloatArray) -> list[list[str]]:
    """Return the number of every cell, rows along y, with a sign at the lowest and the highest."""
    texts = [[f"{v:#.4g}".rstrip(".") if np.isfinite(v) else "" for v in row] for row in values.T]
    for pick, sign in ((np.nanargmin, "▽"), (np.nanargmax, "△")):
        if not np.isnan(values).all():
            i, j = np.unravel_index(int(pick(values)), values.shape)
            texts[int(j)][int(i)] += f"<br>{sign}"
    return texts


def is_coarse(*counts: int) -> bool:
    """Return whether a map has too few positions to be smoothed: its poses are then drawn as they were computed."""
    return min(counts) < MIN_SMOOTHED_POSITIONS


def set_column_buttons(chart: go.Figure, words: Sequence[str]) -> None:
    """Give a map its buttons: one column and its extremes at a time (the first traces), everything else always."""
    count = len(words)
    if count < 2:
        return
    # Traces: one map a column, then the extremes of each, then what is drawn for all columns.
    always_visible = [True] * (len(chart.data) - 2 * count)
    buttons = [{"label": name, "method": "restyle",
                "args": [{"visible": [k % count == i for k in range(2 * count)] + always_visible}]}
               for i, name in enumerate(words)]
    chart.update_layout(updatemenus=[{"type": "dropdown", "buttons": buttons, "x": 0, "xanchor": "left", "y": 1.03,
                                     "yanchor": "bottom", "bgcolor": "rgba(127,127,127,0.12)"}], margin={"t": 64})


def _extremes(chart: go.Figure, axis_positions: tuple[FloatArray, FloatArray], values: FloatArray, *, is_shown: bool,
              size: int) -> None:
    """Mark where a column is lowest and highest; the trace is there also where nothing could be computed."""
    places = ([] if np.isnan(values).all() else [np.unravel_index(int(pick(values)), values.shape)
                                                for pick in (np.nanargmin, np.nanargmax)])
    chart.add_scatter(x=[axis_positions[0][i] for i, _ in places], y=[axis_positions[1][j] for _, j in places], mode="markers",
                      visible=is_shown,
                     name="lowest (▽) and highest (△)", text=[f"{values[place]:.4g}" for place in places],
                     hovertemplate="%{text}<extra></extra>",
                     marker={"symbol": ["triangle-down-open", "triangle-up-open"][:len(places)], "size": size,
                             "opacity": 1 if size else 0, "color": COLOURS[1], "line": {"width": 3}})


def _ticks(positions: FloatArray) -> dict[str, Any]:
    """Return axis settings that name every position where they are few."""
    return {"tickvals": positions.tolist(),
            "ticktext": [f"{v:.4g}" for v in positions]} if positions.size < MIN_SMOOTHED_POSITIONS else {}


def _crosses(chart: go.Figure, axis_positions: tuple[FloatArray, FloatArray], values: FloatArray,
             reasons: Mapping[tuple[int, ...], str]
             ) -> None:
    x, y = axis_positions
    i, j = np.nonzero(np.isnan(values).any(axis=2))
    if i.size == 0:
        return
    texts = [plain(reasons.get((int(a), int(b)), "pose failed")) for a, b in zip(i, j, strict=True)]
    chart.add_scatter(x=x[i], y=y[j], mode="markers", name="pose failed", showlegend=True, text=texts, hoverinfo="text",
                     marker={"symbol": "x", "color": COLOURS[1], "size": 9})


def _column_names(names: Sequence[str], count: int) -> list[str]:
    words = [plain(name) for name in names] or [f"mode {i}" for i in range(1, count + 1)]
    if len(words) != count:
        fail("names", f"{len(words)} names", f"must be {count}, one for each mode")
    return words
