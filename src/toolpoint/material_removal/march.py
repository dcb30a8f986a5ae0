"""Pieces of a path in turn: each is checked, cut, and the arcs at its ends are taken; contacts are kept with their places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from toolpoint._check import FloatArray
from toolpoint.material_removal.arcs import MAX_ARCS, tool_arcs
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.removed import RemovalSettings
from toolpoint.material_removal.surface import Work, cut_move, touch_move

_PIECES_PER_CALL = 4000  # of one call of the kernel: progress in between, and an interruption
_MAX_CONTACTS = 2000  # kept of each kind; more say nothing new
RAPID, HOLDER = 0, 1

Contact = tuple[int, int, int, tuple[float, float, float, float]]


@dataclass(eq=False)
class RemovalMarch:
    """Arrays that the pieces fill: reach, arcs and their number of every place, the volume of every piece, contacts."""

    reach: FloatArray
    arcs: FloatArray
    arc_count: np.ndarray
    volume: FloatArray
    contacts: list[Contact]


def march(work: Work, moves: Moves, places: tuple[np.ndarray, np.ndarray, np.ndarray], *, flutes: FloatArray,
          settings: RemovalSettings, bodies: Sequence[Sequence[tuple[float, FloatArray]]],
          progress: Callable[[int, int], None] | None) -> RemovalMarch:
    """Return what the pieces took and met, in their order."""
    piece, at_start, is_sampled = places
    n = piece.size
    result = RemovalMarch(np.zeros(n), np.full((n, settings.slices, MAX_ARCS, 2), np.nan, np.float32), np.zeros(n, np.int32),
                   np.zeros(moves.count), [])
    touched = np.zeros((moves.count, 4))
    first_place = np.searchsorted(piece, np.arange(moves.count + 1))
    numbers, lifts, rows = _body_table(bodies)
    held = np.zeros((moves.count, max(lifts.shape[1], 1), 4))
    for first in range(0, moves.count, _PIECES_PER_CALL):
        last = min(first + _PIECES_PER_CALL, moves.count)
        _march(work, (first, last), (first_place, at_start, is_sampled), (moves.first, moves.last), moves.rapid, flutes,
               (numbers, lifts, rows), (result.reach, result.arcs, result.arc_count, result.volume, touched, held))
        if progress is not None:
            progress(last, moves.count)
    for k in np.flatnonzero(moves.rapid & (touched[:, 0] > settings.tolerance))[:_MAX_CONTACTS]:
        result.contacts.append((RAPID, int(k), 0, tuple(touched[k].tolist())))
    for k, part in np.argwhere(held[:, :, 0] > settings.tolerance)[:_MAX_CONTACTS]:
        result.contacts.append((HOLDER, int(k), int(part), tuple(held[k, part].tolist())))
    return result


def _body_table(bodies: Sequence[Sequence[tuple[float, FloatArray]]]) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Return the number of bodies of each tool, their heights above the tip (tools, n) and shape rows (tools, n, 5)."""
    widest = max((len(parts) for parts in bodies), default=0)
    lifts, rows = np.zeros((len(bodies), widest)), np.zeros((len(bodies), widest, 5))
    for k, parts in enumerate(bodies):
        for m, (lift, row) in enumerate(parts):
            lifts[k, m], rows[k, m] = lift, row
    return np.array([len(parts) for parts in bodies]), lifts, rows


@njit(cache=True, nogil=True)
def _march(work, span, places, ways, rapid, flutes, bodies, out):  # type: ignore[no-untyped-def]
    """Cut the pieces of a span; write what they took, met, and the arcs at their places."""
    first_place, at_start, is_sampled = places
    reach, arcs, arc_count, volume, touched, held = out
    numbers, lifts, rows = bodies
    box = np.zeros(4, np.int64)
    for k in range(span[0], span[1]):
        tool = int(work.moves[k, 12])
        shape = work.shapes[tool]
        for part in range(numbers[tool]):
            touch_move(work, k, rows[tool, part], lifts[tool, part], box, held[k, part])
        is_near = False
        for n in range(first_place[k], first_place[k + 1]):
            if not at_start[n]:
                volume[k], is_near = cut_move(work, k, box, touched[k])
            if is_sampled[n] and (at_start[n] or is_near):
                tip = work.moves[k, 0:3] if at_start[n] else work.moves[k, 3:6]
                feed = ways[0][k] if at_start[n] else ways[1][k]
                reach[n], arc_count[n] = tool_arcs(work, tip, feed, shape, flutes[tool], arcs[n])
        if first_place[k] == first_place[k + 1]:
            volume[k], is_near = cut_move(work, k, box, touched[k])
