"""MotionTable: how a place that slides along an elastic body moves per coordinate of the body, smooth in the position."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, floats, increasing


@dataclass(frozen=True, eq=False)
class MotionTable:
    """Motion of a sliding place per coordinate, at any position on its way.

    Parameters
    ----------
    positions : (p,) floats
        m, increasing.
    values : (p, 6, r) floats
        Twist (v, w) of the place about itself per coordinate.
    name : str
        Of the place, for messages.
    error : float
        Largest deviation of the spline from the mesh between entries, over the largest value; 0 where it was not asked for.
    """

    positions: FloatArray
    values: FloatArray
    name: str = "place"
    error: float = 0.0
    _spline: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "positions", increasing("positions", floats("positions", self.positions)))
        put(self, "values", floats("values", self.values, (self.positions.size, None, None)))
        if self.positions.size < 4:
            fail("positions", f"{self.positions.size}", "must be at least 4 for a smooth table", remedy="make the step smaller")
        from scipy.interpolate import CubicSpline  # scipy loads when a body slides, not with the room

        put(self, "_spline", CubicSpline(self.positions, self.values, axis=0, extrapolate=False))

    @property
    def span(self) -> tuple[float, float]:
        """First and last position, m."""
        return float(self.positions[0]), float(self.positions[-1])

    def at(self, position: float | FloatArray, order: int = 0) -> FloatArray:
        """Return the motion (..., 6, r) at positions, or its derivative by position of this order (0, 1, 2).

        Raises ToolpointError beyond the way: nothing is extrapolated.
        """
        low, high = self.span
        slack = 1e-12 * (high - low)
        if isinstance(position, float) and low - slack <= position <= high + slack:
            return self._at_one(min(max(position, low), high), order)
        place = floats("position", position)
        if place.size and (place.min() < low - slack or place.max() > high + slack):
            worst = place.min() if place.min() < low else place.max()
            fail(self.name, f"position {worst:.6g} m", f"must be within its way, {low:.6g} .. {high:.6g} m",
                 remedy="a carriage would leave its rail there: narrow the limits of the axis, or lengthen the rail")
        return np.asarray(self._spline(np.clip(place, low, high), order))

    def _at_one(self, place: float, order: int) -> FloatArray:
        """Return the cubic's value at one place, without what it costs to ask for many."""
        interval = min(int(np.searchsorted(self.positions, place, side="right")), len(self.positions) - 1) - 1
        third, second, first, value = self._spline.c[:, interval]
        t = place - float(self.positions[interval])
        if order == 0:
            return np.asarray(((third * t + second) * t + first) * t + value)
        return np.asarray((3 * third * t + 2 * second) * t + first if order == 1 else 6 * third * t + 2 * second)

    def deviation(self, position: float) -> FloatArray:
        """Return by how much the table may err about a position: of the two entries there, (2, 6, r).

        Splines through every other entry are off by so much at those between; with half the step, where the second derivative
        jumps, a quarter of it is left, and twice that is stated.
        """
        i = int(np.searchsorted(self.positions, position, side="right")) - 1
        return self._skipped[[min(max(k, 0), len(self.positions) - 1) for k in (i, i + 1)]] / 2

    @cached_property
    def _skipped(self) -> FloatArray:
        """At every entry, what a spline through every other one, itself not among them, differs by; at the ends, as beside."""
        from scipy.interpolate import CubicSpline

        result = np.zeros_like(self.values)
        for first in (0, 1):
            known, left_out = slice(first, None, 2), slice(1 - first, None, 2)
            spline = CubicSpline(self.positions[known], self.values[known], axis=0)
            result[left_out] = spline(self.positions[left_out]) - self.values[left_out]
        result[[0, -1]] = result[[1, -2]]
        return result

    def mixed(self, turn: FloatArray, after: int = 0) -> MotionTable:
        """Return the table over combinations (r, k) of its coordinates behind the first `after`, which stay."""
        values = np.concatenate([self.values[:, :, :after], self.values[:, :, after:] @ turn], axis=2)
        return MotionTable(self.positions, values, self.name)
