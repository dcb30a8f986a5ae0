"""Surface that a turned tool leaves by its end: normals along the tool's own axes, and the tracks side by side on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from toolpoint._check import FloatArray, IndexArray
from toolpoint.material_removal.tri_dexels.line_ends import LineEnds, is_swept_deeper, list_line_ends
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.machining.errors.left_surface import LeftSurface
from toolpoint.studies.machining.five_axes.tool_outline import MIN_CUSP, Outline, across_feed, cusp_between
from toolpoint.studies.machining.five_axes.turned_path import TurnedPath

_RIM_TOLERANCE = 1e-7  # m, within which an end lies on the rim of a flat end
_MIN_FACING = 0.5  # cosine between a surface's normal and a line that is asked about its cusps
_MIN_LEAN = 1e-4  # sine of the lean, below which a flat end leaves a floor
_DEEPER_SHARE = 0.1  # of a cusp's height: a track that takes more of it is between the two
_SEARCHED_RADII = 1.5  # of the tool, about a cusp, from which other steps may pass over it
_MIN_UP = 1e-6  # part of the normal along the tool's axis, below which it is a wall of the cylinder


@dataclass(frozen=True, eq=False)
class _Contacts:
    """Contacts of the tool's end with what it leaves, (n, 3) each: tip, m, axis, outward normal and feed, unit vectors in the
    work; local : the normal along the tool's axes, not a number of what the end does not leave."""

    tip: FloatArray
    axis: FloatArray
    normal: FloatArray
    feed: FloatArray
    local: FloatArray


def find_turned_surface(turned: TurnedPath, removed: TurnedRemoval, count: int) -> LeftSurface:
    """Return the surface that each of `count` segments leaves by the end of its tool; normals along the tool's own axes."""
    assert removed.lines is not None
    ends = list_line_ends(removed.lines)
    contacts = _contacts(ends, turned, removed)
    has_normal = ~np.isnan(contacts.local[:, 0])
    by_step = _mean_directions(contacts.local[has_normal], ends.step[has_normal], turned.moves.count)
    block = turned.moves.block[ends.step]
    by_block = _mean_directions(contacts.local[has_normal], block[has_normal], count)
    return LeftSurface(by_block, _cusps(ends, contacts, block, removed, count), by_step)


def _contacts(ends: LineEnds, turned: TurnedPath, removed: TurnedRemoval) -> _Contacts:
    motion, step, share = turned.moves, ends.step, ends.share[:, None]
    tip = (1 - share) * motion.tips[step, 0] + share * motion.tips[step, 1]
    frame = (1 - share[..., None]) * motion.frames[step, 0] + share[..., None] * motion.frames[step, 1]
    axis = _unit(frame[:, :, 2])
    arm = ends.place - tip
    height = (arm * axis).sum(axis=1)
    outwards = arm - height[:, None] * axis
    distance = np.linalg.norm(outwards, axis=1)
    outwards = outwards / np.maximum(distance, 1e-12)[:, None]
    around = np.cross(axis, outwards)
    turn = np.cross(axis, motion.axes[step, 1] - motion.axes[step, 0])
    feed = _unit(motion.tips[step, 1] - motion.tips[step, 0] + np.cross(turn, arm))
    shapes = removed.shapes
    corner, largest = (np.array([getattr(shape, name) for shape in shapes])[motion.shape[step]]
                       for name in ("corner_radius", "radius"))
    normal = ends.normal.copy()
    is_rim = (corner == 0) & (np.abs(height) < _RIM_TOLERANCE) & (np.abs(distance - largest) < _RIM_TOLERANCE)
    rim = np.cross(around, feed)
    rim *= np.where((rim * axis).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    normal[is_rim] = _unit(rim)[is_rim]
    up, inwards = (normal * axis).sum(axis=1), -(normal * outwards).sum(axis=1)
    lean = np.sqrt(np.clip(1 - up**2, 0.0, 1.0))
    # The end leaves what faces it: an edge that lies outside, as of a rim that goes along itself, is not its surface.
    is_left = (up > _MIN_UP) & (~is_rim | (inwards > _MIN_LEAN)) & (is_rim | (corner > 0) | (lean < _MIN_LEAN))
    local = np.einsum("nij,ni->nj", frame, normal)
    local[~is_left] = np.nan
    return _Contacts(tip, axis, normal, feed, local)


def _unit(vectors: FloatArray) -> FloatArray:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(size > 0, size, 1.0))


