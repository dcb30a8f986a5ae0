"""Curved tetrahedra whose mid-side nodes fold them: the nodes go back to the middle of their sides."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.assembly import chunks
from toolpoint.bodies.solid.element_kinds import kind_of

LEAST = 0.15  # ratio of smallest to largest volume change inside an element below which it counts as folded
ROUNDS = 6


def straighten(nodes: FloatArray, elements: IndexArray) -> tuple[FloatArray, int]:
    """Return nodes with the sides of folded elements straight, and how many elements were folded.

    nodes : (n, 3); elements : (e, 10) or (e, 20). A straight side may fold a neighbour, so it is asked again, a few times.
    """
    kind = kind_of(elements.shape[1])
    result, touched = np.array(nodes), np.zeros(len(elements), dtype=bool)
    for _ in range(ROUNDS):
        folded = np.concatenate([_ratio(result[elements[part]]) for part in chunks(len(elements))]) < LEAST
        moved = folded & ~_straight(result[elements])
        if not moved.any():
            break
        touched |= moved
        ends, middle = elements[moved][:, kind.sides], elements[moved][:, kind.corner_count:]
        result[middle] = result[ends].mean(axis=2)
    return result, int(touched.sum())


def _ratio(places: FloatArray) -> FloatArray:
    """Return the least over the largest volume change at the corners, mid-sides and points of the rule of each element."""
    kind = kind_of(places.shape[1])
    at = np.vstack([kind.mass_points, kind.points])
    determinant = np.linalg.det(np.einsum("pna,enb->epab", kind.slopes(at), places, optimize=True))
    return determinant.min(axis=1) / np.maximum(np.abs(determinant).max(axis=1), 1e-300)


def _straight(places: FloatArray) -> np.ndarray:
    kind = kind_of(places.shape[1])
    middle = places[:, kind.sides].mean(axis=2)
    size = np.abs(np.diff(places[:, kind.sides], axis=2)).max(axis=(1, 2, 3))
    return np.abs(places[:, kind.corner_count:] - middle).max(axis=(1, 2)) <= 1e-12 * size
