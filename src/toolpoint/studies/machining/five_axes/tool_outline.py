r"""Outline of a tool's end as seen along its feed, and the cusp between two of them side by side.

The end of a mill is a ball of the corner radius c rolled over a disc of the radius f of its flat: it reaches by
:math:`h(d) = p \cdot d + c + f \sqrt{1 - (a \cdot d)^2}` in a direction d (p the centre of the disc, a the axis), its support
function. A straight track leaves the lower side of the outline; two tracks cross in a cusp above the line that touches both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.material_removal import MillShape

MIN_CUSP = 1e-10  # m: a lower one is none
_DIRECTIONS = np.linspace(-0.8, 0.8, 1601)  # rad, from the surface's inward normal, in which an end is asked how far it reaches
_CROSSING_BISECTIONS = 40  # halve the gap to 1e-12 of itself: below the smallest cusp of any tool


@dataclass(frozen=True, eq=False)
class Outline:
    """Outline by its reach (n,), m, in `_DIRECTIONS`; place (2,), m, of the tip across the feed and up."""

    reach: FloatArray
    place: FloatArray

    @classmethod
    def of(cls, shape: MillShape, tip: FloatArray, axis: FloatArray, *, view: FloatArray) -> Outline:
        """Return the outline of a tool at a tip (3,), m; view : (3, 3) rows along the feed, across it and up."""
        down = np.sin(_DIRECTIONS)[:, None] * view[1] - np.cos(_DIRECTIONS)[:, None] * view[2]
        lean = down @ axis
        corner, flat = shape.corner_radius, max(shape.flat, 0.0)
        reach = down @ (tip + corner * axis) + corner + flat * np.sqrt(np.maximum(1 - lean**2, 0.0))
        return cls(reach, view[1:] @ tip)

    def height_at(self, y: float) -> float:
        """Return the height of its lower side at a place across the feed, m."""
        return float(((y * np.sin(_DIRECTIONS) - self.reach) / np.cos(_DIRECTIONS)).max())


def across_feed(normal: FloatArray, feed: FloatArray) -> FloatArray:
    """Return the directions along the feed, across it and up the normal, rows (3, 3)."""
    across = np.cross(normal, feed)
    across = across / np.linalg.norm(across)
    return np.stack([feed, across, np.cross(feed, across)])


def cusp_between(first: Outline, second: Outline) -> tuple[float, tuple[float, float]]:
    """Return the height of the cusp between two outlines, m, and its place across the feed and up; not a number for none.

    Examples
    --------
    Two balls of 5 mm, 1 mm apart: R - sqrt(R^2 - s^2/4).

    >>> ball, view = MillShape(0.01, 0.005), np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> both = [Outline.of(ball, np.array([0.0, y, 0.0]), np.array([0.0, 0.0, 1.0]), view=view) for y in (0.0, 1e-3)]
    >>> height, place = cusp_between(*both)
    >>> round(1e6 * height, 2), round(1e3 * place[0], 6)
    (25.06, 0.5)
    """
    nothing = float("nan"), (float("nan"), float("nan"))
    difference = first.reach - second.reach
    changes = np.flatnonzero(np.signbit(difference[1:]) != np.signbit(difference[:-1]))
    if not changes.size:
        return nothing
    k = int(changes[np.abs(_DIRECTIONS[changes]).argmin()])
    share = difference[k] / (difference[k] - difference[k + 1])
    theta = float(_DIRECTIONS[k] + share * (_DIRECTIONS[k + 1] - _DIRECTIONS[k]))
    line = float(first.reach[k] + share * (first.reach[k + 1] - first.reach[k]))
    # Where the touching line meets each of the two: the slope of the reach is the place along the line.
    step = _DIRECTIONS[k + 1] - _DIRECTIONS[k]
    along = [float(outline.reach[k + 1] - outline.reach[k]) / step for outline in (first, second)]
    ends = sorted(float(value * np.cos(theta) + line * np.sin(theta)) for value in along)
    lower, upper = ends
    gap = [first.height_at(y) - second.height_at(y) for y in ends]
    if gap[0] * gap[1] >= 0:
        return nothing
    for _ in range(_CROSSING_BISECTIONS):
        middle = 0.5 * (lower + upper)
        if (first.height_at(middle) - second.height_at(middle)) * gap[0] > 0:
            lower = middle
        else:
            upper = middle
    z = first.height_at(lower)
    return float(line - lower * np.sin(theta) + z * np.cos(theta)), (lower, z)
