r"""Interfaces that slide: a carriage on rails, a ram in its housing, a limb through its frame.

A body is reduced once, with responses to the patch at stations along its way among its shapes. Online only
:math:`b(z) = V^T W(z)` depends on the position z; it is tabulated, with a spline that is smooth to the second derivative
between the entries, so frequencies are smooth in z and have an exact derivative. Consistent weights make b smooth; what the
spline leaves out is measured between its entries when it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, count, fail, floats, increasing, positive
from toolpoint.substructuring.estimate import Surroundings
from toolpoint.substructuring.reduction import Reduction

SlidingWeights = Callable[[float], "csc_array | FloatArray"]


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

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "positions", increasing("positions", floats("positions", self.positions)))
        put(self, "values", floats("values", self.values, (self.positions.size, None, None)))
        if self.positions.size < 4:
            fail("positions", f"{self.positions.size}", "must be at least 4 for a smooth table", "make the step smaller")
        put(self, "_spline", CubicSpline(self.positions, self.values, axis=0, extrapolate=False))

    @property
    def span(self) -> tuple[float, float]:
        """First and last position, m."""
        return float(self.positions[0]), float(self.positions[-1])

    def at(self, position: float | FloatArray, order: int = 0) -> FloatArray:
        """Return the motion (..., 6, r) at positions, or its derivative by position of this order (0, 1, 2).

        Raises ToolpointError beyond the way: nothing is extrapolated.
        """
        place = floats("position", position)
        low, high = self.span
        slack = 1e-12 * (high - low)
        if place.size and (place.min() < low - slack or place.max() > high + slack):
            worst = place.min() if place.min() < low else place.max()
            fail(self.name, f"position {worst:.6g} m", f"must be within its way, {low:.6g} .. {high:.6g} m",
                 "a carriage would leave its rail there: narrow the limits of the axis, or lengthen the rail")
        spline: CubicSpline = self._spline  # type: ignore[attr-defined]
        return np.asarray(spline(np.clip(place, low, high), order))

    def joined(self, more: FloatArray) -> MotionTable:
        """Return the table with further coordinates (p, 6, k) behind its own."""
        return MotionTable(self.positions, np.concatenate([self.values, more], axis=2), self.name, self.error)


def tabulate(shapes: FloatArray, weights: SlidingWeights, low: float, high: float, *, step: float = 5e-3, name: str = "place",
             is_checked: bool = True) -> MotionTable:
    """Return the motion of a sliding place in given shapes.

    Parameters
    ----------
    shapes : (n, r) floats
        Rigid motions and vectors of a reduction, side by side.
    weights : function of position (m) to (n, 6) consistent weights
        Such as ``lambda z: patch.moved([0, 0, z]).averages(model)``; raises where the place would leave its rail.
    low, high : float
        Way, m.
    step : float
        Of the table, m.
    is_checked : bool
        Whether the spline is compared with the mesh midway between entries, at eight places.
    """
    if not low < high:
        fail("low", f"{low:g} m with high {high:g} m", "must be below it")
    count = max(int(np.ceil((high - low) / positive("step", step) - 1e-9)), 3) + 1
    at = np.linspace(low, high, count)
    values = np.array([weights(float(z)).T @ shapes for z in at])
    table = MotionTable(at, values, name)
    if not is_checked:
        return table
    middle = (at[:-1] + at[1:]) / 2
    sample = middle[np.unique(np.linspace(0, len(middle) - 1, 8).astype(int))]
    exact = np.array([weights(float(z)).T @ shapes for z in sample])
    size = np.abs(values).max(axis=(0, 2), keepdims=True)
    error = float(np.max(np.abs(table.at(sample) - exact) / np.maximum(size, 1e-300)))
    return MotionTable(at, values, name, error)


def station_loads(weights: Sequence[SlidingWeights], low: float, high: float, step: float) -> csc_array:
    """Return loads of several sliding places at stations a step apart or closer, side by side, (n, 6 k): for `LargeBody`.

    Stations a patch length apart or closer are enough: what they have in common is compressed.
    """
    from scipy.sparse import hstack

    count = max(int(np.ceil((high - low) / positive("step", step) - 1e-9)), 1) + 1
    return csc_array(hstack([csc_array(place(float(z))) for z in np.linspace(low, high, count) for place in weights]))


@dataclass(frozen=True, eq=False)
class SlidingBody:
    """A reduced body with places that slide along it and others that stay.

    Parameters
    ----------
    reduction : Reduction
    tables : mapping of name to MotionTable
        Over the rigid motions and vectors of the reduction, side by side.
    fixed : (f, r) floats
        Motions of the other loads' places, likewise.
    """

    reduction: Reduction
    tables: Mapping[str, MotionTable]
    fixed: FloatArray

    @property
    def span(self) -> tuple[float, float]:
        """Positions at which all sliding places are on their ways, m."""
        spans = [table.span for table in self.tables.values()]
        return max(low for low, _ in spans), min(high for _, high in spans)

    def participation(self, position: float, order: int = 0) -> FloatArray:
        """Return the motion of all places (sliding ones first) per coordinate, or its derivative by the position."""
        moving = [table.at(position, order) for table in self.tables.values()]
        return np.concatenate([*moving, self.fixed if order == 0 else np.zeros_like(self.fixed)])

    def frequencies(self, position: float, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        """Return the lowest coupled natural frequencies (Hz) with the places at a position, and their derivative, Hz/m.

        surroundings : over the places (sliding ones first), then further coordinates. The derivative is that of simple roots.
        """
        part = self.participation(position)
        places, inner = part.shape
        others = len(surroundings.stiffness) - places
        if others < 0:
            fail("surroundings", f"{len(surroundings.stiffness)} coordinates", f"must be at least the {places} places")
        n = inner + others
        place = np.zeros((places + others, n))
        place[:places, :inner], place[places:, inner:] = part, np.eye(others)
        k, m = place.T @ surroundings.stiffness @ place, place.T @ surroundings.mass @ place
        rigid = inner - self.reduction.size
        k[range(rigid, inner), range(rigid, inner)] += self.reduction.squares
        m[range(inner), range(inner)] += 1.0
        number = min(count("modes", modes), n)
        squares, vectors = eigh(k, m, subset_by_index=[0, number - 1], check_finite=False)
        slope = self.participation(position, 1) @ vectors[:inner]
        moved = place @ vectors
        force = surroundings.stiffness @ moved - (surroundings.mass @ moved) * squares
        omega = np.sqrt(np.maximum(squares, 1e-300))
        return omega / (2 * np.pi), np.einsum("im,im->m", slope, force[:places]) / (2 * np.pi * omega)
