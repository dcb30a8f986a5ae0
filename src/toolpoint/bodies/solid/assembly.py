"""Assembly of element matrices into the blocks of node pairs, a chunk of elements at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse.node_matrix import NodePattern

_CHUNK_ELEMENTS = 1024  # element matrices, 60 x 60, held at once: 30 MB
# Coordinates of the nodes of elements (e, n, 3), m, to their matrices (e, width n, width n).
ElementMatrices = Callable[[FloatArray], FloatArray]


def add_pairs(nodes: FloatArray, elements: IndexArray, pattern: NodePattern, *, blocks: FloatArray, matrices: ElementMatrices
              ) -> None:
    """Add element matrices to the stored blocks (pairs, width, width) of a pattern, in place.

    nodes : (n, 3) m; elements : (e, nodes of one); matrices : from coordinates to matrices of some elements. The width is 3 for
    stiffness, 1 for mass, which is alike in x, y and z.
    """
    from toolpoint.vibration.sparse import node_kernels

    for part in chunks(len(elements)):
        chosen = elements[part]
        node_kernels.scatter_pairs(chosen, matrices(nodes[chosen]), blocks.shape[1], pattern.pointers, pattern.columns,
                                   pattern.entries, blocks)


def chunks(count: int) -> Iterator[slice]:
    """Return the slices of a number of elements in pieces of at most `_CHUNK_ELEMENTS`."""
    return (slice(start, min(start + _CHUNK_ELEMENTS, count)) for start in range(0, count, _CHUNK_ELEMENTS))
