"""The removal of material along a path: what every piece takes away, its arcs of cut, and what it must not touch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint._notebook import NotebookText
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.stock import Stock
from toolpoint.material_removal.tool_shape import Holder, MillShape

DEFAULT_SLICES = 10  # of the tool along the edge
SPACING_RATIO = 1 / 20  # of the smallest tool's radius, where no spacing is given
_MIN_CORNER_TURN = 0.05  # rad: a smaller jump of the direction gets no place of its own
COLLISION_KINDS = ("rapid through stock", "holder in the work")


@dataclass(frozen=True)
class RemovalSettings:
    """Numerical settings.

    spacing : of the dexels, m; slices : of the tool along its edge; tolerance : m, of material that a rapid or a holder may
    brush without being told (the grid does not show less).
    """

    spacing: float
    slices: int = DEFAULT_SLICES
    tolerance: float = 2e-5

    def __post_init__(self) -> None:
        positive("spacing", self.spacing, 1.0)
        count("slices", self.slices)


@dataclass(frozen=True)
class Collision:
    """Contact that must not be: its kind, the index of the segment, the deepest place (m), and how deep (m) it is."""

    kind: str
    block: int
    place: tuple[float, float, float]
    depth: float
    body: str = ""


@dataclass(frozen=True, eq=False)
class RemovedMaterial(NotebookText):
    """What a path took away.

    Parameters
    ----------
    piece : (n,) ints
        Piece of every place at which the engagement was taken; `at_start` tells its end from its start.
    tip, feed : (n, 3) floats
        Place of the tool's tip, m, and unit direction of feed.
    reach : (n,) floats
        Height above the tip over which the slices are laid, m; 0 where nothing is cut.
    arcs : (n, slices, MAX_ARCS, 2) floats
        Entry and exit, rad, clockwise from the normal of the feed; not a number where there is none.
    arc_count : (n,) ints
        Largest number of arcs of a slice; above MAX_ARCS the last ones are joined.
    volume : (pieces,) floats
        Taken away by each piece, m^3, by its dexels.
    total_volume, left_volume : float
        m^3, walls resolved within the cells.
    height, owner : (nx, ny)
        Height of the work, m, and the piece that cut there last (-1 none).
    """

    moves: Moves
    stock: Stock
    shapes: tuple[MillShape, ...]
    settings: RemovalSettings
    piece: np.ndarray
    at_start: np.ndarray
    tip: FloatArray
    feed: FloatArray
    reach: FloatArray
    arcs: FloatArray
    arc_count: np.ndarray
    volume: FloatArray
    total_volume: float
    left_volume: float
    height: FloatArray
    owner: np.ndarray
    origin: tuple[float, float]
    collisions: tuple[Collision, ...] = field(default=())

    @property
    def arc_length(self) -> FloatArray:
        """Sum of the arcs of every slice, rad, (n, slices)."""
        return np.asarray(np.nansum(self.arcs[..., 1] - self.arcs[..., 0], axis=-1))

    @property
    def depth(self) -> FloatArray:
        """Height above the tip up to which the edge cuts, m, (n,): the upper end of the highest slice with an arc."""
        has_arc = ~np.isnan(self.arcs[:, :, 0, 0])
        share = np.where(has_arc.any(axis=1), self.settings.slices - has_arc[:, ::-1].argmax(axis=1), 0) / self.settings.slices
        shape = self.moves.rows[self.piece, 12].astype(int)
        out = np.zeros(share.size)
        for k in np.unique(shape):
            out[shape == k] = self.shapes[k].height_at(self.shapes[k].edge_length(self.reach[shape == k]) * share[shape == k])
        return out

    def __repr__(self) -> str:
        return (f"RemovedMaterial({self.moves.count} pieces, {1e9 * self.total_volume:.6g} mm^3 removed, "
                f"{len(self.collisions)} collisions)")


def remove_material(moves: Moves, stock: Stock, shapes: Sequence[MillShape], settings: RemovalSettings, *,
                    holders: Sequence[Holder] = (), sampled: np.ndarray | None = None,
                    progress: Callable[[int, int], None] | None = None) -> RemovedMaterial:
    """Return what a path takes away from a stock.

    Parameters
    ----------
    moves : Moves
    stock : Stock
    shapes : sequence of MillShape
        Those that the moves name by index.
    settings : RemovalSettings
    holders : sequence of Holder, optional
        One for each shape; nothing above the edges where left out.
    sampled : (n,) bools, optional
        Places (`places_of`) whose arcs are wanted; all of cutting moves where left out.
    progress : function of pieces done and in all, optional

    Raises ToolpointError where the path never comes over the stock.
    """
    from toolpoint.material_removal.march import march  # brings the compiler
    from toolpoint.material_removal.surface import Work, begin_heights, removed_volume

    _check_place(moves, stock, shapes)
    dexels = stock.laid_out(settings.spacing)
    height = np.empty(dexels.intervals.shape[:2])
    begin_heights(dexels.intervals, height)
    joined, final = moves.joined()
    work = Work(dexels.x, dexels.y, dexels.spacing, height, np.full(height.shape, -1, np.int32), dexels.intervals,
                np.ascontiguousarray(moves.rows), joined, final, np.zeros(1, np.int64),
                np.array([shape.array for shape in shapes]), stock.kind, np.array(stock.lower), np.array(stock.upper))
    piece, at_start = places_of(moves)
    is_sampled = ~moves.rapid[piece] if sampled is None else sampled
    flutes = np.array([min(shape.flute_length, 10.0) for shape in shapes])
    result = march(work, moves, (piece, at_start, is_sampled), flutes=flutes, settings=settings, bodies=_bodies(shapes, holders),
                   progress=progress)
    total, left = removed_volume(work)
    ends = np.where(at_start[:, None], moves.rows[piece, 0:3], moves.rows[piece, 3:6])
    feed = np.where(at_start[:, None], moves.first[piece], moves.last[piece])
    collisions = tuple(Collision(COLLISION_KINDS[kind], int(moves.block[k]), (x, y, z), depth,
                                 holders[int(moves.rows[k, 12])].names[part] if kind else "")
                       for kind, k, part, (depth, x, y, z) in result.contacts)
    return RemovedMaterial(moves, stock, tuple(shapes), settings, piece, at_start, ends, feed, result.reach, result.arcs, result.arc_count,
                           result.volume, total, left, height, work.owner, (dexels.x, dexels.y), collisions)


def places_of(moves: Moves) -> tuple[np.ndarray, np.ndarray]:
    """Return the piece of every place at which the engagement is taken, and whether it is its start.

    The end of every piece, and the start where the direction of feed jumps.
    """
    begins = np.ones(moves.count, bool)
    turned = np.einsum("ni,ni->n", moves.first[1:], moves.last[:-1]) < np.cos(_MIN_CORNER_TURN)
    begins[1:] = turned | (moves.rapid[1:] != moves.rapid[:-1])
    piece = np.repeat(np.arange(moves.count), 1 + begins)
    at_start = np.zeros(piece.size, bool)
    at_start[np.cumsum(1 + begins)[begins] - 2] = True
    return piece, at_start


def _bodies(shapes: Sequence[MillShape], holders: Sequence[Holder]) -> list[list[tuple[float, FloatArray]]]:
    """Return (height above the tip, row of a flat cylinder) of every body above each tool's edges."""
    if holders and len(holders) != len(shapes):
        fail("holders", f"{len(holders)}", f"must be one for each of the {len(shapes)} tools")
    return [[(h, np.array([d / 2, 0.0, 0.0, 1.0, d / 2])) for h, d in zip(holder.heights, holder.diameters, strict=True)]
            for holder in (holders or [Holder()] * len(shapes))]


