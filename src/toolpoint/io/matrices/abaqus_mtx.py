"""Abaqus matrix output (.mtx): `matrix input` (node, direction, node, direction, value) and `coordinate` (row column value)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, triu

from toolpoint._check import ToolpointError, fail
from toolpoint.io.door import door
from toolpoint.io.matrices.labelled_matrix import LabelledMatrix, complete, node_dof
from toolpoint.vibration import Dof

# Abaqus puts this on the diagonal of a held row, in place of removing it.
_HELD_DIAGONAL = 1e36


@door("Abaqus matrix file")
def read(path: Path) -> list[LabelledMatrix]:
    """Return the one matrix of the file; what stores one triangle only comes back whole, held rows are left out and noted."""
    lines = [(n, line) for n, line in enumerate(Path(path).read_text(encoding="utf-8", errors="replace").splitlines(), 1)
             if line.strip() and not line.lstrip().startswith("*")]
    if not lines:
        raise ToolpointError(f"{path}: no entries; must hold lines of node, direction, node, direction, value")
    rows = [(n, line.replace(",", " ").split()) for n, line in lines]
    width = len(rows[0][1])
    if width not in (3, 5):
        raise ToolpointError(f"{path}:{rows[0][0]}: {width} numbers; must be 5 (matrix input) or 3 (coordinate)")
    for n, words in rows:
        if len(words) != width:
            raise ToolpointError(f"{path}:{n}: {len(words)} numbers; must be {width} as in the first; it is cut off or mixed")
    values = np.array([words[-1] for _, words in rows], dtype=float)
    places = np.array([words[:-1] for _, words in rows], dtype=float).astype(np.int64)
    return [_labelled(path, places, values) if width == 5 else _plain(path, places, values)]


def _labelled(path: Path, places: np.ndarray, values: np.ndarray) -> LabelledMatrix:
    # Rows in the order of nodes and directions, whichever entry of the file names them first.
    keys, index = np.unique(np.concatenate([places[:, :2], places[:, 2:]]), axis=0, return_inverse=True)
    rows, columns = index.ravel()[:len(values)], index.ravel()[len(values):]
    dofs = tuple(node_dof(int(node), int(direction)) for node, direction in keys)
    return _finished(path, rows, columns, values, dofs, len(keys))


def _plain(path: Path, places: np.ndarray, values: np.ndarray) -> LabelledMatrix:
    if places.min() < 1:
        raise ToolpointError(f"{path}: row or column {places.min()}; must be numbered from 1")
    return _finished(path, places[:, 0] - 1, places[:, 1] - 1, values, (), int(places.max()))


def _finished(path: Path, rows: np.ndarray, columns: np.ndarray, values: np.ndarray, dofs: tuple[Dof, ...],
              size: int) -> LabelledMatrix:
    if not np.isfinite(values).all():
        raise ToolpointError(f"{path}: {int((~np.isfinite(values)).sum())} values are not finite; must be finite")
    matrix = csc_array(coo_array((values, (rows, columns)), shape=(size, size)))
    # Entries of one triangle only: the file leaves out the other, which is the same.
    if (rows >= columns).all() or (rows <= columns).all():
        matrix = complete(matrix)
    held = matrix.diagonal() >= _HELD_DIAGONAL
    if not held.any():
        return LabelledMatrix(Path(path).stem, matrix, dofs, dofs)
    free = np.flatnonzero(~held)
    kept = tuple(dofs[k] for k in free) if dofs else ()
    return LabelledMatrix(Path(path).stem, csc_array(matrix[free][:, free]), kept, kept,
                          (f"{int(held.sum())} held rows (1e36 on the diagonal) left out",))


def write(path: Path, matrix: LabelledMatrix, *, layout: str = "matrix input") -> None:
    """Write a symmetric matrix: its upper triangle with labels (`matrix input`), or all of it by number (`coordinate`)."""
    if layout not in ("matrix input", "coordinate"):
        fail("layout", repr(layout), "must be 'matrix input' or 'coordinate'")
    entries = (triu(matrix.matrix) if layout == "matrix input" else matrix.matrix).tocoo()
    i, j = entries.coords
    if layout == "coordinate":
        text = [f"{a + 1} {b + 1} {float(v)!r}" for a, b, v in zip(i, j, entries.data, strict=True)]
    else:
        labels = matrix.rows or tuple(Dof(k + 1, "+x") for k in range(matrix.matrix.shape[0]))
        names = [f"{dof.point}, {['+x', '+y', '+z', '+rx', '+ry', '+rz'].index(dof.direction) + 1}" for dof in labels]
        text = [f"{names[a]}, {names[b]}, {float(v)!r}" for a, b, v in zip(i, j, entries.data, strict=True)]
    Path(path).write_text("\n".join(text) + "\n", encoding="utf-8")
