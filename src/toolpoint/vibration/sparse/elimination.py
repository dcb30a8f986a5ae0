"""EliminationPlan: the order in which rows of one pattern are eliminated, and where everything of their factors will lie."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse import kernels, symbolic
from toolpoint.vibration.sparse.node_matrix import WIDTH, NodeMatrix, SymmetricMatrix
from toolpoint.vibration.sparse.ordering import cuts, dissection

# Below this many vertices a part is ordered by minimum degree.
_LEAF = 60
# Numbers of a factor between two looks at the keyboard.
_CHUNK = 2_000_000


class EliminationPlan:
    """Order of elimination for all matrices of a pattern; rows that share a place (`coordinates`) are ordered together."""

    def __init__(self, pattern: SymmetricMatrix, coordinates: FloatArray | None = None) -> None:
        xadj, adj, weight, group = _graph(pattern, coordinates)
        places = _places(xadj, adj, group, coordinates)
        self.name = "nested dissection by place" if coordinates is not None else "nested dissection by graph"
        order = dissection.dissect(xadj, adj, weight, places, _LEAF)
        parent = symbolic.elimination_tree(xadj, adj, order)
        order = order[symbolic.postorder(parent, symbolic.column_weights(xadj, adj, order, parent, weight))]
        parent = symbolic.elimination_tree(xadj, adj, order)
        rows = symbolic.column_weights(xadj, adj, order, parent, weight)
        self._lay_out(xadj, adj, weight, group, order, symbolic.supernodes(parent, rows, weight[order]))

    def _lay_out(self, xadj: IndexArray, adj: IndexArray, weight: IndexArray, group: IndexArray, order: IndexArray,
                 starts: IndexArray) -> None:
        pointers, rows, parent = symbolic.structure(xadj, adj, order, starts)
        self.begins, self.pointers, self.rows = symbolic.expand_rows(pointers, rows, order, weight, starts)
        self.parent = parent
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        self.order = np.argsort(place[group], kind="stable").astype(np.int32)
        self.place = np.empty_like(self.order)
        self.place[self.order] = np.arange(len(group), dtype=np.int32)
        self.starts = symbolic.factor_starts(self.begins, self.pointers, kernels.BLOCK)

    @property
    def arrays(self) -> tuple[IndexArray, ...]:
        """What the compiled loops go by."""
        return self.order, self.place, self.begins, self.pointers, self.rows, self.parent, self.starts

    @property
    def factor_size(self) -> int:
        """Numbers that the factors hold."""
        return int(self.starts[-1])

    def workspace(self) -> tuple[FloatArray, IndexArray, IndexArray, FloatArray, FloatArray]:
        """Return what a factorisation works in: stack of contributions, its state, places in a front, and the largest front."""
        stack, columns, square = symbolic.room_needed(self.begins, self.pointers, self.parent)
        state = np.full(1 + 3 * len(self.parent), -1, dtype=np.int64)
        state[0] = 0
        return np.empty(stack), state, np.empty(len(self.order), dtype=np.int64), np.empty(columns), np.empty(square)

    def pieces(self) -> list[tuple[int, int]]:
        """Cut the groups so that a keyboard interrupt is heard between pieces."""
        ends = np.searchsorted(self.starts, np.arange(_CHUNK, self.factor_size, _CHUNK))
        ends = np.unique(np.concatenate([[0], ends, [len(self.parent)]]))
        return [(int(a), int(b)) for a, b in pairwise(ends)]


def _graph(pattern: SymmetricMatrix, coordinates: FloatArray | None) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Return pointers, neighbours and rows of vertices (nodes with the same neighbours are one), and each row's vertex."""
    if isinstance(pattern, NodeMatrix):
        indptr, indices = pattern.pattern.pointers, pattern.pattern.columns
        group: IndexArray = np.arange(pattern.pattern.node_count)
        width = WIDTH
    else:
        indptr, indices, width = pattern.indptr, pattern.indices, 1
        group = _node_groups(indptr, indices, pattern.shape[0], coordinates)
    xadj, adj, _ = symbolic.quotient(indptr, indices, group, int(group.max()) + 1)
    keys = np.random.default_rng(7).integers(1, 2**62, len(xadj) - 1)
    twin, count = symbolic.twins(xadj, adj, keys)
    xadj, adj, weight = symbolic.quotient(indptr, indices, twin[group], count)
    return xadj, adj, width * weight, np.repeat(twin[group], width)


def _node_groups(indptr: IndexArray, indices: IndexArray, n: int, coordinates: FloatArray | None) -> IndexArray:
    """Return a number for each row: rows of one node together, by their place, or by what makes the pattern no denser."""
    if coordinates is not None:
        new = np.concatenate([[True], (np.diff(coordinates, axis=0) != 0).any(axis=1)])
        return np.cumsum(new) - 1
    for width in (6, 3):
        if n % width == 0:
            group = np.arange(n) // width
            xadj, _, _ = symbolic.quotient(indptr, indices, group, n // width)
            if (xadj[-1] + n // width) * width**2 <= 1.7 * indptr[-1]:
                return group
    return np.arange(n)


def _places(xadj: IndexArray, adj: IndexArray, group: IndexArray, coordinates: FloatArray | None) -> FloatArray:
    """Return smooth functions of the vertices: coordinates, or distances from vertices that lie far from each other."""
    count = len(xadj) - 1
    if coordinates is not None:
        places = np.empty((count, coordinates.shape[1]))
        places[group] = coordinates
        return places
    far = [cuts.distances(xadj, adj, 0)]
    for _ in range(4):
        nearest = np.min(far[1:] or far, axis=0)
        far.append(cuts.distances(xadj, adj, int(np.argmax(nearest))))
    a = far[1:]
    return np.column_stack([*a, a[0] - a[1], a[0] + a[1] - a[2] - a[3], a[2] - a[3]])
