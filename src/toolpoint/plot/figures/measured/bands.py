"""FRAC over frequency bands: the agreement of responses by frequency."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import fail, floats
from toolpoint.plot.figures.theme import figure, plain


def frac_bands(values: ArrayLike, bands: ArrayLike, responses: Sequence[str], *, title: str = "") -> go.Figure:
    """Return FRAC values as a matrix of responses over bands.

    Parameters
    ----------
    values : (n_bands, n_responses) floats
        0 .. 1.
    bands : (n_bands, 2) floats
        Hz.
    responses : sequence of str
        Names.
    """
    frac, edges = floats("values", values, (None, None)), floats("bands", bands, (None, 2))
    if frac.shape != (len(edges), len(responses)):
        fail("values", f"shape {frac.shape}", f"must be ({len(edges)}, {len(responses)}): bands, responses")
    names = [f"{band_start:.4g} – {band_end:.4g} Hz" for band_start, band_end in edges]
    rows = [plain(name) for name in responses]
    chart = figure(title, 190 + min(26 * max(len(rows), 3), 700))
    # Numbers in more cells than this cannot be read, and make the page slow.
    has_texts = frac.size <= 400
    chart.add_heatmap(
        z=frac.T, x=names, y=rows, zmin=0, zmax=1, colorscale="Viridis", xgap=1, ygap=1,
        text=[[f"{v:.2f}" for v in row] for row in frac.T] if has_texts else None,
        texttemplate="%{text}" if has_texts else None,
        hovertemplate="%{y}<br>%{x}<br>FRAC %{z:.4f}<extra></extra>", colorbar={"title": {"text": "FRAC"}, "thickness": 14})
    chart.update_xaxes(title_text="Band", showgrid=False)
    chart.update_yaxes(autorange="reversed", showgrid=False)
    return chart
