"""Charts of a drift: the change of every mode beside what two tests of one machine differ by, and its course over tests."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.plot.figures.theme import COLOURS, figure
from toolpoint.studies.drift.drift_study import DriftStudy

MAX_COURSES = 8  # modes whose course is drawn: those that moved most


def mode_changes(study: DriftStudy) -> go.Figure:
    """Return the change of every mode to the last test, with the range of an unchanged machine."""
    last = study.last
    pairs = last.paired
    frequency = last.baseline.frequency[pairs]
    change, limit = 100 * np.expm1(last.change[pairs]), 100 * NORMAL_QUANTILE_95 * last.deviation[pairs]
    has_moved = np.isin(pairs, last.significant(study.false_alarms))
    names = [f"{f:.4g} Hz" for f in frequency]
    chart = figure("", 420)
    chart.add_bar(x=names, y=2 * limit, base=-limit, name="two tests of one machine (95 %)",
                  marker={"color": "rgba(128,128,128,0.3)"},
                  hovertemplate="%{x}<br>± %{customdata:.3f} %<extra></extra>", customdata=limit)
    for words, mask, colour in (("within it", ~has_moved, COLOURS[0]), ("moved", has_moved, COLOURS[1])):
        chart.add_scatter(x=[n for n, is_in in zip(names, mask, strict=True) if is_in], y=change[mask], name=words,
                          mode="markers",
                          marker={"size": 11, "color": colour, "symbol": "diamond"},
                          hovertemplate="%{x}<br>%{y:+.3f} %<extra>" + words + "</extra>")
    chart.update_xaxes(title_text="Mode of the baseline", type="category", categoryorder="array", categoryarray=names)
    chart.update_yaxes(title_text="Change of frequency, %")
    chart.update_layout(legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0})
    return chart


def course_of_modes(study: DriftStudy) -> go.Figure:
    """Return the frequencies of the modes that moved most over the tests, relative to the baseline."""
    first = study.last.baseline
    changes = np.stack([np.zeros(first.count), *(100 * np.expm1(c.change) for c in study.history)])
    deviations = np.stack([np.zeros(first.count), *(100 * NORMAL_QUANTILE_95 * c.deviation for c in study.history)])
    order = np.argsort(-np.nan_to_num(np.abs(study.last.scores)))[:MAX_COURSES]
    chart = figure("", 420)
    for k, i in enumerate(np.sort(order)):
        chart.add_scatter(x=["baseline", *study.names], y=changes[:, i], mode="lines+markers",
                          name=f"{first.frequency[i]:.4g} Hz",
                          line={"color": COLOURS[k % len(COLOURS)]}, error_y={"type": "data", "array": deviations[:, i],
                                                                              "thickness": 1})
    chart.update_xaxes(type="category", title_text="Test")
    chart.update_yaxes(title_text="Change of frequency, %")
    chart.update_layout(legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0})
    return chart
