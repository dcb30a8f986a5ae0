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

DEFAULT_SLICES = 10  # of the tool along the edge
SPACING_RATIO = 1 / 20  # of the smallest tool's radius, where no spacing is given
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
    work : Work
        Arrays of the work as it is left, for the kernels.
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


