"""Places in a mesh: the element that holds each, or the nearest one, and the shape functions there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import ElementKind

_TRIED_ELEMENTS = 8  # nearest elements, by their centres, that are tried for a place
_PARENT_STEPS = 8
_MIN_PARENT_STEP, _MAX_PARENT = 1e-12, 3.0  # in the parent element: a smaller step is the last; places looked at lie within


@dataclass(frozen=True, eq=False)
class ElementPlaces:
    """Places (n,) in elements: nodes (n, k) and shape functions (n, k) of the element of each, padded with zeros, and the
    distance (n,), m, of those that lie in no element."""

    nodes: IndexArray
    values: FloatArray
    distance: FloatArray

    def motion(self, shapes: FloatArray) -> FloatArray:
        """Return the motion (n, 3, m) of the places in shapes (coordinates, m)."""
        by_node = shapes.reshape(-1, 3, shapes.shape[-1])
        return np.einsum("nk,nkcm->ncm", self.values, by_node[self.nodes])


def locate(parts: Sequence[tuple[ElementKind, IndexArray, FloatArray]], places: FloatArray) -> ElementPlaces:
    """Return where places (n, 3), m, are among elements: kind, nodes (e, k) and their coordinates (e, k, 3) of each part.

    A place in no element is moved to the nearest place of one.
    """
    width = max(kind.node_count for kind, _, _ in parts)
    nodes, values = np.zeros((len(places), width), np.int64), np.zeros((len(places), width))
    distance = np.full(len(places), np.inf)
    for kind, numbers, corners in parts:
        if not len(numbers):
            continue
        element, parent, gap = _nearest(kind, corners, places)
        closer = np.flatnonzero(gap < distance)
        k = kind.node_count
        nodes[closer], values[closer] = 0, 0.0
        nodes[closer, :k], values[closer, :k] = numbers[element[closer]], kind.values(parent[closer])
        distance[closer] = gap[closer]
    return ElementPlaces(nodes, values, distance)


def _nearest(kind: ElementKind, corners: FloatArray, places: FloatArray) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return the element of one kind at or next to each place, the place in its parent (n, 3), and the distance, m."""
    tree = cKDTree(corners[:, :kind.corner_count].mean(axis=1))
    tried = np.atleast_2d(tree.query(places, k=min(_TRIED_ELEMENTS, len(corners)))[1]).reshape(len(places), -1)
    element, target = tried.ravel(), np.repeat(places, tried.shape[1], axis=0)
    parent, nodes = np.tile(kind.nodes.mean(axis=0), (element.size, 1)), corners[element]
    for _ in range(_PARENT_STEPS):
        jacobian = np.einsum("pna,pnb->pab", kind.slopes(parent), nodes)
        residual = target - np.einsum("pn,pnc->pc", kind.values(parent), nodes)
        step = np.linalg.solve(np.swapaxes(jacobian, 1, 2), residual[:, :, None])[:, :, 0]
        moved = np.clip(parent + step, -_MAX_PARENT, _MAX_PARENT)
        has_settled, parent = bool(np.abs(moved - parent).max() < _MIN_PARENT_STEP), moved
        if has_settled:
            break
    inside = _clipped(kind, parent)
    gap = np.linalg.norm(np.einsum("pn,pnc->pc", kind.values(inside), nodes) - target, axis=1).reshape(tried.shape)
    best, rows = gap.argmin(axis=1), np.arange(len(places))
    return tried[rows, best], inside.reshape(*tried.shape, 3)[rows, best], gap[rows, best]


def _clipped(kind: ElementKind, parent: FloatArray) -> FloatArray:
    """Return places moved into the parent element."""
    if kind.corner_count == 8:
        return np.clip(parent, -1.0, 1.0)
    barycentric = np.maximum(np.column_stack([1 - parent.sum(axis=1), parent]), 0.0)
    return (barycentric / barycentric.sum(axis=1, keepdims=True))[:, 1:]
