"""Table of the blocks: sums and the largest over the places of each segment."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.loads import LOAD_COLUMNS, CutLoads, largest_of_blocks
from toolpoint.studies.machining.margins import PlaceMargins, limit_over_depth
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.result import AIR, CHATTERS, STABLE, UNKNOWN_VERDICT, BlockTable


def table_blocks(laid: ProgramPath, removed: RemovedMaterial, loads: CutLoads, *, arcs: PlaceArcs, margins: PlaceMargins | None
                 ) -> BlockTable:
    """Return the table of the segments of a program."""
    count, block = laid.path.count, laid.moves.block[removed.piece]
    place_depth = np.zeros(removed.piece.size)
    place_depth[arcs.place] = arcs.depth
    depth = largest_of_blocks(place_depth, block, count)
    columns = {name: largest_of_blocks(getattr(loads, name), block, count) for name in LOAD_COLUMNS}
    volume = np.bincount(laid.moves.block, removed.volume, count).astype(float)
    longest = largest_of_blocks(removed.arc_length.max(axis=1, initial=0.0), block, count)
    verdict = np.where(depth > 0, UNKNOWN_VERDICT, AIR)
    limit, error, frequency, ratio = (np.full(count, np.nan) for _ in range(4))
    if margins is not None and arcs.place.size:
        hand = limit_over_depth(margins, arcs)
        judged, worst_place = _worst_places(hand, block[arcs.place], count)
        limit[judged], error[judged] = margins.limit[worst_place], margins.error[worst_place]
        frequency[judged], ratio[judged] = margins.frequency[worst_place], hand[worst_place]
        depth[judged] = arcs.depth[worst_place]
        is_known = ~np.isnan(margins.limit[worst_place])
        verdict[judged] = np.where(is_known, np.where(margins.stable[worst_place], STABLE, CHATTERS), UNKNOWN_VERDICT)
    return BlockTable(laid.path.line, volume, depth, longest, columns, limit,
                      error,
                      frequency, ratio, verdict)


def _worst_places(hand: FloatArray, block: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the blocks that cut, and the place with the least limit over its depth of each."""
    order = np.argsort(-np.where(np.isnan(hand), np.inf, hand), kind="stable")
    worst_place = np.full(count, -1)
    worst_place[block[order]] = order  # written last is the least
    judged = np.flatnonzero(worst_place >= 0)
    return judged, worst_place[judged]
