"""What a reduced body keeps to state the error of a machine's modes: its places as loads, sliding ones between stations too.

The weights of a sliding patch are polynomials of its position between one edge of an element and the next, so all of them are
combinations of a few columns: those of its stations, and as many more as the mesh asks for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array, hstack

from toolpoint._check import FloatArray
from toolpoint.bodies.residual_form import ResidualForm
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.reduction import Reduction

# Of the largest, singular values of the stations that are taken apart: below it combinations would be large and lose digits.
APART = 1e-2
LEFT_OUT_SHARE = 1e-4  # of a load's size: what is left out of a sliding load


@dataclass(frozen=True, eq=False)
class PlaceLoads:
    """A place as loads: columns (n, k) that the shapes answer, further ones (n, q) beside them, and which combination of both
    a wrench is: (6, k + q), or (p, 6, k + q) at the positions (p,) of a sliding place, m."""

    columns: csc_array
    beside: csc_array
    combination: FloatArray
    positions: FloatArray | None = None

    @classmethod
    def still(cls, weights: csc_array) -> PlaceLoads:
        """Return a place that stays, of its weights (n, 6)."""
        return cls(weights, csc_array((weights.shape[0], 0)), np.eye(6))


def split_sliding(stations: Sequence[csc_array], weights: Sequence[csc_array], positions: FloatArray) -> PlaceLoads:
    """Return a sliding place as loads: its weights (n, 6) at `positions`, of those at its stations and what these lack."""
    columns, all_weights = (csc_array(hstack(parts)) for parts in (stations, weights))
    rows = np.unique(np.concatenate([columns.indices, all_weights.indices]))
    near, every = (part.tocsr()[rows].toarray() for part in (columns, all_weights))
    near_size, every_size = (np.linalg.norm(part, axis=0) for part in (near, every))
    left, size, right = np.linalg.svd(near / near_size, full_matrices=False)
    keep = size > APART * size[0]
    left, size, right = left[:, keep], size[keep], right[keep]
    known = left.T @ (every / every_size)
    further, rest, _ = np.linalg.svd(every / every_size - left @ known, full_matrices=False)
    further = further[:, rest > LEFT_OUT_SHARE]
    beside = np.zeros((columns.shape[0], further.shape[1]))
    beside[rows] = further
    of_stations = (right.T / size / near_size[:, None]) @ known * every_size
    combination = np.vstack([of_stations, further.T @ every])
    return PlaceLoads(columns, csc_array(beside), combination.T.reshape(len(positions), 6, -1), positions)


def residual_form(reduction: Reduction, rigid: FloatArray, places: Mapping[str, PlaceLoads]) -> ResidualForm:
    """Return the form of a free reduction.

    Parameters
    ----------
    reduction : Reduction
        Of a body whose loads are the places' columns in their order, and beside them the places' further ones.
    rigid : (6, 6) floats
        The motions of the body's frame over the reduction's rigid motions.
    places : mapping of name to PlaceLoads
    """
    known = reduction.residual
    x, r = known.shapes.shape
    l = len(known.loads)
    used, tables = _combinations(places, l, len(known.gram) - x - l)
    turn = np.zeros((len(known.gram), 6 + 2 * r + int(used.sum())))
    turn[:len(rigid), :6] = rigid
    turn[:x, 6:6 + r], turn[x:x + l, 6:6 + r] = known.inertial, known.loads
    turn[:x, 6 + r:6 + 2 * r] = known.shapes
    turn[x + np.flatnonzero(used), np.arange(6 + 2 * r, turn.shape[1])] = 1.0
    gram = turn.T @ known.gram @ turn
    return ResidualForm((gram + gram.T) / 2, known.shift, reduction.reach, tables)


def _combinations(places: Mapping[str, PlaceLoads], columns: int, beside: int
                  ) -> tuple[np.ndarray, dict[str, FloatArray | MotionTable]]:
    """Return which of all loads a place uses, and over these what a wrench on every place is."""
    whole, first, second = {}, 0, columns
    used = np.zeros(columns + beside, dtype=bool)
    for name, place in places.items():
        k, q = place.columns.shape[1], place.beside.shape[1]
        at = [*range(first, first + k), *range(second, second + q)]
        wide = np.zeros((*place.combination.shape[:-1], columns + beside))
        wide[..., at] = place.combination
        whole[name] = wide
        used[at] = True
        first, second = first + k, second + q
    return used, {name: wide[..., used] if (positions := places[name].positions) is None
                  else MotionTable(positions, wide[..., used], name) for name, wide in whole.items()}
