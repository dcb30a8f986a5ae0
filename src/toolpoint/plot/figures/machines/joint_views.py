"""Joints in three views: their places and the directions of their axes, among the measured points of the components."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray
from toolpoint.joint_identification import JointEstimate
from toolpoint.plot.figures.machines.point_views import Point, dots, outline, segments, views
from toolpoint.plot.figures.theme import COLOURS

_MARK = "#b00020"


def joint_views(
    points: Mapping[Point, ArrayLike], components: Mapping[str, Sequence[Point]], joints: Sequence[JointEstimate],
    *, title: str = "",
) -> go.Figure:
    """Return hulls and points of every component, joints as crosses, and a line along every free direction of each joint."""
    chart = views(title)
    point_positions = {name: np.asarray(xyz, float) for name, xyz in points.items()}
    size = float(np.linalg.norm(np.ptp(np.array(list(point_positions.values())), axis=0)))
    for view in range(3):
        for k, (name, members) in enumerate(components.items()):
            measured = {p: point_positions[p] for p in members if p in point_positions}
            outline(chart, view, list(measured.values()), name=name, colour=COLOURS[k % len(COLOURS)], legend=False)
            dots(chart, view, measured, name=name, mark={"size": 4, "color": COLOURS[k % len(COLOURS)]})
        for joint in joints:
            ends = [(joint.position - 0.08 * size * way, joint.position + 0.08 * size * way) for way in joint.directions]
            segments(chart, view, ends, colour=_MARK)
        places: dict[Point, FloatArray] = {
            f"{j.parent} - {j.child}: {j.kind} {' '.join(j.freedoms)}": j.position for j in joints}
        dots(chart, view, places, name="joints", mark={"symbol": "x-thin", "size": 13, "line": {"width": 3, "color": _MARK}})
    return chart
