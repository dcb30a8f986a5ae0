r"""Helical tools of equal pitch in the default engine: the cut's shape depends on depth, so each boundary is a fixed point."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.cut.arc import ArcNodes, gauss
from toolpoint.cutting.cut.coefficients import CuttingCoefficients, mean_matrix
from toolpoint.cutting.cut.problem import MillingProblem

# solve(nodes' depth, speed, largest depth, levels) -> rows (depth, theta, change, error) of the frozen shape, sorted
Frozen = Callable[[float, float, float], FloatArray]
Cell = tuple[float, float, int, int]  # depths and counts at its ends


def helical_nodes(problem: MillingProblem, depth: float, density: float, *, least: int, second_direction: bool) -> ArcNodes:
    r"""Nodes for the mean matrix over the height, :math:`\bar A(\xi) = 1/\Lambda \int_0^\Lambda k n^T d\lambda` in closed
    form, :math:`\Lambda = 2 \tan\beta\, d/D` the lag of the edge; every entry and exit of tip and top is a break."""
    tool, arc = problem.tool, problem.engagement
    pitch = 2 * np.pi / tool.teeth
    lag = 2 * abs(float(np.tan(tool.helix[0]))) * depth / tool.diameter
    marks = np.array([0.0, lag, arc.arc, arc.arc + lag]) % pitch
    ends = np.unique(np.round(np.concatenate([[0.0, pitch], marks]), 12))
    rows = []
    for place, (a, b) in enumerate(pairwise(ends)):
        reach = (a + b) / 2 + pitch * np.arange(int(np.ceil((arc.arc + lag) / pitch)) + 1)
        teeth = np.flatnonzero(reach < arc.arc + lag)
        if teeth.size == 0 or b - a < 1e-9:
            continue
        x, w, rising = gauss(least + int(np.ceil(density * (b - a))))
        angle, half = a + (b - a) * (1 + x) / 2, (b - a) / 2
        matrix = _mean(problem.coefficients, arc.entry, arc.arc, lag, angle[:, None] + pitch * teeth, problem.plane.size)
        rows.append((place, angle, half * w, half * rising, matrix))
    return _assembled(rows, 2 if second_direction else 1)


def _mean(material: CuttingCoefficients, entry: float, arc: float, lag: float, u: FloatArray, size: int) -> FloatArray:
    """Mean of k n^T over the height summed over teeth whose tips are u past entry, shape (n, size, size)."""
    low, high = np.maximum(u - lag, 0.0), np.minimum(u, arc)
    total = np.zeros((u.shape[0], size, size))
    for i, j in np.ndindex(u.shape):
        if high[i, j] > low[i, j]:
            a, b = entry + float(low[i, j]), entry + float(high[i, j])
            total[i] += mean_matrix(material, a, b, teeth=1, size=size) * (2 * np.pi / lag)
    return total


def _assembled(rows: list[tuple[int, FloatArray, FloatArray, FloatArray, FloatArray]], ways: int) -> ArcNodes:
    angle = np.concatenate([np.tile(r[1], ways) for r in rows])
    weight = np.concatenate([np.tile(r[2], ways) for r in rows])
    force = np.concatenate([np.concatenate([r[4][:, :, way] for way in range(ways)]) for r in rows])
    chip = np.concatenate([np.repeat(np.eye(r[4].shape[1])[:ways], r[1].size, axis=0) for r in rows])
    size = [ways * r[1].size for r in rows]
    at = np.concatenate([[0], np.cumsum(size)])
    partial = np.zeros((at[-1], at[-1]))
    for i, row in enumerate(rows):
        own = slice(at[i], at[i + 1])
        partial[own, :at[i]] = weight[None, :at[i]]
        partial[own, own] = np.tile(row[3], (ways, ways))
    return ArcNodes(angle, weight, partial, np.ascontiguousarray(chip), np.ascontiguousarray(force))


def boundaries(frozen: Frozen, speed: float, counts: FloatArray, *, levels: FloatArray) -> list[Array]:
    """Boundary points of one speed from the counts at the levels (first at depth zero, 0): rows (depth, theta, change,
    error), each the depth at which a boundary of the frozen shape is the shape's own depth."""
    rows: list[Array] = []
    stack = [(a, b, int(m), int(n)) for (a, b), (m, n) in zip(pairwise(levels), pairwise(counts)) if m != n]
    while stack:
        a, b, m, n = stack.pop()
        point = _fixed_point(frozen, speed, a, b)
        if point is not None and abs(n - m) >= abs(int(point[2])) and (n - m) * point[2] > 0:
            rows.append(point)
            if n - m != int(point[2]):
                stack += _rest(frozen, speed, (a, b, m, n), point)
            continue
        if b - a < 1e-6 * b:
            rows.append(np.array([(a + b) / 2, np.pi / 2, n - m, b - a]))
            continue
        middle = (a + b) / 2
        half = count_at(frozen, speed, middle)
        stack += [part for part in ((a, middle, m, half), (middle, b, half, n)) if part[2] != part[3]]
    return rows


def _rest(frozen: Frozen, speed: float, cell: Cell, found: Array) -> list[Cell]:
    a, b, m, n = cell
    low, high = found[0] * (1 - 1e-5), found[0] * (1 + 1e-5)
    before, after = count_at(frozen, speed, low), count_at(frozen, speed, high)
    parts = ((a, low, m, before), (high, b, after, n))
    return [p for p in parts if p[2] != p[3] and p[1] > p[0]]


def count_at(frozen: Frozen, speed: float, depth: float) -> int:
    """Number of unstable multipliers at this depth."""
    rows = frozen(depth, speed, depth)
    return int(rows[rows[:, 0] <= depth, 2].sum())


def _fixed_point(frozen: Frozen, speed: float, a: float, b: float) -> Array | None:
    """Secant iteration for d = (boundary of the shape frozen at d), None where it leaves the cell."""
    d0 = (a + b) / 2
    row = _nearest(frozen(d0, speed, 1.5 * b), d0)
    if row is None:
        return None
    g0, d1 = row[0] - d0, row[0]
    for _ in range(12):
        if not a <= d1 <= b:
            return None
        row = _nearest(frozen(d1, speed, 1.3 * d1), d1)
        if row is None:
            return None
        g1 = row[0] - d1
        if abs(g1) < 1e-11 * d1 or g1 == g0:
            break
        d0, d1, g0 = d1, d1 - g1 * (d1 - d0) / (g1 - g0), g1
    if abs(g1) > 1e-8 * d1:
        return None
    return np.array([row[0], row[1], row[2], row[3] + 2 * abs(g1)])


def _nearest(rows: FloatArray, depth: float) -> Array | None:
    return None if rows.shape[0] == 0 else rows[np.argmin(np.abs(rows[:, 0] - depth))]
