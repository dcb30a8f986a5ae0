"""Compiled cuts of dexels along x, y and z: what a step of the tool takes from each line, and who made its ends."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.tri_dexels.tool_distance import distance_at, swept_distance

MAX_LINE_INTERVALS = 8  # of one line
_NEWTON_STEPS = 40  # on one end: the distance along a line is convex, so that they come from outside without passing it
_END_TOLERANCE = 1e-9  # m, of distance at an end
_MIN_PART = 1e-8  # m: shorter parts are not taken away


class TriWork(NamedTuple):
    """Arrays of the work in a form that kernels read: grid, lines of three directions with their ends' owners, steps, stock.

    lower, spacing : (3,) m, corner of the stock's box and cells along each axis, whose centres the lines pass; intervals : of
    each direction (n, m, MAX_LINE_INTERVALS, 2) m over the two other axes in their order; owners, earlier : the same of step
    numbers, -1 where the stock ends; numbers : (n, m) of intervals; motions : (steps, 13), see `tool_distance`; block :
    (steps,); shapes : (tools, 6); now : (1,) the last step that was cut; kind, upper : of the stock; triangles, first, columns
    : of a mesh, with the triangles over each cell of x and y; spilled : (1,) lines that would need more intervals.
    """

    lower: np.ndarray
    spacing: np.ndarray
    intervals: tuple[np.ndarray, np.ndarray, np.ndarray]
    owners: tuple[np.ndarray, np.ndarray, np.ndarray]
    earlier: tuple[np.ndarray, np.ndarray, np.ndarray]
    numbers: tuple[np.ndarray, np.ndarray, np.ndarray]
    motions: np.ndarray
    block: np.ndarray
    shapes: np.ndarray
    now: np.ndarray
    kind: int
    upper: np.ndarray
    triangles: np.ndarray
    first: np.ndarray
    columns: np.ndarray
    spilled: np.ndarray


@njit(cache=True, nogil=True, **BORROWS)
def motion_box(row, shape, box):
    """Write the corners (2, 3) of a box (m) about the tool along a step."""
    for i in range(3):
        # A disc of radius R across an axis with the part a_i reaches R sqrt(1 - a_i^2) along i.
        a, b = row[6 + i], row[9 + i]
        square_min = 0.0 if a * b < 0.0 else min(a * a, b * b)
        reach = shape[4] * math.sqrt(max(1.0 - square_min, 0.0))
        tip0, tip1 = row[i], row[3 + i]
        top0, top1 = tip0 + shape[5] * a, tip1 + shape[5] * b
        box[0, i] = min(min(tip0, tip1), min(top0, top1)) - reach
        box[1, i] = max(max(tip0, tip1), max(top0, top1)) + reach


@njit(cache=True, nogil=True, **BORROWS)
def _line_end(row, shape, place, axis, span, way):
    """Return where a line first meets the swept tool within a span, searched upwards (way 1) or downwards; not a number for
    none.

    place : room for the place on the line, whose coordinates across it are set.
    """
    t, last = (span[0], span[1]) if way > 0 else (span[1], span[0])
    for _ in range(_NEWTON_STEPS):
        place[axis] = t
        distance, _, gradient = swept_distance(row, shape, place)
        if distance <= _END_TOLERANCE:
            return t
        slope = gradient[axis] * way
        if slope >= -1e-12 or distance > (last - t) * way:
            return math.nan
        t -= way * distance / slope
        if (last - t) * way < 0.0:
            return math.nan
    return math.nan


@njit(cache=True, nogil=True, **BORROWS)
def part_of_line(row, shape, place, axis, span):
    """Return the part (m) of a span of a line that the tool sweeps along a step; the second end below the first for none."""
    first = _line_end(row, shape, place, axis, span, 1)
    if math.isnan(first):
        return 1.0, 0.0
    last = _line_end(row, shape, place, axis, (first, span[1]), -1)
    return (1.0, 0.0) if math.isnan(last) else (first, last)


@njit(cache=True, nogil=True, inline="always")
def _copy_interval(intervals, owners, earlier, source, target):
    """Copy an interval of a line with its owners; by number, as a row would be copied through an array of its own."""
    for end in range(2):
        intervals[target, end] = intervals[source, end]
        owners[target, end], earlier[target, end] = owners[source, end], earlier[source, end]


@njit(cache=True, nogil=True, **BORROWS)
def take_part(work, axis, i, j, n, part, k):
    """Take a part from interval n of a line and write its new ends' owner; return whether the interval itself is gone."""
    intervals, owners, earlier = work.intervals[axis][i, j], work.owners[axis][i, j], work.earlier[axis][i, j]
    count = work.numbers[axis]
    from_start, to_end = part[0] <= intervals[n, 0] + _MIN_PART, part[1] >= intervals[n, 1] - _MIN_PART
    if from_start and to_end:
        for m in range(n, count[i, j] - 1):
            _copy_interval(intervals, owners, earlier, m + 1, m)
        count[i, j] -= 1
        return True
    if from_start or to_end:
        end = 0 if from_start else 1
        owner = owners[n, end]
        if owner >= 0 and work.block[owner] != work.block[k]:
            earlier[n, end] = owner
        intervals[n, end], owners[n, end] = part[1 - end], k
        return False
    if count[i, j] == intervals.shape[0]:
        work.spilled[0] += 1
        return False
    for m in range(count[i, j], n + 1, -1):
        _copy_interval(intervals, owners, earlier, m - 1, m)
    intervals[n + 1, 0], intervals[n + 1, 1] = part[1], intervals[n, 1]
    owners[n + 1, 0], owners[n + 1, 1], earlier[n + 1, 0], earlier[n + 1, 1] = k, owners[n, 1], -1, earlier[n, 1]
    intervals[n, 1], owners[n, 1], earlier[n, 1] = part[0], k, -1
    count[i, j] += 1
    return False


