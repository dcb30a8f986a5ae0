"""Compiled surface of the work while it is cut: dexels with the move that cut them last, and the exact surface between them.

A dexel keeps the height (m) of the remaining material, the piece of a move that cut it last (its owner; -1 uncut), the owner
before that, and two that came as deep. Between dexels the surface is the lowest envelope of the owners around, each with its
whole move up to the present piece (`joined`): walls and cusps lie where the moves put them, not at the lines of the grid, and
not where one piece ends. A sliver narrower than the spacing, which owns no dexel nearby, is missed: the difference of an arc
between two spacings shows it.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.envelope import ball_side, lowest

_LATTICE_SIZE, _LATTICE_STEP = 89, 55  # points of the Fibonacci lattice in a cell at a wall, and its step: an edge along the
# grid is placed within 1/89 of the cell

OWNER_LAYERS = 4  # moves that are kept of a dexel, see `Work`
_EDGE_BEND = 0.02  # of the spacing: ends of a stock's dexels in a row that bend more are those of an edge
_WALL_BEND = 0.2  # of the spacing: heights of three dexels in a row that bend more are those of a wall


class Work(NamedTuple):
    """Arrays of the work in a form that kernels read: grid, heights and owners, moves, shapes, stock.

    x0, y0 : centre of the first dexel, m; spacing : m; height : (nx, ny) of the remaining material, m; owner, earlier_owner :
    (nx, ny) the piece that cut a dexel last and the owner before it, -1 where none; equal_owner, earlier_equal :
    (nx, ny) the last piece of another move that came down just as deep as the owner, and the one before it, -1 where none;
    intervals : (nx, ny, n, 2) of the stock, m; moves : (pieces, 13) rows of `envelope`;
    joined : the same from the beginning of each piece's move to the piece's end;
    final : (pieces,) last piece of each piece's move; now : (2,) the piece that was cut last, and whether any dexel has
    an equal owner; shapes : (tools, 5) rows of
    `SHAPE_COLUMNS`; kind, lower, upper : of the stock, see `Stock`.
    """

    x0: float
    y0: float
    spacing: float
    height: np.ndarray
    owner: np.ndarray
    earlier_owner: np.ndarray
    equal_owner: np.ndarray
    earlier_equal: np.ndarray
    intervals: np.ndarray
    moves: np.ndarray
    joined: np.ndarray
    final: np.ndarray
    now: np.ndarray
    shapes: np.ndarray
    kind: int
    lower: np.ndarray
    upper: np.ndarray


@njit(cache=True, nogil=True, **BORROWS)
def begin_heights(intervals, height):
    """Write the upper end of the stock in every column, m; minus infinity where there is no stock."""
    for i in range(height.shape[0]):
        for j in range(height.shape[1]):
            upper_end = -math.inf
            for n in range(intervals.shape[2]):
                if intervals[i, j, n, 1] > upper_end:
                    upper_end = intervals[i, j, n, 1]
            height[i, j] = upper_end


@njit(cache=True, nogil=True, **BORROWS)
def stock_has(work, x, y, z):
    """Whether a place (m) lies inside the stock before the first cut."""
    if z > work.upper[2] or z < work.lower[2]:
        return False
    if work.kind == 0:
        return work.lower[0] <= x <= work.upper[0] and work.lower[1] <= y <= work.upper[1]
    if work.kind == 1:
        radius = 0.5 * (work.upper[0] - work.lower[0])
        dx, dy = x - 0.5 * (work.lower[0] + work.upper[0]), y - 0.5 * (work.lower[1] + work.upper[1])
        return dx * dx + dy * dy <= radius * radius
    fx, fy = (x - work.x0) / work.spacing, (y - work.y0) / work.spacing
    i, j = math.floor(fx + 0.5), math.floor(fy + 0.5)
    if i < 0 or j < 0 or i >= work.intervals.shape[0] or j >= work.intervals.shape[1]:
        return False
    for n in range(work.intervals.shape[2]):
        if math.isnan(work.intervals[i, j, n, 0]):
            continue
        if _end_between(work, fx, fy, n, 0) <= z <= _end_between(work, fx, fy, n, 1):
            return True
    return False


@njit(cache=True, nogil=True, **BORROWS)
def _end_between(work, fx, fy, n, end):
    """Return an end of a mesh's interval between four dexels: bilinear where all have it, else the nearest one's; beside an
    edge of the mesh where the faces on both sides meet."""
    i, j = math.floor(fx), math.floor(fy)
    near_i, near_j = math.floor(fx + 0.5), math.floor(fy + 0.5)
    nearest_end = work.intervals[near_i, near_j, n, end]
    if i < 0 or j < 0 or i + 1 >= work.intervals.shape[0] or j + 1 >= work.intervals.shape[1]:
        return nearest_end
    u, v = fx - i, fy - j
    a, b = work.intervals[i, j, n, end], work.intervals[i + 1, j, n, end]
    c, d = work.intervals[i, j + 1, n, end], work.intervals[i + 1, j + 1, n, end]
    value = (1 - u) * (1 - v) * a + u * (1 - v) * b + (1 - u) * v * c + u * v * d
    if math.isnan(value):
        return nearest_end
    if i < 1 or j < 1 or i + 2 >= work.intervals.shape[0] or j + 2 >= work.intervals.shape[1]:
        return value
    ends, limit = work.intervals[:, :, n, end], _WALL_BEND * work.spacing
    along_x = (1 - v) * _past_edge(ends[i - 1, j], a, b, ends[i + 2, j], u, limit) + v * _past_edge(
        ends[i - 1, j + 1], c, d, ends[i + 2, j + 1], u, limit)
    along_y = (1 - u) * _past_edge(ends[i, j - 1], a, c, ends[i, j + 2], v, limit) + u * _past_edge(
        ends[i + 1, j - 1], b, d, ends[i + 1, j + 2], v, limit)
    return along_x if abs(along_x - value) > abs(along_y - value) else along_y


@njit(cache=True, nogil=True, inline="always")
def _past_edge(left_end, first, second, right_end, share, limit):
    """Return the height (m) at a share between two dexels; where these make an edge by the lines of those on either side.

    limit : bend (m) from which on it is an edge; a smooth face stays linear.
    """
    linear = (1 - share) * first + share * second
    left, right = first + share * (first - left_end), second - (1 - share) * (right_end - second)
    if math.isnan(left) or math.isnan(right):
        return linear
    bend_left, bend_right = left_end - 2 * first + second, first - 2 * second + right_end
    if (abs(bend_left) < limit and abs(bend_right) < limit) or bend_left * bend_right < 0:
        return linear
    # The lines cross between the dexels: over a ridge the lower of them counts, in a valley the higher one.
    if bend_left + bend_right < 0:
        return max(min(left, right), linear)
    return min(max(left, right), linear)


@njit(cache=True, nogil=True, **BORROWS)
def cut_height(work, x, y):
    """Return the height (m) down to which the owners around a place have cut there; infinite where none has."""
    i = math.floor((x - work.x0) / work.spacing)
    j = math.floor((y - work.y0) / work.spacing)
    nx, ny = work.owner.shape
    i0, i1 = min(max(i, 0), nx - 1), min(max(i + 1, 0), nx - 1)
    j0, j1 = min(max(j, 0), ny - 1), min(max(j + 1, 0), ny - 1)
    height_min = math.inf
    for m in (i0, i1):
        for n in (j0, j1):
            for layer in range(OWNER_LAYERS if work.now[1] else 2):
                k = move_of(work, layer, m, n) if layer < 2 else equal_of(work, layer - 2, m, n)
                if k >= 0:
                    height_min = min(height_min, lowest(work.joined, work.shapes, k, x, y))
    return height_min


@njit(cache=True, nogil=True, inline="always")
def move_of(work, layer, i, j):
    """Return the row of `joined` of the move that cut a dexel last (layer 1: of its earlier owner) up to the present piece; -1
    where none has."""
    k = work.owner[i, j] if layer == 0 else work.earlier_owner[i, j]
    return k if k < 0 else min(work.final[k], work.now[0])


@njit(cache=True, nogil=True, inline="always")
def equal_of(work, layer, i, j):
    """Return the row of `joined` of the last move that came down just as deep as the owner (layer 1: the one before it)."""
    k = work.equal_owner[i, j] if layer == 0 else work.earlier_equal[i, j]
    return k if k < 0 else min(work.final[k], work.now[0])


@njit(cache=True, nogil=True, inline="always")
def _passes_below(work, k, x, y, z):
    """Whether a move, up to the present piece, has cut a place (m)."""
    side = ball_side(work.joined[k], work.shapes[int(work.joined[k, 12])], x, y, z)
    return side < 0 or (side == 0 and lowest(work.joined, work.shapes, k, x, y) <= z)


@njit(cache=True, nogil=True, **BORROWS)
def has_material(work, x, y, z, margin):
    """Whether there is material at a place (m) now: that of `cut_height`, which ends at the first owner that has cut below it.

    margin : further dexels on each side whose owners are asked; 0 suffices except where three moves meet.
    """
    if not stock_has(work, x, y, z):
        return False
    i = math.floor((x - work.x0) / work.spacing)
    j = math.floor((y - work.y0) / work.spacing)
    nx, ny = work.owner.shape
    first_i, last_i = min(max(i - margin, 0), nx - 1), min(max(i + 1 + margin, 0), nx - 1)
    first_j, last_j = min(max(j - margin, 0), ny - 1), min(max(j + 1 + margin, 0), ny - 1)
    previous = -1
    for layer in range(2):
        for m in range(first_i, last_i + 1):
            for n in range(first_j, last_j + 1):
                k = move_of(work, layer, m, n)
                if k >= 0 and k != previous:
                    if _passes_below(work, k, x, y, z):
                        return False
                    previous = k
    if not work.now[1]:
        return True
    for layer in range(2):
        for m in range(first_i, last_i + 1):
            for n in range(first_j, last_j + 1):
                k = equal_of(work, layer, m, n)
                if k >= 0 and _passes_below(work, k, x, y, z):
                    return False
    return True


@njit(cache=True, nogil=True, **BORROWS)
def column(work, i, j, height, cut_to):
    """Return the length (m) of material of a dexel between `cut_to` and `height`."""
    length = 0.0
    for n in range(work.intervals.shape[2]):
        lower_end, upper_end = work.intervals[i, j, n, 0], work.intervals[i, j, n, 1]
        if upper_end > lower_end:  # false for the not-a-number of a missing one
            length += max(min(upper_end, height) - max(lower_end, cut_to), 0.0)
    return length


@njit(cache=True, nogil=True, **BORROWS)
def box_of(work, k, radius, box):
    """Write the range of dexels (first and last index along x, then along y) that piece k with a tool radius (m) can reach."""
    row = work.moves[k]
    bulge = row[9] * (1.0 - math.cos(0.5 * row[11])) if row[6] == 1.0 else 0.0
    reach = radius + bulge
    nx, ny = work.height.shape
    box[0] = max(math.ceil((min(row[0], row[3]) - reach - work.x0) / work.spacing), 0)
    box[1] = min(math.floor((max(row[0], row[3]) + reach - work.x0) / work.spacing), nx - 1)
    box[2] = max(math.ceil((min(row[1], row[4]) - reach - work.y0) / work.spacing), 0)
    box[3] = min(math.floor((max(row[1], row[4]) + reach - work.y0) / work.spacing), ny - 1)


@njit(cache=True, nogil=True, inline="always")
def _keep_equal(work, k, i, j):
    """Keep a piece that comes down to the height of a dexel's owner: where two passes cross, each has walls of its own."""
    owner, equal = work.owner[i, j], work.equal_owner[i, j]
    if owner < 0 or work.final[owner] == work.final[k]:
        return
    if equal >= 0 and work.final[equal] != work.final[k]:
        work.earlier_equal[i, j] = equal
    work.equal_owner[i, j], work.now[1] = k, 1


