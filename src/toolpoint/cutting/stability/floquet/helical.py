r"""Helical tools of equal pitch in the default engine: the cut's shape depends on depth, so each boundary is a fixed point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.cut.arc import ArcNodes, gauss
from toolpoint.cutting.cut.coefficients import CuttingCoefficients, mean_matrix
from toolpoint.cutting.cut.problem import MillingProblem

# solve(nodes' depth, speed, largest depth, levels) -> rows (depth, theta, change, error) of the frozen shape, sorted
Frozen = Callable[[float, float, float], FloatArray]


def helical_nodes(problem: MillingProblem, depth: float, density: float, *, nodes_min: int, second_direction: bool) -> ArcNodes:
    r"""Return the nodes for the mean matrix over the height, :math:`\bar A(\xi) = 1/\Lambda \int_0^\Lambda k n^T d\lambda` in
    closed form, :math:`\Lambda = 2 \tan\beta\, d/D` the lag of the edge; every entry and exit of tip and top is a break."""
    tool, arc = problem.tool, problem.engagement
    pitch = 2 * np.pi / tool.teeth
    lag = 2 * abs(float(np.tan(tool.helix[0]))) * depth / tool.diameter
    marks = np.array([0.0, lag, arc.arc, arc.arc + lag]) % pitch
    # Rounded: marks that coincide in theory differ by rounding, and a stretch between them would have no length.
    ends = np.unique(np.round(np.concatenate([[0.0, pitch], marks]), 12))
    rows = []
    for a, b in pairwise(ends):
        reach = (a + b) / 2 + pitch * np.arange(int(np.ceil((arc.arc + lag) / pitch)) + 1)
        teeth = np.flatnonzero(reach < arc.arc + lag)
        if teeth.size == 0 or b - a < 1e-9:
            continue
        x, w, rising = gauss(nodes_min + int(np.ceil(density * (b - a))))
        angle, half = a + (b - a) * (1 + x) / 2, (b - a) / 2
        matrix = _mean_over_height(problem.coefficients, arc.entry, arc.arc, lag, angle[:, None] + pitch * teeth,
                                   problem.plane.size)
        rows.append(_Arc(angle, half * w, half * rising, matrix))
    return _assemble_nodes(rows, 2 if second_direction else 1)


def _mean_over_height(material: CuttingCoefficients, entry: float, arc: float, lag: float, u: FloatArray,
                      size: int) -> FloatArray:
    """Return the mean of k n^T over the height summed over teeth whose tips are u past entry, shape (n, size, size)."""
    lower, upper = np.maximum(u - lag, 0.0), np.minimum(u, arc)
    total = np.zeros((u.shape[0], size, size))
    for i, j in np.ndindex(u.shape):
        if upper[i, j] > lower[i, j]:
            a, b = entry + float(lower[i, j]), entry + float(upper[i, j])
            total[i] += mean_matrix(material, a, b, teeth=1, size=size) * (2 * np.pi / lag)
    return total


class _Arc(NamedTuple):
    """Gauss nodes of one stretch of the arc: angles, weights, integrals up to each node, mean force (n, d, d)."""

    angle: FloatArray
    weight: FloatArray
    rising: FloatArray
    force: FloatArray


def _assemble_nodes(rows: Sequence[_Arc], ways: int) -> ArcNodes:
    angle = np.concatenate([np.tile(row.angle, ways) for row in rows])
    weight = np.concatenate([np.tile(row.weight, ways) for row in rows])
    force = np.concatenate([np.concatenate([row.force[:, :, way] for way in range(ways)]) for row in rows])
    chip = np.concatenate([np.repeat(np.eye(row.force.shape[1])[:ways], row.angle.size, axis=0) for row in rows])
    size = [ways * row.angle.size for row in rows]
    offsets = np.concatenate([[0], np.cumsum(size)])
    partial = np.zeros((offsets[-1], offsets[-1]))
    for i, row in enumerate(rows):
        block = slice(offsets[i], offsets[i + 1])
        partial[block, :offsets[i]] = weight[None, :offsets[i]]
        partial[block, block] = np.tile(row.rising, (ways, ways))
    return ArcNodes(angle, weight, partial, np.ascontiguousarray(chip), np.ascontiguousarray(force))


class _Boundary(NamedTuple):
    """A boundary point: depth, angle of the multiplier, change of the count, error of the depth."""

    depth: float
    angle: float
    change: float
    error: float


class _Cell(NamedTuple):
    """Depths between which the count changes, and the counts at both."""

    lower: float
    upper: float
    below: int
    above: int


def boundaries(frozen: Frozen, speed: float, counts: FloatArray, *, levels: FloatArray) -> list[_Boundary]:
    """Return the boundary points of one speed from the counts at the levels (first at depth zero, 0): each is the depth at
    which a boundary of the frozen shape is the shape's own depth."""
    rows: list[_Boundary] = []
    stack = [_Cell(a, b, int(m), int(n)) for (a, b), (m, n) in zip(pairwise(levels), pairwise(counts)) if m != n]
    while stack:
        cell = stack.pop()
        a, b, m, n = cell
        point = _fixed_point(frozen, speed, a, b)
        if point is not None and abs(n - m) >= abs(int(point.change)) and (n - m) * point.change > 0:
            rows.append(point)
            if n - m != int(point.change):
                stack += _remaining_cells(frozen, speed, cell, point)
            continue
        if b - a < 1e-6 * b:
            rows.append(_Boundary((a + b) / 2, np.pi / 2, n - m, b - a))
            continue
        middle = (a + b) / 2
        half = count_at(frozen, speed, middle)
        stack += [part for part in (_Cell(a, middle, m, half), _Cell(middle, b, half, n)) if part.below != part.above]
    return rows


