"""Pieces of a path in turn: each is checked, cut, and the arcs at its ends are taken; contacts are kept with their places."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from toolpoint._check import FloatArray
from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.arcs import MAX_ARCS, OUTSIDE_GAP_RATIO, tool_arcs
from toolpoint.material_removal.holder_touch import touch_move
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.removed import RemovalSettings
from toolpoint.material_removal.surface import Work, cut_move

_PIECES_PER_CALL = 4000  # pieces of one call of the kernel: between calls progress is reported and an interruption heard
_MAX_CONTACTS = 2000  # contacts kept of each kind
# Of the gap outside the edge at which material is asked for: how much before its end a motion is looked at there. The wall that
# is touched at the end then lies outside the gap but for a twentieth of a degree.
_HALT_LOOK = 1000.0
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
    halts = find_halts(pieces, at_start, piece)
    result = RemovalMarch(np.zeros(n), np.full((n, settings.slices, MAX_ARCS, 2), np.nan, np.float32), np.zeros(n, np.int32),
                   np.zeros(pieces.count), [])
    touched = np.zeros((pieces.count, 4))
    first_place = np.searchsorted(piece, np.arange(pieces.count + 1))
    numbers, lifts, rows = _body_table(bodies)
    held = np.zeros((pieces.count, max(lifts.shape[1], 1), 4))
    for first in range(0, pieces.count, _PIECES_PER_CALL):
        last = min(first + _PIECES_PER_CALL, pieces.count)
        _march(work, (first, last), (first_place, at_start, is_sampled, halts), (pieces.first, pieces.last), pieces.rapid,
               flutes, (numbers, lifts, rows), (result.reach, result.arcs, result.arc_count, result.volume, touched, held))
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


def find_halts(pieces: Moves, at_start: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Return whether the motion ends behind each piece (n,): the next one begins in another direction, or there is none."""
    halts = np.zeros(pieces.count, bool)
    begins = piece[at_start]
    halts[begins[begins > 0] - 1] = True
    halts[-1:] = True
    return halts


@njit(cache=True, nogil=True, **BORROWS)
def _end_early(row, length):  # type: ignore[no-untyped-def]
    """Let a row of a move end a length (m) before its end, or in its middle where it is shorter than twice that."""
    if row[6] == 1.0:
        total = abs(row[11]) * row[9]
        share = 1.0 - min(length / total, 0.5) if total > 0.0 else 1.0
        row[11] *= share
        row[3] = row[7] + row[9] * math.cos(row[10] + row[11])
        row[4] = row[8] + row[9] * math.sin(row[10] + row[11])
        row[5] = row[2] + share * (row[5] - row[2])
        return
    total = math.sqrt((row[3] - row[0]) ** 2 + (row[4] - row[1]) ** 2 + (row[5] - row[2]) ** 2)
    share = 1.0 - min(length / total, 0.5) if total > 0.0 else 1.0
    for i in range(3):
        row[3 + i] = row[i] + share * (row[3 + i] - row[i])


@njit(cache=True, nogil=True)
def _march(work, span, places, ways, rapid, flutes, bodies, out):  # type: ignore[no-untyped-def]
    """Cut the pieces of a span one after another; write their volumes, contacts, and the arcs at their places."""
    first_place, at_start, is_sampled, halts = places
    reach, arcs, arc_count, volume, touched, held = out
    numbers, lifts, rows = bodies
    box, last_touch = np.zeros(4, np.int64), np.zeros(4)
    for k in range(span[0], span[1]):
        tool = int(work.moves[k, 12])
        shape = work.shapes[tool]
        for part in range(numbers[tool]):
            touch_move(work, k, rows[tool, part], lifts[tool, part], box, held[k, part])
        is_near = False
        for n in range(first_place[k], first_place[k + 1]):
            # Where the motion ends, a wall of an earlier pass may lie along the edge and is not cut: the tool is looked at just
            # before it is there.
            is_early = halts[k] and is_sampled[n] and not at_start[n]
            if is_early:
                kept, kept_joined = work.moves[k].copy(), work.joined[k].copy()
                _end_early(work.moves[k], _HALT_LOOK * OUTSIDE_GAP_RATIO * (shape[4] + 1e-3))
                _end_early(work.joined[k], _HALT_LOOK * OUTSIDE_GAP_RATIO * (shape[4] + 1e-3))
            if not at_start[n]:
                volume[k], is_near = cut_move(work, k, box, touched[k])
            if is_sampled[n] and (at_start[n] or is_near):
                tip = work.moves[k, 0:3] if at_start[n] else work.moves[k, 3:6]
                feed = ways[0][k] if at_start[n] else ways[1][k]
                reach[n], arc_count[n] = tool_arcs(work, tip, feed, shape, flutes[tool], arcs[n])
            if is_early:
                work.moves[k], work.joined[k] = kept, kept_joined
                volume[k] += cut_move(work, k, box, last_touch)[0]
        if first_place[k] == first_place[k + 1]:
            volume[k], is_near = cut_move(work, k, box, touched[k])

# Code of other modules in these kernels: dc7dbab76798
