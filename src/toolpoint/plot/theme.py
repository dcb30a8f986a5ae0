"""Theme: colours, fonts and axis settings that all figures share, readable on light and dark pages."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go
from plotly.colors import sequential, unlabel_rgb

from toolpoint._check import fail

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
# Okabe and Ito, Color Universal Design (2008), without its black and yellow, which vanish on dark and on light pages.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F")
STABLE, UNSTABLE, MARK = "rgba(0,158,115,0.16)", "rgba(213,94,0,0.16)", "rgba(127,127,127,0.75)"
DASHES = ("solid", "dash", "dot", "dashdot")


def _ramp() -> list[list[float]]:
    colours = [c if isinstance(c, str) else str(c) for c in sequential.Viridis]
    return [[int(c[i:i + 2], 16) / 255 for i in (1, 3, 5)] if c.startswith("#")
            else [v / 255 for v in unlabel_rgb(c)] for c in colours]


RAMP = _ramp()
_AXIS = {"gridcolor": "rgba(127,127,127,0.22)", "linecolor": "rgba(127,127,127,0.6)", "showline": True, "mirror": True,
         "ticks": "outside", "tickcolor": "rgba(127,127,127,0.6)", "ticklen": 4, "zeroline": False, "automargin": True,
         "title": {"standoff": 8}, "exponentformat": "power"}
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
    """Return an empty figure in the common style."""
    made = go.Figure(layout={"template": TEMPLATE, "height": height, **layout})
    if title:
        made.update_layout(title={"text": plain(title)}, margin={"t": 84})
    return made


def plain(text: object) -> str:
    """Return text that plotly shows as it is: its small markup language is switched off by escaping."""
    return str(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def with_alpha(colour: str, alpha: float) -> str:
    """Return a ``#rrggbb`` colour as rgba."""
    if len(colour) != 7 or colour[0] != "#":
        fail("colour", repr(colour), "must be #rrggbb")
    return "rgba({},{},{},{:g})".format(*(int(colour[i:i + 2], 16) for i in (1, 3, 5)), alpha)


def mark_modes(made: go.Figure, frequency: Any, words: Any = None, row: Any = None, col: Any = None) -> None:
    """Draw a thin vertical line at each frequency (Hz), with words at its top where given."""
    for i, f in enumerate(frequency):
        text = {} if words is None else {"annotation": {
            "text": plain(words[i]), "font": {"size": 10}, "textangle": -90, "yanchor": "top", "xanchor": "right"}}
        made.add_vline(x=float(f), line={"color": MARK, "width": 1, "dash": "dot"}, row=row, col=col, **text)
