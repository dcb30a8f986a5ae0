"""Removal of material by a tool of any and of changing direction: one call over tri-dexels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.material_removal.arcs import MAX_ARCS
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.removed import COLLISION_KINDS, Collision, RemovalSettings, RemovedMaterial
from toolpoint.material_removal.stock import Stock
from toolpoint.material_removal.tool_shape import Holder, MillShape
from toolpoint.material_removal.tri_dexels.laid_lines import lay_lines
from toolpoint.material_removal.tri_dexels.lines import MAX_LINE_INTERVALS, TriWork
from toolpoint.material_removal.tri_dexels.sampled_volume import measure_work
from toolpoint.material_removal.tri_dexels.turned_march import Bodies, Places, TurnedMarch, march_turned
from toolpoint.material_removal.tri_dexels.turned_moves import TurnedMoves

_MIN_FEED_JUMP = 0.05  # rad: a smaller jump of the direction gets no place of its own
_MAX_CONTACTS_KEPT = 2000  # of each kind


@dataclass(frozen=True, eq=False)
class TurnedRemoval(RemovedMaterial):
    """Result of a removal by a turned tool; places and work in the axes of the work, `feed` along the tool's own x, y and z.

    frame : (n, 3, 3) columns are the tool's axes at every place; feed_way : (n,) way of the middle of the cutting edge in the
    step of the place, m; feed_spread : (n,) largest difference of the feeds of the ends of the cutting edge from that of its
    middle, over the latter; lines : the dexels as they are left.
    """

    frame: FloatArray | None = None
    feed_way: FloatArray | None = None
    feed_spread: FloatArray | None = None
    lines: TriWork | None = None


def remove_by_turned_tool(motion: TurnedMoves, stock: Stock, shapes: Sequence[MillShape], *, settings: RemovalSettings,
                          holders: Sequence[Holder] = (), with_volume: bool = True,
                          progress: Callable[[int, int], None] | None = None) -> TurnedRemoval:
    """Return the material that a moving and turning tool removes from a stock, with the arcs of cut and the collisions.

    Parameters
    ----------
    motion : TurnedMoves
        Steps in their order; a step turns by a degree or so at body_number_max.
    stock : Stock
        Box, upright cylinder or mesh.
    shapes, settings, holders, progress : as in `remove_material`; edges end at their length, and cut nothing above it
    with_volume : bool
        Whether the volume is measured with walls resolved within the cells; else by the lines alone.

    Raises ToolpointError where a line would need more than `MAX_LINE_INTERVALS` parts, and where no step meets the stock.

    Examples
    --------
    >>> tips = np.array([[[-0.01, 0.01, -0.002], [0.05, 0.01, -0.002]]])
    >>> up, frames = np.tile([0.0, 0.0, 1.0], (1, 2, 1)), np.tile(np.eye(3), (1, 2, 1, 1))
    >>> slot = TurnedMoves(tips, up, frames, np.zeros(1, int), np.zeros(1, int), np.zeros(1, bool))
    >>> stock = Stock.box((0, 0, -0.01), (0.04, 0.02, 0))
    >>> removed = remove_by_turned_tool(slot, stock, [MillShape(0.01)], settings=RemovalSettings(1e-3))
    >>> abs(1e9 * removed.total_volume - 800) < 4  # a slot of 10 x 2 x 40 mm, mm^3
    True
    """
    body_length = 2 * float(np.linalg.norm(stock.upper - stock.lower)) + 0.1
    table = np.array([[*shape.array, min(shape.flute_length, body_length)] for shape in shapes])
    work = lay_lines(stock, settings.spacing, motions=motion.rows, block=motion.block, shapes=table)
    step, at_start = _places(motion)
    end = np.where(at_start, 0, 1)
    frame = np.ascontiguousarray(motion.frames[step, end])
    places = Places(np.searchsorted(step, np.arange(motion.count + 1)), at_start, frame)
    result = march_turned(work, motion.rates, motion.rapid, places=places, bodies=_bodies(shapes, holders, body_length),
                          slices=settings.slices, arc_room=MAX_ARCS, progress=progress)
    if work.spilled[0]:
        fail("stock", f"{int(work.spilled[0])} dexels that are cut into more than {MAX_LINE_INTERVALS} parts",
             f"must be at body_number_max {MAX_LINE_INTERVALS}", remedy="a larger spacing")
    if not (result.volume[~motion.rapid] > 0).any() and (~motion.rapid).any():
        fail("stock", stock.words, "is met by no cutting move", remedy="give the stock in the coordinates of the program")
    total, left = measure_work(work) if with_volume else (float(result.volume.sum()), float("nan"))
    feed, way, spread = _feeds(motion, step, frame, result.reach)
    contacts = _contacts(motion, result, settings.tolerance, holders)
    tip, owner = motion.tips[step, end], np.full(work.numbers[2].shape, -1, np.int32)
    corner = work.lower + work.spacing / 2
    origin = float(corner[0]), float(corner[1])
    return TurnedRemoval(_as_moves(motion), stock, tuple(shapes), settings, step, at_start, tip, feed, result.reach,
                         result.arcs, result.arc_count, result.volume, total, left, _top(work), owner, origin, contacts,
                         None, frame, way, spread, work)


def _places(motion: TurnedMoves) -> tuple[np.ndarray, np.ndarray]:
    """Return the step of every place and whether it is its start: ends of all steps, starts where the feed's way jumps."""
    way = motion.rates[:, 0]
    size = np.linalg.norm(way, axis=1, keepdims=True)
    unit = way / np.where(size > 0, size, 1.0)
    begins = np.ones(motion.count, bool)
    jumps = np.einsum("ni,ni->n", unit[1:], unit[:-1]) < np.cos(_MIN_FEED_JUMP)
    begins[1:] = (jumps & (size[1:, 0] > 0) & (size[:-1, 0] > 0)) | (motion.rapid[1:] != motion.rapid[:-1])
    step = np.repeat(np.arange(motion.count), 1 + begins)
    at_start = np.zeros(step.size, bool)
    at_start[np.cumsum(1 + begins)[begins] - 2] = True
    return step, at_start


