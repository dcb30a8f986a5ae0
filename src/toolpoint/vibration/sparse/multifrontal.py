"""Our own supernodal multifrontal factorisation: nested dissection, Cholesky where the matrix is positive, else L D L^T."""

from __future__ import annotations

import zlib
from itertools import pairwise
from typing import NoReturn

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint.vibration.sparse import cuts, dense_calls, dissection, kernels, symbolic

# Below this many vertices a part is ordered by minimum degree.
_LEAF = 60
# Of the largest entry: a pivot this small means that the matrix, or a leading part of it, has no inverse.
_TINY = 1e-15
# Numbers of a factor between two looks at the keyboard.
_CHUNK = 2_000_000


class Multifrontal:
    """Factors of a symmetric matrix; rows that share a place (`coordinates`) are ordered together."""

    def __init__(self, matrix: csc_array, coordinates: FloatArray | None = None, is_positive: bool = True) -> None:
        self._routines = dense_calls.addresses()
        self._plan(matrix, coordinates)
        self._planned = self._pattern(matrix)
        self.is_positive = is_positive and bool((matrix.diagonal() > 0).all())
        self._factorise(matrix)
        self.negative_pivots = int((self._diagonal < 0).sum())
        self.name = f"multifrontal {'Cholesky' if self.is_positive else 'L D L^T'} ({self._ordering})"

    def count_negative(self, matrix: csc_array) -> int | None:
        """Return the negative pivots of another matrix, in the order planned here; None where its pattern is another."""
        if self._pattern(matrix) != self._planned:
            return None
        diagonal, widest = np.ones(matrix.shape[0]), max(int(self._starts[b] - self._starts[a]) for a, b in self._pieces())
        row = self._run(matrix, False, np.empty(widest), diagonal)
        if row >= 0:
            self._refuse(row)
        return int((diagonal < 0).sum())

    @staticmethod
    def _pattern(matrix: csc_array) -> tuple[int, int, int]:
        return matrix.nnz, zlib.crc32(memoryview(matrix.indptr)), zlib.crc32(memoryview(matrix.indices))

    def _plan(self, matrix: csc_array, coordinates: FloatArray | None) -> None:
        n = matrix.shape[0]
        indptr, indices = matrix.indptr.astype(np.int64), matrix.indices
        group = _node_groups(indptr, indices, n, coordinates)
        xadj, adj, _ = symbolic.quotient(indptr, indices, group, int(group.max()) + 1)
        keys = np.random.default_rng(7).integers(1, 2**62, len(xadj) - 1)
        twin, count = symbolic.twins(xadj, adj, keys)
        group = twin[group]
        xadj, adj, weight = symbolic.quotient(indptr, indices, group, count)
        places = _places(xadj, adj, group, coordinates)
        self._ordering = "nested dissection by place" if coordinates is not None else "nested dissection by graph"
        order = dissection.dissect(xadj, adj, weight, places, _LEAF)
        parent = symbolic.elimination_tree(xadj, adj, order)
        order = order[symbolic.postorder(parent, symbolic.column_weights(xadj, adj, order, parent, weight))]
        parent = symbolic.elimination_tree(xadj, adj, order)
        rows = symbolic.column_weights(xadj, adj, order, parent, weight)
        self._lay_out(xadj, adj, weight, group, order, symbolic.supernodes(parent, rows, weight[order]))

    def _lay_out(self, xadj: IndexArray, adj: IndexArray, weight: IndexArray, group: IndexArray, order: IndexArray,
                 starts: IndexArray) -> None:
        pointers, rows, parent = symbolic.structure(xadj, adj, order, starts)
        self._begins, self._pointers, self._rows = symbolic.expand_rows(pointers, rows, order, weight, starts)
        self._parent = parent
        place = np.empty(len(order), dtype=np.int64)
        place[order] = np.arange(len(order))
        self._order = np.argsort(place[group], kind="stable")
        self._place = np.empty_like(self._order)
        self._place[self._order] = np.arange(len(group))
        wide, below = np.diff(self._begins), np.diff(self._pointers)
        self._starts = np.concatenate([[0], np.cumsum(wide * (wide + below))])

    def _factorise(self, matrix: csc_array) -> None:
        self._factor, self._diagonal = np.empty(self._starts[-1]), np.ones(matrix.shape[0])
        if self.is_positive and self._run(matrix, True, self._factor, self._diagonal) < 0:
            return
        self._diagonal[:] = 1.0
        self.is_positive = False
        row = self._run(matrix, False, self._factor, self._diagonal)
        if row >= 0:
            self._refuse(row)

    def _refuse(self, row: int) -> NoReturn:
        fail("matrix", f"no usable pivot in row {int(self._order[row])}", "must have an inverse, as its leading parts must",
             "hold the body, or shift a free body's stiffness: K + s M with s above zero; move a shift off an eigenvalue")

    def _run(self, matrix: csc_array, positive: bool, factor: FloatArray, diagonal: FloatArray) -> int:
        """Factorise into `factor`; one that holds less than all is written over by every piece."""
        count, n = len(self._parent), matrix.shape[0]
        is_whole = len(factor) >= self._starts[-1]
        stack = np.empty(symbolic.stack_size(self._begins, self._pointers, self._parent))
        state = np.full(1 + 3 * count, -1, dtype=np.int64)
        state[0] = 0
        local = np.empty(n, dtype=np.int64)
        tiny = _TINY * float(np.abs(matrix.data).max())
        for low, high in self._pieces():
            row = kernels.factorise_groups(
                low, high, matrix.indptr, matrix.indices, matrix.data, self._order, self._place, self._begins, self._pointers,
                self._rows, self._parent, self._starts - (0 if is_whole else self._starts[low]), factor, diagonal, stack, state,
                local, self._routines, positive, tiny)
            if row >= 0:
                return int(row)
        return -1

    def _pieces(self) -> list[tuple[int, int]]:
        """Cut the groups so that a keyboard interrupt is heard between pieces."""
        ends = np.searchsorted(self._starts, np.arange(_CHUNK, self._starts[-1], _CHUNK))
        ends = np.unique(np.concatenate([[0], ends, [len(self._parent)]]))
        return [(int(a), int(b)) for a, b in pairwise(ends)]

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution for one right side (n,) or several (n, k)."""
        block = np.ascontiguousarray(np.atleast_2d(right.T)[:, self._order])
        kernels.solve_groups(block, self._begins, self._pointers, self._rows, self._starts, self._factor, self._diagonal,
                             self._routines, self.is_positive)
        result = np.empty_like(block)
        result[:, self._order] = block
        return result[0] if right.ndim == 1 else result.T


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