def _mean_directions(vectors: FloatArray, group: IndexArray, count: int) -> FloatArray:
    """Return the mean direction (count, 3) of unit vectors by groups, not a number where there is none."""
    total = np.zeros((count, 3))
    np.add.at(total, group, vectors)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(size > 1e-9, total / np.where(size > 1e-9, size, 1.0), np.nan)


def _cusps(ends: LineEnds, contacts: _Contacts, block: IndexArray, removed: TurnedRemoval, count: int) -> FloatArray:
    """Return the largest cusp of each segment, m: between the tracks of lines side by side that different segments have left.

    A third track that passes deeper over the cusp has left no line there: two tracks about it have none between them.
    """
    assert removed.lines is not None
    cusp, tree = np.full(count, -1.0), cKDTree(removed.lines.motions[:, :6].reshape(-1, 2, 3).mean(axis=1))
    length = float(removed.moves.length.max(initial=0.0))
    for a, b in _neighbours(ends, contacts, block):
        shape = removed.shapes[int(removed.moves.rows[ends.step[a], 12])]
        view = across_feed(contacts.normal[a] + contacts.normal[b], contacts.feed[a])
        outlines = [Outline.of(shape, contacts.tip[k], contacts.axis[k], view=view) for k in (a, b)]
        height, place = cusp_between(*outlines)
        if not height > MIN_CUSP:
            continue
        apex = place[0] * view[1] + place[1] * view[2] + (0.5 * (ends.place[a] + ends.place[b]) @ view[0]) * view[0]
        steps_around = np.array(tree.query_ball_point(apex, _SEARCHED_RADII * shape.radius + length), dtype=np.int64)
        if not is_swept_deeper(removed.lines, steps_around, apex, _DEEPER_SHARE * height):
            cusp[[block[a], block[b]]] = np.maximum(cusp[[block[a], block[b]]], height)
    return np.where(cusp >= 0, cusp, np.nan)


def _neighbours(ends: LineEnds, contacts: _Contacts, block: IndexArray) -> list[tuple[int, int]]:
    """Return pairs of ends on lines side by side that two segments have left with round ends, one of each two segments."""
    facing = np.abs(np.take_along_axis(contacts.normal, ends.line[:, :1], axis=1)[:, 0])
    is_floor = np.abs((contacts.normal * contacts.axis).sum(axis=1)) > 1 - _MIN_LEAN**2
    chosen = np.flatnonzero(~np.isnan(contacts.local[:, 0]) & (facing > _MIN_FACING))
    if not chosen.size:
        return []
    sizes = np.array([3, *(ends.line[:, 1:4].max(axis=0, initial=0) + 2), 2])
    keys = np.ravel_multi_index(tuple(ends.line[chosen].T), tuple(sizes))
    order = np.argsort(keys)
    pairs = list[np.ndarray]()
    for side in (1, 2):
        next_keys = keys + int(np.prod(sizes[side + 1:]))
        position = np.minimum(np.searchsorted(keys[order], next_keys), keys.size - 1)
        a, b = chosen, chosen[order[position]]
        is_pair = (keys[order[position]] == next_keys) & (block[a] != block[b]) & ~(is_floor[a] & is_floor[b])
        pairs.append(np.stack([a[is_pair], b[is_pair]], axis=1))
    both = np.concatenate(pairs)
    blocks = np.sort(block[both], axis=1)
    order = np.lexsort((blocks[:, 1], blocks[:, 0]))
    _, first, count = np.unique(blocks[order], axis=0, return_index=True, return_counts=True)
    return [(int(a), int(b)) for a, b in both[order[first + count // 2]]]
