"""Charts of a sensitivity study: every parameter over the modes, and the parts cumulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import fail, floats
from toolpoint.plot.figures.theme import COLOURS, PRINTED_PAGE_WIDTH, figure, needs_width, plain


def sensitivity_map(
    values: ArrayLike, parameters: Sequence[str], frequencies: ArrayLike, *, quantity: str = "relative sensitivity",
    diverging: bool = True, title: str = "",
) -> go.Figure:
    """Return sensitivities as a matrix of parameters over modes, coloured by sign and size.

    Parameters
    ----------
    values : (n_parameters, n_modes) floats
    parameters : names
    frequencies : (n_modes,) floats
        Hz.
    quantity : str
        Title of the colour bar.
    diverging : bool
        Whether the colours go both ways from zero; otherwise from zero up.
    """
    table, mode_frequencies = floats("values", values, (None, None)), floats("frequencies", frequencies)
    if table.shape != (len(parameters), mode_frequencies.size) or not table.size:
        fail("values", f"shape {table.shape}", f"must be ({len(parameters)}, {mode_frequencies.size}): parameters, modes")
    largest = max(float(np.abs(table).max()), 1e-12)
    chart = figure(title, 170 + 21 * max(len(parameters), 5))
    needs_width(chart, min(300 + 46 * mode_frequencies.size, PRINTED_PAGE_WIDTH))
    chart.add_heatmap(
        z=table, x=[f"{i}: {f:.4g} Hz" for i, f in enumerate(mode_frequencies, start=1)],
        y=[plain(name) for name in parameters],
        zmin=-largest if diverging else 0.0, zmax=largest, colorscale="RdBu" if diverging else "Viridis",
        reversescale=diverging,
        # Values that would read 0.000 are left blank.
        xgap=1, ygap=1, text=[[f"{v:.3f}" if abs(v) >= 5e-4 else "" for v in row] for row in table], texttemplate="%{text}",
        hovertemplate="%{y}<br>mode %{x}<br>" + plain(quantity) + " %{z:.5f}<extra></extra>",
        colorbar={"title": {"text": plain(quantity), "side": "right"}, "thickness": 14})
    chart.update_xaxes(title_text="Mode", showgrid=False, type="category")
    chart.update_yaxes(autorange="reversed", showgrid=False, automargin=True)
    return chart


def cumulative_bars(
    parts: Mapping[str, ArrayLike], frequencies: ArrayLike, *, quantity: str = "relative sensitivity", title: str = "",
) -> go.Figure:
    """Return one group of bars a mode, one bar a part (at most the ten largest), of cumulated sensitivities (n_modes,)."""
    mode_frequencies = floats("frequencies", frequencies)
    rows = {name: floats(f"parts[{name!r}]", row, (mode_frequencies.size,)) for name, row in parts.items()}
    if not rows:
        fail("parts", "none", "must be at least one")
    chosen = sorted(rows, key=lambda name: -float(np.abs(rows[name]).max()))[:10]
    chart = figure(title, 430, barmode="group")
    needs_width(chart, PRINTED_PAGE_WIDTH)
    words = [f"{i}: {f:.4g} Hz" for i, f in enumerate(mode_frequencies, start=1)]
    for k, name in enumerate(chosen):
        pattern = {"shape": "" if k < len(COLOURS) else "/"}
        chart.add_bar(x=words, y=rows[name], name=plain(name),
                     marker={"color": COLOURS[k % len(COLOURS)], "pattern": pattern, "line": {"width": 0}},
                     hovertemplate="%{x}<br>" + plain(quantity) + " %{y:.4f}<extra>" + plain(name) + "</extra>")
    chart.update_xaxes(title_text="Mode", type="category")
    chart.update_yaxes(title_text=plain(quantity), zeroline=True, zerolinecolor="rgba(127,127,127,0.8)")
    chart.update_layout(legend={"orientation": "h", "y": -0.22, "yanchor": "top"})
    return chart
