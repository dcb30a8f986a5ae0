"""Shapes of the stable poles of a stabilization diagram, for a view of one at a time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from toolpoint.modal_identification import Identification, residues
from toolpoint.plot import AnimatedShapes, ShapeView
from toolpoint.plot.shape_view.hulls import drawn_points
from toolpoint.vibration import Modes
from toolpoint.vibration.geometry import Geometry


def pole_shapes(result: Identification, geometry: Geometry, components: Mapping[str, Sequence[str | int]] | None = None
                ) -> tuple[list[int] | None, ShapeView | None]:
    """Return for every pole of the diagram its place in a view of the stable poles' own shapes, and the view."""
    diagram = result.diagram
    if diagram is None or not (diagram.level == 3).any():
        return None, None
    numbers = np.full(diagram.poles.size, -1)
    poles: list[complex] = []
    shapes, labels = [], []
    for order in diagram.orders:
        stable_poles = np.flatnonzero((diagram.order == order) & (diagram.level == 3))
        if stable_poles.size == 0:
            continue
        parts = residues(result.frf, diagram.poles[stable_poles]).values
        # The reference with the largest residues shows the shape best.
        strongest = np.argmax(np.abs(parts).sum(axis=0), axis=0)
        for k, pole in enumerate(stable_poles):
            numbers[pole] = len(poles)
            poles.append(diagram.poles[pole])
            shapes.append(parts[:, strongest[k], k])
            labels.append(f"order {order}")
    s = np.array(poles)
    modes = Modes(np.abs(s) / (2 * np.pi), -s.real / np.abs(s), np.stack(shapes, axis=1), result.frf.outputs, "unscaled")
    scene = drawn_points(geometry, components)
    view = ShapeView(scene, AnimatedShapes.from_modes(modes, geometry.points, labels), "poles", "Shape of the pole chosen")
    return numbers.tolist(), view
