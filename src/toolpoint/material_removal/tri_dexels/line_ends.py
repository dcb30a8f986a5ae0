"""Ends that the tool has left on the lines of a work: which step made each, where in the step, and the normal there."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray
from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.tri_dexels.lines import TriWork
from toolpoint.material_removal.tri_dexels.tool_distance import swept_distance


@dataclass(frozen=True, eq=False)
class LineEnds:
    """Ends that steps of the tool have left, (n,).

    step : that made the end; share : of the step, where the tool was; place : (n, 3), m; normal : (n, 3) outward from the work,
    unit, of the tool's surface there; line : (n, 5) axis of the line, its indices, interval and which end of it.
    """

    step: IndexArray
    share: FloatArray
    place: FloatArray
    normal: FloatArray
    line: IndexArray


def list_line_ends(work: TriWork) -> LineEnds:
    """Return the ends that the tool has left on the lines along x, y and z."""
    count = sum(int(_count_ends(owners, numbers)) for owners, numbers in zip(work.owners, work.numbers, strict=True))
    lines, values = np.zeros((count, 6), np.int64), np.zeros((count, 7))
    _write_ends(work, lines, values)
    return LineEnds(lines[:, 5], values[:, 0], values[:, 1:4], -values[:, 4:7], lines[:, :5])


@njit(cache=True, nogil=True, **BORROWS)
def _count_ends(owners, numbers):
    """Return the number of ends that have an owner."""
    total = 0
    for i in range(numbers.shape[0]):
        for j in range(numbers.shape[1]):
            for n in range(numbers[i, j]):
                total += (owners[i, j, n, 0] >= 0) + (owners[i, j, n, 1] >= 0)
    return total


@njit(cache=True, nogil=True)
def _write_ends(work, lines, values):
    """Write axis, indices, interval, end and owner of the ends (n, 6), and share, place (m) and gradient of them (n, 7)."""
    row_number, place = 0, np.empty(3)
    for axis in range(3):
        p, q = (1, 2) if axis == 0 else (0, 2) if axis == 1 else (0, 1)
        numbers, owners = work.numbers[axis], work.owners[axis]
        for i in range(numbers.shape[0]):
            for j in range(numbers.shape[1]):
                for n in range(numbers[i, j]):
                    for end in range(2):
                        k = owners[i, j, n, end]
                        if k < 0:
                            continue
                        place[p] = work.lower[p] + (i + 0.5) * work.spacing[p]
                        place[q] = work.lower[q] + (j + 0.5) * work.spacing[q]
                        place[axis] = work.intervals[axis][i, j, n, end]
                        row = work.motions[k]
                        _, share, gradient = swept_distance(row, work.shapes[int(row[12])], place)
                        lines[row_number, 0], lines[row_number, 1], lines[row_number, 2] = axis, i, j
                        lines[row_number, 3], lines[row_number, 4], lines[row_number, 5] = n, end, k
                        values[row_number, 0] = share
                        for m in range(3):
                            values[row_number, 1 + m], values[row_number, 4 + m] = place[m], gradient[m]
                        row_number += 1


@njit(cache=True, nogil=True, **BORROWS)
def is_swept_deeper(work, steps, place, depth):
    """Whether one of some steps passes by a place with more than a depth (m) of the tool over it."""
    for k in steps:
        row = work.motions[k]
        if swept_distance(row, work.shapes[int(row[12])], place)[0] < -depth:
            return True
    return False

# Code of other modules in these kernels: 0f2b9722d1e2
