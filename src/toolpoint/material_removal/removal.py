"""Removal of material along a path: the pieces cut the dexels of the stock one after the other, and the results are
gathered."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.removed import COLLISION_KINDS, Collision, RemovalSettings, RemovedMaterial
from toolpoint.material_removal.stock import MESH_KIND, Stock
from toolpoint.material_removal.tool_shape import Holder, MillShape

_MIN_CORNER_TURN = 0.05  # rad: a smaller jump of the direction gets no place of its own
_MAX_EDGE_HEIGHT = 10.0  # m, of edges whose length is not known


def remove_material(pieces: Moves, stock: Stock, shapes: Sequence[MillShape], *, settings: RemovalSettings,
                    holders: Sequence[Holder] = (), sampled: np.ndarray | None = None,
                    progress: Callable[[int, int], None] | None = None) -> RemovedMaterial:
    """Return the material that a path removes from a stock, with the arcs of cut and the collisions.

    Parameters
    ----------
    pieces : Moves
        Pieces of the path, in their order.
    stock : Stock
    shapes : sequence of MillShape
        Shapes of the tools, which the pieces name by index.
    settings : RemovalSettings
    holders : sequence of Holder, optional
        One for each shape; nothing above the edges where left out.
    sampled : (n,) bools, optional
        Places (`places_of`) whose arcs are wanted; all of cutting moves where left out.
    progress : function of pieces done and in all, optional

    Raises ToolpointError where the path never comes over the stock.

    Examples
    --------
    >>> from toolpoint.material_removal.moves import split_moves
    >>> pieces = split_moves([[-0.01, 0.01, -0.002]], [[0.05, 0.01, -0.002]], step=0.02)
    >>> stock = Stock.box((0, 0, -0.01), (0.04, 0.02, 0))
    >>> removed = remove_material(pieces, stock, [MillShape(0.01)], settings=RemovalSettings(1e-3))
    >>> round(1e9 * removed.total_volume)  # a slot of 10 x 2 x 40 mm, mm^3
    800
    """
    from toolpoint.material_removal.cell_volumes import measure_by_lines
    from toolpoint.material_removal.march import march  # brings the compiler
    from toolpoint.material_removal.surface import OWNER_LAYERS, Work, begin_heights, measure_volumes

    _check_place(pieces, stock, shapes)
    dexels = stock.laid_out(settings.spacing)
    height = np.empty(dexels.intervals.shape[:2])
    begin_heights(dexels.intervals, height)
    joined, final = pieces.joined()
    owners = np.full((OWNER_LAYERS, *height.shape), -1, np.int32)
    work = Work(dexels.x, dexels.y, dexels.spacing, height, owners[0], owners[1], owners[2], owners[3],
                dexels.intervals,
                np.ascontiguousarray(pieces.rows), joined, final, np.zeros(2, np.int64),
                np.array([shape.array for shape in shapes]), stock.kind, np.array(stock.lower), np.array(stock.upper))
    piece, at_start = places_of(pieces)
    is_sampled = ~pieces.rapid[piece] if sampled is None else sampled
    flutes = np.array([min(shape.flute_length, _MAX_EDGE_HEIGHT) for shape in shapes])
    result = march(work, pieces, (piece, at_start, is_sampled), flutes=flutes, settings=settings, bodies=_bodies(shapes,
            holders),
                   progress=progress)
    total, left = measure_volumes(work) if stock.kind != MESH_KIND else measure_by_lines(work, stock)
    ends = np.where(at_start[:, None], pieces.rows[piece, 0:3], pieces.rows[piece, 3:6])
    feed = np.where(at_start[:, None], pieces.first[piece], pieces.last[piece])
    collisions = tuple(Collision(COLLISION_KINDS[kind], int(pieces.block[k]), (x, y, z), depth,
                                 holders[int(pieces.rows[k, 12])].names[part] if kind else "")
                       for kind, k, part, (depth, x, y, z) in result.contacts)
    return RemovedMaterial(pieces, stock, tuple(shapes), settings, piece, at_start, ends, feed, result.reach, result.arcs,
                           result.arc_count,
                           result.volume, total, left, height, work.owner, (dexels.x, dexels.y), collisions, work)


def places_of(pieces: Moves) -> tuple[np.ndarray, np.ndarray]:
    """Return the piece of every place at which the engagement is taken, and whether it is its start.

    The end of every piece, and the start where the direction of feed jumps.
    """
    begins = np.ones(pieces.count, bool)
    turned = np.einsum("ni,ni->n", pieces.first[1:], pieces.last[:-1]) < np.cos(_MIN_CORNER_TURN)
    begins[1:] = turned | (pieces.rapid[1:] != pieces.rapid[:-1])
    piece = np.repeat(np.arange(pieces.count), 1 + begins)
    at_start = np.zeros(piece.size, bool)
    at_start[np.cumsum(1 + begins)[begins] - 2] = True
    return piece, at_start


def _bodies(shapes: Sequence[MillShape], holders: Sequence[Holder]) -> list[list[tuple[float, FloatArray]]]:
    """Return (height above the tip, row of a flat cylinder) of every body above each tool's edges."""
    if holders and len(holders) != len(shapes):
        fail("holders", f"{len(holders)}", f"must be one for each of the {len(shapes)} tools")
    return [[(h, np.array([d / 2, 0.0, 0.0, 1.0, d / 2])) for h, d in zip(holder.heights, holder.diameters, strict=True)]
            for holder in (holders or [Holder()] * len(shapes))]


def _check_place(pieces: Moves, stock: Stock, shapes: Sequence[MillShape]) -> None:
    """Refuse a stock that no cutting move comes near: it stands elsewhere than the program takes it to be."""
    radius = np.array([shape.radius for shape in shapes])[pieces.rows[:, 12].astype(int)][:, None]
    cutting = ~pieces.rapid
    ends = np.minimum(pieces.rows[:, 0:3], pieces.rows[:, 3:6]), np.maximum(pieces.rows[:, 0:3], pieces.rows[:, 3:6])
    over = (ends[0][:, :2] - radius <= stock.upper[:2]) & (ends[1][:, :2] + radius >= stock.lower[:2])
    meets = over.all(axis=1) & (ends[0][:, 2] < stock.upper[2])
    if cutting.any() and not (meets & cutting).any():
        spans = ", ".join(f"{name} {1e3 * a:.4g} .. {1e3 * b:.4g}" for name, a, b in zip(
            "XYZ", ends[0][cutting].min(axis=0), ends[1][cutting].max(axis=0), strict=True))
        corners = ", ".join(f"{name} {1e3 * a:.4g} .. {1e3 * b:.4g}" for name, a, b in zip("XYZ", stock.lower, stock.upper,
                                                                                       strict=True))
        fail("stock", f"{corners} mm", f"is met by no cutting move: they go over {spans} mm",
             remedy="give the stock in the coordinates of the program")
