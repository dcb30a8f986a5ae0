"""Compiled loops of the multifrontal factorisation and its solutions.

Each group of columns has a front: its width columns (kept as a part of L) and the contribution to what comes after, which waits
on a stack until the parent takes it. Source: Duff, Reid, ACM Trans. Math. Softw. 9 (1983); Liu, SIAM Review 34 (1992).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numba.extending import overload

from toolpoint._check import Array, FloatArray, IndexArray
from toolpoint.vibration.sparse.dense_calls import Scratch, cholesky, product, scratch, solve_triangle, square_update

# Compressed columns (pointers, rows, values) or blocks of node pairs (pointers, columns, entries, blocks).
StoredMatrix = tuple[Array, ...]

KEPT_BLOCK_COLUMNS = 64  # of the factor, stored from one diagonal down
_PIVOT_BLOCK_COLUMNS = 64  # eliminated by scalar loops before one product updates the others
_STRIP_COLUMNS = 256  # of a product that computes the lower triangle: little of the upper one is computed beside it


@njit(cache=True, nogil=True)
def factorise_groups(group_begin: int, group_end: int, stiffness: StoredMatrix, mass: StoredMatrix, shift: float,
                     plan: tuple[IndexArray, ...], work: tuple[FloatArray, IndexArray, IndexArray, FloatArray, FloatArray],
                     factor: FloatArray, diagonal: FloatArray, routines: IndexArray, positive: bool, tiny: float) -> int:
    """Factorise groups of columns of K + shift M = L D L^T (or L L^T, `positive`).

    Every group s has a front of `width` own columns and `below` rows: its own columns become those of L, the remaining block
    A_22 - L_21 D L_21^T is its contribution to the parent (Duff, Reid; Liu).

    Parameters
    ----------
    group_begin, group_end : int
        Groups group_begin .. group_end - 1; pieces in order, so that a keyboard interrupt is heard between them.
    stiffness, mass : tuples of arrays
        Compressed columns (pointers, rows int32, values float64) or blocks of node pairs (pointers, columns, entries int32,
        blocks (pairs, 3, 3) or (pairs,) float64).
    shift : float
    plan : tuple of int arrays
        order, place (n,), begins (groups + 1,), pointers (groups + 1,), rows, parent (groups,), starts (groups + 1,).
    work : tuple of arrays
        Kept between calls: stack float64 (contributions that wait), state int64 (its top, first child and next child of each
        group, place of its contribution), local (n,) int64, and memory for the largest front's columns and contribution,
        float64.
    factor : (starts[-1],) float64
        Each group's columns from its start; empty: they are not kept.
    diagonal : (n,) float64
        D, written; ones for a Cholesky factorisation.
    routines : (4,) int64
        Addresses of BLAS and LAPACK routines.
    positive : bool
    tiny : float
        Size of a pivot up to which it is refused.

    Returns
    -------
    int
        -1, or the first row (in elimination order) without a usable pivot.
    """
    order, place, begins, pointers, rows, parent, starts = plan
    stack, state, local, columns, square = work
    places = scratch()
    for s in range(group_begin, group_end):
        first, width, below = begins[s], begins[s + 1] - begins[s], pointers[s + 1] - pointers[s]
        front = width + below
        panel, contribution = columns[:width * front], square[:below * below]
        panel[:] = 0.0
        for j in range(below):
            # The lower triangle alone: nothing reads what is above it, and clearing it would touch twice the memory.
            contribution[j * below + j:(j + 1) * below] = 0.0
        for i in range(width):
            local[first + i] = i
        for i in range(below):
            local[rows[pointers[s] + i]] = width + i
        _gather(stiffness, 1.0, order, place, first, width, front, local, panel)
        if shift != 0.0:
            _gather(mass, shift, order, place, first, width, front, local, panel)
        _take_children(s, begins, pointers, rows, stack, state, local, width, front, below, panel, contribution)
        if positive:
            fault = _cholesky_front(panel, contribution, width, below, front, routines, places)
            diagonal[first:first + width] = 1.0
        else:
            fault = _indefinite_front(panel, contribution, width, below, front, diagonal[first:first + width], routines,
                                      places, tiny)
        if fault >= 0:
            return first + fault
        if factor.size:
            _store_columns(panel, width, front, factor[starts[s]:starts[s + 1]])
        _push(s, parent, below, contribution, stack, state)
    return -1


def _gather(matrix: StoredMatrix, scale: float, order: IndexArray, place: IndexArray, first: int, width: int, front: int,
            local: IndexArray, panel: FloatArray) -> None:
    """Add a group's columns of a matrix, from the diagonal down, to its panel."""


