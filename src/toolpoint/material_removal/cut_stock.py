"""CutStock: work that one path has left, as the stock of the next path, along another direction of the tool."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, fail, positive
from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.mesh_intervals import MAX_MESH_INTERVALS
from toolpoint.material_removal.removed import RemovedMaterial
from toolpoint.material_removal.stock import MESH_KIND, Dexels, Stock, count_dexels
from toolpoint.material_removal.surface import has_material

_LOOK_RATIO = 1.0  # of the spacing: step along a line between two samples of the earlier work
_END_BISECTIONS = 12  # halvings of a step: an end is placed within 1/4000 of it
_LINE_SHIFT = 1e-4  # of the spacing: lines pass beside faces that lie in their plane


@dataclass(frozen=True, eq=False)
class CutStock(Stock):
    """Work left by a removal, in the axes of another plane.

    removed : of the stage before; rotation : (3, 3) columns are the axes of this plane in those of the plane before;
    first_box : (2, 3) corners of the box of the first stock, m, and to_box : (3, 3) columns are the axes of this plane in
    those of that box.

    Ends of its dexels are found within 1/4000 of the spacing; what is thinner than the spacing may be missed. Between
    dexels its faces are straight: edges of earlier stages are known within the spacing.
    """

    removed: RemovedMaterial | None = None
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    first_box: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))
    to_box: FloatArray = field(default_factory=lambda: np.eye(3))

    @classmethod
    def of(cls, removed: RemovedMaterial, rotation: FloatArray) -> CutStock:
        """Return the work that a removal has left, by the axes of the next plane in those of its own."""
        stock = removed.stock
        # The box of the first stock, turned again: a box about a turned box would grow from stage to stage.
        earlier_stock = stock if isinstance(stock, CutStock) else None
        box = np.stack([stock.lower, stock.upper]) if earlier_stock is None else earlier_stock.first_box
        to_box = np.asarray(rotation if earlier_stock is None else earlier_stock.to_box @ rotation)
        corners = np.array(list(itertools.product(*box.T))) @ to_box
        return cls(MESH_KIND, corners.min(axis=0), corners.max(axis=0), np.zeros((0, 3, 3)), removed, np.array(rotation), box,
                   to_box)

    @property
    def volume(self) -> float:
        """Volume, m^3, as it was left."""
        assert self.removed is not None
        return self.removed.left_volume

    @property
    def words(self) -> str:
        """Kind and size in words."""
        size = 1e3 * (self.upper - self.lower)
        return f"work as the stage before left it, within {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm of this plane's axes"

    def laid_out(self, spacing: float) -> Dexels:
        """Return the dexels at a spacing (m) along the axis of this plane, their intervals sorted upwards."""
        assert self.removed is not None and self.removed.work is not None
        h = positive("spacing", spacing)
        count = count_dexels(self.lower, self.upper, h)
        origin = self.lower[:2] + h / 2
        intervals = np.full((*count.tolist(), MAX_MESH_INTERVALS, 2), np.nan)
        number = _cross_work(self.removed.work, np.ascontiguousarray(self.rotation),
                             (origin[0], origin[1], h), (np.ascontiguousarray(self.to_box), self.first_box), intervals)
        if number > MAX_MESH_INTERVALS:
            fail("stock", f"work that is crossed {number} times by one line", f"must be at most {MAX_MESH_INTERVALS}",
                 remedy="a larger spacing")
        return Dexels(float(origin[0]), float(origin[1]), h, intervals[:, :, :max(number, 1)].copy())

    def cell_lines(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the intervals (cells, lines, n, 2) of the work along upright lines at x and y (cells, lines), m."""
        assert self.removed is not None and self.removed.work is not None
        intervals = np.full((x.size, MAX_MESH_INTERVALS, 2), np.nan)
        places = np.stack([x.ravel(), y.ravel()], axis=1)
        number = _cross_places(self.removed.work, np.ascontiguousarray(self.rotation), self.removed.settings.spacing,
                               (np.ascontiguousarray(self.to_box), self.first_box), places, intervals)
        return intervals[:, :min(max(number, 1), MAX_MESH_INTERVALS)].reshape(*x.shape, -1, 2)


@njit(cache=True, nogil=True, **BORROWS)
def _is_inside(work, rotation, x, y, z):
    """Whether a place (m, in the new axes) lies inside the earlier work."""
    return has_material(work, rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z,
                        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z,
                        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z, 0)


@njit(cache=True, nogil=True, **BORROWS)
def _end(work, rotation, place, span, starts_inside):
    """Return the z (m) at which a line enters or leaves the earlier work, between two samples of a span."""
    lower, upper = span
    for _ in range(_END_BISECTIONS):
        middle = 0.5 * (lower + upper)
        if _is_inside(work, rotation, place[0], place[1], middle) == starts_inside:
            lower = middle
        else:
            upper = middle
    return 0.5 * (lower + upper)


@njit(cache=True, nogil=True, **BORROWS)
def _span_in_box(to_box, box, x, y):
    """Return the z (m) at which an upright line enters and leaves a rotated box; the second is lower where it misses it."""
    first, last = -math.inf, math.inf
    for k in range(3):
        base, slope = to_box[k, 0] * x + to_box[k, 1] * y, to_box[k, 2]
        if abs(slope) < 1e-12:
            if base < box[0, k] or base > box[1, k]:
                return 1.0, 0.0
            continue
        a, b = (box[0, k] - base) / slope, (box[1, k] - base) / slope
        first, last = max(first, min(a, b)), min(last, max(a, b))
    return first, last


@njit(cache=True, nogil=True, **BORROWS)
def _cross_work(work, rotation, grid, first_stock, intervals):
    """Write the intervals of every line of a grid (x0, y0, spacing); return the largest number of them on a line."""
    x0, y0, h = grid
    number_max = 0
    for i in range(intervals.shape[0]):
        for j in range(intervals.shape[1]):
            # Shifted unequally in x and y: a line through an edge or a diagonal of the mesh would cross it twice or not at
            # all.
            place = (x0 + (i + _LINE_SHIFT) * h, y0 + (j + 1.7 * _LINE_SHIFT) * h)
            number_max = max(number_max, _cross_line(work, rotation, _LOOK_RATIO * h, first_stock, place, intervals[i, j]))
    return number_max


@njit(cache=True, nogil=True, **BORROWS)
def _cross_places(work, rotation, step, first_stock, places, intervals):
    """Write the intervals of the lines at places (n, 2); return the largest number of them on a line."""
    number_max = 0
    for n in range(places.shape[0]):
        place = (places[n, 0], places[n, 1])
        number_max = max(number_max, _cross_line(work, rotation, step, first_stock, place, intervals[n]))
    return number_max


@njit(cache=True, nogil=True, **BORROWS)
def _cross_line(work, rotation, step, first_stock, place, intervals):
    """Write the intervals of the earlier work on a line, sampled in steps (m); return their number, also beyond the room."""
    span = _span_in_box(first_stock[0], first_stock[1], place[0], place[1])
    if span[1] < span[0]:
        return 0
    was_inside, number, previous = False, 0, span[0] - step
    for n in range(math.ceil((span[1] - span[0]) / step) + 2):
        z = span[0] - 0.5 * step + n * step
        now = _is_inside(work, rotation, place[0], place[1], z)
        if now != was_inside:
            if number < intervals.shape[0]:
                intervals[number, 0 if now else 1] = _end(work, rotation, place, (previous, z), was_inside)
            number += 0 if now else 1
        was_inside, previous = now, z
    return number

# Code of other modules in these kernels: 7190a4000aa3
