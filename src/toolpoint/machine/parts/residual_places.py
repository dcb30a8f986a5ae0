"""Loads that a reduced body keeps for the error of a machine's modes: its places, sliding ones between stations too.

The weights of a sliding patch are polynomials of its position between one edge of an element and the next, so all of them are
combinations of a few columns: those of its stations, and as many more as the mesh asks for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, hstack

from toolpoint._check import FloatArray
from toolpoint.bodies.residual_form import ResidualForm
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.reduction import Reduction

# Of the largest singular value of the stations: below it combinations would be large and lose digits.
MIN_STATION_RATIO = 1e-2
NEGLECTED_LOAD_FRACTION = 1e-4  # of a load's size: part of a sliding load that is neglected


@dataclass(frozen=True, eq=False)
class PlaceLoads:
    """A place as loads: columns (n, k) that the shapes answer, `further_columns` (n, q), and the combination of both that
    a wrench is: (6, k + q), or (p, 6, k + q) at the positions (p,) of a sliding place, m."""

    columns: csc_array
    further_columns: csc_array
    combination: FloatArray
    positions: FloatArray | None = None

    @classmethod
    def fixed(cls, weights: csc_array) -> PlaceLoads:
        """Return a place that stays, of its weights (n, 6)."""
        return cls(weights, csc_array((weights.shape[0], 0)), np.eye(6))


def split_sliding(stations: Sequence[csc_array], weights: Sequence[csc_array], positions: FloatArray) -> PlaceLoads:
    """Return a sliding place as loads: its weights (n, 6) at `positions`, of those at its stations and what these lack."""
    columns, all_weights = (csc_array(hstack(parts)) for parts in (stations, weights))
    rows = np.unique(np.concatenate([columns.indices, all_weights.indices]))
    station_rows, all_rows = (part.tocsr()[rows].toarray() for part in (columns, all_weights))
    station_size, all_size = (np.linalg.norm(part, axis=0) for part in (station_rows, all_rows))
    left_vectors, singular, right_vectors = np.linalg.svd(station_rows / station_size, full_matrices=False)
    is_kept = singular > MIN_STATION_RATIO * singular[0]
    left_vectors, singular, right_vectors = left_vectors[:, is_kept], singular[is_kept], right_vectors[is_kept]
    in_stations = left_vectors.T @ (all_rows / all_size)
    further_vectors, rest_size, _ = np.linalg.svd(all_rows / all_size - left_vectors @ in_stations, full_matrices=False)
    further_vectors = further_vectors[:, rest_size > NEGLECTED_LOAD_FRACTION]
    further_columns = np.zeros((columns.shape[0], further_vectors.shape[1]))
    further_columns[rows] = further_vectors
    of_stations = (right_vectors.T / singular / station_size[:, None]) @ in_stations * all_size
    combination = np.vstack([of_stations, further_vectors.T @ all_rows])
    return PlaceLoads(columns, csc_array(further_columns), combination.T.reshape(len(positions), 6, -1), positions)


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
    frame = np.zeros((len(reduction.residual.gram), 6))
    frame[:len(rigid)] = rigid
    return _form(reduction, frame, places)


def held_residual_form(reduction: Reduction, rigid_mass: FloatArray, places: Mapping[str, PlaceLoads], *,
                       held: str) -> ResidualForm:
    r"""Return the form of a body whose shapes are relative to its frame, and zero at nodes that move with that.

    The last six loads of the reduction are M R on the other coordinates, R the motions of the frame. Residuals act on these
    coordinates alone, as the frame's are in balance; but the flexibility is that of the body with its frame free, and follows
    from that of the held one, S, by :math:`S + s_0^2 S M R (s_0 R^T M R - s_0^2 R^T M S M R)^{-1} R^T M S`. A motion
    orthogonal in the mass to the frame's and to all held modes below a frequency has no less energy than at that frequency: the
    reach is that of the held modes.

    Parameters
    ----------
    reduction : Reduction
        Of the held body, its loads those of the places, then M R.
    rigid_mass : (6, 6) floats
        R^T M R, about the frame.
    places : mapping of name to PlaceLoads
        On the coordinates that are not held.
    held : str
        Interface of the held nodes: a wrench there is the frame's.
    """
    residual = reduction.residual
    last = len(residual.shapes) + len(residual.loads)
    frame, shift, gram = slice(last - 6, last), residual.shift, residual.gram
    answer = np.linalg.solve(shift * rigid_mass - shift**2 * gram[frame, frame], gram[frame])
    of_free = replace(residual, gram=gram + shift**2 * gram[:, frame] @ answer)
    selected = np.zeros((len(gram), 6))
    selected[frame] = np.eye(6)
    form = _form(replace(reduction, residual=of_free), selected, places)
    return replace(form, places={**form.places, held: np.zeros((6, form.load_count))})


def _form(reduction: Reduction, frame: FloatArray, places: Mapping[str, PlaceLoads]) -> ResidualForm:
    """Return the form of a reduction with the columns (x + l + q, 6) that the inertia of the frame's motions is."""
    residual = reduction.residual
    x, r = residual.shapes.shape
    l = len(residual.loads)
    is_used, tables = _combinations(places, l, len(residual.gram) - x - l)
    turn = np.zeros((len(residual.gram), 6 + 2 * r + int(is_used.sum())))
    turn[:, :6] = frame
    turn[:x, 6:6 + r], turn[x:x + l, 6:6 + r] = residual.inertial, residual.loads
    turn[:x, 6 + r:6 + 2 * r] = residual.shapes
    turn[x + np.flatnonzero(is_used), np.arange(6 + 2 * r, turn.shape[1])] = 1.0
    gram = turn.T @ residual.gram @ turn
    return ResidualForm((gram + gram.T) / 2, residual.shift, reduction.reach, tables)


def _combinations(places: Mapping[str, PlaceLoads], columns: int, further_count: int
                  ) -> tuple[np.ndarray, dict[str, FloatArray | MotionTable]]:
    """Return which of all loads a place uses, and over these the combination that a wrench on every place is."""
    combinations, first_column, further_column = {}, 0, columns
    is_used = np.zeros(columns + further_count, dtype=bool)
    for name, place in places.items():
        k, q = place.columns.shape[1], place.further_columns.shape[1]
        columns_used = [*range(first_column, first_column + k), *range(further_column, further_column + q)]
        padded = np.zeros((*place.combination.shape[:-1], columns + further_count))
        padded[..., columns_used] = place.combination
        combinations[name] = padded
        is_used[columns_used] = True
        first_column, further_column = first_column + k, further_column + q
    return is_used, {name: padded[..., is_used] if (positions := places[name].positions) is None
                     else MotionTable(positions, padded[..., is_used], name) for name, padded in combinations.items()}
