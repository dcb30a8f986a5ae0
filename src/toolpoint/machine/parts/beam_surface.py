"""The surface of a described beam: rings of its sections along the axis, moved by its nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies.surface import BodySurface
from toolpoint.machine.description.beam import BeamDescription, BeamSegment
from toolpoint.spatial.rotation import skew

SIDES = 20
STATIONS = 40  # rings at most, about, beside those at steps


def beam_surface(description: BeamDescription, places: FloatArray, owners: Sequence[str], *, motion: FloatArray) -> BodySurface:
    """Return the surface in the body's frame.

    places : (n,) of the nodes, m; owners : (n - 1,), segment of each element; motion : (6 n or more, m) of the nodes.
    """
    every = max(1, len(owners) // STATIONS)
    rings: list[FloatArray] = []
    moves: list[FloatArray] = []
    for k, owner in enumerate(owners):
        first, last = k == 0 or owners[k - 1] != owner, k == len(owners) - 1 or owners[k + 1] != owner
        outline = _outline(description.segments[owner])
        for node, is_wanted in ((k, first), (k + 1, last or (k + 1) % every == 0)):
            if is_wanted:
                ring = np.column_stack([np.full(len(outline), places[node]), outline])
                rings.append(ring)
                moves.append(_moved(ring - [places[node], 0, 0], motion[6 * node:6 * node + 6]))
    turn = np.roll(np.eye(3), -"xyz".index(description.axis), axis=0)  # from the body's frame to the beam's
    nodes, triangles = _skin(rings)
    ends = [_middle(m) for m in (moves[0], moves[-1])]
    return BodySurface(nodes @ turn, triangles, np.einsum("ab,nbm->nam", turn.T, np.concatenate([*moves, *ends])))


def _outline(segment: BeamSegment) -> FloatArray:
    """Return the places across the axis of a section's corners, (sides, 2), m."""
    width, height = segment.extent
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    if segment.diameter is not None:
        return width / 2 * np.column_stack([np.cos(turn), np.sin(turn)])
    # As many corners as a circle, so that rings join: each on the rectangle's side, the corners among them.
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1.0]]) * [width / 2, height / 2]
    at = np.arange(SIDES) * 4 / SIDES
    return np.column_stack([np.interp(at, np.arange(5), corners[:, axis]) for axis in range(2)])


def _moved(arms: FloatArray, node: FloatArray) -> FloatArray:
    """Return the displacement (n, 3, m) of places about a node with motion (6, m)."""
    return np.stack([node[:3] - skew(arm) @ node[3:] for arm in arms])


def _middle(ring: FloatArray) -> FloatArray:
    return ring.mean(axis=0, keepdims=True)


def _skin(rings: Sequence[FloatArray]) -> tuple[FloatArray, np.ndarray]:
    """Return nodes, with the middles of both ends last, and triangles of the rings joined one to the next."""
    at = np.arange(SIDES)
    after = np.roll(at, -1)
    triangles = []
    for k in range(len(rings) - 1):
        low, high = SIDES * k, SIDES * (k + 1)
        triangles += [np.column_stack([low + at, low + after, high + at]),
                      np.column_stack([low + after, high + after, high + at])]
    first, last = SIDES * len(rings), SIDES * (len(rings) - 1)
    triangles += [np.column_stack([np.full(SIDES, first), after, at]),
                  np.column_stack([np.full(SIDES, first + 1), last + at, last + after])]
    middles = [ring.mean(axis=0) for ring in (rings[0], rings[-1])]
    return np.concatenate([*rings, middles]), np.concatenate(triangles)