def _check_place(moves: Moves, stock: Stock, shapes: Sequence[MillShape]) -> None:
    """Refuse a stock that no cutting move comes near: it stands elsewhere than the program takes it to be."""
    radius = np.array([shape.radius for shape in shapes])[moves.rows[:, 12].astype(int)][:, None]
    cutting = ~moves.rapid
    ends = np.minimum(moves.rows[:, 0:3], moves.rows[:, 3:6]), np.maximum(moves.rows[:, 0:3], moves.rows[:, 3:6])
    over = (ends[0][:, :2] - radius <= stock.upper[:2]) & (ends[1][:, :2] + radius >= stock.lower[:2])
    meets = over.all(axis=1) & (ends[0][:, 2] < stock.upper[2])
    if cutting.any() and not (meets & cutting).any():
        spans = ", ".join(f"{name} {1e3 * a:.4g} .. {1e3 * b:.4g}" for name, a, b in zip(
            "XYZ", ends[0][cutting].min(axis=0), ends[1][cutting].max(axis=0), strict=True))
        corners = ", ".join(f"{name} {1e3 * a:.4g} .. {1e3 * b:.4g}" for name, a, b in zip("XYZ", stock.lower, stock.upper,
                                                                                       strict=True))
        fail("stock", f"{corners} mm", f"is met by no cutting move: they go over {spans} mm",
             remedy="give the stock in the coordinates of the program")
