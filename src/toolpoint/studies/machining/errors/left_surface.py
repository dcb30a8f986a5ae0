r"""Surface that blocks leave by their ends: normals and cusps from the dexels that each block cut last.

A ball of radius R whose centre runs along C(s) leaves, at a dexel P, the normal (C - P)/R at the nearest C. Two neighbouring
tracks with centres a distance s apart, across the normal, leave a cusp of :math:`R - \sqrt{R^2 - s^2/4}`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.drives.program.path import ARC_KIND
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.program_path import ProgramPath

_FLOOR_TOLERANCE = 1e-6  # m, between the height of a dexel and the tip that cut it flat
SAME_TRACK_SHARE = 0.02  # of the radius: centres nearer across the feed are of one track


@dataclass(frozen=True, eq=False)
class LeftSurface:
    """Surface that the ends of tools leave, of every block (n,).

    normal : (n, 3) mean outward normal in the program's axes (of a tool that turns along its own), not a number where a block
    leaves nothing by the end of its tool; cusp : height of the largest cusp between it and its neighbours, m, not a number
    where it has none, or no ball; step_normal : (pieces, 3) the same normals of the pieces of a path that turns the tool.
    """

    normal: FloatArray
    cusp: FloatArray
    step_normal: FloatArray | None = None

    def normal_at(self, piece: IndexArray, block: IndexArray) -> FloatArray:
        """Return the normals (m, 3) at places, by their piece where the tool turns, else by their block."""
        return self.normal[block] if self.step_normal is None else self.step_normal[piece]


def find_left_surface(laid: ProgramPath, removed: RemovedMaterial) -> LeftSurface:
    """Return the surface that each block leaves by the end of its tool."""
    n = laid.path.count
    i, j = np.nonzero(removed.owner >= 0)
    block = np.asarray(removed.moves.block[removed.owner[i, j]])
    spacing = removed.settings.spacing
    point = np.stack([removed.origin[0] + spacing * i, removed.origin[1] + spacing * j, removed.height[i, j]],
                     axis=1)
    shape_index = removed.moves.rows[removed.owner[i, j], 12].astype(int)
    normal, centre = np.full((block.size, 3), np.nan), np.full((block.size, 3), np.nan)
    for k, shape in enumerate(removed.shapes):
        rows = np.flatnonzero(shape_index == k)
        if shape.kind == "ball":
            centre[rows] = _nearest(laid, block[rows], point[rows], shape.radius)
            outward = centre[rows] - point[rows]
            normal[rows] = outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-12)
        elif shape.flat > 0:
            tip = _nearest(laid, block[rows], point[rows], 0.0)
            is_floor = np.abs(tip[:, 2] - point[rows, 2]) < _FLOOR_TOLERANCE
            normal[rows[is_floor]] = (0.0, 0.0, 1.0)
    return LeftSurface(_mean_normals(normal, block, n), _cusps(laid, removed, (i, j), block, centre))


def _nearest(laid: ProgramPath, block: np.ndarray, point: FloatArray, rise: float) -> FloatArray:
    """Return the places of the tip, raised by `rise` (m) along the axis, that are nearest to points, each on its block."""
    path = laid.path
    start, end = path.start[block] + [0, 0, rise], path.end[block] + [0, 0, rise]
    chord = end - start
    # A block without length has its one place; the floor keeps its share of the way finite.
    square = np.maximum((chord**2).sum(axis=1), 1e-18)
    share = np.clip(((point - start) * chord).sum(axis=1) / square, 0.0, 1.0)
    foot = start + share[:, None] * chord
    level = (path.kind[block] == ARC_KIND) & (path.plane[block] == [0, 1]).all(axis=1)
    if level.any():
        middle = path.center[block[level]][:, :2]
        radius = np.linalg.norm(start[level][:, :2] - middle, axis=1, keepdims=True)
        way = point[level][:, :2] - middle
        foot[level, :2] = middle + radius * way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    return foot


def _mean_normals(normal: FloatArray, block: np.ndarray, count: int) -> FloatArray:
    has_normal = ~np.isnan(normal[:, 0])
    total = np.zeros((count, 3))
    np.add.at(total, block[has_normal], normal[has_normal])
    size = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(size > 1e-9, total / np.where(size > 1e-9, size, 1.0), np.nan)


def _cusps(laid: ProgramPath, removed: RemovedMaterial, places: tuple[np.ndarray, np.ndarray], block: np.ndarray,
           centre: FloatArray) -> FloatArray:
    """Return the largest cusp of each block, m: between dexels side by side whose centres lie on tracks apart."""
    number = np.full(removed.owner.shape, -1)
    number[places] = np.arange(block.size)
    cusp = np.full(laid.path.count, -1.0)
    for first, second in ((number[:-1], number[1:]), (number[:, :-1], number[:, 1:])):
        pairs = np.stack([first.ravel(), second.ravel()])
        pairs = pairs[:, (pairs >= 0).all(axis=0)]
        pairs = pairs[:, block[pairs[0]] != block[pairs[1]]]
        a, b = pairs
        shape_index = removed.moves.rows[removed.owner[places][a], 12].astype(int)
        radius = np.array([shape.radius for shape in removed.shapes])[shape_index]
        way = laid.path.end[block[a]] - laid.path.start[block[a]]
        way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
        # Centres on two blocks of one track lie behind each other: only their distance across the feed makes a cusp.
        gap = centre[b] - centre[a]
        across = np.linalg.norm(gap - (gap * way).sum(axis=1, keepdims=True) * way, axis=1)
        is_track = (across > SAME_TRACK_SHARE * radius) & (across < 2 * radius)
        height = radius - np.sqrt(np.maximum(radius**2 - across**2 / 4, 0.0))
        for side in pairs:
            np.maximum.at(cusp, block[side[is_track]], height[is_track])
    return np.where(cusp >= 0, cusp, np.nan)