def _remaining_cells(frozen: Frozen, speed: float, cell: _Cell, point: _Boundary) -> list[_Cell]:
    # Farther off than the point's own error, else the count beside it could be that of its other side.
    lower, upper = point.depth * (1 - 1e-5), point.depth * (1 + 1e-5)
    count_below, count_above = count_at(frozen, speed, lower), count_at(frozen, speed, upper)
    parts = (_Cell(cell.lower, lower, cell.below, count_below), _Cell(upper, cell.upper, count_above, cell.above))
    return [part for part in parts if part.below != part.above and part.upper > part.lower]


def count_at(frozen: Frozen, speed: float, depth: float) -> int:
    """Return the number of unstable multipliers at this depth."""
    rows = frozen(depth, speed, depth)
    return int(rows[rows[:, 0] <= depth, 2].sum())


def _fixed_point(frozen: Frozen, speed: float, a: float, b: float) -> _Boundary | None:
    r"""Solve d = (boundary of the shape frozen at d) by the secant rule; None where it leaves the cell.

    With R(s) the boundary of the shape frozen at s, the growth G(w, s) changes along s = w by :math:`G_w (1 - R')`: where the
    boundary moves faster than the depth, a multiplier that leaves the circle of the frozen shape enters that of the cut.
    """
    d0 = (a + b) / 2
    # A little beyond the cell: the boundary of a frozen shape may lie deeper than that of the cut.
    row = _nearest(frozen(d0, speed, 1.5 * b), d0)
    if row is None:
        return None
    g0, d1, slope = row[0] - d0, row[0], -1.0
    for _ in range(12):
        if not a <= d1 <= b:
            return None
        row = _nearest(frozen(d1, speed, 1.3 * d1), d1)
        if row is None:
            return None
        g1 = row[0] - d1
        if g1 != g0 and abs(d1 - d0) > 1e-9 * d1:
            slope = (g1 - g0) / (d1 - d0)  # R' - 1
        if abs(g1) < 1e-11 * d1 or g1 == g0:
            break
        d0, d1, g0 = d1, d1 - g1 / slope, g1
    if abs(g1) > 1e-8 * d1:
        return None
    depth, angle, change, error = row
    return _Boundary(depth, angle, change if slope < 0 else -change, error + 2 * abs(g1))


def _nearest(rows: FloatArray, depth: float) -> Array | None:
    return None if rows.shape[0] == 0 else rows[np.argmin(np.abs(rows[:, 0] - depth))]
