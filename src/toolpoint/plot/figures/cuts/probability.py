"""Charts of uncertain stability: P(stable) over speed and depth, and which parameter the limit depends on most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from toolpoint.cutting.advice.probability import ProbabilityChart
from toolpoint.plot.figures.theme import COLOURS, figure

if TYPE_CHECKING:
    import plotly.graph_objects as go

LEVELS = ((0.95, "solid"), (0.5, "dash"), (0.05, "dot"))
# More names cannot be read at the width of a page; the largest shares are shown.
MOST_BARS = 12


def probability_chart(sampled: ProbabilityChart, points: Sequence[tuple[float, float, str]] = (), title: str = "") -> go.Figure:
    """Return P(stable) over spindle speed and depth, with the depths of 95, 50 and 5 % and cuts (rev/min, m, words)."""
    chart = figure(title, 460)
    percent = 100 * sampled.probability.T
    chart.add_heatmap(x=sampled.speeds, y=1e3 * sampled.depths, z=percent, zmin=0, zmax=100, colorscale="Viridis",
                     customdata=100 * sampled.error.T, colorbar={"title": {"text": "P(stable), %"}},
                     hovertemplate="%{x:.0f} rev/min, %{y:.3g} mm<br>stable with %{z:.0f} ± %{customdata:.0f} %<extra></extra>")
    for level, dash in LEVELS:
        chart.add_scatter(x=sampled.speeds, y=1e3 * sampled.depth_at(level), mode="lines", name=f"{100 * level:g} % stable",
                         line={"color": "white", "width": 2, "dash": dash}, hoverinfo="skip")
    for speed, depth, words in points:
        chart.add_scatter(x=[speed], y=[1e3 * depth], mode="markers", name=words,
                         marker={"size": 12, "symbol": "x" if "chatter" in words else "circle",
                                 "color": COLOURS[1], "line": {"width": 1.5, "color": "white"}})
    chart.update_xaxes(title_text="Spindle speed, rev/min", exponentformat="none",
                       range=[sampled.speeds[0], sampled.speeds[-1]])
    chart.update_yaxes(title_text="Axial depth of cut, mm", range=[0, 1e3 * float(sampled.depths[-1])])
    chart.update_layout(plot_bgcolor="rgba(127,127,127,0.25)", legend={"bgcolor": "rgba(127,127,127,0.35)"})
    return chart


def importance_chart(share: Mapping[str, float], title: str = "") -> go.Figure:
    """Return the share of the limit's variance that every parameter explains, largest on top (the first twelve)."""
    names = list(share)[:MOST_BARS][::-1]
    chart = figure(title, 120 + 26 * len(names))
    chart.add_bar(x=[100 * share[name] for name in names], y=names, orientation="h", marker={"color": COLOURS[0]},
                 hovertemplate="%{y}: %{x:.1f} %<extra></extra>")
    chart.update_xaxes(title_text="Share of the limit's variance, %", rangemode="tozero")
    chart.update_yaxes(type="category")
    return chart
