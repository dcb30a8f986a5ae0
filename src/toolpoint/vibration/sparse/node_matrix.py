"""NodeMatrix: a symmetric matrix with three rows a node and half of its blocks stored, for large finite-element bodies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array, eye_array, kron

from toolpoint._check import FloatArray, IndexArray, fail

ROWS_PER_NODE = 3  # translations x, y, z


@dataclass(frozen=True, eq=False)
class NodePattern:
    """Neighbours of each node (nodes that share an element), and where the block of each pair is stored.

    pointers (n + 1,) and columns (k,): neighbours of each node, itself among them, ascending; entries (k,): number of the
    stored block of each pair, the same for (i, j) and (j, i).
    """

    pointers: IndexArray
    columns: IndexArray
    entries: IndexArray

    @property
    def node_count(self) -> int:
        """Number of nodes."""
        return len(self.pointers) - 1

    @cached_property
    def block_count(self) -> int:
        """Number of stored blocks: pairs i >= j."""
        return int(self.entries.max(initial=-1)) + 1


def pattern_of(elements: list[IndexArray], node_count: int) -> NodePattern:
    """Return the pattern of groups of elements (e, nodes each)."""
    from toolpoint.vibration.sparse import node_kernels

    total = None
    for nodes in elements:
        e, n = nodes.shape
        # Nodes that share an element are the pattern of incidence^T incidence: one sparse product instead of loops over
        # pairs.
        rows = np.repeat(np.arange(e, dtype=np.int32), n)
        incidence = csr_array((np.ones(e * n, dtype=bool), (rows, nodes.ravel().astype(np.int32))), shape=(e, node_count))
        graph = incidence.T @ incidence
        total = graph if total is None else total + graph
    if total is None:
        fail("elements", "none", "must be at least one group")
    graph = csr_array(total)
    graph.sort_indices()
    pointers, columns = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    return NodePattern(pointers, columns, node_kernels.number_pairs(pointers, columns))


@dataclass(frozen=True, eq=False)
class NodeMatrix:
    """A symmetric matrix, shape (3 nodes, 3 nodes).

    Parameters
    ----------
    pattern : NodePattern
    blocks : (pairs, 3, 3) floats, or (pairs,)
        Block of rows of node i and columns of node j, i >= j; a number stands for itself times the unit matrix.
    """

    pattern: NodePattern
    blocks: FloatArray

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return (ROWS_PER_NODE * self.pattern.node_count,) * 2

    @property
    def largest(self) -> float:
        """Size of the largest entry; not finite where any is not."""
        return max(float(self.blocks.max(initial=0.0)), -float(self.blocks.min(initial=0.0)))

    def diagonal(self) -> FloatArray:
        """Return the diagonal."""
        pattern = self.pattern
        rows = np.repeat(np.arange(pattern.node_count), np.diff(pattern.pointers))
        blocks = self.blocks[pattern.entries[pattern.columns == rows]]
        return np.repeat(blocks, ROWS_PER_NODE) if blocks.ndim == 1 else np.einsum("naa->na", blocks).ravel()

    def __matmul__(self, motion: FloatArray) -> FloatArray:
        from toolpoint.vibration.sparse import node_kernels

        pattern = self.pattern
        # Writeable: a kernel is compiled a second time for what may not be written.
        x = np.require(motion, float, ["C", "W"]).reshape(pattern.node_count, ROWS_PER_NODE, -1)
        result = np.zeros_like(x)
        if self.blocks.ndim == 3:
            node_kernels.multiply(pattern.pointers, pattern.columns, pattern.entries, self.blocks, x, result)
        else:
            node_kernels.multiply_scalars(pattern.pointers, pattern.columns, pattern.entries, self.blocks,
                                          x.reshape(pattern.node_count, -1), result.reshape(pattern.node_count, -1))
        return result.reshape(np.shape(motion))

    def columns(self) -> csc_array:
        """Return all of it as compressed columns."""
        pattern = self.pattern
        if self.blocks.ndim == 1:
            numbers = (self.blocks[pattern.entries], pattern.columns, pattern.pointers)
            return csc_array(kron(csr_array(numbers, shape=(pattern.node_count,) * 2), eye_array(ROWS_PER_NODE), format="csc"))
        rows = np.repeat(np.arange(pattern.node_count), np.diff(pattern.pointers))
        blocks = self.blocks[pattern.entries]
        is_above = pattern.columns > rows
        blocks[is_above] = blocks[is_above].transpose(0, 2, 1)
        rows_matrix = bsr_array((blocks, pattern.columns, pattern.pointers), shape=self.shape).tocsr()
        return csc_array((rows_matrix.data, rows_matrix.indices, rows_matrix.indptr),
                         shape=self.shape)  # symmetric: its rows are its columns


SymmetricMatrix: TypeAlias = csc_array | NodeMatrix


def as_columns(matrix: SymmetricMatrix) -> csc_array:
    """Return a matrix as compressed columns."""
    return matrix.columns() if isinstance(matrix, NodeMatrix) else matrix
