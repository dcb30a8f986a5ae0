"""Outer faces of a solid model: those that belong to one element only; as triangles, and thinned for drawing."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.model import SolidModel


def outer_faces(model: SolidModel) -> list[IndexArray]:
    """Return the outer faces as node numbers, one array (f, 8) or (f, 6) for each kind; corners first, seen from outside."""
    by_width: dict[int, list[IndexArray]] = {}
    for block in model.blocks:
        faces = block.nodes[:, block.kind.faces].reshape(-1, block.kind.faces.shape[1])
        by_width.setdefault(faces.shape[1], []).append(faces)
    return [_single(np.concatenate(faces)) for _, faces in sorted(by_width.items(), reverse=True)]


def _single(faces: IndexArray) -> IndexArray:
    corners = np.sort(faces[:, :faces.shape[1] // 2], axis=1)
    _, index, repeats = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return faces[repeats[index.ravel()] == 1]


def outer_triangles(model: SolidModel) -> tuple[IndexArray, IndexArray]:
    """Return the corner nodes of the outer faces and triangles (t, 3) between them."""
    triangles = []
    for faces in outer_faces(model):
        corners = faces[:, :faces.shape[1] // 2]
        triangles += [corners[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
    whole = np.concatenate(triangles)
    used, index = np.unique(whole, return_inverse=True)
    return used, index.reshape(-1, 3)


def thin_triangles(nodes: FloatArray, triangles: IndexArray, most: int) -> tuple[IndexArray, IndexArray]:
    """Return at most about `most` nodes (their numbers) and the triangles left between them: one node a cell of a grid."""
    chosen, owner = np.arange(len(nodes)), np.arange(len(nodes))
    low, size = nodes.min(axis=0), float(np.ptp(nodes, axis=0).max())
    order = np.argsort(-np.linalg.norm(nodes - nodes.mean(axis=0), axis=1), kind="stable")  # of a cell the outermost node stays
    cells = np.sqrt(most)
    while len(chosen) > most:
        grid = np.floor((nodes[order] - low) / size * cells).astype(np.int64)
        _, first, inverse = np.unique(grid, axis=0, return_index=True, return_inverse=True)
        chosen, owner = order[first], np.empty(len(nodes), dtype=np.int64)
        owner[order] = inverse.ravel()
        cells *= 0.85
    faces = owner[triangles]
    is_flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    faces = np.unique(np.sort(faces[~is_flat], axis=1), axis=0, return_index=True)[1]
    return chosen, owner[triangles][~is_flat][faces]