@njit(cache=True, nogil=True, **BORROWS)
def cut_move(work, k, box, place):
    """Remove the material that piece k sweeps; return the volume (m^3) and whether any column beneath rises above its lowest
    point.

    box : (4,) room for `box_of`; place : (4,) written: depth of the deepest cut below the surface that was there, and its x, y,
    z, m.
    """
    row, shape = work.moves[k], work.shapes[int(work.moves[k, 12])]
    work.now[0] = k
    box_of(work, k, shape[4] + work.spacing, box)  # a cut thinner than the grid owns no dexel, but has an arc
    tip, length, is_near = min(row[2], row[5]), 0.0, False
    place[0] = 0.0
    for i in range(box[0], box[1] + 1):
        x = work.x0 + i * work.spacing
        for j in range(box[2], box[3] + 1):
            height_before = work.height[i, j]
            if height_before < tip or (height_before == tip and work.owner[i, j] < 0):
                continue
            is_near |= height_before > tip
            y = work.y0 + j * work.spacing
            if ball_side(row, shape, x, y, height_before) > 0:
                continue
            z = lowest(work.moves, work.shapes, k, x, y)
            if z == height_before:
                _keep_equal(work, k, i, j)
            if z < height_before:
                if height_before - z > place[0]:
                    place[0], place[1], place[2], place[3] = height_before - z, x, y, z
                length += column(work, i, j, height_before, z)
                owner = work.owner[i, j]
                if owner >= 0 and work.final[owner] != work.final[k]:
                    work.earlier_owner[i, j] = owner  # a pass above on the same line keeps its walls
                work.height[i, j], work.owner[i, j] = z, k
    return length * work.spacing * work.spacing, is_near


