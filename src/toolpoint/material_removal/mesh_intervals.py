"""Compiled intervals of a closed mesh along upright lines: crossings of each line with the triangles, sorted in pairs."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, fail
from toolpoint._kernel_options import BORROWS

_GRID_SHIFT = 1e-7  # of the spacing: lines pass beside edges and corners of a mesh laid on round numbers
MAX_MESH_INTERVALS = 16  # along one line
_MAX_OPEN_FRACTION = 1e-3  # of the lines through a mesh that may cross it an odd number of times


def cross_mesh(triangles: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the intervals (nx, ny, n, 2) inside a closed mesh along upright lines at x and y, not a number where none.

    Raises ToolpointError where lines cross the mesh an odd number of times: it is not closed.
    """
    count = np.zeros((x.size, y.size), np.int32)
    shift = _GRID_SHIFT * (x[1] - x[0] if x.size > 1 else 1.0)
    crossings = np.full((x.size, y.size, 2 * MAX_MESH_INTERVALS), np.nan)
    # Shifted a little, and unequally in x and y: a line through an edge, or along a diagonal of the mesh, would cross it
    # twice or not at all.
    _cross(np.ascontiguousarray(triangles), x + shift, y + 1.7 * shift, count, crossings)
    if count.max() > 2 * MAX_MESH_INTERVALS:
        fail("stock", f"a mesh crossed {count.max()} times by one upright line", f"must be at most {2 * MAX_MESH_INTERVALS}",
             remedy="give the stock without its small inner faces")
    is_open = int((count % 2 == 1).sum())
    if is_open > _MAX_OPEN_FRACTION * max(int((count > 0).sum()), 1):
        fail("stock", f"a mesh that is not closed ({is_open} upright lines cross it an odd number of times)",
             "must enclose a volume", remedy="close it in the program that wrote it")
    crossings.sort(axis=2)
    n = max(int(count.max()) // 2, 1)
    intervals = crossings[:, :, :2 * n].reshape(x.size, y.size, n, 2).copy()
    intervals[count % 2 == 1] = np.nan
    return intervals


def cross_cells(triangles: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the intervals (cells, lines, n, 2) inside a closed mesh along upright lines at x and y (cells, lines), m.

    The lines of a cell lie near each other: triangles beside a cell are passed over. Lines that cross the mesh an odd number of
    times, through an edge, have none.
    """
    crossings = np.full((*x.shape, 2 * MAX_MESH_INTERVALS), np.nan)
    count = np.zeros(x.shape, np.int32)
    _cross_cells(np.ascontiguousarray(triangles), np.ascontiguousarray(x), np.ascontiguousarray(y), count, crossings)
    crossings[count % 2 == 1] = np.nan
    crossings.sort(axis=2)
    n = max(int(count.max(initial=0)) // 2, 1)
    return crossings[:, :, :2 * n].reshape(*x.shape, n, 2)


@njit(cache=True, nogil=True)
def _cross_cells(triangles, x, y, count, crossings):
    """Write z of every crossing of the lines of cells with the triangles, by strips of cells in x."""
    lower, upper = x[:, 0].copy(), x[:, 0].copy()
    for cell in range(x.shape[0]):
        lower[cell], upper[cell] = x[cell].min(), x[cell].max()
    order = np.argsort(lower)
    width = (upper - lower).max()
    starts = lower[order]
    for k in range(triangles.shape[0]):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:
            continue
        y_min, y_max = min(ay, by, cy), max(ay, by, cy)
        first = np.searchsorted(starts, min(ax, bx, cx) - width)
        last = np.searchsorted(starts, max(ax, bx, cx), side="right")
        for cell in order[first:last]:
            if y[cell].max() < y_min or y[cell].min() > y_max:
                continue
            for n in range(x.shape[1]):
                u = ((x[cell, n] - ax) * (cy - ay) - (cx - ax) * (y[cell, n] - ay)) / area
                v = ((bx - ax) * (y[cell, n] - ay) - (x[cell, n] - ax) * (by - ay)) / area
                if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                    if count[cell, n] < crossings.shape[2]:
                        crossings[cell, n, count[cell, n]] = az + u * (bz - az) + v * (cz - az)
                    count[cell, n] += 1


@njit(cache=True, nogil=True, **BORROWS)
def _cross(triangles, x, y, count, crossings):
    """Write z of every crossing of the lines with the triangles; count goes on beyond the room for them."""
    step_x = x[1] - x[0] if x.size > 1 else 1.0
    step_y = y[1] - y[0] if y.size > 1 else 1.0
    for k in range(triangles.shape[0]):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:
            continue
        first = max(math.ceil((min(ax, bx, cx) - x[0]) / step_x), 0)
        last = min(math.floor((max(ax, bx, cx) - x[0]) / step_x), x.size - 1)
        lower = max(math.ceil((min(ay, by, cy) - y[0]) / step_y), 0)
        upper = min(math.floor((max(ay, by, cy) - y[0]) / step_y), y.size - 1)
        for i in range(first, last + 1):
            for j in range(lower, upper + 1):
                u = ((x[i] - ax) * (cy - ay) - (cx - ax) * (y[j] - ay)) / area
                v = ((bx - ax) * (y[j] - ay) - (x[i] - ax) * (by - ay)) / area
                if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                    if count[i, j] < crossings.shape[2]:
                        crossings[i, j, count[i, j]] = az + u * (bz - az) + v * (cz - az)
                    count[i, j] += 1

# Code of other modules in these kernels: 814697192537
