"""Assembly of element matrices into the blocks of node pairs, a chunk of elements at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.node_matrix import NodePattern

# Elements at a time: 60 x 60 matrices of so many take 30 MB.
_CHUNK = 1024
ElementMatrices = Callable[[FloatArray], FloatArray]


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
