"""Quantities of the blocks of a program over its time, as steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.theme import COLOURS, figure, plain

MAX_DRAWN_BLOCKS = 4000  # of a course; of each run of blocks beyond them the largest value is drawn


def course_over_time(ends: FloatArray, curves: Mapping[str, FloatArray], *, labels: Sequence[str], quantity: str) -> go.Figure:
    """Return curves of one value a block over the times (s) at which the blocks end.

    >>> power = {"power": np.array([200.0, 500.0])}
    >>> figure = course_over_time(np.array([1.0, 3.0]), power, labels=["N10", "N20"], quantity="W")
    >>> figure.layout.yaxis.title.text
    'W'
    """
    chart = figure("", 360)
    group = max(1, int(np.ceil(ends.size / MAX_DRAWN_BLOCKS)))
    starts = np.arange(0, ends.size, group)
    for number, (name, values) in enumerate(curves.items()):
        chosen = np.array([first + int(np.argmax(values[first:first + group])) for first in starts])
        chart.add_scatter(x=ends[chosen], y=values[chosen], mode="lines", line={"shape": "vh", "color": COLOURS[number]},
                          name=plain(name), customdata=[plain(labels[k]) for k in chosen],
                          hovertemplate="%{customdata}<br>%{x:.4g} s: %{y:.4g}<extra></extra>")
    chart.update_xaxes(title_text="Time of the program, s")
    chart.update_yaxes(title_text=plain(quantity), rangemode="tozero")
    chart.update_layout(showlegend=len(curves) > 1)
    return chart


def record_over_time(time: FloatArray, values: FloatArray, *, expected: FloatArray, quantity: str) -> go.Figure:
    """Return a record over the time of its program (s), and what was expected of it.

    >>> time = np.linspace(0, 1, 5)
    >>> len(record_over_time(time, 100 * time, expected=90 * time, quantity="Power, W").data)
    2
    """
    chart = figure("", 360)
    group = max(1, int(np.ceil(time.size / MAX_DRAWN_BLOCKS)))
    count = time.size // group * group
    for number, (name, curve) in enumerate((("recorded", values), ("expected", expected))):
        x, y = (array[:count].reshape(-1, group).mean(axis=1) for array in (time, curve))
        chart.add_scatter(x=x, y=y, mode="lines", line={"color": COLOURS[number], "width": 1.2}, name=name,
                          hovertemplate="%{x:.4g} s: %{y:.4g}<extra></extra>")
    chart.update_xaxes(title_text="Time of the program, s")
    chart.update_yaxes(title_text=plain(quantity))
    return chart
