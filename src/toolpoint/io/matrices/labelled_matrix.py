"""LabelledMatrix: a matrix of a file with its name and, where the file has them, the labels of its rows and columns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, csc_array, tril, triu

from toolpoint._check import ToolpointError, fail
from toolpoint._notebook import NotebookText
from toolpoint.vibration import Dof

DIRECTIONS = ("+x", "+y", "+z", "+rx", "+ry", "+rz")


@dataclass(frozen=True, eq=False)
class LabelledMatrix(NotebookText):
    """A matrix as its file holds it: real or complex, both triangles, labels of rows and columns or none."""

    name: str
    matrix: csc_array
    rows: tuple[Dof, ...] = ()
    columns: tuple[Dof, ...] = ()
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        kind = "complex" if self.matrix.dtype.kind == "c" else "real"
        return f"LabelledMatrix({self.name}, {self.matrix.shape[0]} x {self.matrix.shape[1]}, {self.matrix.nnz} {kind} entries)"


def node_dof(node: int, direction: int) -> Dof:
    """Return the label of a node's direction 1 .. 6 (0: a scalar point, written as x)."""
    if not 0 <= direction <= 6 or node < 1:
        fail("label", f"node {node}, direction {direction}", "must be a node from 1 and a direction 0 .. 6")
    return Dof(node, DIRECTIONS[max(direction - 1, 0)])


def complete(matrix: csc_array) -> csc_array:
    """Return the whole symmetric matrix of one stored triangle."""
    off_diagonal = csc_array(tril(matrix, -1)) if tril(matrix, -1).nnz else csc_array(triu(matrix, 1))
    return csc_array(matrix + off_diagonal.T)


def gather(path: Path, i: list[np.ndarray], j: list[np.ndarray], *, values: list[np.ndarray],
           shape: tuple[int, int], kind: int) -> csc_array:
    """Return the sparse matrix of strings of rows, columns and values, explicit zeros left out."""
    dtype = complex if kind > 2 else float
    if not values:
        return csc_array(shape, dtype=dtype)
    rows, columns, data = np.concatenate(i), np.concatenate(j), np.concatenate(values).astype(dtype)
    if rows.min() < 0 or rows.max() >= shape[0]:
        raise ToolpointError(f"{path}: row {int(rows.max()) + 1} in column {int(columns[np.argmax(rows)]) + 1}; "
                             f"must be within 1 .. {shape[0]}")
    if not np.isfinite(data).all():
        raise ToolpointError(f"{path}: {int((~np.isfinite(data)).sum())} values are not finite; damaged")
    keep = data != 0
    return csc_array(coo_array((data[keep], (rows[keep], columns[keep])), shape=shape))
