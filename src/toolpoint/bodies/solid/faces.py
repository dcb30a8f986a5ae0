"""Outer faces of a solid model: those that belong to one element only; as triangles, and thinned for drawing."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.model import SolidModel

SHARP_EDGE_ANGLE = 30.0  # degrees between the normals of two triangles: above, an edge parts two smooth faces


def outer_faces(model: SolidModel) -> list[IndexArray]:
    """Return the outer faces as indices of nodes, one array (f, 8) or (f, 6) for each kind.

    Corners come first, anticlockwise as seen from outside, then the nodes in the middle of the sides.
    """
    by_width: dict[int, list[IndexArray]] = {}
    for block in model.blocks:
        faces = block.nodes[:, block.kind.faces].reshape(-1, block.kind.faces.shape[1])
        by_width.setdefault(faces.shape[1], []).append(faces)
    return [_unshared_faces(np.concatenate(faces)) for _, faces in sorted(by_width.items(), reverse=True)]


def _unshared_faces(faces: IndexArray) -> IndexArray:
    """Return the faces (f, 8 or 6) whose corners no other face has."""
    corners = np.sort(faces[:, :faces.shape[1] // 2], axis=1)
    _, index, repeats = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return faces[repeats[index.ravel()] == 1]


def outer_triangles(model: SolidModel) -> tuple[IndexArray, IndexArray]:
    """Return the indices (n,) of the corner nodes of the outer faces, and triangles (t, 3) as places in that array."""
    triangles = []
    for faces in outer_faces(model):
        corners = faces[:, :faces.shape[1] // 2]
        triangles += [corners[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    corners_of_all = np.concatenate(triangles)
    used, index = np.unique(corners_of_all, return_inverse=True)
    return used, index.reshape(-1, 3)


def thin_triangles(nodes: FloatArray, triangles: IndexArray, max_nodes: int) -> tuple[IndexArray, IndexArray]:
    """Return the indices of about `max_nodes` kept nodes at most, and triangles (t, 3) as places in that array.

    nodes : (n, 3); triangles : (t, 3) indices of nodes.

    One node a cell of a grid is kept among those of the same smooth faces: walls stay separate, edges sharp, flat faces flat.
    """
    chosen, owner = np.arange(len(nodes)), np.arange(len(nodes))
    origin, size = nodes.min(axis=0), float(np.ptp(nodes, axis=0).max())
    order = np.argsort(-np.linalg.norm(nodes - nodes.mean(axis=0), axis=1),
                       kind="stable")  # the outermost node of a cell is kept
    faces, cells = _faces_of_nodes(nodes, triangles), 2 * np.sqrt(max_nodes)
    # A surface crosses far fewer cells than the box has: the grid is made coarser step by step until few enough remain.
    while len(chosen) > max_nodes and cells > 1:
        grid = np.floor((nodes[order] - origin) / size * cells).astype(np.int64)
        _, first, inverse = np.unique(np.column_stack([grid, faces[order]]), axis=0, return_index=True, return_inverse=True)
        chosen, owner = order[first], np.empty(len(nodes), dtype=np.int64)
        owner[order] = inverse.ravel()
        # Coarser step by step, as the number of triangles that a grid leaves is not known before it is laid.
        cells *= 0.85
    thinned = owner[triangles]
    is_flat = (thinned == np.roll(thinned, 1, axis=1)).any(axis=1)
    unique_rows = np.unique(np.sort(thinned[~is_flat], axis=1), axis=0, return_index=True)[1]
    used, index = np.unique(thinned[~is_flat][unique_rows], return_inverse=True)
    return chosen[used], index.reshape(-1, 3)


def _faces_of_nodes(nodes: FloatArray, triangles: IndexArray) -> IndexArray:
    """Return a key (n,) for each node, equal for nodes on the same set of smooth faces.

    A smooth face is all triangles joined over edges with an angle below `SHARP_EDGE_ANGLE`.
    """
    normal = np.cross(nodes[triangles[:, 1]] - nodes[triangles[:, 0]], nodes[triangles[:, 2]] - nodes[triangles[:, 0]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(sides.T)
    triangle_of = order // 3
    is_shared = (sides[order][1:] == sides[order][:-1]).all(axis=1)
    first, second = triangle_of[:-1][is_shared], triangle_of[1:][is_shared]
    is_smooth = (normal[first] * normal[second]).sum(axis=1) > np.cos(np.radians(SHARP_EDGE_ANGLE))
    count = len(triangles)
    graph = coo_array((np.ones(int(is_smooth.sum())), (first[is_smooth], second[is_smooth])), shape=(count, count))
    face = connected_components(graph, directed=False)[1]
    pairs = np.unique(np.column_stack([triangles.ravel(), np.repeat(face, 3)]), axis=0)
    keys = np.random.default_rng(1).integers(1, 2**40, int(face.max()) + 1)
    # The set of faces of a node as a sum of random keys, one a face.
    node_key = np.zeros(len(nodes), dtype=np.int64)
    np.add.at(node_key, pairs[:, 0], keys[pairs[:, 1]])
    return node_key
