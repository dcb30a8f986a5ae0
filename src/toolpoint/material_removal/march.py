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

_PIECES_PER_CALL = 4000  # pieces of one call of the kernel: between calls progress is reported and an interruption heard
_MAX_CONTACTS = 2000  # contacts kept of each kind
_RAPID_CONTACT, _HOLDER_CONTACT = 0, 1  # kinds of contacts: indices of `COLLISION_KINDS`

Contact = tuple[int, int, int, tuple[float, float, float, float]]


@dataclass(eq=False)
class RemovalMarch:
    """Result of the march: reach (m), arcs (rad) and number of arcs of every place, volume (m^3) of every piece, and contacts
    (kind, piece, body, (depth, x, y, z))."""

    reach: FloatArray
    arcs: FloatArray
    arc_count: np.ndarray
    volume: FloatArray
    contacts: list[Contact]


def march(work: Work, pieces: Moves, places: tuple[np.ndarray, np.ndarray, np.ndarray], *, flutes: FloatArray,
          settings: RemovalSettings, bodies: Sequence[Sequence[tuple[float, FloatArray]]],
          progress: Callable[[int, int], None] | None) -> RemovalMarch:
    """Cut the pieces in their order; return their volumes, the arcs at their places, and their contacts.

    places : (piece, whether at its start, whether its arcs are asked for) of every place; flutes : (tools,) m; bodies : of
    each tool, (height above the tip, shape row) of the bodies above its edges.
    """
    piece, at_start, is_sampled = places
    n = piece.size
    result = RemovalMarch(np.zeros(n), np.full((n, settings.slices, MAX_ARCS, 2), np.nan, np.float32), np.zeros(n, np.int32),
                   np.zeros(pieces.count), [])
    touched = np.zeros((pieces.count, 4))
    first_place = np.searchsorted(piece, np.arange(pieces.count + 1))
    numbers, lifts, rows = _body_table(bodies)
    held = np.zeros((pieces.count, max(lifts.shape[1], 1), 4))
    for first in range(0, pieces.count, _PIECES_PER_CALL):
        last = min(first + _PIECES_PER_CALL, pieces.count)
        _march(work, (first, last), (first_place, at_start, is_sampled), (pieces.first, pieces.last), pieces.rapid, flutes,
               (numbers, lifts, rows), (result.reach, result.arcs, result.arc_count, result.volume, touched, held))
        if progress is not None:
            progress(last, pieces.count)
    for k in np.flatnonzero(pieces.rapid & (touched[:, 0] > settings.tolerance))[:_MAX_CONTACTS]:
        result.contacts.append((_RAPID_CONTACT, int(k), 0, tuple(touched[k].tolist())))
    for k, part in np.argwhere(held[:, :, 0] > settings.tolerance)[:_MAX_CONTACTS]:
        result.contacts.append((_HOLDER_CONTACT, int(k), int(part), tuple(held[k, part].tolist())))
    return result


def _body_table(bodies: Sequence[Sequence[tuple[float, FloatArray]]]) -> tuple[np.ndarray, FloatArray, FloatArray]:
    """Return the number of bodies of each tool, their heights above the tip (tools, n) and shape rows (tools, n, 5)."""
    body_number_max = max((len(parts) for parts in bodies), default=0)
    lifts, rows = np.zeros((len(bodies), body_number_max)), np.zeros((len(bodies), body_number_max, 5))
    for k, parts in enumerate(bodies):
        for m, (lift, row) in enumerate(parts):
            lifts[k, m], rows[k, m] = lift, row
    return np.array([len(parts) for parts in bodies]), lifts, rows


@njit(cache=True, nogil=True)
def _march(work, span, places, ways, rapid, flutes, bodies, out):  # type: ignore[no-untyped-def]
    """Cut the pieces of a span one after another; write their volumes, contacts, and the arcs at their places."""
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
