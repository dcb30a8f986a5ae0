"""WallContacts: where the edges of a tool touch the work at every place of a program, and how thick the wall behind is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.cut_solid import CutSolid
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.thin_walls.part_stages import PartStage

CONTACT_HEIGHT_COUNT = 4  # places along the cut's depth, over which motion and force are averaged
_RAY_RATIO = 4.0  # mean sizes of an element through which a wall is followed
_RAY_STEPS = 80
_CORNER_COUNT = 8  # nodes of an element, the first, between which its size is taken
_OUTSIDE_RATIO = 1e-6  # of the part's extent: a place farther from every element is outside


@dataclass(frozen=True, eq=False)
class WallContacts:
    """Contacts of places that cut, (m,) as `PlaceArcs`.

    places : (m, heights, 3), m, over the depth, where the middle of the arc meets the work; wall : (m, 3) unit direction from
    the tool's axis to the wall that it leaves, to the middle of the arc where it leaves none; axis : (m, 3) of the tool at
    half the depth, m; radius : (m,), m.
    """

    places: FloatArray
    wall: FloatArray
    axis: FloatArray
    radius: FloatArray


def contacts_of(arcs: PlaceArcs, removed: RemovedMaterial, wall_reach: float) -> WallContacts:
    """Return the contacts of all places that cut; an arc that ends within `wall_reach` (rad) of 0 or 180° leaves a wall."""
    shape = removed.moves.rows[removed.piece[arcs.place], 12].astype(int)
    radius = np.array([each.radius for each in removed.shapes])[shape]
    tip = removed.tip[arcs.place]
    middle = 0.5 * (arcs.entry + arcs.exit)
    left, right = arcs.entry < wall_reach, arcs.exit > np.pi - wall_reach
    towards = np.where(right, np.pi, np.where(left, 0.0, middle))
    share = (np.arange(CONTACT_HEIGHT_COUNT) + 0.5) / CONTACT_HEIGHT_COUNT
    places = np.repeat((tip + radius[:, None] * _direction(middle, arcs.angle))[:, None, :], CONTACT_HEIGHT_COUNT, axis=1)
    places[:, :, 2] += share * arcs.depth[:, None]
    axis = tip + np.array([0.0, 0.0, 0.5]) * arcs.depth[:, None]
    return WallContacts(places, _direction(towards, arcs.angle), axis, radius)


def _direction(phi: FloatArray, angle: FloatArray) -> FloatArray:
    """Return unit directions (m, 3) of a tooth at phi: from the left of the feed (0) over the feed to its right (180°)."""
    along, left = np.sin(phi), np.cos(phi)
    return np.stack([np.cos(angle) * along - np.sin(angle) * left, np.sin(angle) * along + np.cos(angle) * left,
                     np.zeros_like(phi)], axis=1)


@dataclass(frozen=True, eq=False)
class ThicknessAtCuts:
    """Thickness of the wall behind contacts, (k,), m, infinite where it is not ended within a few elements; and how many
    elements stand across it, (k,)."""

    thickness: FloatArray
    elements: FloatArray


def measure_walls(contacts: WallContacts, members: IndexArray, *, stage: PartStage, cut: CutSolid) -> ThicknessAtCuts:
    """Return the thickness of the walls behind some contacts at a stage, along the normal of the wall."""
    size = float(np.mean(np.concatenate([np.ptp(block.corners[active], axis=1).max(axis=1)
                                         for block, active in zip(cut.blocks, stage.state.active, strict=True)])))
    way = np.linspace(0.0, _RAY_RATIO * size, _RAY_STEPS)
    step = way[1]
    start = contacts.axis[members] + (0.5 * contacts.radius[members])[:, None] * contacts.wall[members]
    reach = np.concatenate([way, way[-1] + step * np.arange(1, 1 + int(np.ceil(0.6 * contacts.radius.max() / step)))])
    rays = (start[:, None, :] + reach[None, :, None] * contacts.wall[members][:, None, :]).reshape(-1, 3)
    located = stage.locate(cut, rays)
    extent = float(np.ptp(cut.model.nodes, axis=0).max())
    inside = (located.distance < _OUTSIDE_RATIO * extent) & (cut.sweep.first_pieces(rays) >= stage.piece)
    inside = inside.reshape(members.size, -1)
    first = inside.argmax(axis=1)
    is_behind = np.arange(inside.shape[1]) >= first[:, None]
    ends = is_behind & ~inside
    last = np.where(ends.any(axis=1), ends.argmax(axis=1), -1)
    is_ended = inside.any(axis=1) & (last >= 0)
    thickness = np.where(is_ended, step * (last - first), np.where(inside.any(axis=1), np.inf, np.nan))
    corners = cut.model.nodes[located.nodes[:, :_CORNER_COUNT]].reshape(members.size, -1, _CORNER_COUNT, 3)
    across = np.ptp(corners[np.arange(members.size), first], axis=1)
    width = (across * np.abs(contacts.wall[members])).sum(axis=1)
    return ThicknessAtCuts(thickness, thickness / np.maximum(width, 1e-12))