@overload(_gather)
def _gather_of(matrix: StoredMatrix, scale: float, order: IndexArray, place: IndexArray, first: int, width: int, front: int,
               local: IndexArray, panel: FloatArray) -> Callable[..., None]:
    """Choose the loop by how the matrix is stored: compressed columns (3 arrays), or blocks of node pairs (4)."""
    if len(matrix) == 3:
        return _columns_of
    return _blocks_of if matrix[3].ndim == 3 else _scalars_of


def _columns_of(matrix: StoredMatrix, scale: float, order: IndexArray, place: IndexArray, first: int, width: int, front: int,
                local: IndexArray, panel: FloatArray) -> None:
    """Add scale times compressed columns."""
    indptr, indices, data = matrix
    for j in range(width):
        column = order[first + j]
        for k in range(indptr[column], indptr[column + 1]):
            row = place[indices[k]]
            # Rows above the diagonal belong to columns that are eliminated already; their mirror images are there.
            if row >= first + j:
                panel[j * front + local[row]] += scale * data[k]


def _blocks_of(matrix: StoredMatrix, scale: float, order: IndexArray, place: IndexArray, first: int, width: int, front: int,
               local: IndexArray, panel: FloatArray) -> None:
    """Add scale times blocks of node pairs: the block of (i, j) is stored for i >= j, and transposed for its mirror image."""
    pointers, columns, entries, blocks = matrix
    for j in range(width):
        node, b = order[first + j] // 3, order[first + j] % 3
        for k in range(pointers[node], pointers[node + 1]):
            other, block = columns[k], blocks[entries[k]]
            for a in range(3):
                row = place[3 * other + a]
                if row >= first + j:
                    value = block[a, b] if other >= node else block[b, a]
                    panel[j * front + local[row]] += scale * value


def _scalars_of(matrix: StoredMatrix, scale: float, order: IndexArray, place: IndexArray, first: int, width: int, front: int,
                local: IndexArray, panel: FloatArray) -> None:
    """Add scale times numbers of node pairs, each times the unit matrix."""
    pointers, columns, entries, values = matrix
    for j in range(width):
        node, b = order[first + j] // 3, order[first + j] % 3
        for k in range(pointers[node], pointers[node + 1]):
            row = place[3 * columns[k] + b]
            if row >= first + j:
                panel[j * front + local[row]] += scale * values[entries[k]]


@njit(cache=True, nogil=True)
def _take_children(s: int, begins: IndexArray, pointers: IndexArray, rows: IndexArray, stack: FloatArray, state: IndexArray,
                   local: IndexArray, width: int, front: int, below: int, panel: FloatArray, contribution: FloatArray) -> None:
    """Add the contributions of the children, a linked list in `state`: 1 + s first child, 1 + n + s next, 1 + 2 n + s place."""
    count = begins.size - 1
    place = np.empty(front, np.int64)
    child = state[1 + s]
    while child >= 0:
        size = pointers[child + 1] - pointers[child]
        base = state[1 + 2 * count + child]
        for j in range(size):
            place[j] = local[rows[pointers[child] + j]]
        for j in range(size):
            column = place[j]
            if column < width:
                target = panel[column * front:(column + 1) * front]
                for i in range(j, size):
                    target[place[i]] += stack[base + i - j]
            else:
                target = contribution[(column - width) * below:(column - width + 1) * below]
                for i in range(j, size):
                    target[place[i] - width] += stack[base + i - j]
            base += size - j
        child = state[1 + count + child]


@njit(cache=True, nogil=True)
def _store_columns(panel: FloatArray, width: int, front: int, kept: FloatArray) -> None:
    """Store the columns of L, a block at a time from its diagonal down: only the small triangle above it is stored in vain."""
    position = 0
    for a in range(0, width, KEPT_BLOCK_COLUMNS):
        for j in range(a, min(a + KEPT_BLOCK_COLUMNS, width)):
            kept[position:position + front - a] = panel[j * front + a:(j + 1) * front]
            position += front - a


