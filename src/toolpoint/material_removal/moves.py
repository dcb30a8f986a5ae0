"""Moves: a program's lines and arcs as short pieces, each a row that the kernels read, with its directions at both ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive

MOVE_WIDTH = 13  # numbers of a row; their meaning is listed in `envelope`
_MAX_ARC_SWEEP = 0.5  # rad, of one piece
_CHORD_TOLERANCE = 1e-6  # m, of arcs that are not in XY
MAX_PIECES = 20_000_000  # of a path: 2 GB of rows


@dataclass(frozen=True, eq=False)
class Moves:
    """Pieces of a path.

    rows : (n, 13) m and rad, see `envelope`; block : (n,) index of the segment that each is of; first, last : (n, 3) unit
    directions of feed at its ends; rapid : (n,) bools; length : (n,) m.

    >>> moves = split_moves([[0, 0, 0.0]], [[0.01, 0, 0.0]], step=0.004)
    >>> moves.first.tolist()[0], moves.block.tolist()  # three pieces of one segment, fed along x
    ([1.0, 0.0, 0.0], [0, 0, 0])
    """

    rows: FloatArray
    block: np.ndarray
    first: FloatArray
    last: FloatArray
    rapid: np.ndarray
    length: FloatArray

    @property
    def count(self) -> int:
        """Number of pieces."""
        return int(self.block.size)

    def joined(self) -> tuple[FloatArray, np.ndarray]:
        """Return rows from the beginning of each piece's segment to the piece's end, and the last piece of its segment.

        A helical arc, and an arc out of XY, stay in pieces: their envelope is known piece by piece only.
        """
        rows = self.rows.copy()
        continues = (self.block[1:] == self.block[:-1]) & (self.rows[1:, 6] == self.rows[:-1, 6])
        level = (self.rows[:, 2] == self.rows[:, 5]) | (self.rows[:, 6] == 0)
        continues &= level[1:] & level[:-1] & (np.einsum("ni,ni->n", self.first[1:], self.first[:-1]) > 1 - 1e-12) | (
            continues & level[1:] & (self.rows[1:, 6] == 1))
        begin = np.maximum.accumulate(np.where(np.concatenate([[True], ~continues]), np.arange(self.count), 0))
        ends = np.flatnonzero(np.concatenate([~continues, [True]]))
        rows[:, 0:3], rows[:, 10] = self.rows[begin, 0:3], self.rows[begin, 10]
        rows[:, 11] = self.rows[:, 11] * (np.arange(self.count) - begin + 1)
        return rows, ends[np.searchsorted(ends, np.arange(self.count))]


def split_moves(start: FloatArray, end: FloatArray, step: float, *, kind: np.ndarray | None = None,
                center: FloatArray | None = None, sweep: FloatArray | None = None, plane: np.ndarray | None = None,
                rapid: np.ndarray | None = None, shape: np.ndarray | None = None) -> Moves:
    """Return the pieces of lines and arcs, none longer than `step` (m).

    Parameters
    ----------
    start, end : (n, 3) floats
        m, of the tool's tip.
    step : float
        m.
    kind : (n,) ints, optional
        0 line, 1 arc; lines where left out.
    center, sweep, plane : (n, 3) m, (n,) rad, (n, 2) axes
        Of arcs; the third axis goes linearly along.
    rapid : (n,) bools, optional
    shape : (n,) ints, optional
        Index of the tool's shape; 0 where left out.

    Examples
    --------
    >>> moves = split_moves([[0, 0, 0.0]], [[0.01, 0, 0.0]], step=0.004)
    >>> moves.count, round(float(moves.length.sum()), 9)
    (3, 0.01)
    """
    a, b = floats("start", start, (None, 3)), floats("end", end, (None, 3))
    n = len(a)
    kinds = np.zeros(n, int) if kind is None else np.asarray(kind)
    c, w = (a if center is None else floats("center", center, (n, 3))), np.zeros(n) if sweep is None else np.asarray(sweep)
    planes = np.tile([0, 1], (n, 1)) if plane is None else np.asarray(plane)
    is_arc = kinds == 1
    rows = np.arange(n)
    radius = np.where(is_arc, np.linalg.norm((a - c)[rows[:, None], planes], axis=1), 0.0)
    rise = (b - a)[rows, 3 - planes.sum(axis=1)]
    length = np.where(is_arc, np.hypot(radius * w, rise), np.linalg.norm(b - a, axis=1))
    level = is_arc & (planes == [0, 1]).all(axis=1)
    # An arc out of XY is followed by chords within the tolerance: r (1 - cos(w/2)).
    chord_turn = 2 * np.arccos(np.clip(1 - _CHORD_TOLERANCE / np.maximum(radius, 1e-9), -1, 1))
    turn_max = np.where(level, _MAX_ARC_SWEEP, np.maximum(chord_turn, 1e-3))
    parts = np.maximum(np.ceil(length / positive("step", step) - 1e-9), np.where(is_arc, np.ceil(np.abs(w) / turn_max), 1))
    # A rapid cuts nothing: its pieces are only as short as their envelope needs.
    fast = np.zeros(n, bool) if rapid is None else np.asarray(rapid, bool)
    parts = np.maximum(np.where(fast & ~is_arc, 1, parts), 1).astype(int)
    if parts.sum() > MAX_PIECES:
        fail("step", f"{1e3 * step:g} mm: {parts.sum() / 1e6:.0f} million pieces", f"must make at most {MAX_PIECES / 1e6:.0f} "
             "million", remedy="a longer step, or a part of the program")
    block = np.repeat(rows, parts)
    order = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.stack([order / parts[block], (order + 1) / parts[block]])
    path = _Path(a, b, c, w, planes, is_arc, radius)
    (p, t0), (q, t1) = (path.at(block, share[k]) for k in (0, 1))
    table = np.zeros((block.size, MOVE_WIDTH))
    table[:, 0:3], table[:, 3:6] = p, q
    exact = level[block]
    table[:, 6], table[:, 7:9], table[:, 9] = exact, c[block, :2], radius[block]
    table[:, 10] = np.arctan2(p[:, 1] - c[block, 1], p[:, 0] - c[block, 0])
    table[:, 11] = w[block] / parts[block]
    table[:, 12] = 0 if shape is None else np.asarray(shape)[block]
    return Moves(table, block, t0, t1, fast[block], length[block] / parts[block])


@dataclass(frozen=True, eq=False)
class _Path:
    """Segments of a program, n of them: ends and centres (n, 3) m, sweeps (n,) rad, axes of the plane of an arc (n, 2),
    radii (n,) m."""

    start: FloatArray
    end: FloatArray
    center: FloatArray
    sweep: FloatArray
    plane: np.ndarray
    is_arc: np.ndarray
    radius: FloatArray

    def at(self, block: np.ndarray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points and unit directions at shares of segments."""
        chord = self.end[block] - self.start[block]
        points, ways = self.start[block] + share[:, None] * chord, chord.copy()
        k = np.flatnonzero(self.is_arc[block])
        i, rows = block[k], np.arange(k.size)[:, None]
        d = (self.start[i] - self.center[i])[rows, self.plane[i]]
        angle = share[k] * self.sweep[i]
        turned = np.stack([np.cos(angle) * d[:, 0] - np.sin(angle) * d[:, 1],
                           np.sin(angle) * d[:, 0] + np.cos(angle) * d[:, 1]], axis=1)
        points[k[:, None], self.plane[i]] = self.center[i][rows, self.plane[i]] + turned
        ways[k[:, None], self.plane[i]] = self.sweep[i][:, None] * np.stack([-turned[:, 1], turned[:, 0]], axis=1)
        # Ends are those of the program, free of the rounding of sines.
        is_end = share == 1.0
        points[is_end] = self.end[block[is_end]]
        size = np.linalg.norm(ways, axis=1, keepdims=True)
        return points, ways / np.where(size > 0, size, 1.0)
