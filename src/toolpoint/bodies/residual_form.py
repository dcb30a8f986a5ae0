r"""ResidualForm: a small form from which the error of a machine's modes by a body's reduction is stated at any pose.

A mode of the reduced machine leaves forces in the whole body's equations,
:math:`r = K V y - \lambda M (R c + V y) + \sum_i W_i f_i`, with rigid motions R, shapes V and wrenches f on the places W.
Their norm in the body's own flexibility, :math:`\rho^2 = r^T (K + s_0 M)^{-1} r`, is a quadratic form over
(c, y, y, f): its matrix is kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, floats, positive
from toolpoint.spatial.motion_table import MotionTable


@dataclass(frozen=True, eq=False)
class ResidualForm:
    """Products of [M R, K V, M V, loads] in (K + s0 M)^-1, and the map of wrenches on places to loads.

    Parameters
    ----------
    gram : (6 + 2 r + q, 6 + 2 r + q) floats
        R are the motions of the body's frame (twists (v, w) in its axes), V its r shapes.
    shift : float
        s0, rad^2/s^2.
    reach : float
        Frequency below which all free modes of the body are among the shapes, Hz; 0: unknown.
    places : mapping of name to (6, q) floats or MotionTable
        A wrench f on a place, in the body's axes and about the place, acts as the loads with ``places[name].T @ f``; for a
        place that slides, a table over its positions.
    """

    gram: FloatArray
    shift: float
    reach: float
    places: Mapping[str, FloatArray | MotionTable]

    def __post_init__(self) -> None:
        object.__setattr__(self, "gram", floats("ResidualForm.gram", self.gram, (None, None)))
        positive("ResidualForm.shift", self.shift)
        object.__setattr__(self, "places", dict(self.places))

    @property
    def load_count(self) -> int:
        """Number q of loads."""
        return next(iter(place.values.shape[2] if isinstance(place, MotionTable) else place.shape[1]
                         for place in self.places.values()), 0)

    def loads(self, place: str, wrench: FloatArray, way: float | None = None) -> FloatArray:
        """Return the loads (q, modes) of wrenches (6, modes) on a place; `way` is the position of a sliding one, m."""
        wrench_map = self.places.get(place)
        if wrench_map is None:
            fail("place", repr(place), f"must be of {', '.join(self.places)}")
        if not isinstance(wrench_map, MotionTable):
            return wrench_map.T @ wrench
        if way is None:
            fail("way", "none", f"must be given for the sliding place {place}")
        return wrench_map.at(float(way)).T @ wrench

    def squared(self, rigid: FloatArray, stiff: FloatArray, *, heavy: FloatArray, loads: FloatArray) -> FloatArray:
        """Return rho^2 (modes,) of M R rigid + K V stiff + M V heavy + loads; each has one column a mode."""
        columns = np.vstack([rigid, stiff, heavy, loads])
        return np.maximum(np.einsum("im,ij,jm->m", columns, self.gram, columns), 0.0)

    def combined(self, mix: FloatArray) -> ResidualForm:
        """Return the form over combinations (r, k) of the shapes."""
        q, (shapes, count) = self.load_count, mix.shape
        turn = np.zeros((len(self.gram), 6 + 2 * count + q))
        turn[:6, :6], turn[len(turn) - q:, 6 + 2 * count:] = np.eye(6), np.eye(q)
        turn[6:6 + shapes, 6:6 + count] = turn[6 + shapes:6 + 2 * shapes, 6 + count:6 + 2 * count] = mix
        return replace(self, gram=turn.T @ self.gram @ turn)

    def scaled(self, stiff: float, heavy: float) -> ResidualForm:
        """Return the form of the body with all stiffness and all density multiplied, the shapes kept."""
        q = self.load_count
        shapes = (len(self.gram) - 6 - q) // 2
        factor = np.repeat([heavy, stiff, heavy, 1.0], [6, shapes, shapes, q])
        return replace(self, gram=self.gram * factor[:, None] * factor / stiff, shift=self.shift * stiff / heavy,
                       reach=self.reach * float(np.sqrt(stiff / heavy)))
