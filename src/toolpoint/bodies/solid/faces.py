"""Outer faces of a solid model: those that belong to one element only."""

from __future__ import annotations

import numpy as np

from toolpoint._check import IndexArray
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