@njit(cache=True, nogil=True)
def _push(s: int, parent: IndexArray, below: int, contribution: FloatArray, stack: FloatArray, state: IndexArray) -> None:
    """Put the lower triangle of the contribution on the stack, over those of the children, which are used up."""
    count = parent.size
    base = state[0]
    child = state[1 + s]
    while child >= 0:
        # Children are eliminated just before their parent (postorder), so their contributions lie together at the top of
        # the stack.
        base = min(base, state[1 + 2 * count + child])
        child = state[1 + count + child]
    state[0] = base
    if parent[s] < 0:
        return
    state[1 + 2 * count + s] = base
    state[1 + count + s] = state[1 + parent[s]]
    state[1 + parent[s]] = s
    for j in range(below):
        stack[base:base + below - j] = contribution[j * below + j:(j + 1) * below]
        base += below - j
    state[0] = base


@njit(cache=True, nogil=True)
def _cholesky_front(panel: FloatArray, contribution: FloatArray, width: int, below: int, front: int, routines: IndexArray,
                    places: Scratch) -> int:
    """L_11 L_11^T = A_11, L_21 = A_21 L_11^-T, contribution -L_21 L_21^T; return -1, or the row of a pivot not above zero."""
    address = panel.ctypes.data
    fault = cholesky(routines, places, width, address, front)
    if fault:
        return fault - 1
    if below:
        solve_triangle(routines, places, True, True, False, below, width, address, front, address + 8 * width, front)
        square_update(routines, places, below, width, address + 8 * width, front, contribution.ctypes.data, below)
    return -1


@njit(cache=True, nogil=True)
def _indefinite_front(panel: FloatArray, contribution: FloatArray, width: int, below: int, front: int, diagonal: FloatArray,
                      routines: IndexArray, places: Scratch, tiny: float) -> int:
    """L D L^T of the width columns without exchanges, a block at a time; return -1, or the row of a pivot up to `tiny`."""
    address = panel.ctypes.data
    scaled = np.empty(_PIVOT_BLOCK_COLUMNS * front)
    for a in range(0, width, _PIVOT_BLOCK_COLUMNS):
        b = min(a + _PIVOT_BLOCK_COLUMNS, width)
        fault = _indefinite_block(panel, a, b, front, diagonal, tiny)
        if fault >= 0:
            return fault
        under = front - b
        if under == 0:
            continue
        block = address + 8 * (a * front + b)
        solve_triangle(routines, places, True, True, True, under, b - a, address + 8 * (a * front + a), front, block, front)
        for j in range(a, b):
            for i in range(b, front):
                scaled[(j - a) * under + i - b] = panel[j * front + i]
                panel[j * front + i] /= diagonal[j]
        for c in range(b, width, _STRIP_COLUMNS):
            d = min(c + _STRIP_COLUMNS, width)
            product(routines, places, (front - c, d - c, b - a), (False, True), (block + 8 * (c - b), front),
                    (scaled.ctypes.data + 8 * (c - b), under), (address + 8 * (c * front + c), front))
    _update_contribution(panel, contribution, width, below, front, diagonal, routines, places)
    return -1


@njit(cache=True, nogil=True)
def _update_contribution(panel: FloatArray, contribution: FloatArray, width: int, below: int, front: int, diagonal: FloatArray,
                         routines: IndexArray, places: Scratch) -> None:
    """Subtract L_21 D L_21^T from the contribution, strip by strip."""
    strip = np.empty(min(_STRIP_COLUMNS, max(below, 1)) * width)
    address, out = panel.ctypes.data, contribution.ctypes.data
    for c in range(0, below, _STRIP_COLUMNS):
        d = min(c + _STRIP_COLUMNS, below)
        for j in range(width):
            for i in range(c, d):
                strip[j * (d - c) + i - c] = panel[j * front + width + i] * diagonal[j]
        product(routines, places, (below - c, d - c, width), (False, True), (address + 8 * (width + c), front),
                (strip.ctypes.data, d - c), (out + 8 * (c * below + c), below))


