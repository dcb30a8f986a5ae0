"""Cuts of a turned tool below the part's surface and below the stock, with the line that cut there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal import Stock
from toolpoint.material_removal.tri_dexels.lines import TriWork
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.machining.contacts import GOUGE_TOLERANCE, MAX_LISTED_CONTACTS, place_words
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup

MAX_MEASURED_PLACES = 4000  # whose distance from the part's surface is computed, the deepest along their lines first


def question_gouges(removed: TurnedRemoval, laid: ProgramPath, setup: MachiningSetup) -> list[Doubt]:
    """Return doubts about cuts below the stock, and grave ones about cuts into the part, the deepest of each line."""
    doubts = _below_stock(removed, laid)
    if not len(setup.part):
        return doubts
    from toolpoint.material_removal.mesh_distance import distance_to_mesh

    Stock.mesh(setup.part)  # refuses what encloses nothing
    work = removed.lines
    assert work is not None
    place, owner, along = _ends_in_part(work, setup.part)
    lost_volume = _lost_volume(work, setup)
    order = np.argsort(-along)[:MAX_MEASURED_PLACES]
    order = order[along[order] > GOUGE_TOLERANCE]
    depth = np.minimum(distance_to_mesh(place[order], setup.part), along[order]) if order.size else np.zeros(0)
    line = laid.path.line[laid.moves.block[owner[order]]]
    deepest = dict[int, int]()
    for k in np.argsort(-depth).tolist():
        if depth[k] > GOUGE_TOLERANCE:
            deepest.setdefault(int(line[k]), k)
    for number, k in list(deepest.items())[:MAX_LISTED_CONTACTS]:
        x, y, z = place[order[k]].tolist()
        doubts.append(Doubt("gouge", f"line {number} cuts {1e3 * depth[k]:.3g} mm into the part at {place_words((x, y, z))}",
                            "check the direction, the offset and the length of the tool", grave=True))
    if len(deepest) > MAX_LISTED_CONTACTS:
        doubts.append(Doubt("gouge", f"{len(deepest) - MAX_LISTED_CONTACTS} more lines", grave=True))
    surface = float(np.linalg.norm(np.cross(setup.part[:, 1] - setup.part[:, 0], setup.part[:, 2] - setup.part[:, 0]),
                                   axis=1).sum() / 2)
    if not deepest and lost_volume > GOUGE_TOLERANCE * surface:
        doubts.append(Doubt("gouge", f"{1e9 * lost_volume:.4g} mm^3 of the part are cut away, and nothing of it is left to "
                            "say by which line", "check that part and stock lie in the program's coordinates", grave=True))
    return doubts


def _below_stock(removed: TurnedRemoval, laid: ProgramPath) -> list[Doubt]:
    """Return the doubt about the place where the tool's body reaches farthest below the stock while it cuts."""
    cuts = removed.reach > 0
    if not cuts.any() or removed.frame is None:
        return []
    shape_index = laid.moves.rows[removed.piece, 12].astype(int)
    corner, flat = (np.array([getattr(shape, name) for shape in removed.shapes])[shape_index]
                    for name in ("corner_radius", "flat"))
    up = removed.frame[:, 2, 2]
    lowest = removed.tip[:, 2] + corner * (up - 1) - flat * np.sqrt(np.maximum(1 - up**2, 0.0))
    k = int(np.argmin(np.where(cuts, lowest, np.inf)))
    if lowest[k] >= removed.stock.lower[2] - GOUGE_TOLERANCE:
        return []
    return [Doubt("cut below the stock", f"line {laid.path.line[laid.moves.block[removed.piece[k]]]} goes to "
                  f"{1e3 * lowest[k]:.4g} mm, the stock ends at {1e3 * removed.stock.lower[2]:.4g} mm",
                  "see that neither table nor vice is there")]


def _part_lines(work: TriWork, part: FloatArray) -> Iterator[tuple[int, FloatArray, FloatArray, FloatArray]]:
    """Return, of each direction, the places of its lines across it (m) and the part's intervals on them (n, m, k, 2)."""
    from toolpoint.material_removal.mesh_intervals import cross_mesh

    for axis in range(3):
        p, q = [i for i in range(3) if i != axis]
        u, v = (work.lower[i] + work.spacing[i] * (np.arange(count) + 0.5)
                for i, count in zip((p, q), work.numbers[axis].shape, strict=True))
        yield axis, u, v, cross_mesh(np.ascontiguousarray(part[:, :, [p, q, axis]]), u, v)


def _ends_in_part(work: TriWork, part: FloatArray) -> tuple[FloatArray, np.ndarray, FloatArray]:
    """Return the places (n, 3) of cut ends of dexels that lie in the part, their steps, and how deep along their lines (m)."""
    places, owners, depths = [], [], []
    for axis, u, v, inside in _part_lines(work, part):
        p, q = [i for i in range(3) if i != axis]
        ends, owner = work.intervals[axis], work.owners[axis]
        is_cut = (np.arange(ends.shape[2]) < work.numbers[axis][..., None])[..., None] & (owner >= 0)
        depth = np.full(ends.shape, -1.0)
        for k in range(inside.shape[2]):
            first, last = (inside[:, :, k, end][:, :, None, None] for end in (0, 1))
            with np.errstate(invalid="ignore"):
                depth = np.fmax(depth, np.minimum(ends - first, last - ends))
        i, j, m, end = np.nonzero(is_cut & (depth > 0))
        place = np.zeros((i.size, 3))
        place[:, p], place[:, q], place[:, axis] = u[i], v[j], ends[i, j, m, end]
        places.append(place)
        owners.append(owner[i, j, m, end])
        depths.append(depth[i, j, m, end])
    return np.concatenate(places), np.concatenate(owners), np.concatenate(depths)


def _lost_volume(work: TriWork, setup: MachiningSetup) -> float:
    """Return the volume of the part within the stock that is cut away, m^3, by the lines along z."""
    from toolpoint.material_removal.tri_dexels.laid_lines import lines_of_stock

    axis, u, v, inside = list(_part_lines(work, setup.part))[2]
    count = work.numbers[axis]
    kept = np.where((np.arange(work.intervals[axis].shape[2]) < count[..., None])[..., None], work.intervals[axis], np.nan)
    stock_lines = lines_of_stock(setup.stock, axis, x=u, y=v)
    return float((_overlap(stock_lines, inside) - _overlap(kept, inside)).sum() * work.spacing[0] * work.spacing[1])


def _overlap(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the common length of two sets of intervals (n, m, k, 2) on every line, m; those that are no numbers are none."""
    total = np.zeros(first.shape[:2])
    for a in range(first.shape[2]):
        for b in range(second.shape[2]):
            with np.errstate(invalid="ignore"):
                common = np.minimum(first[:, :, a, 1], second[:, :, b, 1]) - np.maximum(first[:, :, a, 0], second[:, :, b, 0])
            total += np.nan_to_num(np.maximum(common, 0.0))
    return total
