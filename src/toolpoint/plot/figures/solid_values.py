"""Values of elements drawn on the part: its outer faces, coloured."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from toolpoint._check import floats
from toolpoint.bodies.solid import SolidModel
from toolpoint.plot.figures.theme import figure


def values_on_part(model: SolidModel, values: ArrayLike, *, title: str = "", unit: str = "") -> go.Figure:
    """Return the part with each outer face in the colour of its element's value (n_elements,)."""
    shown = floats("values", values, (model.element_count,))
    corners, colours = [], []
    at = 0
    for block in model.blocks:
        faces = block.nodes[:, block.kind.faces]
        half = faces.shape[2] // 2
        corners.append(np.sort(faces[:, :, :half], axis=2).reshape(-1, half))
        colours.append((faces[:, :, :half].reshape(-1, half), np.repeat(shown[at:at + len(block)], faces.shape[1])))
        at += len(block)
    triangles, intensity = [], []
    for keys, (faces, value) in zip(corners, colours, strict=True):
        _, index, repeats = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        outer = repeats[index.ravel()] == 1
        for i in range(1, faces.shape[1] - 1):
            triangles.append(faces[outer][:, [0, i, i + 1]])
            intensity.append(value[outer])
    i, j, k = np.concatenate(triangles).T
    x, y, z = model.nodes.T
    chart = figure(title, 520)
    chart.add_mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, intensity=np.concatenate(intensity), intensitymode="cell", flatshading=True,
                     colorscale="Viridis", colorbar={"title": {"text": unit}, "thickness": 14}, hoverinfo="skip")
    chart.update_layout(scene={"aspectmode": "data", "xaxis_title": "x m", "yaxis_title": "y m", "zaxis_title": "z m",
                               "camera": {"eye": {"x": 1.6, "y": -1.9, "z": 1.0}}})
    return chart
