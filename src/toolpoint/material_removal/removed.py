"""Removed material: volumes of the pieces of a path, their arcs of cut, the work that is left, and collisions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from toolpoint._check import FloatArray, count, positive
from toolpoint._notebook import NotebookText
from toolpoint.material_removal.moves import Moves
from toolpoint.material_removal.stock import Stock
from toolpoint.material_removal.tool_shape import MillShape

if TYPE_CHECKING:
    from toolpoint.material_removal.surface import Work

DEFAULT_SLICES = 10  # slices of equal length along the tool's edge
SPACING_RATIO = 1 / 20  # of the smallest tool's radius, where no spacing is given
COLLISION_KINDS = ("rapid through stock", "holder in the work")


@dataclass(frozen=True)
class RemovalSettings:
    """Numerical settings.

    spacing : of the dexels, m; slices : number along the tool's edge; tolerance : m, depth of material up to which a contact
    of a rapid or a holder is not reported (the grid resolves no less).

    Examples
    --------
    >>> RemovalSettings(spacing=5e-4).slices
    10
    """

    spacing: float
    slices: int = DEFAULT_SLICES
    tolerance: float = 2e-5

    def __post_init__(self) -> None:
        positive("spacing", self.spacing, 1.0)
        count("slices", self.slices)


@dataclass(frozen=True)
class Collision:
    """Collision: kind (of `COLLISION_KINDS`), index of the program's segment, place (m) and depth (m) of the deepest
    contact, and the body of the holder that touches."""

    kind: str
    block: int
    place: tuple[float, float, float]
    depth: float
    body: str = ""


@dataclass(frozen=True, eq=False)
class RemovedMaterial(NotebookText):
    """Result of a path over a stock: removed volumes, arcs of cut at every place, the remaining work, and collisions.

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
        Removed by each piece, m^3, by its dexels.
    total_volume, left_volume : float
        m^3, walls resolved within the cells.
    height, owner : (nx, ny)
        Height of the work, m, and the piece that cut there last (-1 none).
    work : Work
        Arrays of the work as it is left, for the kernels.

    >>> from toolpoint.material_removal import MillShape, RemovalSettings, Stock, remove_material, split_moves
    >>> pieces = split_moves([[-0.01, 0.01, -0.002]], [[0.05, 0.01, -0.002]], step=0.02)
    >>> removed = remove_material(pieces, Stock.box((0, 0, -0.01), (0.04, 0.02, 0)), [MillShape(0.01)],
    ...                           settings=RemovalSettings(1e-3))
    >>> round(1e9 * (removed.total_volume + removed.left_volume))  # the block of 40 x 20 x 10 mm, mm^3
    8000
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
    work: Work | None = None

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


