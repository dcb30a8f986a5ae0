"""Places of a plane with a quantity over them, and the most even segments drawn in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go

from toolpoint._check import FloatArray
from toolpoint.plot.figures.machines.pose_map import frequency_map, set_column_buttons
from toolpoint.plot.figures.theme import COLOURS


def place_contours(across: FloatArray, along: FloatArray, values: FloatArray, *, axes: tuple[str, str], columns: Sequence[str],
                   quantity: str, segments: Sequence[tuple[FloatArray, FloatArray]] = (),
                   reasons: Mapping[tuple[int, ...], str] | None = None) -> go.Figure:
    """Return contours over places of a plane (mm) with segments ((2,), (2,) mm) drawn in, the first the best."""
    chart = frequency_map(across, along, values, axes=axes, units=("mm", "mm"), names=columns, quantity=quantity,
                          reasons=reasons)
    for number, (start, end) in enumerate(segments):
        x, y = np.stack([start, end]).T
        chart.add_scatter(x=x, y=y, mode="lines+markers", name="most even segment" if number == 0 else f"rank {number + 1}",
                          line={"color": COLOURS[1] if number == 0 else "rgba(255,255,255,0.85)",
                                "width": 4 if number == 0 else 2})
    set_column_buttons(chart, [str(name) for name in columns])
    chart.update_yaxes(scaleanchor="x", scaleratio=1)
    return chart
