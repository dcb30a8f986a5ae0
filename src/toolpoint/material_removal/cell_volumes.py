"""Volumes of a stock whose edges lie across the dexels: cells at walls and edges are measured along lines of their own."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.material_removal.cut_stock import CutStock
from toolpoint.material_removal.stock import Stock
from toolpoint.material_removal.surface import Work, list_mixed_cells, measure_lines, measure_volumes

# Lines of a cell and step of their Fibonacci lattice: an edge along the grid is within 1/34 (1/13) of the cell. A line through
# earlier work samples every cell that it passes: the number of lines is at most that of the dexels.
_MESH_LINES, _WORK_LINES = (34, 21), ((13, 8), (8, 5), (5, 3), (3, 2), (1, 0))
_CELLS_AT_ONCE = 20_000  # whose lines are in memory together: 200 MB


def measure_by_lines(work: Work, stock: Stock) -> tuple[float, float]:
    """Return the removed and the remaining volume, m^3, of a mesh or of work that an earlier stage left.

    A dexel measures a cell without walls; where a wall or an edge of the stock passes, the stock is measured along further
    lines.
    """
    taken, kept = measure_volumes(work)
    cells = list_mixed_cells(work)
    count, step = _MESH_LINES
    if isinstance(stock, CutStock):
        count, step = next((pair for pair in _WORK_LINES if pair[0] * len(cells) <= work.height.size), _WORK_LINES[-1])
    number = np.arange(count)
    lines = (number + 0.5) / count - 0.5, ((number * step) % count + 0.5) / count - 0.5
    area = work.spacing**2 / count
    for start in range(0, len(cells), _CELLS_AT_ONCE):
        part: FloatArray = cells[start:start + _CELLS_AT_ONCE].astype(float)
        x = work.x0 + work.spacing * (part[:, :1] + lines[0])
        y = work.y0 + work.spacing * (part[:, 1:] + lines[1])
        intervals = stock.cell_lines(x, y)
        more_taken, more_kept = measure_lines(work, x.ravel(), y.ravel(), intervals.reshape(x.size, -1, 2))
        taken, kept = taken + area * more_taken, kept + area * more_kept
    return taken, kept
