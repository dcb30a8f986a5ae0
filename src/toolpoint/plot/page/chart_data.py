"""Data of a chart on a page: its figure as short JSON text, numbers to seven digits, widths left to the page."""

from __future__ import annotations

import base64
import json
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import plotly.graph_objects as go

_STORED_DIGITS = 7  # more than any screen shows, fewer than a double holds


def chart_text(figure: go.Figure) -> str:
    """Return data and layout of a figure as JSON without width and title: the page gives the chart both, so that a chart
    shrinks with the screen and a title breaks its lines."""
    figure_data = json.loads(figure.to_json())
    layout = {key: value for key, value in figure_data["layout"].items() if key not in ("width", "title")}
    return json.dumps({"data": _shorten(figure_data["data"]), "layout": layout}, separators=(",", ":"), allow_nan=False)


def _shorten(value: Any) -> Any:
    """Return plain data with packed arrays (of newer plotly) opened and every float to seven digits."""
    if isinstance(value, dict):
        if {"dtype", "bdata"} <= value.keys():
            return _unpack(value)
        return {key: _shorten(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_shorten(entry) for entry in value]
    return float(f"{value:.{_STORED_DIGITS}g}") if isinstance(value, float) else value


def _unpack(packed: dict[str, Any]) -> Any:
    """Return a packed array as lists, as numbers of `_STORED_DIGITS` digits."""
    array = np.frombuffer(base64.b64decode(packed["bdata"]), np.dtype(packed["dtype"]).newbyteorder("<"))
    if "shape" in packed:
        array = array.reshape([int(n) for n in str(packed["shape"]).split(",")])
    if array.dtype.kind != "f":
        return array.tolist()
    return _rows(array)


def _rows(array: Any) -> Any:
    """Return an array as nested lists; what is not finite becomes null, which JSON has."""
    if array.ndim > 1:
        return [_rows(row) for row in array]
    return [float(f"{v:.{_STORED_DIGITS}g}") if np.isfinite(v) else None for v in array.tolist()]
