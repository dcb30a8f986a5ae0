"""ArcNodes: Gauss nodes over one tooth pitch of the cut, with the directions of chip and force at each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from toolpoint._check import Array, FloatArray
from toolpoint.cutting.cut.coefficients import CuttingCoefficients, chip_direction, force_direction
from toolpoint.cutting.cut.tool import Engagement


@dataclass(frozen=True, eq=False)
class ArcNodes:
    """Nodes of the periodic Green equation; a node may be one tooth's chip or one component of the vibration.

    Parameters
    ----------
    angle : (q,) floats
        Time of the node as an angle of rotation within one pitch, rad.
    weight : (q,) floats
        Gauss weights, rad.
    partial : (q, q) floats
        Weights of the integral from the pitch's start to node i, rad.
    chip, force : (q, 2) floats, with the axial direction (q, 3)
        Row n and column k: force density k (n^T r) per metre of depth, Pa.
    """

    angle: FloatArray
    weight: FloatArray
    partial: FloatArray
    chip: FloatArray
    force: FloatArray

    @property
    def same_time(self) -> Array:
        """Whether two nodes are at the same time, for every pair, shape (q, q)."""
        return np.abs(self.angle[:, None] - self.angle[None, :]) < 1e-14


@lru_cache(maxsize=256)
def gauss(n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the nodes, weights and integration matrix of n-point Gauss-Legendre on (-1, 1): B f = integral from -1 to each
    node."""
    x, w = legendre.leggauss(n)
    # Integrate each Lagrange polynomial through its Legendre series: coefficients (2k+1)/2 w_j P_k(x_j).
    p = legendre.legvander(x, n)
    series = (np.arange(n) + 0.5)[:, None] * p[:, :n].T * w
    rising = np.empty((n, n))
    rising[:, 0] = 1 + x
    for k in range(1, n):
        rising[:, k] = (p[:, k + 1] - p[:, k - 1]) / (2 * k + 1)
    return x, w, rising @ series


def lagrange(x: FloatArray, points: FloatArray) -> FloatArray:
    """Return the interpolation matrix from Gauss nodes x to points, by the barycentric formula."""
    gap = x[:, None] - x[None, :] + np.eye(x.size)
    # Products of many differences below one underflow; only their ratios count, so logarithms are taken and the largest is
    # one.
    log = -np.log(np.abs(gap)).sum(1)
    sign = np.prod(np.sign(gap), axis=1)
    weight = sign * np.exp(log - log.max())
    difference = points[:, None] - x[None, :]
    # At a node the quotient is infinite over infinite: the row is that of the node alone.
    exact = np.abs(difference) < 1e-15
    with np.errstate(divide="ignore", invalid="ignore"):
        terms = weight / np.where(exact, 1.0, difference)
        rows = terms / terms.sum(1, keepdims=True)
    hit = exact.any(1)
    rows[hit] = exact[hit]
    return rows


def breaks(engagement: Engagement, teeth: int) -> FloatArray:
    """Return the angles within one pitch, from entry, where the number of teeth in cut changes."""
    pitch = 2 * np.pi / teeth
    remainder = engagement.arc % pitch
    if engagement.arc < pitch - 1e-12:
        return np.array([0.0, engagement.arc])
    # A whole number of pitches: the number of teeth in cut never changes, and a part of 1e-9 would be a part with nodes of
    # its own.
    if remainder < 1e-9 or pitch - remainder < 1e-9:
        return np.array([0.0, pitch])
    return np.array([0.0, remainder, pitch])


def straight_nodes(coefficients: CuttingCoefficients, engagement: Engagement, teeth: int, *, density: float,
                   nodes_min: int, second_direction: bool, size: int = 2) -> ArcNodes:
    """Return nodes for straight teeth of equal pitch: `density` nodes per rad and at least `nodes_min` on each part of the
    pitch; `size` directions of force (3: with the axial one, along which a cylinder has no chip)."""
    pitch = 2 * np.pi / teeth
    ends = breaks(engagement, teeth)
    parts = []
    for a, b in pairwise(ends):
        n = nodes_min + int(np.ceil(density * (b - a)))
        x, w, rising = gauss(n)
        angle = a + (b - a) / 2 * (1 + x)
        number = int(np.floor((engagement.arc - (a + b) / 2) / pitch)) + 1
        phi = engagement.entry + angle[:, None] + pitch * np.arange(number)
        k, chip = force_direction(coefficients, phi), chip_direction(phi)
        if size == 3:
            k = np.concatenate([k, np.full((*phi.shape, 1), -coefficients.ka)], axis=-1)
            chip = np.concatenate([chip, np.zeros((*phi.shape, 1))], axis=-1)
        parts.append((angle, w * (b - a) / 2, rising * (b - a) / 2, k, chip))
    return _join_parts(parts, second_direction)


def _join_parts(parts: Sequence[tuple[FloatArray, ...]], second_direction: bool) -> ArcNodes:
    rows = []
    for index, (angle, weight, _, k, chip) in enumerate(parts):
        if k.shape[1] == 1:
            rows.append((np.full(angle.size, index), np.arange(angle.size), angle, weight, chip[:, 0], k[:, 0]))
            continue
        matrix = np.einsum("qti,qtj->qij", k, chip)
        for way in range(2 if second_direction else 1):
            unit = np.broadcast_to(np.eye(k.shape[-1])[way], (angle.size, k.shape[-1]))
            rows.append((np.full(angle.size, index), np.arange(angle.size), angle, weight, unit, matrix[:, :, way]))
    place, number, angle, weight = (np.concatenate([row[i] for row in rows]) for i in range(4))
    chip, force = (np.ascontiguousarray(np.concatenate([row[i] for row in rows])) for i in (4, 5))
    partial = np.where(place[None, :] < place[:, None], weight[None, :], 0.0)
    for index, (_, _, rising, _, _) in enumerate(parts):
        inside = np.flatnonzero(place == index)
        partial[np.ix_(inside, inside)] = rising[np.ix_(number[inside], number[inside])]
    return ArcNodes(angle, weight, partial, chip, force)
