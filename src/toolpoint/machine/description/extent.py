"""Size of bodies: of a described shape, or of the box with a body's moments of inertia."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.machine.description.body import BodyDescription, ShapeDescription


def shape_size(shape: ShapeDescription) -> FloatArray:
    """Return the size of the box around a described shape, m, shape (3,)."""
    if shape.size is not None:
        return np.array(shape.size)
    size = np.full(3, shape.diameter or 0.1)
    if shape.length is not None:
        size["xyz".index(shape.axis)] = shape.length
    return size


def equal_box(mass: FloatArray) -> FloatArray:
    """Return the size of the uniform box with the body's own moments about the axes through its centre, m."""
    total = mass[0, 0]
    first_moment = mass[3:6, :3] / total
    about_centre = np.diag(mass[3:6, 3:6] + total * first_moment @ first_moment)
    squares = 6 / total * (about_centre.sum() - 2 * about_centre)
    # A plate or a rod has an inertia of rounding about its thin axis: it is drawn a thousandth as thick, not as nothing.
    return np.sqrt(np.maximum(squares, 1e-6 * max(float(squares.max()), 1e-9)))


def body_span(body: BodyDescription, frame: FloatArray, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centre and half size (m) of the box around a body in the machine frame: as drawn, else that of its mass."""
    if body.mesh is not None:
        corners = body.mesh.corners.reshape(-1, 3) + np.array(body.centre)
        centre, size = (corners.max(axis=0) + corners.min(axis=0)) / 2, np.ptp(corners, axis=0)
    else:
        shape = body.draw or body.shape
        centre = np.array(body.centre if body.draw_at is None else body.draw_at)
        size = equal_box(mass) if shape is None else shape_size(shape)
    return frame[:3, :3] @ centre + frame[:3, 3], np.abs(frame[:3, :3]) @ size / 2
