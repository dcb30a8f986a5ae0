"""Assembly of element matrices into sparse ones: the pattern from nodes, the values by compiled loops."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.sparse import csc_array, csr_array

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.node_matrix import NodePattern

# Elements at a time: 60 x 60 matrices of so many take 30 MB.
_CHUNK = 1024
ElementMatrices = Callable[[FloatArray], FloatArray]


def node_pattern(elements: IndexArray, node_count: int) -> tuple[IndexArray, IndexArray]:
    """Return pointers and sorted columns of the nodes that share an element with each node."""
    e, n = elements.shape
    rows = np.repeat(np.arange(e), n)
    incidence = csr_array((np.ones(e * n, dtype=bool), (rows, elements.ravel())), shape=(e, node_count))
    graph = (incidence.T @ incidence).tocsr()
    graph.sort_indices()
    return graph.indptr, graph.indices


def assemble_blocks(nodes: FloatArray, elements: IndexArray, width: int, *, matrices: ElementMatrices) -> csc_array:
    """Return the sum of element matrices as compressed columns, shape (width nodes,) * 2.

    `matrices` maps coordinates (e, n, 3) of some elements to their matrices (e, width n, width n).
    """
    from toolpoint.bodies.solid import kernels

    pointers, columns = node_pattern(elements, len(nodes))
    data = np.zeros((len(columns), width, width))
    for part in chunks(len(elements)):
        chosen = elements[part]
        kernels.scatter(chosen, matrices(nodes[chosen]), width, pointers, columns, data)
    size = width * len(nodes)
    indptr = np.empty(size + 1, dtype=np.int32 if data.size < 2**31 else np.int64)
    indices = np.empty(data.size, dtype=np.int32)
    values = np.empty(data.size)
    kernels.expand(pointers, columns, data, indptr, indices, values)
    # The matrix is symmetric, so its rows are its columns.
    return csc_array((values, indices, indptr), shape=(size, size))


def add_pairs(nodes: FloatArray, elements: IndexArray, pattern: NodePattern, *, blocks: FloatArray, matrices: ElementMatrices
              ) -> None:
    """Add element matrices to the stored blocks (pairs, width, width) of a pattern."""
    from toolpoint.vibration.sparse import node_kernels

    for part in chunks(len(elements)):
        chosen = elements[part]
        node_kernels.scatter_pairs(chosen, matrices(nodes[chosen]), blocks.shape[1], pattern.pointers, pattern.columns,
                                   pattern.entries, blocks)


def chunks(count: int) -> Iterator[slice]:
    """Cut a number of elements into slices."""
    return (slice(at, min(at + _CHUNK, count)) for at in range(0, count, _CHUNK))
