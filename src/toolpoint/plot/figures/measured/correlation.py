"""Figures of mode correlation: the MAC matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import fail, floats
from toolpoint.plot.figures.theme import COLOURS, figure, plain
from toolpoint.vibration import Modes


def mac_matrix(
    values: ArrayLike,
    rows: Modes | Sequence[str],
    columns: Modes | Sequence[str],
    *,
    row_title: str = "Mode of the first set",
    column_title: str = "Mode of the second set",
    title: str = "",
    pairs: ArrayLike | None = None,
) -> go.Figure:
    """Return the picture of a MAC matrix, each cell coloured 0 .. 1 and, up to 20 x 20, with its number.

    Parameters
    ----------
    values : (n_rows, n_columns) floats
        MAC values, 0 .. 1 (`toolpoint.vibration.correlation.mac`).
    rows, columns : Modes or names
        Modes give number and frequency.
    pairs : (n, 2) indices, optional
        Cells of paired modes, framed.

    >>> figure = mac_matrix([[1.0, 0.25], [0.0, 0.75]], ["1", "2"], ["1", "2"])
    >>> figure.data[0].z.tolist()
    [[1.0, 0.25], [0.0, 0.75]]
    """
    mac = floats("values", values, (None, None))
    if mac.ndim != 2 or mac.size == 0:
        fail("values", f"shape {mac.shape}", "must be (n_rows, n_columns), not empty")
    if mac.min() < -1e-9 or mac.max() > 1 + 1e-9:
        fail("values", f"{mac.min():g} .. {mac.max():g}", "must be within 0 .. 1")
    row_names, column_names = _names("rows", rows, mac.shape[0]), _names("columns", columns, mac.shape[1])
    has_texts = max(mac.shape) <= 20
    chart = figure(title, 160 + min(36 * max(mac.shape[0], 6), 640))
    chart.add_heatmap(
        z=mac.astype(np.float32), zmin=0, zmax=1, colorscale="Viridis", xgap=1, ygap=1,
        text=[[f"{v:.2f}" for v in row] for row in mac] if has_texts else None, texttemplate="%{text}" if has_texts else None,
        customdata=[[f"{a} – {b}" for b in column_names] for a in row_names],
        hovertemplate="%{customdata}<br>MAC %{z:.4f}<extra></extra>",
        colorbar={"title": {"text": "MAC"}, "thickness": 14})
    for i, j in np.zeros((0, 2), int) if pairs is None else np.asarray(pairs, int):
        chart.add_shape(type="rect", x0=j - 0.5, x1=j + 0.5, y0=i - 0.5, y1=i + 0.5,
                       line={"color": COLOURS[1], "width": 3}, name="pair")
    chart.update_xaxes(title_text=plain(column_title), tickvals=list(range(len(column_names))), ticktext=column_names,
                       showgrid=False,
                      constrain="domain", tickangle=-45)
    chart.update_yaxes(title_text=plain(row_title), tickvals=list(range(len(row_names))), ticktext=row_names, showgrid=False,
                      autorange="reversed", scaleanchor="x", constrain="domain")
    # Cells are square: the width follows from the height.
    chart.update_layout(margin={"l": 110, "b": 100}, width=int(chart.layout.height * mac.shape[1] / mac.shape[0]) + 140)
    return chart


def _names(what: str, names: Modes | Sequence[str], count: int) -> list[str]:
    if isinstance(names, Modes):
        if names.frequency.ndim > 1:
            fail(what, f"{names.frequency.shape[0]} poses", "must be one pose", remedy="use modes.at_pose(i)")
        names = [f"{i}: {f:.4g} Hz" for i, f in enumerate(names.frequency, start=1)]
    if len(names) != count:
        fail(what, f"{len(names)} names", f"must be {count}, as the matrix")
    return [plain(name) for name in names]
