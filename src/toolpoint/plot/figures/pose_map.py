"""Figures over the workspace: natural frequencies, or any other quantity, over one axis or over two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, increasing
from toolpoint.plot.figures.theme import COLOURS, figure, plain


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
    """
    at = increasing("position", floats("position", position))
    values = floats("frequency", frequency, (at.size, None), finite=False)
    if values.ndim != 2:
        fail("frequency", f"shape {values.shape}", f"must be ({at.size}, modes)")
    words = _names(names, values.shape[1])
    chart = figure(title, 420)
    for i, name in enumerate(words):
        chart.add_scatter(x=at, y=values[:, i], name=name, mode="lines+markers" if at.size <= 40 else "lines",
                         line={"color": COLOURS[i % len(COLOURS)], "width": 2}, marker={"size": 5},
                         hovertemplate=f"{plain(axis)} %{{x:.4g}} {plain(unit)}<br>%{{y:.4f}}")
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
) -> go.Figure:
    """Return contours over two axes, one mode at a time with buttons to change it.

    Parameters
    ----------
    x, y : (nx,), (ny,) floats
        Axis positions, increasing, in `units`.
    frequency : (nx, ny, m) floats
        NaN marks a pose that failed: it is drawn as a cross and not interpolated over.
    axes, units, names, quantity : as for `frequency_curves`
    reasons : mapping of (i, j) to text, optional
        Why poses failed; shown at their crosses.
    """
    across, along = increasing("x", floats("x", x)), increasing("y", floats("y", y))
    values = floats("frequency", frequency, (across.size, along.size, None), finite=False)
    if values.ndim != 3 or across.size < 2 or along.size < 2:
        fail("frequency", f"shape {values.shape}", "must be (nx, ny, modes) with nx and ny of 2 or more",
             "for one axis use frequency_curves")
    words = _names(names, values.shape[2])
    chart = figure(title, 500)
    for i, name in enumerate(words):
        chart.add_contour(
            x=across, y=along, z=values[:, :, i].T, name=name, visible=i == 0, colorscale="Viridis", connectgaps=False,
            contours={"showlabels": True, "labelfont": {"size": 11, "color": "white"}}, line={"width": 0.6},
            colorbar={"title": {"text": plain(quantity), "side": "right"}, "thickness": 14},
            hovertemplate=f"{plain(axes[0])} %{{x:.4g}} {plain(units[0])}, "
                          f"{plain(axes[1])} %{{y:.4g}} {plain(units[1])}<br>%{{z:.4f}}")
    lost = _crosses(chart, (across, along), values, reasons or {})
    chart.update_xaxes(title_text=f"{plain(axes[0])}, {plain(units[0])}")
    chart.update_yaxes(title_text=f"{plain(axes[1])}, {plain(units[1])}")
    if len(words) > 1:
        buttons = [{"label": name, "method": "restyle",
                    "args": [{"visible": [k == i for k in range(len(words))] + [True] * lost}]}
                   for i, name in enumerate(words)]
        chart.update_layout(updatemenus=[{"type": "dropdown", "buttons": buttons, "x": 0, "xanchor": "left", "y": 1.14,
                                         "yanchor": "bottom", "bgcolor": "rgba(127,127,127,0.12)"}], margin={"t": 96})
    return chart


def _crosses(chart: go.Figure, at: tuple[FloatArray, FloatArray], values: FloatArray, reasons: Mapping[tuple[int, ...], str]
             ) -> int:
    x, y = at
    i, j = np.nonzero(np.isnan(values).any(axis=2))
    if i.size == 0:
        return 0
    texts = [plain(reasons.get((int(a), int(b)), "pose failed")) for a, b in zip(i, j, strict=True)]
    chart.add_scatter(x=x[i], y=y[j], mode="markers", name="pose failed", showlegend=True, text=texts, hoverinfo="text",
                     marker={"symbol": "x", "color": COLOURS[1], "size": 9})
    return 1


def _names(names: Sequence[str], count: int) -> list[str]:
    words = [plain(name) for name in names] or [f"mode {i}" for i in range(1, count + 1)]
    if len(words) != count:
        fail("names", f"{len(words)} names", f"must be {count}, one for each mode")
    return words
