"""Shapes side by side: their pairs, and their signs turned alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.vibration import correlation


def partners(first: AnimatedShapes, second: AnimatedShapes) -> list[int]:
    """Return for every shape of `first` the one of `second` (at least as many) on the same nodes that is most like it."""
    a, b = (shapes.displacement.reshape(shapes.count, -1).T for shapes in (first, second))
    rows, columns = linear_sum_assignment(correlation.mac(a, b), maximize=True)
    return [int(j) for j in columns[np.argsort(rows)]]


def difference_of(first: AnimatedShapes, second: AnimatedShapes) -> AnimatedShapes:
    """Return what is left of the shapes of `first` after those of `second`, each scaled to leave the least sum of squares."""
    product = (first.displacement * second.displacement.conj()).sum(axis=(1, 2))
    size = (np.abs(second.displacement) ** 2).sum(axis=(1, 2))
    scale = product / np.where(size > 0, size, 1.0)
    return replace(first, displacement=first.displacement - scale[:, None, None] * second.displacement)


def turn_alike(shapes: AnimatedShapes, like: AnimatedShapes) -> AnimatedShapes:
    """Return shapes with the sign that brings each nearest to the shape of `like` of the same place: a shape's sign is free."""
    product = np.real((like.displacement * shapes.displacement.conj()).sum(axis=(1, 2)))
    sign = np.where(product < 0, -1.0, 1.0)
    return replace(shapes, displacement=shapes.displacement * sign[:, None, None])
