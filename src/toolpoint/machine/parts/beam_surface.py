"""The surface of a described beam: rings of its sections along the axis, moved by its nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies.surface import BodySurface
from toolpoint.machine.description.beam import BeamDescription, BeamSegment
from toolpoint.spatial.rotation import skew

RING_CORNERS = 20  # corners of a ring: a circle is seen as round
MAX_SURFACE_RINGS = 40  # rings at most, about, beside those at steps


def beam_surface(description: BeamDescription, places: FloatArray, owners: Sequence[str], *, motion: FloatArray) -> BodySurface:
    """Return the surface in the body's frame.

    places : (n,) of the nodes, m; owners : (n - 1,), segment of each element; motion : (6 n or more, m) of the nodes.
    """
    element_stride = max(1, len(owners) // MAX_SURFACE_RINGS)
    rings: list[FloatArray] = []
    motions: list[FloatArray] = []
    for k, owner in enumerate(owners):
        is_first, is_last = k == 0 or owners[k - 1] != owner, k == len(owners) - 1 or owners[k + 1] != owner
        outline = _outline(description.segments[owner])
        for node, has_ring in ((k, is_first), (k + 1, is_last or (k + 1) % element_stride == 0)):
            if has_ring:
                ring = np.column_stack([np.full(len(outline), places[node]), outline])
                rings.append(ring)
                motions.append(_node_displacement(ring - [places[node], 0, 0], motion[6 * node:6 * node + 6]))
    turn = np.roll(np.eye(3), -"xyz".index(description.axis), axis=0)  # from the body's frame to the beam's
    nodes, triangles = _skin(rings)
    ends = [_middle(m) for m in (motions[0], motions[-1])]
    return BodySurface(nodes @ turn, triangles, np.einsum("ab,nbm->nam", turn.T, np.concatenate([*motions, *ends])))


def _outline(segment: BeamSegment) -> FloatArray:
    """Return the places across the axis of a section's corners, (sides, 2), m."""
    width, height = segment.extent
    turn = 2 * np.pi * np.arange(RING_CORNERS) / RING_CORNERS
    if segment.diameter is not None:
        return width / 2 * np.column_stack([np.cos(turn), np.sin(turn)])
    # As many corners as a circle, so that rings join: each on the rectangle's side, the corners among them.
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1.0]]) * [width / 2, height / 2]
    corner_numbers = np.arange(RING_CORNERS) * 4 / RING_CORNERS
    return np.column_stack([np.interp(corner_numbers, np.arange(5), corners[:, axis]) for axis in range(2)])


def _node_displacement(arms: FloatArray, node: FloatArray) -> FloatArray:
    """Return the displacement (n, 3, m) of places about a node with motion (6, m)."""
    return np.stack([node[:3] - skew(arm) @ node[3:] for arm in arms])


def _middle(ring: FloatArray) -> FloatArray:
    return ring.mean(axis=0, keepdims=True)


def _skin(rings: Sequence[FloatArray]) -> tuple[FloatArray, np.ndarray]:
    """Return nodes, with the middles of both ends last, and triangles of the rings joined one to the next."""
    ring_nodes = np.arange(RING_CORNERS)
    next_nodes = np.roll(ring_nodes, -1)
    triangles = []
    for k in range(len(rings) - 1):
        ring_start, next_start = RING_CORNERS * k, RING_CORNERS * (k + 1)
        triangles += [np.column_stack([ring_start + ring_nodes, ring_start + next_nodes, next_start + ring_nodes]),
                      np.column_stack([ring_start + next_nodes, next_start + next_nodes, next_start + ring_nodes])]
    first_middle, last_ring = RING_CORNERS * len(rings), RING_CORNERS * (len(rings) - 1)
    triangles += [np.column_stack([np.full(RING_CORNERS, first_middle), next_nodes, ring_nodes]),
                  np.column_stack([np.full(RING_CORNERS, first_middle + 1), last_ring + ring_nodes, last_ring + next_nodes])]
    middles = [ring.mean(axis=0) for ring in (rings[0], rings[-1])]
    return np.concatenate([*rings, middles]), np.concatenate(triangles)
