"""Table of the motion of a place that slides along an elastic body, per coordinate of the body, smooth in the position."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from toolpoint._check import FloatArray, fail, floats, increasing


@dataclass(frozen=True, eq=False)
class MotionTable:
    """Motion of a sliding place per coordinate of its body, at any position of its travel.

    Parameters
    ----------
    positions : (p,) floats
        m, increasing, at least four.
    values : (p, 6, r) floats
        Twist (v, w) of the place about itself per coordinate.
    name : str
        Name of the place, for messages.
    error : float
        Largest deviation of the spline from the mesh between entries, over the largest value; 0 where it was not asked for.

    Raises
    ------
    ToolpointError
        For fewer than four positions, or positions that do not increase.

    Examples
    --------
    >>> import numpy as np
    >>> from toolpoint.spatial.motion_table import MotionTable
    >>> positions = np.linspace(0.0, 0.4, 5)
    >>> table = MotionTable(positions, positions[:, None, None] * np.ones((5, 6, 1)))
    >>> table.at(0.25).shape, float(np.round(table.at(0.25)[0, 0], 12))
    ((6, 1), 0.25)
    """

    positions: FloatArray
    values: FloatArray
    name: str = "place"
    error: float = 0.0
    _spline: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "positions", increasing("positions", floats("positions", self.positions)))
        set_field(self, "values", floats("values", self.values, (self.positions.size, None, None)))
        if self.positions.size < 4:
            fail("positions", f"{self.positions.size}", "must be at least 4 for a smooth table", remedy="make the step smaller")
        from scipy.interpolate import CubicSpline  # scipy loads when a body slides, not with the room

        set_field(self, "_spline", CubicSpline(self.positions, self.values, axis=0, extrapolate=False))

    @property
    def span(self) -> tuple[float, float]:
        """First and last position, m."""
        return float(self.positions[0]), float(self.positions[-1])

    def at(self, position: float | FloatArray, order: int = 0) -> FloatArray:
        """Return the motion (..., 6, r) at positions, or its derivative by position of this order (0, 1, 2).

        Raises ToolpointError outside the table: nothing is extrapolated.
        """
        first, last = self.span
        # Positions come from sums of axis values: rounding must not refuse either end of the travel.
        tolerance = 1e-12 * (last - first)
        if isinstance(position, float) and first - tolerance <= position <= last + tolerance:
            return self._at_one(min(max(position, first), last), order)
        places = floats("position", position)
        if places.size and (places.min() < first - tolerance or places.max() > last + tolerance):
            outside = places.min() if places.min() < first else places.max()
            fail(self.name, f"position {outside:.6g} m", f"must be within its way, {first:.6g} .. {last:.6g} m",
                 remedy="a carriage would leave its rail there: narrow the limits of the axis, or lengthen the rail")
        return np.asarray(self._spline(np.clip(places, first, last), order))

    def _at_one(self, position: float, order: int) -> FloatArray:
        """Return the cubic's value, or its derivative, at one position, without what a call for many costs."""
        interval = min(int(np.searchsorted(self.positions, position, side="right")), len(self.positions) - 1) - 1
        cubic, square, linear, constant = self._spline.c[:, interval]
        t = position - float(self.positions[interval])
        if order == 0:
            return np.asarray(((cubic * t + square) * t + linear) * t + constant)
        return np.asarray((3 * cubic * t + 2 * square) * t + linear if order == 1 else 6 * cubic * t + 2 * square)

    def deviation(self, position: float) -> FloatArray:
        """Return the error bound (2, 6, r) of the table at the two entries beside a position.

        A spline through every other entry deviates by so much at the entries between. Half the step leaves a quarter of that
        where the second derivative jumps; twice this is stated.
        """
        i = int(np.searchsorted(self.positions, position, side="right")) - 1
        return self._skipped[[min(max(k, 0), len(self.positions) - 1) for k in (i, i + 1)]] / 2

    @cached_property
    def _skipped(self) -> FloatArray:
        """Deviation (p, 6, r) at each entry of the spline through every other one; the ends take their neighbours'."""
        from scipy.interpolate import CubicSpline

        result = np.zeros_like(self.values)
        for start in (0, 1):
            nodes, checked = slice(start, None, 2), slice(1 - start, None, 2)
            spline = CubicSpline(self.positions[nodes], self.values[nodes], axis=0)
            result[checked] = spline(self.positions[checked]) - self.values[checked]
        result[[0, -1]] = result[[1, -2]]
        return result

    def mixed(self, combination: FloatArray, after: int = 0) -> MotionTable:
        """Return the table over combinations (r, k) of its coordinates; the first `after` coordinates stay as they are."""
        values = np.concatenate([self.values[:, :, :after], self.values[:, :, after:] @ combination], axis=2)
        return MotionTable(self.positions, values, self.name)
