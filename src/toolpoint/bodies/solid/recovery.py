"""Strain recovery: strains smooth over the elements of a set, fitted to each element's points of highest accuracy.

Around every corner a polynomial of second degree is fitted to the strains of the elements that meet there; its values at the
corner and at half of the sides from it are those of the nodes. Source: Zienkiewicz, Zhu, Int. J. Numer. Methods Eng. 33
(1992), 1331-1364 and 1365-1382. Walls of one element hold two points across: terms of second degree that these do not
determine are kept near zero by a small penalty.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import coo_array, csr_array

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.element_kinds import HEXAHEDRON, STRAIGHT_TETRAHEDRON, ElementKind
from toolpoint.bodies.solid.model import ElementBlock, SolidModel

_GAUSS_COORDINATE = 1 / np.sqrt(3)  # of the rule of order two, where strains of 20-node hexahedra are most accurate
# Number of corners of an element to the points of its parent (p, 3).
_BEST_POINTS = {8: HEXAHEDRON.nodes[:8] * _GAUSS_COORDINATE, 4: STRAIGHT_TETRAHEDRON.points}
_PENALTY = np.array([0.0] + [1e-8] * 3 + [1e-4] * 6)  # of the terms of degree 0, 1 and 2, over the mean square of the terms
_CORNERS_AT_ONCE = 2000  # corners whose fits are solved as one array


def best_points(kind: ElementKind) -> FloatArray:
    """Return the points (p, 3) of the parent element at which strains are taken."""
    return _BEST_POINTS[kind.corner_count]


def blocks_of(model: SolidModel, name: str) -> list[ElementBlock]:
    """Return the element blocks of the set `name`, in their order."""
    return [block for block in model.blocks if block.name == name]


def recovery(model: SolidModel, name: str) -> csr_array:
    """Return the map (nodes, points) from strains at the best points of a set's elements to strains at its nodes.

    Points are in the order of blocks, elements, best points. Nodes outside the set have empty rows.
    """
    places, corners, owners, sides = _patches(model, blocks_of(model, name))
    order = np.argsort(corners, kind="stable")
    vertices, first, count = np.unique(corners[order], return_index=True, return_counts=True)
    points = owners[order]
    halves = np.concatenate([sides[:, [0, 1]], sides[:, [0, 2]]])
    halves = halves[np.argsort(halves[:, 1], kind="stable")]
    rows, columns = list[IndexArray](), list[IndexArray]()
    values = list[FloatArray]()
    for chosen in _equal_counts(count):
        near_points = points[first[chosen, None] + np.arange(count[chosen[0]])]
        begin, end = (np.searchsorted(halves[:, 1], vertices[chosen], side=side) for side in ("left", "right"))
        owner = np.repeat(np.arange(len(chosen)), end - begin)
        mid_nodes = halves[np.repeat(begin, end - begin) + np.arange(len(owner))
                           - np.repeat(np.cumsum(end - begin) - (end - begin),
                                                                                       end - begin), 0]
        at_corner, at_middle = _weights(places[near_points], model.nodes[vertices[chosen]], owner, model.nodes[mid_nodes])
        rows += [np.repeat(vertices[chosen], near_points.shape[1]), np.repeat(mid_nodes, near_points.shape[1])]
        columns += [near_points.ravel(), near_points[owner].ravel()]
        # A node in the middle of a side takes the mean of the fits about both ends.
        values += [at_corner.ravel(), at_middle.ravel() / 2]
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return csr_array(coo_array(entries, shape=(len(model.nodes), len(places))))


def _patches(model: SolidModel, blocks: list[ElementBlock]) -> tuple[FloatArray, IndexArray, IndexArray, IndexArray]:
    """Return places (P, 3) of all best points, corner nodes (q,) and points (q,) of pairs, and sides (s, 3).

    A pair is a corner and a point of one element; a side is the node in its middle, then its two ends.
    """
    places, corners, owners, sides, count = [], [], [], [], 0
    for block in blocks:
        kind, point_count = block.kind, len(best_points(block.kind))
        places.append(np.einsum("pn,end->epd", kind.values(best_points(kind)), model.nodes[block.nodes]).reshape(-1, 3))
        shape = (len(block), kind.corner_count, point_count)
        corners.append(np.broadcast_to(block.nodes[:, :kind.corner_count, None], shape).ravel())
        points = count + np.arange(len(block) * point_count).reshape(len(block), 1, point_count)
        owners.append(np.broadcast_to(points, shape).ravel())
        side_ends = np.sort(block.nodes[:, kind.sides], axis=2)
        sides.append(np.concatenate([block.nodes[:, kind.corner_count:, None], side_ends], axis=2).reshape(-1, 3))
        count += len(block) * point_count
    return (np.concatenate(places), np.concatenate(corners), np.concatenate(owners),
            np.unique(np.concatenate(sides), axis=0))


def _equal_counts(count: IndexArray) -> Iterator[IndexArray]:
    """Yield the positions of equal counts, at most `_CORNERS_AT_ONCE` each: their fits are solved as one array."""
    for number in np.unique(count):
        positions = np.flatnonzero(count == number)
        yield from (positions[start:start + _CORNERS_AT_ONCE] for start in range(0, len(positions), _CORNERS_AT_ONCE))


def _weights(points: FloatArray, corner: FloatArray, which: IndexArray, mid_places: FloatArray) -> tuple[FloatArray,
                                                                                                         FloatArray]:
    """Return weights of points for the values at corners (v, p), and at nodes in the middle of sides (s, p).

    points : (v, p, 3) about each corner; corner : (v, 3); which : (s,) corner that each middle belongs to; mid_places : (s, 3).
    """
    arms = points - corner[:, None]
    scale = np.abs(arms).max(axis=1, keepdims=True)
    matrix = _terms(arms / scale)
    normal = matrix.transpose(0, 2, 1) @ matrix / points.shape[1] + np.diag(_PENALTY)
    fit = np.linalg.solve(normal, matrix.transpose(0, 2, 1)) / points.shape[1]
    terms = _terms((mid_places - corner[which]) / scale[which, 0])
    return fit[:, 0], (terms[:, None] @ fit[which])[:, 0]


def _terms(place: FloatArray) -> FloatArray:
    """Return the terms of a polynomial of second degree at places (..., 3), shape (..., 10)."""
    x, y, z = np.moveaxis(place, -1, 0)
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, z * x, x * x, y * y, z * z], axis=-1)
