"""Compiled question whether there is material at a place: lines around it, and the steps that made their ends."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.tri_dexels.tool_distance import sweeps

_NEAR_ENDS = 1.6  # cells: ends of lines so near are asked for the step that made them


@njit(cache=True, nogil=True, **BORROWS)
def stock_has(work, place):
    """Whether a place (m) lies inside the stock before the first cut."""
    for i in range(3):
        if place[i] < work.lower[i] or place[i] > work.upper[i]:
            return False
    if work.kind == 0:
        return True
    if work.kind == 1:
        radius = 0.5 * (work.upper[0] - work.lower[0])
        dx, dy = place[0] - 0.5 * (work.lower[0] + work.upper[0]), place[1] - 0.5 * (work.lower[1] + work.upper[1])
        return dx * dx + dy * dy <= radius * radius
    nx, ny = work.numbers[2].shape
    i = min(max(math.floor((place[0] - work.lower[0]) / work.spacing[0]), 0), nx - 1)
    j = min(max(math.floor((place[1] - work.lower[1]) / work.spacing[1]), 0), ny - 1)
    inside = False
    for m in range(work.first[i * ny + j], work.first[i * ny + j + 1]):
        inside ^= _is_above(work.triangles[work.columns[m]], place)
    return inside


@njit(cache=True, nogil=True, **BORROWS)
def _is_above(triangle, place):
    """Whether the line upwards from a place crosses a triangle (3, 3)."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = triangle[0], triangle[1], triangle[2]
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    if area == 0.0:
        return False
    u = ((place[0] - ax) * (cy - ay) - (cx - ax) * (place[1] - ay)) / area
    v = ((bx - ax) * (place[1] - ay) - (place[0] - ax) * (by - ay)) / area
    return u >= 0.0 and v >= 0.0 and u + v <= 1.0 and az + u * (bz - az) + v * (cz - az) > place[2]


@njit(cache=True, nogil=True, **BORROWS)
def has_material(work, place):
    """Whether there is material at a place (m) now.

    Lines of three directions around the place that agree, with no end nearby, decide. Else the steps that made the ends nearby
    are asked whether they have swept the place, and the stock whether it was there.
    """
    inside, lines, has_end = 0, 0, False
    last_owner, earlier_owner = -1, -1
    for axis in range(3):
        p, q = (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
        count, t = work.numbers[axis], place[axis]
        end_distance = _NEAR_ENDS * work.spacing[axis]
        i = math.floor((place[p] - work.lower[p]) / work.spacing[p] - 0.5)
        j = math.floor((place[q] - work.lower[q]) / work.spacing[q] - 0.5)
        for m in range(max(i, 0), min(i + 1, count.shape[0] - 1) + 1):
            for n in range(max(j, 0), min(j + 1, count.shape[1] - 1) + 1):
                lines += 1
                for k in range(count[m, n]):
                    lower_end, upper_end = work.intervals[axis][m, n, k, 0], work.intervals[axis][m, n, k, 1]
                    if lower_end <= t <= upper_end:
                        inside += 1
                    for end in range(2):
                        if abs(work.intervals[axis][m, n, k, end] - t) > end_distance:
                            continue
                        has_end = True
                        for owner in (work.owners[axis][m, n, k, end], work.earlier[axis][m, n, k, end]):
                            if owner >= 0 and owner != last_owner and owner != earlier_owner:
                                if sweeps(work.motions, work.shapes, owner, work.now[0], place):
                                    return False
                                earlier_owner, last_owner = last_owner, owner
    if not has_end and inside in (0, lines):
        return inside > 0
    return stock_has(work, place)

# Code of other modules in these kernels: 2c31a1f62246
