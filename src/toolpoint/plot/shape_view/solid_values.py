"""A part of solid elements with its outer faces coloured by a value of each element, to be turned and looked at."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import floats
from toolpoint.bodies.solid import SolidModel
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.scene import Scene
from toolpoint.plot.shape_view.view import ShapeView


def values_on_part(model: SolidModel, values: ArrayLike, *, name: str = "values", title: str = "", unit: str = "") -> ShapeView:
    """Return the part with each outer face in the colour of its element's value (n_elements,)."""
    element_values = floats("values", values, (model.element_count,))
    corners, of_element, element_start = [], [], 0
    for block in model.blocks:
        faces = block.nodes[:, block.kind.faces]
        corner_count = faces.shape[2] // 2
        faces, value = (faces[:, :, :corner_count].reshape(-1, corner_count),
                        np.repeat(element_values[element_start:element_start + len(block)], faces.shape[1]))
        # A face that two elements share is inside.
        _, index, repeats = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
        is_outer = repeats[index.ravel()] == 1
        corners.append(faces[is_outer])
        of_element.append(value[is_outer])
        element_start += len(block)
    nodes, triangles, lines, colours, first = [], [], [], [], 0
    for faces, value in zip(corners, of_element, strict=True):  # every face has nodes of its own, so that colours do not mix
        count, sides = faces.shape
        corner = first + np.arange(count * sides).reshape(count, sides)
        nodes.append(model.nodes[faces].reshape(-1, 3))
        triangles += [corner[:, [0, i, i + 1]] for i in range(1, sides - 1)]
        lines += [np.stack([corner[:, i], corner[:, (i + 1) % sides]], axis=1) for i in range(sides)]
        colours.append(np.repeat(value, sides))
        first += count * sides
    value_min, value_max = float(element_values.min()), float(max(element_values.max(), element_values.min() + 1e-300))
    scene = Scene(np.concatenate(nodes), np.concatenate(triangles), np.concatenate(lines), None, ("part",))
    displacement = np.zeros((1, len(scene.nodes), 3), complex)
    displacement[0, :, 0] = np.concatenate(colours) - value_min
    return ShapeView(scene, AnimatedShapes(np.zeros(1), np.zeros(1), displacement), name, title,
                     static_range=(value_min, value_max, unit))