def _bodies(shapes: Sequence[MillShape], holders: Sequence[Holder], body_length: float) -> Bodies:
    """Return the bodies above the edges of each tool; each ends where the next begins, the last one far above the stock."""
    tool_holders = list(holders) or [Holder()] * len(shapes)
    if len(tool_holders) != len(shapes):
        fail("holders", f"{len(tool_holders)}", f"must be one for each of the {len(shapes)} tools")
    body_number_max = max((len(holder.heights) for holder in tool_holders), default=0)
    lift, table = np.zeros((len(tool_holders), body_number_max)), np.zeros((len(tool_holders), body_number_max, 6))
    for k, holder in enumerate(tool_holders):
        for m, (height, diameter) in enumerate(zip(holder.heights, holder.diameters, strict=True)):
            above = [*(h for h in holder.heights if h > height), height + body_length]
            lift[k, m], table[k, m] = height, (diameter / 2, 0.0, 0.0, 1.0, diameter / 2, above[0] - height)
    return Bodies(np.array([len(holder.heights) for holder in tool_holders]), lift, table)


def _feeds(motion: TurnedMoves, step: np.ndarray, frame: FloatArray, reach: FloatArray
           ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the unit feed of the middle of the cutting edge along the tool's axes, its way in the step (m), and its spread."""
    rates = np.einsum("nij,nki->nkj", frame, motion.rates[step])  # of tip and axis, along the tool's x, y, z
    middle = rates[:, 0] + 0.5 * reach[:, None] * rates[:, 1]
    size = np.linalg.norm(middle, axis=1)
    unit = middle / np.where(size > 0, size, 1.0)[:, None]
    difference = np.linalg.norm(0.5 * reach[:, None] * rates[:, 1], axis=1)
    return unit, size, difference / np.where(size > 0, size, np.inf)


def _contacts(motion: TurnedMoves, result: TurnedMarch, tolerance: float, holders: Sequence[Holder]) -> tuple[Collision, ...]:
    contacts = []
    for k in np.flatnonzero(motion.rapid & (result.touched[:, 0] > tolerance))[:_MAX_CONTACTS_KEPT].tolist():
        depth, x, y, z = result.touched[k].tolist()
        contacts.append(Collision(COLLISION_KINDS[0], int(motion.block[k]), (x, y, z), depth))
    for k, part in np.argwhere(result.held[:, :, 0] > tolerance)[:_MAX_CONTACTS_KEPT].tolist():
        depth, x, y, z = result.held[k, part].tolist()
        contacts.append(Collision(COLLISION_KINDS[1], int(motion.block[k]), (x, y, z), depth,
                                  holders[int(motion.shape[k])].names[part]))
    return tuple(contacts)


def _as_moves(motion: TurnedMoves) -> Moves:
    """Return the steps as moves of the tip, for tables and pages."""
    way = motion.rates[:, 0]
    length = np.linalg.norm(way, axis=1)
    rows = np.zeros((motion.count, 13))
    rows[:, 0:3], rows[:, 3:6], rows[:, 12] = motion.tips[:, 0], motion.tips[:, 1], motion.shape
    unit = way / np.where(length > 0, length, 1.0)[:, None]
    return Moves(rows, motion.block, unit, unit, motion.rapid, length)


def _top(work: TriWork) -> FloatArray:
    """Return the upper end of the material on every line along z, m; minus infinity where there is none."""
    count, ends = work.numbers[2], work.intervals[2][..., 1]
    last = np.take_along_axis(ends, np.maximum(count - 1, 0)[..., None], axis=2)[..., 0]
    return np.where(count > 0, last, -np.inf)
