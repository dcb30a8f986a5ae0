"""Distinct engagements of a program: one arc of cut for each place, grouped by tool, arc, speed, feed direction and pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.loads import slice_edges
from toolpoint.studies.machining.program_path import ProgramPath

ARC_STEP = np.radians(4.0)  # rad, of entry and exit within a group
DIRECTION_STEP = np.radians(15.0)  # rad, of the feed's direction within a group
_MIN_ARC = np.radians(0.5)  # rad: a shorter one is taken as so long


@dataclass(frozen=True, eq=False)
class PlaceArcs:
    """One arc of cut at every place that cuts: the hull of all its slices' arcs, at the tool's largest radius.

    place : (m,) indices of places; entry, exit : (m,) rad; depth : (m,) axial depth, m; angle : (m,) direction of feed from x
    towards y, rad; is_hull : (m,) whether the slices' arcs differ by more than a group's width, or are several.
    """

    place: np.ndarray
    entry: FloatArray
    exit: FloatArray
    depth: FloatArray
    angle: FloatArray
    is_hull: np.ndarray


def arcs_of_places(removed: RemovedMaterial) -> PlaceArcs:
    """Return the arc of every place that cuts.

    The angles of a slice of radius r are taken to the largest radius R as between plane walls, cos phi = (r/R) cos phi_r,
    which is how the stability problem takes them back. Of a cylinder the depth is the length of edge that cuts.
    """
    depth = removed.depth
    place = np.flatnonzero(depth > 0)
    if not place.size:
        empty = np.zeros(0)
        return PlaceArcs(place, empty, empty, empty, empty, np.zeros(0, bool))
    shape_index = removed.moves.rows[removed.piece[place], 12].astype(int)
    arcs = removed.arcs[place].astype(float)
    for k, shape in enumerate(removed.shapes):
        rows = np.flatnonzero(shape_index == k)
        ratio = slice_edges(shape, removed.reach[place[rows]], arcs.shape[1])[..., 2] / shape.radius
        clipped = np.clip(arcs[rows], 0.0, np.pi)
        arcs[rows] = np.arccos(np.cos(clipped) * ratio[..., None, None])
    # Slices without an arc take no part: infinities of the sign that loses.
    entries, exits = np.where(np.isnan(arcs[..., 0]), np.inf, arcs[..., 0]), np.where(np.isnan(arcs[..., 1]), -np.inf,
                                                                                      arcs[..., 1])
    entry, leave = entries.min(axis=(1, 2)), exits.max(axis=(1, 2))
    first_entries, last_exits = entries[:, :, 0], exits.max(axis=2)
    inner_entry = np.where(np.isfinite(first_entries), first_entries, -np.inf).max(axis=1)
    inner_leave = np.where(np.isfinite(last_exits), last_exits, np.inf).min(axis=1)
    is_hull = (inner_entry - entry > ARC_STEP) | (leave - inner_leave > ARC_STEP) | (removed.arc_count[place] > 1)
    entry = np.minimum(entry, np.pi - _MIN_ARC)
    leave = np.maximum(np.minimum(leave, np.pi), entry + _MIN_ARC)
    has_arc = ~np.isnan(removed.arcs[place][:, :, 0, 0])
    cylinder = np.array([shape.corner_radius == 0 for shape in removed.shapes])[shape_index]
    cut_length = removed.reach[place] * has_arc.mean(axis=1)
    feed = removed.feed[place]
    return PlaceArcs(place, entry, leave, np.where(cylinder, cut_length, depth[place]), np.arctan2(feed[:, 1], feed[:, 0]),
                     is_hull)


@dataclass(frozen=True, eq=False)
class EngagementClasses:
    """Groups of places: `group` (m,) of each place.

    Of each group: tool number, entry, exit and direction of feed (rad), speed (rev/min), pose index, largest depth (m).
    """

    group: np.ndarray
    tool: np.ndarray
    entry: FloatArray
    exit: FloatArray
    angle: FloatArray
    speed: FloatArray
    pose: np.ndarray
    depth: FloatArray

    @property
    def count(self) -> int:
        """Number of groups."""
        return int(self.tool.size)


def group_places(arcs: PlaceArcs, laid: ProgramPath, piece: np.ndarray, *, pose: np.ndarray,
                 isotropic: bool) -> EngagementClasses:
    """Return the groups of places; arcs are widened to the outer ends of their group: entry down, exit up.

    A direction and its opposite are one group, as the response along a line is the same both ways; where the response is
    alike in all directions there is one.
    """
    block = laid.moves.block[piece[arcs.place]]
    entry = np.clip(np.floor(arcs.entry / ARC_STEP + 1e-6), 0, None).astype(int)
    leave = np.ceil(arcs.exit / ARC_STEP - 1e-6).astype(int)
    turns = round(np.pi / DIRECTION_STEP)
    angle = np.zeros(entry.size, int) if isotropic else np.rint(arcs.angle / DIRECTION_STEP).astype(int) % turns
    speed = laid.speed[block]
    keys = np.stack([laid.tool[block], entry, leave, angle, np.rint(speed * 10).astype(int), pose[arcs.place]], axis=1)
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    depth = np.zeros(len(unique))
    np.maximum.at(depth, group, arcs.depth)
    return EngagementClasses(group, unique[:, 0], unique[:, 1] * ARC_STEP, np.minimum(unique[:, 2] * ARC_STEP, np.pi),
                             unique[:, 3] * DIRECTION_STEP, unique[:, 4] / 10, unique[:, 5], depth)
