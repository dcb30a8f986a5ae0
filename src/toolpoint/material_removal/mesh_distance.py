"""Compiled distance of places from the triangles of a mesh.

Closest point by the regions of a triangle: Ericson, Real-Time Collision Detection (2005), 5.1.5.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, floats


def distance_to_mesh(places: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return the distance of places (n, 3) from the nearest of triangles (m, 3, 3), (n,), all in m.

    Examples
    --------
    >>> square = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]], float)
    >>> distance_to_mesh(np.array([[0.3, 0.2, 0.5], [2.0, 0.5, 0.0]]), square).tolist()
    [0.5, 1.0]
    """
    corners = np.ascontiguousarray(floats("triangles", triangles, (None, 3, 3)))
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    return np.asarray(_distances(np.ascontiguousarray(floats("places", places, (None, 3))), corners, middle, reach))


@njit(cache=True, nogil=True)
def _distances(places, corners, middle, reach):
    out = np.empty(len(places))
    for n in range(len(places)):
        p, best = places[n], math.inf
        for m in range(len(corners)):
            dx, dy, dz = p[0] - middle[m, 0], p[1] - middle[m, 1], p[2] - middle[m, 2]
            lower_bound = math.sqrt(dx * dx + dy * dy + dz * dz) - reach[m]
            if lower_bound < best:
                best = min(best, _to_triangle(p, corners[m, 0], corners[m, 1], corners[m, 2]))
        out[n] = best
    return out


@njit(cache=True, nogil=True)
def _to_triangle(p, a, b, c):
    """Return the distance of a place from a triangle."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = np.dot(ab, ap), np.dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return _size(ap)
    bp = p - b
    d3, d4 = np.dot(ab, bp), np.dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return _size(bp)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        return _size(ap - d1 / (d1 - d3) * ab)
    cp = p - c
    d5, d6 = np.dot(ab, cp), np.dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return _size(cp)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        return _size(ap - d2 / (d2 - d6) * ac)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        return _size(bp - (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b))
    inverse = 1.0 / (va + vb + vc)
    return _size(ap - vb * inverse * ab - vc * inverse * ac)


@njit(cache=True, nogil=True)
def _size(v):
    return math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