@njit(cache=True, nogil=True)
def measure_volumes(work):
    """Return the removed and the remaining volume, m^3: cells with walls are sampled finer on the exact envelopes."""
    nx, ny = work.height.shape
    removed, left = 0.0, 0.0
    for i in range(-1, nx + 1):
        for j in range(-1, ny + 1):
            if not _is_mixed(work, i, j):
                taken, kept = _plain_cell(work, i, j)
            elif work.kind == 2:
                continue  # those of a mesh are measured by its own lines, see `measure_lines`
            else:
                taken, kept = _cell(work, i, j)
            removed += taken
            left += kept
    return removed * work.spacing * work.spacing, left * work.spacing * work.spacing


@njit(cache=True, nogil=True)
def list_mixed_cells(work):
    """Return the cells (n, 2) through which a wall or an edge of the stock may pass."""
    cells = []
    for i in range(-1, work.height.shape[0] + 1):
        for j in range(-1, work.height.shape[1] + 1):
            if _is_mixed(work, i, j):
                cells.append((i, j))
    return np.array(cells, np.int64) if len(cells) else np.zeros((0, 2), np.int64)


@njit(cache=True, nogil=True, **BORROWS)
def measure_lines(work, x, y, intervals):
    """Return the removed and the remaining length (m) on upright lines at x and y (n,), whose stock has the intervals (n, m,
    2)."""
    taken, kept = 0.0, 0.0
    for n in range(x.size):
        z = cut_height(work, x[n], y[n])
        for k in range(intervals.shape[1]):
            lower_end, upper_end = intervals[n, k, 0], intervals[n, k, 1]
            if upper_end > lower_end:  # false for the not-a-number of a missing one
                taken += max(upper_end - max(lower_end, z), 0.0)
                kept += max(min(upper_end, z) - lower_end, 0.0)
    return taken, kept


