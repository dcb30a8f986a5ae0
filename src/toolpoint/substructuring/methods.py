r"""Methods of reduction: acting loads (recommended), Craig and Bampton, residual flexibility.

Sources: Craig, Bampton, AIAA J. 6 (1968); MacNeal, Computers & Structures 1 (1971), Rubin, AIAA J. 13 (1975); responses to
the loads that really act, compressed: Law, Phani, Altintas, J. Manuf. Sci. Eng. 135 (2013), for the shape of the problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from toolpoint._check import FloatArray, count, positive
from toolpoint.substructuring.large_body import Preparation
from toolpoint.substructuring.reach import DEFAULT_REACH_RATIO
from toolpoint.substructuring.reduction import RawShapes
from toolpoint.vibration.sparse.node_matrix import as_columns


@dataclass(frozen=True)
class ActingLoads:
    """Free modes up to `reach` times the band, and responses to the loads that act, with inertia, compressed by energy.

    band : Hz, up to which the coupled machine is asked for; order : of the responses, 1 static, 2 with the motion that the
    inertia of these makes, and so on.

    Examples
    --------
    >>> ActingLoads(band=200.0)
    ActingLoads(band=200.0, reach=1.5, order=2, name='acting loads')
    """

    band: float
    reach: float = DEFAULT_REACH_RATIO
    order: int = 2
    name: str = "acting loads"

    def shapes(self, prepared: Preparation) -> RawShapes:
        """Return the shapes."""
        frequency_max = positive("band", self.band) * positive("reach", self.reach)
        return _free_shapes(prepared, frequency_max, count("order", self.order))


@dataclass(frozen=True)
class ResidualFlexibility:
    """Free modes below the band (Hz), and the static responses to all loads (MacNeal, Rubin).

    Examples
    --------
    >>> ResidualFlexibility(band=200.0).name
    'residual flexibility'
    """

    band: float
    name: str = "residual flexibility"

    def shapes(self, prepared: Preparation) -> RawShapes:
        """Return the shapes."""
        return _free_shapes(prepared, positive("band", self.band), 1)


def _free_shapes(prepared: Preparation, frequency_max: float, order: int) -> RawShapes:
    pairs = prepared.elastic_modes(frequency_max)
    r, l = prepared.rigid.shape[1], prepared.body.loads.shape[1]
    inertial = np.vstack([np.zeros((r, pairs.count)), np.diag(pairs.squares)])
    return RawShapes(pairs.vectors, inertial, np.zeros((l, pairs.count)), frequency_max, order)


@dataclass(frozen=True)
class CraigBampton:
    """Modes with all loads' places held, up to `reach` times the band, and one response for each motion of the places.

    Which free modes are among the shapes is not known, so the error estimate says that it may miss one.

    Examples
    --------
    >>> CraigBampton(band=200.0, reach=1.5).name
    'Craig-Bampton'
    """

    band: float
    reach: float = DEFAULT_REACH_RATIO
    name: str = "Craig-Bampton"

    def shapes(self, prepared: Preparation) -> RawShapes:
        """Return the shapes."""
        squares, vectors = _held_modes(prepared, positive("band", self.band) * positive("reach", self.reach))
        body, rigid = prepared.body, prepared.rigid
        force = body.stiffness @ vectors - (body.mass @ vectors) * squares
        loads = np.linalg.lstsq(body.loads, force, rcond=None)[0]
        along = rigid.T @ (body.mass @ vectors)
        return RawShapes(vectors - rigid @ along, np.vstack([along * squares, np.diag(squares)]), loads, 0.0)


def _held_modes(prepared: Preparation, frequency_max: float) -> tuple[FloatArray, FloatArray]:
    """Return squares (rad^2/s^2) and vectors of the modes with W^T u = 0 below a frequency (Hz).

    Lanczos on the inverse of the held body, S - S W (W^T S W)^-1 W^T S: the constraint is never put into the sparse matrices.
    """
    body, n = prepared.body, prepared.body.size
    held = prepared.inverse.solve(body.loads)
    hold = np.linalg.pinv(body.loads.T @ held, rcond=1e-13)

    def solve(right: FloatArray) -> FloatArray:
        free = prepared.inverse.solve(np.asarray(right).reshape(n, -1))
        return (free - held @ (hold @ (body.loads.T @ free))).reshape(np.shape(right))

    stiffness, mass = as_columns(body.stiffness), as_columns(body.mass)
    number, limit = 10, (2 * np.pi * frequency_max) ** 2
    while True:
        number = min(number, n - body.loads.shape[1] - 1)
        operator = LinearOperator((n, n), matvec=solve, dtype=float)
        values, vectors = eigsh(stiffness, number, mass, sigma=-prepared.shift, OPinv=operator, which="LM",
                                v0=solve(np.random.default_rng(n).standard_normal(n)))
        order = np.argsort(values)
        # Complete once one mode lies above the limit; else twice as many are asked for.
        if values.max() > limit or number == n - body.loads.shape[1] - 1:
            keep = order[values[order] <= limit]
            return values[keep], vectors[:, keep]
        number *= 2