@njit(cache=True, nogil=True, **BORROWS)
def pass_step(work, k, row, shape, room, takes, deepest):
    """Pass a tool along a step; return the volume that it meets, m^3, and the largest height above its last tip (m) there.

    row, shape : of the tool, or of a body above it; room : (3, 3), for a box and a place; takes : whether the material is
    taken;
    deepest : (4,) written: largest depth in the tool (m), known within a cell, and its place, where it is larger than before.
    """
    box, place = room[:2], room[2]
    motion_box(row, shape, box)
    bound = 0.5 * (math.sqrt((row[3] - row[0]) ** 2 + (row[4] - row[1]) ** 2 + (row[5] - row[2]) ** 2) + (shape[4] + shape[5])
                   * math.sqrt((row[9] - row[6]) ** 2 + (row[10] - row[7]) ** 2 + (row[11] - row[8]) ** 2))
    volume, height = 0.0, -1.0
    for axis in range(3):
        p, q = (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
        count = work.numbers[axis]
        i0, i1 = _index_range(work, p, box, count.shape[0])
        j0, j1 = _index_range(work, q, box, count.shape[1])
        length = 0.0
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                if count[i, j] == 0:
                    continue
                place[p] = work.lower[p] + (i + 0.5) * work.spacing[p]
                place[q] = work.lower[q] + (j + 0.5) * work.spacing[q]
                n = 0
                while n < count[i, j]:
                    a = max(work.intervals[axis][i, j, n, 0], box[0, axis])
                    b = min(work.intervals[axis][i, j, n, 1], box[1, axis])
                    n += 1
                    if b <= a:
                        continue
                    place[axis] = 0.5 * (a + b)
                    if distance_at(row, shape, 0.5, place)[0] > bound + 0.5 * (b - a):
                        continue
                    first, last = part_of_line(row, shape, place, axis, (a, b))
                    if last - first < _MIN_PART:
                        continue
                    length += last - first
                    height = max(height, _highest(row, place, axis, first, last))
                    if deepest.size:
                        for share in (0.0, 0.5, 1.0):
                            place[axis] = first + share * (last - first)
                            depth = -swept_distance(row, shape, place)[0]
                            if depth > deepest[0]:
                                deepest[0], deepest[1], deepest[2], deepest[3] = depth, place[0], place[1], place[2]
                    if takes and take_part(work, axis, i, j, n - 1, (first, last), k):
                        n -= 1
        volume += length * work.spacing[p] * work.spacing[q] / 3.0
    return volume, height


@njit(cache=True, nogil=True, inline="always")
def _index_range(work, axis, box, count):
    """Return the first and the last line along an axis across lines that pass through a box."""
    first = math.ceil((box[0, axis] - work.lower[axis]) / work.spacing[axis] - 0.5)
    last = math.floor((box[1, axis] - work.lower[axis]) / work.spacing[axis] - 0.5)
    return max(first, 0), min(last, count - 1)


@njit(cache=True, nogil=True, inline="always")
def _highest(row, place, axis, first, last):
    """Return the larger height above the last tip, along the last axis, of two places on a line."""
    height = 0.0
    for i in range(3):
        height += row[9 + i] * ((0.0 if i == axis else place[i]) - row[3 + i])
    return height + max(row[9 + axis] * first, row[9 + axis] * last)

# Code of other modules in these kernels: 2c31a1f62246
