r"""Mean rigid motion of an area of a solid: what a joint, a load or a sensor on it meets.

The motion of an area A is the rigid motion nearest to the surface's in the mean, :math:`v = \frac1A \int u\,dA`,
:math:`w = J^{-1} \int r \times u\,dA`, :math:`J = \int (r \cdot r) I - r r^T dA`, with u by the elements' shape functions and r
from the area's centre. A wrench is spread by the transposed map: its resultants are kept, and nothing is stiffened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, IndexArray, fail

MIN_SPREAD_RATIO = 1e-6  # smallest over largest of the moments J: below it, the area is a line and tells no turn about itself


@dataclass(frozen=True, eq=False)
class AreaPiece:
    """A part of a face at points of a rule.

    nodes : (k,) of the face; values : (p, k) shape functions; places : (p, 3), m; weights : (p,), m^2, negative in a hole.
    """

    nodes: IndexArray
    values: FloatArray
    places: FloatArray
    weights: FloatArray


def area_of(pieces: Sequence[AreaPiece]) -> float:
    """Return the area of pieces, m^2."""
    return float(sum(piece.weights.sum() for piece in pieces))


def centre_of(pieces: Sequence[AreaPiece]) -> FloatArray:
    """Return the centre (3,) of the area of pieces, m."""
    return np.asarray(np.sum([piece.weights @ piece.places for piece in pieces], axis=0) / area_of(pieces))


def mean_motion(size: int, pieces: Sequence[AreaPiece], centre: FloatArray) -> csc_array:
    """Return W (size, 6): W^T u is the twist (v m, w rad) of the area about a centre (3,), m; u (size,) m, three a node."""
    nodes = np.concatenate([piece.nodes for piece in pieces])
    integrals, moments = np.empty(len(nodes)), np.empty((len(nodes), 3))
    second, first_row = np.zeros((3, 3)), 0
    for piece in pieces:
        rows = slice(first_row, first_row := first_row + len(piece.nodes))
        arms = piece.places - centre
        weighted_arms = piece.weights[:, None] * arms
        integrals[rows], moments[rows] = piece.weights @ piece.values, piece.values.T @ weighted_arms
        second += weighted_arms.T @ arms
    used, place = np.unique(nodes, return_inverse=True)
    integral, moment = np.zeros(len(used)), np.zeros((len(used), 3))
    np.add.at(integral, place, integrals)
    np.add.at(moment, place, moments)
    turning = _turning_weights(moment, np.trace(second) * np.eye(3) - second)
    block = np.concatenate([integral[:, None, None] / area_of(pieces) * np.eye(3), turning], axis=2).reshape(-1, 6)
    row = (3 * used[:, None] + np.arange(3)).ravel()
    return csc_array((block.ravel(), (np.repeat(row, 6), np.tile(np.arange(6), len(row)))), shape=(size, 6))


def _turning_weights(moment: FloatArray, inertia: FloatArray) -> FloatArray:
    """Return (n, 3, 3): columns are the turns of the area for displacements of a node; moment (n, 3) of N r, m^3."""
    extent = np.linalg.eigvalsh(inertia)
    if not extent[0] > MIN_SPREAD_RATIO * extent[-1]:
        fail("interface", "a line or a single point", "must be an area, or three points that are not in line",
             remedy="a line tells no turn about itself: add what lies beside it")
    # r x u for unit displacements along x, y and z, for each node.
    crossed = np.cross(moment[:, None, :], np.eye(3)[None])
    return np.asarray(crossed @ np.linalg.inv(inertia).T)
