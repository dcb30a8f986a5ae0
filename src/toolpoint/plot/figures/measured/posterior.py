"""Chart of posterior samples: every parameter alone and against every other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.subplots import make_subplots

from toolpoint._check import FloatArray, fail, floats
from toolpoint.plot.figures.theme import COLOURS, figure, plain

_MAX_CORNER_PARAMETERS = 6  # parameters: more panels cannot be read
_HISTOGRAM_BINS = 40  # of a histogram
_DENSITY_CELLS = 28  # of a density, each way


def posterior_corner(
    values: ArrayLike, names: Sequence[str], normal: tuple[ArrayLike, ArrayLike] | None = None, *, title: str = "",
) -> go.Figure:
    """Return histograms on the diagonal and densities of pairs below it, of at most six parameters.

    Parameters
    ----------
    values : (n_samples, n) floats
    names : (n,) names with their unit
    normal : two (n,) arrays, optional
        Mean and standard deviation of the normal posterior drawn beside the histograms.
    """
    x = floats("values", values, (None, len(names)))
    if not x.size:
        fail("values", "no samples", "must be at least one sample of one parameter")
    n = min(x.shape[1], _MAX_CORNER_PARAMETERS)
    chart = make_subplots(n, n, shared_xaxes=True, horizontal_spacing=0.02, vertical_spacing=0.02)
    chart.update_layout(figure(title, 190 + 130 * n, showlegend=False).layout)
    # Single samples far out would squeeze the rest into one cell.
    ends = np.quantile(x[:, :n], [0.001, 0.999], axis=0)
    edges = [np.linspace(ends[0, k], ends[1, k], _HISTOGRAM_BINS + 1) for k in range(n)]
    for k in range(n):
        _histogram(chart, k, x[:, k], edges[k], None if normal is None else tuple(float(np.asarray(a)[k]) for a in normal))
        for j in range(k):
            _pair_density(chart, k, j, x, edges)
    _labels(chart, n, [plain(name) for name in names])
    return chart


def _histogram(chart: go.Figure, k: int, x: FloatArray, edges: FloatArray, normal: tuple[float, ...] | None) -> None:
    """Draw the histogram of one parameter, with its normal posterior where given."""
    density, _ = np.histogram(x, edges, density=True)
    bin_centres = (edges[1:] + edges[:-1]) / 2
    chart.add_bar(x=bin_centres, y=density, marker={"color": COLOURS[0], "line": {"width": 0}}, row=k + 1, col=k + 1,
                 hovertemplate="%{x:.5g}<extra></extra>")
    if normal is not None:
        mean, sd = normal
        line = np.linspace(edges[0], edges[-1], 160)
        chart.add_scatter(x=line, y=np.exp(-((line - mean) / sd) ** 2 / 2) / (sd * np.sqrt(2 * np.pi)), mode="lines",
                         line={"color": COLOURS[1], "width": 2}, hoverinfo="skip", row=k + 1, col=k + 1)


def _pair_density(chart: go.Figure, row: int, column: int, x: FloatArray, edges: Sequence[FloatArray]) -> None:
    cells = [np.linspace(e[0], e[-1], _DENSITY_CELLS + 1) for e in (edges[column], edges[row])]
    count, _, _ = np.histogram2d(x[:, column], x[:, row], cells)
    visible_counts = np.where(count > 0, count, np.nan).T
    cell_centres = [(e[1:] + e[:-1]) / 2 for e in cells]
    chart.add_heatmap(x=cell_centres[0], y=cell_centres[1], z=visible_counts, colorscale="Viridis", showscale=False,
                      row=row + 1, col=column + 1,
                     hovertemplate="%{x:.5g}, %{y:.5g}: %{z} samples<extra></extra>")


def _labels(chart: go.Figure, n: int, names: Sequence[str]) -> None:
    chart.update_xaxes(showgrid=False, nticks=4, tickangle=0, showticklabels=False)
    chart.update_yaxes(showgrid=False, nticks=4, showticklabels=False)
    for k in range(n):
        chart.update_xaxes(title_text=names[k], showticklabels=True, title_font_size=11, tickfont_size=10, row=n, col=k + 1)
        if k:
            chart.update_yaxes(title_text=names[k], showticklabels=True, title_font_size=11, tickfont_size=10, row=k + 1, col=1)
