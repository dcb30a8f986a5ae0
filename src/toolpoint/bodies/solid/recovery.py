"""Strain that is smooth over the elements of a set, from the points of each element where it is best: patches of elements.

Around every corner a polynomial of second degree is fitted to the strains of the elements that meet there; its values at the
corner and at half of the sides from it are those of the nodes. Source: Zienkiewicz, Zhu, Int. J. Numer. Methods Eng. 33
(1992), 1331-1364 and 1365-1382. Walls of one element hold two points across: what these cannot tell of the second degree is
taken as zero by a small penalty.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array, csr_array

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import HEXAHEDRON, STRAIGHT_TETRAHEDRON, ElementKind
from toolpoint.bodies.solid.model import ElementBlock, SolidModel

_HALF = 1 / np.sqrt(3)  # Gauss points of order two, where strains of 20-node hexahedra are best
_BEST = {8: HEXAHEDRON.nodes[:8] * _HALF, 4: STRAIGHT_TETRAHEDRON.points}
_PENALTY = np.array([0.0] + [1e-8] * 3 + [1e-4] * 6)
_AT_ONCE = 2000  # corners


def best_points(kind: ElementKind) -> FloatArray:
    """Return the points (p, 3) of the parent element at which strains are taken."""
    return _BEST[kind.corner_count]


def blocks_of(model: SolidModel, name: str) -> list[ElementBlock]:
    """Return the blocks of a set, in their order."""
    return [block for block in model.blocks if block.name == name]


def recovery(model: SolidModel, name: str) -> csr_array:
    """Return the map (nodes, points) to nodes from strains at the best points of a set's elements, in the order of blocks."""
    places, corners, owners, sides = _patches(model, blocks_of(model, name))
    order = np.argsort(corners, kind="stable")
    vertices, first, count = np.unique(corners[order], return_index=True, return_counts=True)
    points = owners[order]
    halves = np.concatenate([sides[:, [0, 1]], sides[:, [0, 2]]])
    halves = halves[np.argsort(halves[:, 1], kind="stable")]
    rows, columns = list[IndexArray](), list[IndexArray]()
    values = list[FloatArray]()
    for chosen in _alike(count):
        near = points[first[chosen, None] + np.arange(count[chosen[0]])]
        low, high = (np.searchsorted(halves[:, 1], vertices[chosen], side=side) for side in ("left", "right"))
        which = np.repeat(np.arange(len(chosen)), high - low)
        middle = halves[np.repeat(low, high - low) + np.arange(len(which)) - np.repeat(np.cumsum(high - low) - (high - low),
                                                                                       high - low), 0]
        at_corner, at_middle = _weights(places[near], model.nodes[vertices[chosen]], which, model.nodes[middle])
        rows += [np.repeat(vertices[chosen], near.shape[1]), np.repeat(middle, near.shape[1])]
        columns += [near.ravel(), near[which].ravel()]
        values += [at_corner.ravel(), at_middle.ravel() / 2]
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_array(coo_array(entries, shape=(len(model.nodes), len(places))))


def _patches(model: SolidModel, blocks: list[ElementBlock]) -> tuple[FloatArray, IndexArray, IndexArray, IndexArray]:
    """Return the places of all points (P, 3); corner and point of every pair that meets in an element; sides (s, 3): the node
    in the middle, then its two ends."""
    places, corners, owners, sides, count = [], [], [], [], 0
    for block in blocks:
        kind, number = block.kind, len(best_points(block.kind))
        places.append(np.einsum("pn,end->epd", kind.values(best_points(kind)), model.nodes[block.nodes]).reshape(-1, 3))
        shape = (len(block), kind.corner_count, number)
        corners.append(np.broadcast_to(block.nodes[:, :kind.corner_count, None], shape).ravel())
        points = count + np.arange(len(block) * number).reshape(len(block), 1, number)
        owners.append(np.broadcast_to(points, shape).ravel())
        ends = np.sort(block.nodes[:, kind.sides], axis=2)
        sides.append(np.concatenate([block.nodes[:, kind.corner_count:, None], ends], axis=2).reshape(-1, 3))
        count += len(block) * number
    return (np.concatenate(places), np.concatenate(corners), np.concatenate(owners),
            np.unique(np.concatenate(sides), axis=0))


def _alike(count: IndexArray) -> Iterator[IndexArray]:
    """Yield positions of equal counts, so many at once."""
    for number in np.unique(count):
        alike = np.flatnonzero(count == number)
        yield from (alike[at:at + _AT_ONCE] for at in range(0, len(alike), _AT_ONCE))


def _weights(near: FloatArray, corner: FloatArray, which: IndexArray, middle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weights of the points near corners (v, p, 3) for the values at corners (v, p) and at middles (s, p)."""
    away = near - corner[:, None]
    size = np.abs(away).max(axis=1, keepdims=True)
    matrix = _terms(away / size)
    normal = matrix.transpose(0, 2, 1) @ matrix / near.shape[1] + np.diag(_PENALTY)
    fit = np.linalg.solve(normal, matrix.transpose(0, 2, 1)) / near.shape[1]
    terms = _terms((middle - corner[which]) / size[which, 0])
    return fit[:, 0], (terms[:, None] @ fit[which])[:, 0]


def _terms(at: FloatArray) -> FloatArray:
    """Return the terms of second degree at places (..., 3), (..., 10)."""
    x, y, z = np.moveaxis(at, -1, 0)
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, z * x, x * x, y * y, z * z], axis=-1)
