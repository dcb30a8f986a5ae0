"""EliminationPlan: the order in which rows of one pattern are eliminated, and the layout of their factors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vibration.sparse import kernels, symbolic
from toolpoint.vibration.sparse.node_matrix import ROWS_PER_NODE, NodeMatrix, SymmetricMatrix
from toolpoint.vibration.sparse.ordering import cuts, dissection

_MAX_LEAF_SIZE = 60  # vertices of a part that is ordered by minimum degree, not dissected
_PIECE_SIZE = 2_000_000  # numbers of a factor that are computed between two checks for a keyboard interrupt


class EliminationPlan:
    """Order of elimination for all matrices of a pattern; rows that share a place (`coordinates`) are ordered together."""

    def __init__(self, pattern: SymmetricMatrix, coordinates: FloatArray | None = None) -> None:
        xadj, adj, weight, group = _graph(pattern, coordinates)
        places = _places(xadj, adj, group, coordinates)
        self.name = "nested dissection by place" if coordinates is not None else "nested dissection by graph"
        order = dissection.dissect(xadj, adj, weight, places, _MAX_LEAF_SIZE)
        parent = symbolic.elimination_tree(xadj, adj, order)
        # The tree of the new order is that of the old one, renumbered; the sizes decide which child comes last, which keeps
        # the stack small.
        order = order[symbolic.postorder(parent, symbolic.column_weights(xadj, adj, order, parent, weight))]
        parent = symbolic.elimination_tree(xadj, adj, order)
        rows = symbolic.column_weights(xadj, adj, order, parent, weight)
        self._lay_out(xadj, adj, weight, group, order, symbolic.supernodes(parent, rows, weight[order]))

    def _lay_out(self, xadj: IndexArray, adj: IndexArray, weight: IndexArray, group: IndexArray, order: IndexArray,
                 starts: IndexArray) -> None:
        """Set order and places of the rows, the rows below each group of columns, and where its factor begins."""
        pointers, rows, parent = symbolic.structure(xadj, adj, order, starts)
        self.begins, self.pointers, self.rows = symbolic.expand_rows(pointers, rows, order, weight, starts)
        self.parent = parent
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        self.order = np.argsort(place[group], kind="stable").astype(np.int32)
        self.place = np.empty_like(self.order)
        self.place[self.order] = np.arange(len(group), dtype=np.int32)
        self.starts = symbolic.factor_starts(self.begins, self.pointers, kernels.KEPT_BLOCK_COLUMNS)

    @property
    def arrays(self) -> tuple[IndexArray, ...]:
        """Arrays for the compiled loops: order, place, begins, pointers, rows, parent, starts (see `kernels`)."""
        return self.order, self.place, self.begins, self.pointers, self.rows, self.parent, self.starts

    @property
    def factor_size(self) -> int:
        """Numbers that the factors hold."""
        return int(self.starts[-1])

    def workspace(self) -> tuple[FloatArray, IndexArray, IndexArray, FloatArray, FloatArray]:
        """Return the memory of a factorisation: stack of contributions, its state, places in a front, and the largest front."""
        stack, columns, square = symbolic.room_needed(self.begins, self.pointers, self.parent)
        state = np.full(1 + 3 * len(self.parent), -1, dtype=np.int64)
        state[0] = 0
        return np.empty(stack), state, np.empty(len(self.order), dtype=np.int64), np.empty(columns), np.empty(square)

    def pieces(self) -> list[tuple[int, int]]:
        """Return ranges of groups, cut so that a keyboard interrupt is heard between them."""
        ends = np.searchsorted(self.starts, np.arange(_PIECE_SIZE, self.factor_size, _PIECE_SIZE))
        ends = np.unique(np.concatenate([[0], ends, [len(self.parent)]]))
        return [(int(a), int(b)) for a, b in pairwise(ends)]


def _graph(pattern: SymmetricMatrix, coordinates: FloatArray | None) -> tuple[IndexArray, IndexArray, IndexArray, IndexArray]:
    """Return pointers, neighbours and rows of vertices (nodes with the same neighbours are one), and each row's vertex."""
    if isinstance(pattern, NodeMatrix):
        indptr, indices = pattern.pattern.pointers, pattern.pattern.columns
        group: IndexArray = np.arange(pattern.pattern.node_count)
        width = ROWS_PER_NODE
    else:
        indptr, indices, width = pattern.indptr, pattern.indices, 1
        group = _node_groups(indptr, indices, pattern.shape[0], coordinates)
    xadj, adj, _ = symbolic.quotient(indptr, indices, group, int(group.max()) + 1)
    # Vertices with equal closed neighbourhoods have equal sums of random keys; a wrong match has a chance of about 2^-62.
    keys = np.random.default_rng(7).integers(1, 2**62, len(xadj) - 1)
    twin, count = symbolic.twins(xadj, adj, keys)
    xadj, adj, weight = symbolic.quotient(indptr, indices, twin[group], count)
    return xadj, adj, width * weight, np.repeat(twin[group], width)


def _node_groups(indptr: IndexArray, indices: IndexArray, n: int, coordinates: FloatArray | None) -> IndexArray:
    """Return a number for each row: rows of one node together, by their place, or by what makes the pattern no denser."""
    if coordinates is not None:
        is_first_row = np.concatenate([[True], (np.diff(coordinates, axis=0) != 0).any(axis=1)])
        return np.cumsum(is_first_row) - 1
    # Without coordinates a node's rows are guessed: 6 or 3 of one node, if filling its blocks adds few entries to the pattern.
    for width in (6, 3):
        if n % width == 0:
            group = np.arange(n) // width
            xadj, _, _ = symbolic.quotient(indptr, indices, group, n // width)
            # Grouped, all entries of a node's blocks count as stored: worth it as long as most of them are.
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
    distances = [cuts.distances(xadj, adj, 0)]
    for _ in range(4):
        to_nearest = np.min(distances[1:] or distances, axis=0)
        distances.append(cuts.distances(xadj, adj, int(np.argmax(to_nearest))))
    lengths = distances[1:]
    return np.column_stack([*lengths, lengths[0] - lengths[1], lengths[0] + lengths[1] - lengths[2] - lengths[3],
                            lengths[2] - lengths[3]])
