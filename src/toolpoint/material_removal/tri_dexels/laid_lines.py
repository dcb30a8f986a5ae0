"""Dexels along x, y and z of a stock before the first cut."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.material_removal.stock import BOX_KIND, CYLINDER_KIND, MESH_KIND, Stock
from toolpoint.material_removal.tri_dexels.lines import MAX_LINE_INTERVALS, TriWork

MAX_TRI_LINES = 8_000_000  # of three directions together: 2.1 GB


def lay_lines(stock: Stock, spacing: float, *, motions: FloatArray, block: np.ndarray, shapes: FloatArray) -> TriWork:
    """Return the work before the first step, with lines at a spacing (m) at most; cells tile the stock's box exactly.

    Raises ToolpointError for more lines than the memory takes, and for meshes that are not closed.
    """
    if type(stock) is not Stock:
        fail("stock", stock.words, "must be a box, a cylinder or a mesh", remedy="give the work before the first cut")
    size = stock.upper - stock.lower
    # A size that is a whole number of spacings must not get one line more by rounding.
    count = np.maximum(np.ceil(size / spacing - 1e-9).astype(int), 1)
    lines = int(count[1] * count[2] + count[0] * count[2] + count[0] * count[1])
    if lines > MAX_TRI_LINES:
        fail("spacing", f"{1e3 * spacing:g} mm: {lines / 1e6:.1f} million dexels", f"must need at most {MAX_TRI_LINES / 1e6:g} "
             "million", remedy="a larger spacing, or a smaller stock")
    cells = size / count
    lines_of_axes = []
    for axis in range(3):
        p, q = [i for i in range(3) if i != axis]
        u, v = (stock.lower[i] + cells[i] * (np.arange(count[i]) + 0.5) for i in (p, q))
        ends = lines_of_stock(stock, axis, x=u, y=v)
        filled = np.zeros((u.size, v.size, MAX_LINE_INTERVALS, 2))
        has_interval = ~np.isnan(ends[..., 0])
        if has_interval.sum(axis=2).max(initial=0) > MAX_LINE_INTERVALS // 2:
            fail("stock", f"a mesh crossed {2 * int(has_interval.sum(axis=2).max())} times by one line",
                 f"must be at most {MAX_LINE_INTERVALS}", remedy="give the stock without its small inner faces")
        filled[:, :, :ends.shape[2]] = np.where(has_interval[..., None], ends, 0.0)[:, :, :MAX_LINE_INTERVALS]
        lines_of_axes.append((filled, has_interval.sum(axis=2).astype(np.int32)))
    x, y, z = lines_of_axes
    first, columns = _columns(stock, count, cells)
    return TriWork(np.array(stock.lower), cells, (x[0], y[0], z[0]), _owners(x[0], y[0], z[0]), _owners(x[0], y[0], z[0]),
                   (x[1], y[1], z[1]),
                   np.ascontiguousarray(motions), np.ascontiguousarray(block, dtype=np.int64), shapes,
                   np.full(1, -1, np.int64), stock.kind, np.array(stock.upper), np.array(stock.triangles), first, columns,
                   np.zeros(1, np.int64))


def _owners(*ends: FloatArray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return owners of the ends of lines along x, y and z: none yet."""
    x, y, z = (np.full(each.shape, -1, np.int32) for each in ends)
    return x, y, z


def lines_of_stock(stock: Stock, axis: int, *, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the intervals (nx, ny, n, 2) of a stock along an axis, not a number where there is none; known ones come first."""
    ends = np.empty((x.size, y.size, 1, 2))
    if stock.kind == MESH_KIND:
        from toolpoint.material_removal.mesh_intervals import cross_mesh  # brings the compiler

        order = [i for i in range(3) if i != axis] + [axis]
        return cross_mesh(np.ascontiguousarray(stock.triangles[:, :, order]), x, y)
    ends[..., 0], ends[..., 1] = stock.lower[axis], stock.upper[axis]
    if stock.kind == BOX_KIND:
        return ends
    assert stock.kind == CYLINDER_KIND
    centre, radius = (stock.lower + stock.upper) / 2, (stock.upper - stock.lower)[0] / 2
    if axis == 2:
        ends[(x[:, None] - centre[0]) ** 2 + (y[None, :] - centre[1]) ** 2 > radius**2] = np.nan
        return ends
    half = np.sqrt(np.maximum(radius**2 - (x - centre[1 - axis]) ** 2, 0.0))[:, None]
    ends[..., 0, 0], ends[..., 0, 1] = centre[axis] - half, centre[axis] + half
    ends[(half <= 0)[:, 0]] = np.nan
    return ends


def _columns(stock: Stock, count: np.ndarray, cells: FloatArray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles over each cell of x and y: where each cell's begin, (cells + 1,), and their indices."""
    nx, ny = int(count[0]), int(count[1])
    if stock.kind != MESH_KIND:
        return np.zeros(1, np.int64), np.zeros(0, np.int64)
    span = [(np.floor((stock.triangles[:, :, i].min(axis=1) - stock.lower[i]) / cells[i] - 1e-9).astype(int),
             np.floor((stock.triangles[:, :, i].max(axis=1) - stock.lower[i]) / cells[i] + 1e-9).astype(int)) for i in (0, 1)]
    keys, triangle = [], []
    for k in range(len(stock.triangles)):
        i = np.arange(max(span[0][0][k], 0), min(span[0][1][k], nx - 1) + 1)
        j = np.arange(max(span[1][0][k], 0), min(span[1][1][k], ny - 1) + 1)
        keys.append((i[:, None] * ny + j).ravel())
        triangle.append(np.full(keys[-1].size, k))
    cell, index = np.concatenate(keys), np.concatenate(triangle)
    order = np.argsort(cell, kind="stable")
    return np.searchsorted(cell[order], np.arange(nx * ny + 1)), index[order].astype(np.int64)
