"""SweepTimes: for places in a part, the first piece of a path that sweeps each, and where between two places a move has cut.

What a column holds above the envelope of a move goes, as with dexels (`surface.cut_move`); here the places are given instead
of laid on a grid, so that elements of a mesh ask for material where they need it, at any stage of the path.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray, floats
from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.envelope import lowest
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.tool_shape import MillShape

_BIN_RATIO = 0.5  # of the smallest radius: side of the bins of places
_MAX_BINS = 4_000_000  # of a grid over all places


@dataclass(frozen=True, eq=False)
class SweepTimes:
    """Path that takes material away: pieces in their order, and the shapes of the tools that they name.

    >>> from toolpoint.material_removal import MillShape, split_moves
    >>> pieces = split_moves([[-0.01, 0.0, -0.002]], [[0.05, 0.0, -0.002]], step=0.02)
    >>> sweep = SweepTimes(pieces, (MillShape(0.01),))
    >>> sweep.first_pieces([[0.0, 0.0, -0.001], [0.045, 0.004, -0.001], [0.0, 0.0, -0.003]]).tolist()  # 3: never
    [0, 2, 3]
    """

    moves: Moves
    shapes: Sequence[MillShape]

    @property
    def count(self) -> int:
        """Number of pieces; also the time of a place that no piece sweeps."""
        return self.moves.count

    @cached_property
    def _arrays(self) -> tuple[FloatArray, FloatArray]:
        return np.ascontiguousarray(self.moves.rows), np.array([shape.array for shape in self.shapes])

    @cached_property
    def _joined(self) -> tuple[FloatArray, IndexArray]:
        rows, final = self.moves.joined()
        return np.ascontiguousarray(rows), np.asarray(final)

    @property
    def box(self) -> FloatArray:
        """Corners (2, 3) of a box that holds all swept places, m; without an upper end along z, as columns are cut open."""
        if not self.count:
            return np.array([[np.inf] * 3, [-np.inf] * 3])
        rows, shapes = self._arrays
        reach = shapes[rows[:, 12].astype(int), 4] + np.where(rows[:, 6] == 1, rows[:, 9] * (1 - np.cos(rows[:, 11] / 2)), 0.0)
        ends = np.minimum(rows[:, 0:3], rows[:, 3:6]), np.maximum(rows[:, 0:3], rows[:, 3:6])
        lower, upper = (ends[0][:, :2] - reach[:, None]).min(axis=0), (ends[1][:, :2] + reach[:, None]).max(axis=0)
        return np.array([[*lower, ends[0][:, 2].min()], [*upper, np.inf]])

    def first_pieces(self, places: FloatArray) -> IndexArray:
        """Return the first piece that sweeps each place (n, 3), m; `count` where none does."""
        points = np.ascontiguousarray(floats("places", places, (None, 3)))
        times = np.full(len(points), self.count, np.int64)
        if not len(points) or not self.count:
            return times
        rows, shapes = self._arrays
        lower, size = points[:, :2].min(axis=0), np.ptp(points[:, :2], axis=0)
        side = max(_BIN_RATIO * min(shape.radius for shape in self.shapes), float(np.sqrt(size.prod() / _MAX_BINS)), 1e-6)
        count = np.maximum((size / side).astype(int) + 1, 1)
        bins = np.minimum(((points[:, :2] - lower) / side).astype(int), count - 1)
        key = bins[:, 0] * count[1] + bins[:, 1]
        order = np.argsort(key, kind="stable")
        begins = np.searchsorted(key[order], np.arange(count.prod() + 1))
        # Sorted places lie together in memory; the highest of a bin tells whether a piece can reach any.
        sorted_times = times.copy()
        _sweep(rows, shapes, points[order], begins, (lower[0], lower[1], side, count[0], count[1]), sorted_times)
        times[order] = sorted_times
        return times

    def is_swept(self, places: FloatArray, owner: IndexArray, stage: int) -> np.ndarray:
        """Return whether the move of the piece `owner` (n,) of each place (n, 3), up to the stage, sweeps it.

        stage : number of pieces that have been cut, above every owner.
        """
        rows, final = self._joined
        result = np.zeros(len(owner), bool)
        _ask(rows, self._arrays[1], np.ascontiguousarray(places), np.minimum(final[owner], stage - 1), result)
        return result


@njit(cache=True, nogil=True, **BORROWS)
def _sweep(rows, shapes, places, begins, grid, times):
    """Write the first piece that sweeps each place; places are sorted by the bins of a grid (x0, y0, side, nx, ny)."""
    x0, y0, side, nx, ny = grid
    never = rows.shape[0]
    for k in range(never):
        row = rows[k]
        bulge = row[9] * (1.0 - math.cos(0.5 * row[11])) if row[6] == 1.0 else 0.0
        reach, tip = shapes[int(row[12]), 4] + bulge, min(row[2], row[5])
        i0 = max(math.floor((min(row[0], row[3]) - reach - x0) / side), 0)
        i1 = min(math.floor((max(row[0], row[3]) + reach - x0) / side), nx - 1)
        j0 = max(math.floor((min(row[1], row[4]) - reach - y0) / side), 0)
        j1 = min(math.floor((max(row[1], row[4]) + reach - y0) / side), ny - 1)
        if j1 < j0:
            continue
        for i in range(i0, i1 + 1):
            for n in range(begins[i * ny + j0], begins[i * ny + j1 + 1]):
                if times[n] == never and places[n, 2] >= tip and places[n, 2] >= lowest(
                        rows, shapes, k, places[n, 0], places[n, 1]):
                    times[n] = k


@njit(cache=True, nogil=True, **BORROWS)
def _ask(rows, shapes, places, move, result):
    """Write whether each place lies above the envelope of its move (a row of `joined`)."""
    for n in range(places.shape[0]):
        result[n] = places[n, 2] >= lowest(rows, shapes, move[n], places[n, 0], places[n, 1])

# Code of other modules in these kernels: 75e0e2e3fe0f
