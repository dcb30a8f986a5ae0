r"""Interfaces that slide: a carriage on rails, a ram in its housing, a limb through its frame.

A body is reduced once, with responses to the patch at stations along its way among its shapes. Online only
:math:`b(z) = V^T W(z)` depends on the position z; it is tabulated, with a spline that is smooth to the second derivative
between the entries, so frequencies are smooth in z and have an exact derivative. Consistent weights make b smooth; what the
spline leaves out is measured between its entries when it is made.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, eigh_tridiagonal, lapack
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, count, fail, floats, positive
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.estimate import Surroundings
from toolpoint.substructuring.reduction import Reduction

SMALLEST = 32  # coordinates from which our own way to the lowest modes pays
SlidingWeights = Callable[[float], "csc_array | FloatArray"]


def tabulate(shapes: FloatArray, weights: SlidingWeights, low: float, *, high: float, step: float = 5e-3, name: str = "place",
             is_checked: bool = True) -> MotionTable:
    """Return the motion of a sliding place in given shapes.

    Parameters
    ----------
    shapes : (n, r) floats
        Rigid motions and vectors of a reduction, side by side.
    weights : function of position (m) to (n, 6) consistent weights
        Such as ``lambda z: patch.moved([0, 0, z]).averages(model)``; raises where the place would leave its rail.
    low, high : float
        Way, m.
    step : float
        Of the table, m.
    is_checked : bool
        Whether the spline is compared with the mesh midway between entries, at eight places.
    """
    if not low < high:
        fail("low", f"{low:g} m with high {high:g} m", "must be below it")
    at = table_positions(low, high, step)
    values = np.array([weights(float(z)).T @ shapes for z in at])
    table = MotionTable(at, values, name)
    if not is_checked:
        return table
    middle = (at[:-1] + at[1:]) / 2
    sample = middle[np.unique(np.linspace(0, len(middle) - 1, 8).astype(int))]
    exact = np.array([weights(float(z)).T @ shapes for z in sample])
    size = np.abs(values).max(axis=(0, 2), keepdims=True)
    error = float(np.max(np.abs(table.at(sample) - exact) / np.maximum(size, 1e-300)))
    return MotionTable(at, values, name, error)


def table_positions(low: float, high: float, step: float) -> FloatArray:
    """Return the positions of a table's entries (m): as far apart as `step`, or closer, four at least."""
    count = max(int(np.ceil((high - low) / positive("step", step) - 1e-9)), 3) + 1
    return np.linspace(low, high, count)


def station_loads(weights: Sequence[SlidingWeights], low: float, high: float, *, step: float) -> csc_array:
    """Return loads of several sliding places at stations a step apart or closer, side by side, (n, 6 k): for `LargeBody`.

    Stations a patch length apart or closer are enough: what they have in common is compressed.
    """
    from scipy.sparse import hstack

    count = max(int(np.ceil((high - low) / positive("step", step) - 1e-9)), 1) + 1
    return csc_array(hstack([csc_array(place(float(z))) for z in np.linspace(low, high, count) for place in weights]))


