"""Theme: colours, fonts and axis settings that all figures share, readable on light and dark pages."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.colors import sequential, unlabel_rgb

from toolpoint._check import Array, fail
from toolpoint.plot.page.markup import typeset

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
# Okabe and Ito, Color Universal Design (2008), without its black and yellow, which vanish on dark and on light pages.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F", "#882E72", "#999933", "#5B5BD6",
           "#A6761D", "#1FB5A6")
# Fills of stable and unstable regions of a chart; line at a natural frequency.
STABLE, UNSTABLE, MARK = "rgba(0,158,115,0.16)", "rgba(213,94,0,0.16)", "rgba(127,127,127,0.75)"
# Curves differ in dash as well as in colour: in print and to colour-blind readers colours alone are one.
DASHES = ("solid", "dash", "dot", "dashdot")
PRINTED_PAGE_WIDTH = 640  # pixels that a printed page is wide: no figure may need more
_MIN_LABELLED_WIDTH = 600  # pixels: on a narrower chart the labels of two modes would overlap
# Width of a label turned by 90 degrees, over the length of the axis; frequencies written out in one label.
_LABEL_WIDTH_FRACTION, _MAX_LABEL_FREQUENCIES = 0.02, 4


def _ramp() -> list[list[float]]:
    """Return the colours of Viridis as red, green, blue of 0 .. 1, for the WebGL views."""
    colours = [c if isinstance(c, str) else str(c) for c in sequential.Viridis]
    return [[int(c[i:i + 2], 16) / 255 for i in (1, 3, 5)] if c.startswith("#")
            else [v / 255 for v in unlabel_rgb(c)] for c in colours]


RAMP = _ramp()  # (n, 3) red, green, blue
_AXIS = {"gridcolor": "rgba(127,127,127,0.22)", "linecolor": "rgba(127,127,127,0.6)", "showline": True, "mirror": True,
         "ticks": "outside", "tickcolor": "rgba(127,127,127,0.6)", "ticklen": 4, "zeroline": False, "automargin": True,
         "title": {"standoff": 8}, "exponentformat": "power",
         "minexponent": 5}  # 14000 rev/min and not 1.4 x 10^4
TEMPLATE = go.layout.Template(
    layout={
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "rgba(127,127,127,0.7)", "activecolor": "#0a66b0"},
        "font": {"family": FONT, "size": 13, "color": "#2a3140"}, "colorway": list(COLOURS),
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)", "xaxis": _AXIS, "yaxis": _AXIS,
        "hoverlabel": {"font": {"family": FONT}, "namelength": -1}, "hovermode": "closest",
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom", "bgcolor": "rgba(0,0,0,0)"},
        "margin": {"l": 72, "r": 24, "t": 48, "b": 56}, "title": {"font": {"size": 15}, "x": 0.01, "xanchor": "left"},
        "colorscale": {"sequential": "Viridis"},
    })


def figure(title: str = "", height: int = 420, **layout: Any) -> go.Figure:
    """Return an empty figure in the common style; `height` in pixels, `layout` as plotly's."""
    chart = go.Figure(layout={"template": TEMPLATE, "height": height, **layout})
    if title:
        chart.update_layout(title={"text": plain(title)})
    return chart


def needs_width(chart: go.Figure, pixels: int) -> None:
    """Store the least width of a chart, pixels, in its layout: on a narrower screen the page lets it scroll sideways."""
    chart.update_layout(meta={"narrowest": pixels})


def logarithmic_ticks(value_min: float, value_max: float) -> float | str:
    """Return plotly's `dtick` of a logarithmic axis: every decade, or the digits 1, 2 and 5 up to a span of 30 times."""
    return 1 if value_max / max(value_min, 1e-300) > 30 else "D2"


def plain(text: object) -> str:
    """Return a text typeset as on the page, its ``&``, ``<`` and ``>`` escaped, so that plotly reads no markup in it."""
    return typeset(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def with_alpha(colour: str, alpha: float) -> str:
    """Return a ``#rrggbb`` colour as rgba text with an opacity of 0 to 1."""
    if len(colour) != 7 or colour[0] != "#":
        fail("colour", repr(colour), "must be #rrggbb")
    return "rgba({},{},{},{:g})".format(*(int(colour[i:i + 2], 16) for i in (1, 3, 5)), alpha)


def mark_modes(chart: go.Figure, frequency: ArrayLike, span: tuple[float, float] | None = None, *, logarithmic: bool = False,
               row: Any = None, col: Any = None) -> None:
    """Draw a thin vertical line at each frequency (Hz), and label the lines where the ends of the axis are given.

    span : least and largest frequency of the axis, Hz; no labels where left out. row, col : subplot, as in plotly.

    Lines too close for a label each share one: "4.1, 4.3 Hz", or "4.1 .. 9.8 Hz, 12 modes". The labels stand at the foot,
    because a response is high at its modes.
    """
    frequencies = np.sort(np.atleast_1d(np.asarray(frequency, float)))
    for f in frequencies:
        chart.add_vline(x=float(f), line={"color": MARK, "width": 1, "dash": "dot"}, row=row, col=col)
    if span is None or not frequencies.size:
        return
    if frequencies.size > 1:
        needs_width(chart, _MIN_LABELLED_WIDTH)
    positions = _axis_positions(frequencies, span, logarithmic)
    for group in _label_groups(positions):
        group_frequencies = frequencies[group]
        words = (", ".join(f"{f:.4g}" for f in group_frequencies) if group_frequencies.size <= _MAX_LABEL_FREQUENCIES
                 else f"{group_frequencies[0]:.4g} .. {group_frequencies[-1]:.4g}")
        place = float(np.log10(group_frequencies[-1]) if logarithmic else group_frequencies[-1])
        chart.add_annotation(
            x=place, y=0, yref="y domain", text=f"{words} Hz"
            + (f", {group_frequencies.size} modes" if group_frequencies.size > _MAX_LABEL_FREQUENCIES else ""),
            font={"size": 10}, textangle=-90, yanchor="bottom", showarrow=False, row=row, col=col,
            xanchor="right" if positions[group[-1]] > 1 - _LABEL_WIDTH_FRACTION else "left")


def _axis_positions(frequency: Array, span: tuple[float, float], logarithmic: bool) -> Array:
    """Return the places of frequencies (n,) on an axis, 0 at its left end and 1 at its right end.

    A logarithmic axis that begins at zero is taken to begin three decades below its end.
    """
    if logarithmic:
        decade_min, decade_max = np.log10(max(span[0], 1e-3 * span[1])), np.log10(span[1])
        return np.asarray((np.log10(np.maximum(frequency, 10**decade_min)) - decade_min) / (decade_max - decade_min))
    return np.asarray((frequency - span[0]) / (span[1] - span[0]))


def _label_groups(positions: Array) -> list[list[int]]:
    """Return groups of indices that share a label: each place is nearer to the one before than a label is wide.

    A label stands right of its last line; where the axis ends, left of it and so needs twice the room.
    """
    groups: list[list[int]] = []
    for i, place in enumerate(positions):
        label_width = 2 * _LABEL_WIDTH_FRACTION if place > 1 - _LABEL_WIDTH_FRACTION else _LABEL_WIDTH_FRACTION
        if groups and place - positions[groups[-1][-1]] < label_width:
            groups[-1].append(i)
        else:
            groups.append([i])
    return groups
