r"""Corner blends of two mirrored clothoids: curvature rises linearly to the middle and falls again, in any plane.

With u from 0 at an end to 1 in the middle, turn t of the whole corner and l the length of one half, the tangent turns by
:math:`t u^2/2`; curvature :math:`t u / l`. Fresnel integrals: Abramowitz, Stegun, Handbook of Mathematical Functions, ch. 7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray


@dataclass(frozen=True, eq=False)
class Blend:
    """Blends between `start` and `end` (n, 3) of the corners `corner` (n, 3), each turning by `turn` (n,) rad."""

    start: FloatArray
    end: FloatArray
    corner: FloatArray
    turn: FloatArray

    @property
    def half_length(self) -> FloatArray:
        """Length of one half, m."""
        along, across = _unit_clothoid(self.turn, np.ones_like(self.turn))
        return np.linalg.norm(self.corner - self.start, axis=1) / (along + across * np.tan(self.turn / 2))

    def points(self, share: FloatArray) -> FloatArray:
        """Return the points at shares (0..1) of the whole length, (n, 3)."""
        (origin, tangent, inward), u, _ = self._side(share)
        along, across = (self.half_length * x for x in _unit_clothoid(self.turn, u))
        return origin + along[:, None] * tangent + across[:, None] * inward

    def tangents(self, share: FloatArray) -> FloatArray:
        """Return the unit tangents in the direction of travel, (n, 3)."""
        (_, tangent, inward), u, sign = self._side(share)
        angle = self.turn * u**2 / 2
        return sign[:, None] * (np.cos(angle)[:, None] * tangent + np.sin(angle)[:, None] * inward)

    def curvatures(self, share: FloatArray) -> FloatArray:
        """Return the curvature vectors, 1/m, (n, 3)."""
        (_, tangent, inward), u, _ = self._side(share)
        angle, size = self.turn * u**2 / 2, self.turn * u / self.half_length
        return size[:, None] * (np.cos(angle)[:, None] * inward - np.sin(angle)[:, None] * tangent)

    def _side(self, share: FloatArray) -> tuple[tuple[FloatArray, FloatArray, FloatArray], FloatArray, FloatArray]:
        """Return origin, direction and inward normal of the half in which each share lies, seen from its end; u; sign."""
        first = share <= 0.5
        # The second half is the first one seen from its end, so that one set of formulas serves both.
        direction_in, direction_out = _unit_vectors(self.corner - self.start), _unit_vectors(self.end - self.corner)
        c, s = np.cos(self.turn)[:, None], np.sin(self.turn)[:, None]

        def pick(in_first: FloatArray, in_second: FloatArray) -> FloatArray:
            return np.where(first[:, None], in_first, in_second)

        return ((pick(self.start, self.end), pick(direction_in, -direction_out),
                 pick((direction_out - c * direction_in) / s, (c * direction_out - direction_in) / s)),
                2 * np.where(first, share, 1 - share), np.where(first, 1.0, -1.0))


def half_lengths(turn: FloatArray, tolerance: float, longest: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (half length, distance of the ends from the corner) of blends within `tolerance` (m) of their corners.

    `longest` (m) bounds the distance of the ends from the corner. The middle stands off the corner by
    e = l S / cos(t/2), the ends by d = l (C + S tan(t/2)), with C and S the clothoid's coordinates for l = 1.
    """
    along, across = _unit_clothoid(turn, np.ones_like(turn))
    reach = along + across * np.tan(turn / 2)
    half = np.minimum(tolerance * np.cos(turn / 2) / across, longest / reach)
    return half, half * reach


def steady_speed(turn: FloatArray, half: FloatArray, acceleration: float, *, jerk: float) -> FloatArray:
    """Return the constant speed (m/s) at which a blend keeps |a| = v^2 k and |j| = v^3 sqrt(k'^2 + k^4) within limits."""
    curvature_max = turn / half
    return np.minimum(np.sqrt(acceleration / curvature_max), np.cbrt(jerk / np.hypot(curvature_max / half, curvature_max**2)))


def _unit_clothoid(turn: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates at u of a half of length one: integrals of cos and sin of t u^2/2."""
    from scipy.special import fresnel

    # SciPy states Fresnel integrals over pi t^2 / 2, the turn of a clothoid grows with t^2 / 2.
    root = np.sqrt(turn / np.pi)
    across, along = fresnel(root * u)
    return along / root, across / root


def _unit_vectors(v: FloatArray) -> FloatArray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)