@dataclass(frozen=True, eq=False)
class SlidingBody:
    """A reduced body with places that slide along it and others that stay.

    Parameters
    ----------
    reduction : Reduction
    tables : mapping of name to MotionTable
        Over the rigid motions and vectors of the reduction, side by side.
    fixed : (f, r) floats
        Motions of the other loads' places, likewise.
    """

    reduction: Reduction
    tables: Mapping[str, MotionTable]
    fixed: FloatArray

    @property
    def span(self) -> tuple[float, float]:
        """Positions at which all sliding places are on their ways, m."""
        spans = [table.span for table in self.tables.values()]
        return max(low for low, _ in spans), min(high for _, high in spans)

    def participation(self, position: float, order: int = 0) -> FloatArray:
        """Return the motion of all places (sliding ones first) per coordinate, or its derivative by the position."""
        moving = [table.at(position, order) for table in self.tables.values()]
        return np.concatenate([*moving, self.fixed if order == 0 else np.zeros_like(self.fixed)])

    def frequencies(self, position: float, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        """Return the lowest coupled natural frequencies (Hz) with the places at a position, and their derivative, Hz/m.

        surroundings : over the places (sliding ones first), then further coordinates. The derivative is that of simple roots.
        """
        place = self._place(position, surroundings)
        squares, vectors = self._solved(place, surroundings, modes)
        moved = place @ vectors
        slope = self.participation(position, 1) @ vectors[:self.fixed.shape[1]]
        force = surroundings.stiffness @ moved - (surroundings.mass @ moved) * squares
        omega = np.sqrt(np.maximum(squares, 1e-300))
        return omega / (2 * np.pi), np.einsum("im,im->m", slope, force[:len(slope)]) / (2 * np.pi * omega)

    def coupled(self, position: float, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        """Return squares (rad^2/s^2) and vectors of the lowest coupled modes, over rigid, elastic and further coordinates."""
        return self._solved(self._place(position, surroundings), surroundings, modes)

    def _solved(self, place: FloatArray, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        n, inner = place.shape[1], self.fixed.shape[1]
        places = len(place) - (n - inner)
        k = place.T @ (surroundings.stiffness @ place)
        elastic = range(inner - self.reduction.size, inner)
        k[elastic, elastic] += self.reduction.squares
        number = min(count("modes", modes), n)
        if not surroundings.mass[:places].any():
            return _lowest(k, surroundings.mass[places:, places:], number)
        m = place.T @ surroundings.mass @ place
        m[range(inner), range(inner)] += 1.0
        return eigh(k, m, subset_by_index=[0, number - 1], check_finite=False)

    def _place(self, position: float, surroundings: Surroundings) -> FloatArray:
        part = self.participation(position)
        places, inner = part.shape
        others = len(surroundings.stiffness) - places
        if others < 0:
            fail("surroundings", f"{len(surroundings.stiffness)} coordinates", f"must be at least the {places} places")
        n = inner + others
        place = np.zeros((places + others, n))
        place[:places, :inner], place[places:, inner:] = part, np.eye(others)
        return place


def _lowest(stiffness: FloatArray, outer_mass: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return the lowest eigenpairs where all coordinates have unit mass but the last, whose mass is a block of its own."""
    if not len(outer_mass):
        return _lowest_of(stiffness, number)
    inner = len(stiffness) - len(outer_mass)
    root = np.linalg.inv(np.linalg.cholesky(outer_mass)).T
    stiffness[:, inner:] = stiffness[:, inner:] @ root
    stiffness[inner:] = root.T @ stiffness[inner:]
    squares, vectors = _lowest_of(stiffness, number)
    vectors[inner:] = root @ vectors[inner:]
    return squares, vectors


def _lowest_of(matrix: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return the lowest eigenpairs of a symmetric matrix: tridiagonal, then the few that are asked for, turned back.

    What `eigh` does with bisection and inverse iteration, at two thirds of its time for a hundred coordinates.
    """
    n = len(matrix)
    if n < SMALLEST:
        return eigh(matrix, subset_by_index=[0, number - 1], check_finite=False)
    reflectors, diagonal, beside, sizes, info = lapack.dsytrd(matrix, lower=1, lwork=32 * n)
    squares, vectors = eigh_tridiagonal(diagonal, beside, select="i", select_range=(0, number - 1), check_finite=False,
                                        lapack_driver="stemr")
    vectors[1:], _, failed = lapack.dormqr("L", "N", reflectors[1:, :-1], sizes, vectors[1:], 32 * number)
    if info or failed:
        fail("matrix", "not finite", "must be finite")
    return squares, vectors


def fit_to_surroundings(
    body: SlidingBody, surroundings: Surroundings, positions: FloatArray, *, modes: int, size: int, kept: int
) -> SlidingBody:
    """Return the body with `size` coordinates: its lowest `kept` ones, and what coupled modes at positions need beside them.

    The coupled modes are those of the whole body in its surroundings; combinations are kept by the energy that they store. It
    suits these surroundings: with other joints or masses, fit again (no large matrix is touched).

    Parameters
    ----------
    body : SlidingBody
        With all shapes of its span.
    surroundings : as for `SlidingBody.frequencies`
    positions : (p,) floats, m
    modes : int
        How many coupled modes are wanted; half as many more are followed, so that those at the end are good too.
    size, kept : int
        `kept` are the free modes that the error estimate rests on.
    """
    whole = body.reduction
    if not kept <= size <= whole.size:
        fail("size", f"{size}", f"must be {kept} .. {whole.size}")
    rigid = body.fixed.shape[1] - whole.size
    parts = [body.coupled(float(z), surroundings, modes + modes // 2) for z in floats("positions", positions)]
    # A unit vector stores unit energy here, so that every mode counts by the error of its frequency.
    answers = np.hstack([np.sqrt(whole.squares)[:, None] * vectors[rigid:rigid + whole.size] / np.sqrt(squares)
                         for squares, vectors in parts])
    left = np.linalg.svd(answers[kept:], full_matrices=False)[0][:, :size - kept]
    mix = np.zeros((whole.size, kept + left.shape[1]))
    mix[:kept, :kept] = np.eye(kept)
    mix[kept:, kept:] = left / np.sqrt(whole.squares[kept:])[:, None]
    small = whole.combined(mix)
    turn = np.linalg.lstsq(whole.vectors, small.vectors, rcond=None)[0]
    tables = {name: table.mixed(turn, rigid) for name, table in body.tables.items()}
    return SlidingBody(small, tables, np.hstack([body.fixed[:, :rigid], body.fixed[:, rigid:] @ turn]))
