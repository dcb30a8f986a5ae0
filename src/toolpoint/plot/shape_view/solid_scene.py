"""Scenes and animated shapes of solid models: their outer faces, moved by the finite elements' own shapes."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies.solid import SolidModel
from toolpoint.bodies.solid.faces import outer_triangles
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.scene import Scene


def solid_shapes(
    parts: Mapping[str, SolidModel], shape_of: Callable[[str], FloatArray], frequency: FloatArray, *,
    ratio: float | FloatArray = 0.0, labels: tuple[str, ...] = (),
) -> tuple[Scene, AnimatedShapes]:
    """Return the scene of parts and their modes; `shape_of` gives a part's displacements (3 nodes, modes)."""
    scenes, displacements = [], []
    for name, model in parts.items():
        outer_nodes, triangles = outer_triangles(model)
        scenes.append(Scene.of_mesh(name, model.nodes[outer_nodes], triangles))
        displacements.append(shape_of(name).reshape(len(model.nodes), 3, -1)[outer_nodes].transpose(2, 0, 1))
    moved = np.concatenate(displacements, axis=1)
    ratios = np.broadcast_to(ratio, (len(frequency),)).astype(float)
    return Scene.joined(scenes), AnimatedShapes(frequency, ratios, moved.astype(complex), labels)
