"""Measured points in three views (front, side, top): paired with a model's points, or coloured by a value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike
from plotly.subplots import make_subplots
from scipy.spatial import ConvexHull, QhullError

from toolpoint._check import FloatArray, fail, floats
from toolpoint.plot.figures.theme import COLOURS, TEMPLATE, needs_width, plain, with_alpha

Point = str | int
# Title, horizontal and vertical axis of every view.
VIEWS = (("Front (x, z)", 0, 2), ("Side (y, z)", 1, 2), ("Top (x, y)", 0, 1))
_GREY = "rgba(127,127,127,0.55)"


def point_pairs(
    test: Mapping[Point, ArrayLike], model: Mapping[Point, ArrayLike], pairs: Mapping[Point, Point], *, title: str = "",
) -> go.Figure:
    """Return test points (already in the model's frame, m) and model points, a line between the two of each pair.

    Points without partner are drawn as crosses.
    """
    chart = views(title)
    a = {name: floats(f"test[{name!r}]", xyz, (3,)) for name, xyz in test.items()}
    b = {name: floats(f"model[{name!r}]", xyz, (3,)) for name, xyz in model.items()}
    missing_points = [name for name in (*pairs,) if name not in a] + [name for name in pairs.values() if name not in b]
    if missing_points:
        fail("pairs", f"{missing_points[0]!r}", "must be points of test and model")
    unpaired_model = {name: xyz for name, xyz in b.items() if name not in set(pairs.values())}
    unpaired_test = {name: xyz for name, xyz in a.items() if name not in pairs}
    for view in range(3):
        segments(chart, view, [(a[p], b[q]) for p, q in pairs.items()], colour=COLOURS[6])
        for name, places, mark in (
                ("model, paired", {q: b[q] for q in pairs.values()},
                 {"symbol": "square-open", "size": 11, "color": COLOURS[0]}),
                ("test, paired", {p: a[p] for p in pairs}, {"symbol": "circle", "size": 5, "color": COLOURS[1]}),
                ("model, single", unpaired_model, {"symbol": "square-open", "size": 8, "color": _GREY}),
                ("test, single", unpaired_test, {"symbol": "x", "size": 9, "color": COLOURS[3]})):
            if places:
                dots(chart, view, places, name=name, mark=mark)
    return chart


def point_values(
    points: Mapping[Point, ArrayLike], values: Mapping[Point, float], *, quantity: str,
    limits: tuple[float, float] = (0.0, 1.0), good_is_high: bool = True, lines: Iterable[tuple[Point, Point]] = (),
    components: Mapping[str, Sequence[Point]] | None = None, title: str = "",
) -> go.Figure:
    """Return points coloured by a value in three views; points without a value are grey.

    Parameters
    ----------
    points : point to (3,) position, m
    values : point to number
    quantity : str
        Title of the colour bar.
    limits : (low, high)
        Ends of the colour scale.
    good_is_high : bool
        Whether the high end is the one that agrees (drawn cool); otherwise the low end.
    lines : pairs of points joined by a line
    components : name to its points, whose outline is drawn; none where left out
    """
    places = {name: floats(f"points[{name!r}]", xyz, (3,)) for name, xyz in points.items()}
    unknown = [name for name in values if name not in places]
    if unknown or not values:
        fail("values", f"{unknown[0]!r} without a position" if unknown else "none", "must be of points",
             remedy="give its position")
    chart = views(title)
    valued_places = {name: places[name] for name in values}
    for number, (name, members) in enumerate((components or {}).items()):
        for view in range(3):
            outline(chart, view, [places[p] for p in members if p in places], name=name,
                    colour=COLOURS[number % len(COLOURS)])
    scale = "RdYlBu" if good_is_high else "RdYlBu_r"
    for view in range(3):
        segments(chart, view, [(places[p], places[q]) for p, q in lines if p in places and q in places], colour=_GREY)
        unvalued_places = {name: xyz for name, xyz in places.items() if name not in values}
        if unvalued_places:
            dots(chart, view, unvalued_places, name="no value", mark={"size": 5, "color": _GREY})
        numbers = [float(values[name]) for name in valued_places]
        mark = {"size": 10, "color": numbers, "colorscale": scale, "cmin": limits[0], "cmax": limits[1],
                "line": {"width": 0.5, "color": "rgba(60,60,60,0.6)"}, "showscale": view == 2,
                "colorbar": {"title": {"text": plain(quantity)}, "thickness": 14}}
        words = [f"{plain(name)}: {plain(quantity)} {v:.3f}" for name, v in zip(valued_places, numbers, strict=True)]
        dots(chart, view, valued_places, name=quantity, mark=mark, words=words, legend=False)
    return chart


def views(title: str) -> go.Figure:
    """Return an empty figure of three views with equal scales."""
    chart = make_subplots(rows=1, cols=3, subplot_titles=[name for name, _, _ in VIEWS], horizontal_spacing=0.07)
    chart.update_layout(template=TEMPLATE, height=460, legend={"orientation": "h", "y": -0.2, "yanchor": "top"},
                       margin={"t": 84 if title else 48, "b": 60})
    if title:
        chart.update_layout(title={"text": plain(title)})
    needs_width(chart, 640)
    for k, (_, i, j) in enumerate(VIEWS):
        suffix = "" if k == 0 else str(k + 1)
        chart.update_xaxes(title_text=f"{'xyz'[i]}, m", row=1, col=k + 1, constrain="domain")
        chart.update_yaxes(title_text=f"{'xyz'[j]}, m", row=1, col=k + 1, scaleanchor=f"x{suffix}", constrain="domain")
    return chart


def dots(chart: go.Figure, view: int, places: Mapping[Point, FloatArray], *, name: str, mark: dict[str, Any],
         words: list[str] | None = None, legend: bool = True) -> None:
    """Add points (name to position) to a view (0, 1, 2)."""
    _, i, j = VIEWS[view]
    xyz = np.array(list(places.values())).reshape(-1, 3)
    chart.add_scatter(x=xyz[:, i], y=xyz[:, j], mode="markers", marker=mark, name=plain(name), legendgroup=name,
                     showlegend=legend and view == 0, text=words or [plain(point) for point in places],
                     hovertemplate="%{text}<extra></extra>", row=1, col=view + 1)


def outline(chart: go.Figure, view: int, places: Sequence[FloatArray], *, name: str, colour: str, legend: bool = True) -> None:
    """Add the hull of a component's points to a view, filled thinly; nothing where they lie on a line."""
    _, i, j = VIEWS[view]
    if len(places) < 3:
        return
    flat = np.array(places)[:, [i, j]]
    try:
        ring = ConvexHull(flat).vertices
    except QhullError:
        return
    corners = flat[[*ring, ring[0]]]
    chart.add_scatter(x=corners[:, 0], y=corners[:, 1], mode="lines", line={"color": colour, "width": 1.5}, fill="toself",
                     fillcolor=with_alpha(colour, 0.12), hoverinfo="skip", name=plain(name), legendgroup=name,
                     showlegend=legend and view == 0, row=1, col=view + 1)


def segments(chart: go.Figure, view: int, ends: list[tuple[FloatArray, FloatArray]], *, colour: str) -> None:
    """Add lines between pairs of positions to a view."""
    if not ends:
        return
    _, i, j = VIEWS[view]
    x = [v for a, b in ends for v in (float(a[i]), float(b[i]), None)]
    y = [v for a, b in ends for v in (float(a[j]), float(b[j]), None)]
    chart.add_scatter(x=x, y=y, mode="lines", line={"color": colour, "width": 1}, hoverinfo="skip", showlegend=False,
                     row=1, col=view + 1)
