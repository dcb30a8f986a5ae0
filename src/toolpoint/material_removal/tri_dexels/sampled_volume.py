"""Compiled volume of the work: cells away from its surface by their lines, the others by samples of the exact surface."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.tri_dexels.presence import has_material, stock_has

_MIN_CELL_SAMPLES, _MAX_CELL_SAMPLES = 3, 60  # of a cell at the surface
_SAMPLES_OF_WORK = 200_000  # of all cells at the surface together, where their bounds allow it
# Steps of a sequence that fills a cube evenly: powers of the root of x^4 = x + 1 (Roberts' R3).
_SEQUENCE_RATIOS = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)


@njit(cache=True, nogil=True)
def measure_work(work):
    """Return the removed and the remaining volume, m^3."""
    nx, ny = work.numbers[2].shape
    nz = work.numbers[0].shape[1]
    at_surface = np.zeros((nx, ny, nz), np.bool_)
    for axis in range(3):
        _mark_ends(work, axis, at_surface)
    samples = min(max(_SAMPLES_OF_WORK // max(at_surface.sum(), 1), _MIN_CELL_SAMPLES), _MAX_CELL_SAMPLES)
    removed, left, number, place = 0.0, 0.0, 0, np.empty(3)
    for i in range(nx):
        for j in range(ny):
            for k in range(nz):
                if not at_surface[i, j, k]:
                    place[0] = work.lower[0] + (i + 0.5) * work.spacing[0]
                    place[1] = work.lower[1] + (j + 0.5) * work.spacing[1]
                    place[2] = work.lower[2] + (k + 0.5) * work.spacing[2]
                    is_left = _is_inside(work, i, j, place[2])
                    left += 1.0 if is_left else 0.0
                    removed += 1.0 if not is_left and stock_has(work, place) else 0.0
                    continue
                for _ in range(samples):
                    number += 1
                    for a in range(3):
                        share = number * _SEQUENCE_RATIOS[a]
                        cell = i if a == 0 else j if a == 1 else k
                        place[a] = work.lower[a] + (cell + share - math.floor(share)) * work.spacing[a]
                    if stock_has(work, place):
                        if has_material(work, place):
                            left += 1.0 / samples
                        else:
                            removed += 1.0 / samples
    cell = work.spacing[0] * work.spacing[1] * work.spacing[2]
    return removed * cell, left * cell


@njit(cache=True, nogil=True, **BORROWS)
def _is_inside(work, i, j, z):
    """Whether the line along z through a cell has material at a height."""
    for n in range(work.numbers[2][i, j]):  # noqa: SIM110 - a generator is slower when compiled
        if work.intervals[2][i, j, n, 0] <= z <= work.intervals[2][i, j, n, 1]:
            return True
    return False


@njit(cache=True, nogil=True)
def _mark_ends(work, axis, at_surface):
    """Mark the cells within one cell of the ends of all lines along an axis."""
    count = work.numbers[axis]
    for i in range(count.shape[0]):
        for j in range(count.shape[1]):
            for n in range(count[i, j]):
                for end in range(2):
                    t = (work.intervals[axis][i, j, n, end] - work.lower[axis]) / work.spacing[axis]
                    _mark_cells(at_surface, axis, (i, j), math.floor(t))


@njit(cache=True, nogil=True)
def _mark_cells(at_surface, axis, line, along):
    nx, ny, nz = at_surface.shape
    i, j, k = (along, line[0], line[1]) if axis == 0 else (line[0], along, line[1]) if axis == 1 else (line[0], line[1], along)
    for a in range(max(i - 1, 0), min(i + 1, nx - 1) + 1):
        for b in range(max(j - 1, 0), min(j + 1, ny - 1) + 1):
            for c in range(max(k - 1, 0), min(k + 1, nz - 1) + 1):
                at_surface[a, b, c] = True

# Code of other modules in these kernels: 42d1f5098275
