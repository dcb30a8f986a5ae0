"""Curved tetrahedra that their mid-side nodes fold: the nodes are moved to the middle of their sides."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.assembly import chunks
from toolpoint.bodies.solid.element_kinds import kind_of

MIN_VOLUME_RATIO = 0.15  # smallest over largest Jacobian determinant inside an element: below, it counts as folded
MAX_STRAIGHTENING_ROUNDS = 6  # tests of all elements: each may straighten neighbours of the last


def straighten(nodes: FloatArray, elements: IndexArray) -> tuple[FloatArray, int]:
    """Return nodes with the sides of folded elements straight, and the number of elements that were straightened.

    nodes : (n, 3); elements : (e, 10) or (e, 20). A side that is made straight may fold a neighbour, so elements are tested
    again. Folded elements whose sides are straight already stay as they are, and are not counted.
    """
    kind = kind_of(elements.shape[1])
    result, was_folded = np.array(nodes), np.zeros(len(elements), dtype=bool)
    for _ in range(MAX_STRAIGHTENING_ROUNDS):
        is_folded = np.concatenate([_volume_ratio(result[elements[part]]) for part in chunks(len(elements))]) < MIN_VOLUME_RATIO
        to_straighten = is_folded & ~_has_straight_sides(result[elements])
        if not to_straighten.any():
            break
        was_folded |= to_straighten
        side_ends, mid_nodes = elements[to_straighten][:, kind.sides], elements[to_straighten][:, kind.corner_count:]
        result[mid_nodes] = result[side_ends].mean(axis=2)
    return result, int(was_folded.sum())


def _volume_ratio(places: FloatArray) -> FloatArray:
    """Return the smallest over the largest Jacobian determinant of each element, (e,), negative where it is inside out.

    places : (e, n, 3). The ratio is that at the points of the integration rule, where matrices feel it. Corners and middles of
    sides count where they are inside out: there stresses and neighbours feel it, though curved sides make it small in good
    elements too.
    """
    kind = kind_of(places.shape[1])
    inside, at_nodes = (np.linalg.det(np.einsum("pna,enb->epab", kind.slopes(points), places, optimize=True))
                        for points in (kind.points, kind.nodes))
    largest = np.maximum(np.abs(inside).max(axis=1), 1e-300)
    return np.minimum(inside.min(axis=1), np.where(at_nodes.min(axis=1) < 0, at_nodes.min(axis=1), np.inf)) / largest


def _has_straight_sides(places: FloatArray) -> np.ndarray:
    """Whether all mid-side nodes of each element, places (e, n, 3), are in the middle of their sides, (e,) bools."""
    kind = kind_of(places.shape[1])
    middles = places[:, kind.sides].mean(axis=2)
    size = np.abs(np.diff(places[:, kind.sides], axis=2)).max(axis=(1, 2, 3))
    return np.abs(places[:, kind.corner_count:] - middles).max(axis=(1, 2)) <= 1e-12 * size