@njit(cache=True, nogil=True, **BORROWS)
def _plain_cell(work, i, j):
    """Return the removed and the remaining length (m) of a cell without walls: those of its dexel."""
    if i < 0 or j < 0 or i >= work.height.shape[0] or j >= work.height.shape[1]:
        return 0.0, 0.0
    z = work.height[i, j]
    return column(work, i, j, math.inf, z) if work.owner[i, j] >= 0 else 0.0, column(work, i, j, z, -math.inf)


@njit(cache=True, nogil=True, **BORROWS)
def _is_mixed(work, i, j):
    """Whether a wall or an edge of the stock may pass through a cell: the heights around it are not those of a smooth face."""
    nx, ny = work.height.shape
    edges = 0
    for m in range(i - 1, i + 2):
        for n in range(j - 1, j + 2):
            inside = 0 <= m < nx and 0 <= n < ny
            edges += 1 if not inside or work.height[m, n] == -math.inf else 0
    if edges == 9:
        return False
    if edges > 0:
        return True
    for m, n in ((1, 0), (0, 1), (1, 1), (1, -1)):
        bend = work.height[i + m, j + n] - 2.0 * work.height[i, j] + work.height[i - m, j - n]
        if abs(bend) > _WALL_BEND * work.spacing:
            return True
    return work.kind == 2 and _stock_bends(work, i, j)


@njit(cache=True, nogil=True, **BORROWS)
def _stock_bends(work, i, j):
    """Whether an edge of a mesh passes through a cell: its ends there are not in line with those around."""
    for n in range(work.intervals.shape[2]):
        for end in range(2):
            stock_end = work.intervals[i, j, n, end]
            for m, k in ((1, 0), (0, 1)):
                bend = work.intervals[i + m, j + k, n, end] - 2.0 * stock_end + work.intervals[i - m, j - k, n, end]
                gaps = math.isnan(work.intervals[i + m, j + k, n, end]) + math.isnan(work.intervals[i - m, j - k, n, end])
                if gaps != 2 * math.isnan(stock_end) or abs(bend) > _EDGE_BEND * work.spacing:
                    return True
    return False


@njit(cache=True, nogil=True, **BORROWS)
def _cell(work, i, j):
    """Return the mean removed and remaining length (m) of a cell, over a lattice of lines through it."""
    taken, kept = 0.0, 0.0
    lower, upper = work.lower, work.upper
    for n in range(_LATTICE_SIZE):
        x = work.x0 + (i - 0.5 + (n + 0.5) / _LATTICE_SIZE) * work.spacing
        y = work.y0 + (j - 0.5 + ((n * _LATTICE_STEP) % _LATTICE_SIZE + 0.5) / _LATTICE_SIZE) * work.spacing
        z = cut_height(work, x, y)
        if stock_has(work, x, y, lower[2]):
            taken += max(upper[2] - max(z, lower[2]), 0.0)
            kept += max(min(upper[2], z) - lower[2], 0.0)
    return taken / _LATTICE_SIZE, kept / _LATTICE_SIZE

# Code of other modules in these kernels: 75e0e2e3fe0f