@njit(cache=True, nogil=True)
def _indefinite_block(panel: FloatArray, a: int, b: int, front: int, diagonal: FloatArray, tiny: float) -> int:
    """L D L^T of columns a .. b - 1 within their diagonal block; return -1, or the row of a pivot up to `tiny`."""
    for j in range(a, b):
        pivot = panel[j * front + j]
        if abs(pivot) <= tiny:
            return j
        diagonal[j] = pivot
        panel[j * front + j] = 1.0
        for k in range(j + 1, b):
            factor = panel[j * front + k] / pivot
            for i in range(k, b):
                panel[k * front + i] -= factor * panel[j * front + i]
        for i in range(j + 1, b):
            panel[j * front + i] /= pivot
    return -1


@njit(cache=True, nogil=True)
def solve_groups(right: FloatArray, begins: IndexArray, pointers: IndexArray, rows: IndexArray, starts: IndexArray,
                 factor: FloatArray, diagonal: FloatArray, routines: IndexArray, positive: bool) -> int:
    """Solve L D L^T x = b in place, one right side a row: forward over the groups, D, and backward.

    right (k, n) float64, its columns in elimination order; the other arguments are those of `factorise_groups`. Returns the
    size of the work array.
    """
    places = scratch()
    k, n = right.shape
    count = begins.size - 1
    largest_front = 0
    for s in range(count):
        largest_front = max(largest_front, begins[s + 1] - begins[s] + pointers[s + 1] - pointers[s])
    work = np.empty(largest_front * k)
    for s in range(count):
        first, width, below = begins[s], begins[s + 1] - begins[s], pointers[s + 1] - pointers[s]
        front = width + below
        for c in range(k):
            work[c * front:c * front + width] = right[c, first:first + width]
            work[c * front + width:(c + 1) * front] = 0.0
        _forward(factor[starts[s]:starts[s + 1]], work, width, front, k, routines, places, positive)
        for c in range(k):
            right[c, first:first + width] = work[c * front:c * front + width]
            for i in range(below):
                right[c, rows[pointers[s] + i]] += work[c * front + width + i]
    if not positive:
        for c in range(k):
            for i in range(n):
                right[c, i] /= diagonal[i]
    for s in range(count - 1, -1, -1):
        first, width, below = begins[s], begins[s + 1] - begins[s], pointers[s + 1] - pointers[s]
        front = width + below
        for c in range(k):
            work[c * front:c * front + width] = right[c, first:first + width]
            for i in range(below):
                work[c * front + width + i] = right[c, rows[pointers[s] + i]]
        _backward(factor[starts[s]:starts[s + 1]], work, width, front, k, routines, places, positive)
        for c in range(k):
            right[c, first:first + width] = work[c * front:c * front + width]
    return work.size


@njit(cache=True, nogil=True)
def _forward(kept: FloatArray, work: FloatArray, width: int, front: int, k: int, routines: IndexArray, places: Scratch,
             positive: bool) -> None:
    """Solve L y = b over a front: its own rows by the triangle of each block, the rows below by a product."""
    x, start, position = work.ctypes.data, kept.ctypes.data, 0
    for a in range(0, width, KEPT_BLOCK_COLUMNS):
        b = min(a + KEPT_BLOCK_COLUMNS, width)
        height, block = front - a, start + 8 * position
        solve_triangle(routines, places, False, False, not positive, b - a, k, block, height, x + 8 * a, front)
        if b < front:
            product(routines, places, (front - b, k, b - a), (False, False), (block + 8 * (b - a), height), (x + 8 * a, front),
                    (x + 8 * b, front))
        position += height * (b - a)


@njit(cache=True, nogil=True)
def _backward(kept: FloatArray, work: FloatArray, width: int, front: int, k: int, routines: IndexArray, places: Scratch,
              positive: bool) -> None:
    """Solve L^T x = y over a front, blocks from the last to the first."""
    x, start, position = work.ctypes.data, kept.ctypes.data, kept.size
    for a in range((width - 1) // KEPT_BLOCK_COLUMNS * KEPT_BLOCK_COLUMNS, -1, -KEPT_BLOCK_COLUMNS):
        b = min(a + KEPT_BLOCK_COLUMNS, width)
        height = front - a
        position -= height * (b - a)
        block = start + 8 * position
        if b < front:
            product(routines, places, (b - a, k, front - b), (True, False), (block + 8 * (b - a), height), (x + 8 * b, front),
                    (x + 8 * a, front))
        solve_triangle(routines, places, False, True, not positive, b - a, k, block, height, x + 8 * a, front)

# Code of other modules in these kernels: 232c706a8bf6
