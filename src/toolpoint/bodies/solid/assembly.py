"""Assembly of element matrices into the blocks of node pairs, a chunk of elements at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.node_matrix import NodePattern

_CHUNK_ELEMENTS = 1024  # element matrices, 60 x 60, held at once: 30 MB
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
    """Return slices that cut a number of elements into pieces of at most 1024."""
    return (slice(start, min(start + _CHUNK_ELEMENTS, count)) for start in range(0, count, _CHUNK_ELEMENTS))
