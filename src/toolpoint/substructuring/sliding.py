r"""Interfaces that slide: a carriage on rails, a ram in its housing, a limb through its frame.

A body is reduced once, with responses to the patch at stations along its way among its shapes. Online only
:math:`b(z) = V^T W(z)` depends on the position z; it is tabulated, with a spline that is smooth to the second derivative
between the entries, so frequencies are smooth in z and have an exact derivative. Consistent weights make b smooth; the error
of the spline is measured between its entries when the table is made.
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

MIN_TRIDIAGONAL_SIZE = 32  # coordinates from which the tridiagonal form is faster than `eigh`
SlidingWeights = Callable[[float], "csc_array | FloatArray"]


def tabulate(shapes: FloatArray, weights: SlidingWeights, position_min: float, *, position_max: float, step: float = 5e-3,
             name: str = "place", is_checked: bool = True) -> MotionTable:
    """Tabulate the motion of a sliding place in given shapes over its way.

    Parameters
    ----------
    shapes : (n, r) floats
        Rigid motions and vectors of a reduction, side by side.
    weights : function of position (m) to (n, 6) consistent weights
        Such as ``lambda z: patch.moved([0, 0, z]).averages(model)``; raises where the place would leave its rail.
    position_min, position_max : float
        Ends of the way, m.
    step : float
        Of the table, m.
    is_checked : bool
        Whether the spline is compared with the mesh midway between entries, at eight places.

    Raises
    ------
    ToolpointError
        Where `position_min` is not below `position_max`.

    Examples
    --------
    A place whose motion is linear in its position, between two stations 0.1 m apart:

    >>> import numpy as np
    >>> def weights(z):
    ...     return np.repeat([[1 - z / 0.1], [z / 0.1]], 6, axis=1)
    >>> table = tabulate(np.array([[0.0], [1.0]]), weights, 0.0, position_max=0.1)
    >>> round(float(table.at(0.025)[0, 0]), 9)
    0.25
    """
    if not position_min < position_max:
        fail("position_min", f"{position_min:g} m with position_max {position_max:g} m", "must be below it")
    positions = table_positions(position_min, position_max, step)
    values = np.array([weights(float(z)).T @ shapes for z in positions])
    table = MotionTable(positions, values, name)
    if not is_checked:
        return table
    middle = (positions[:-1] + positions[1:]) / 2
    sample = middle[np.unique(np.linspace(0, len(middle) - 1, 8).astype(int))]
    exact = np.array([weights(float(z)).T @ shapes for z in sample])
    size = np.abs(values).max(axis=(0, 2), keepdims=True)
    error = float(np.max(np.abs(table.at(sample) - exact) / np.maximum(size, 1e-300)))
    return MotionTable(positions, values, name, error)


def table_positions(position_min: float, position_max: float, step: float) -> FloatArray:
    """Return the positions of a table's entries (m), at most `step` apart, at least four."""
    # A cubic between places needs four of them.
    count = max(int(np.ceil((position_max - position_min) / positive("step", step) - 1e-9)), 3) + 1
    return np.linspace(position_min, position_max, count)


def station_loads(weights: Sequence[SlidingWeights], position_min: float, position_max: float, *, step: float) -> csc_array:
    """Return loads of several sliding places at stations a step apart or closer, side by side, (n, 6 k): for `LargeBody`.

    Stations a patch length apart or closer are enough: the compression removes what they have in common.
    """
    from scipy.sparse import hstack

    count = max(int(np.ceil((position_max - position_min) / positive("step", step) - 1e-9)), 1) + 1
    return csc_array(hstack([csc_array(place(float(z))) for z in np.linspace(position_min, position_max, count)
                             for place in weights]))


@dataclass(frozen=True, eq=False)
class SlidingBody:
    """Reduced body with places that slide along it and others that are fixed.

    Parameters
    ----------
    reduction : Reduction
    tables : mapping of name to MotionTable
        Over the rigid motions and vectors of the reduction, side by side.
    fixed : (f, r) floats
        Motions of the other loads' places, likewise.

    >>> from scipy.sparse import csc_array
    >>> from toolpoint.substructuring import ActingLoads, LargeBody, reduce
    >>> pair = LargeBody(csc_array([[1e6, -1e6], [-1e6, 1e6]]), csc_array(np.eye(2)), np.eye(2)[:, :1], rigid=np.ones((2, 1)))
    >>> reduction = reduce(pair, ActingLoads(20.0))
    >>> def weights(z):  # the place lies between the two masses
    ...     return np.outer([1 - z, z], [1.0, 0, 0, 0, 0, 0])
    >>> shapes = np.hstack([np.ones((2, 1)) / np.sqrt(2), reduction.vectors])
    >>> table = tabulate(shapes, weights, 0.0, position_max=1.0, step=0.25, is_checked=False)
    >>> SlidingBody(reduction, {"spring": table}, np.zeros((0, 2))).span
    (0.0, 1.0)
    """

    reduction: Reduction
    tables: Mapping[str, MotionTable]
    fixed: FloatArray

    @property
    def span(self) -> tuple[float, float]:
        """Positions at which all sliding places are on their ways, m."""
        spans = [table.span for table in self.tables.values()]
        return max(start for start, _ in spans), min(end for _, end in spans)

    def participation(self, position: float, order: int = 0) -> FloatArray:
        """Return the motion of all places (sliding ones first) per coordinate, (places, r), or its derivative by the position.

        position : m; order : of the derivative, 0 for the motion itself.
        """
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
        # d lambda/dz = 2 x^T (dP/dz)^T (K - lambda M) P x, x of unit modal mass: only the participation P depends on z.
        omega = np.sqrt(np.maximum(squares, 1e-300))
        return omega / (2 * np.pi), np.einsum("im,im->m", slope, force[:len(slope)]) / (2 * np.pi * omega)

    def coupled(self, position: float, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        """Return squares (rad^2/s^2) and vectors of the lowest coupled modes, over rigid, elastic and further coordinates."""
        return self._solved(self._place(position, surroundings), surroundings, modes)

    def _solved(self, place: FloatArray, surroundings: Surroundings, modes: int) -> tuple[FloatArray, FloatArray]:
        n, n_body = place.shape[1], self.fixed.shape[1]
        places = len(place) - (n - n_body)
        k = place.T @ (surroundings.stiffness @ place)
        elastic = range(n_body - self.reduction.size, n_body)
        k[elastic, elastic] += self.reduction.squares
        number = min(count("modes", modes), n)
        # Without mass at the places the body's mass matrix stays the identity: a standard eigenproblem.
        if not surroundings.mass[:places].any():
            return _lowest_modes(k, surroundings.mass[places:, places:], number)
        m = place.T @ surroundings.mass @ place
        m[range(n_body), range(n_body)] += 1.0
        return eigh(k, m, subset_by_index=[0, number - 1], check_finite=False)

    def _place(self, position: float, surroundings: Surroundings) -> FloatArray:
        part = self.participation(position)
        places, n_body = part.shape
        others = len(surroundings.stiffness) - places
        if others < 0:
            fail("surroundings", f"{len(surroundings.stiffness)} coordinates", f"must be at least the {places} places")
        n = n_body + others
        place = np.zeros((places + others, n))
        place[:places, :n_body], place[places:, n_body:] = part, np.eye(others)
        return place


def _lowest_modes(stiffness: FloatArray, other_mass: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return the lowest eigenpairs where all coordinates have unit mass but the last ones, of mass matrix `other_mass`."""
    if not len(other_mass):
        return _lowest_eigenpairs(stiffness, number)
    n_body = len(stiffness) - len(other_mass)
    root = np.linalg.inv(np.linalg.cholesky(other_mass)).T
    stiffness[:, n_body:] = stiffness[:, n_body:] @ root
    stiffness[n_body:] = root.T @ stiffness[n_body:]
    squares, vectors = _lowest_eigenpairs(stiffness, number)
    vectors[n_body:] = root @ vectors[n_body:]
    return squares, vectors


def _lowest_eigenpairs(matrix: FloatArray, number: int) -> tuple[FloatArray, FloatArray]:
    """Return the lowest eigenpairs of a symmetric matrix: tridiagonal form, a few of its eigenpairs (MRRR), transformed back.

    It takes two thirds of the time of `eigh` for a hundred coordinates.
    """
    n = len(matrix)
    if n < MIN_TRIDIAGONAL_SIZE:
        return eigh(matrix, subset_by_index=[0, number - 1], check_finite=False)
    reflectors, diagonal, off_diagonal, sizes, info = lapack.dsytrd(matrix, lower=1, lwork=32 * n)
    squares, vectors = eigh_tridiagonal(diagonal, off_diagonal, select="i", select_range=(0, number - 1), check_finite=False,
                                        lapack_driver="stemr")
    vectors[1:], _, failed = lapack.dormqr("L", "N", reflectors[1:, :-1], sizes, vectors[1:], 32 * number)
    if info or failed:
        fail("matrix", "not finite", "must be finite")
    return squares, vectors


def fit_to_surroundings(
    body: SlidingBody, surroundings: Surroundings, positions: FloatArray, *, modes: int, size: int, kept: int
) -> SlidingBody:
    """Reduce a sliding body to `size` coordinates: its lowest `kept` ones, and those that coupled modes at positions need.

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

    Raises
    ------
    ToolpointError
        Where `size` is not between `kept` and the size of the body.

    Examples
    --------
    A spring to the ground that slides along a free chain of 30 masses (one direction of its six is stiff):

    >>> import numpy as np
    >>> from scipy.sparse import csc_array, diags_array
    >>> from toolpoint.substructuring import ActingLoads, LargeBody, Surroundings, reduce, tabulate
    >>> n, ones = 30, np.ones((30, 1))
    >>> stiffness = 1e6 * diags_array([-np.ones(n - 1), [1.0, *2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1)], offsets=[-1, 0, 1])
    >>> def weights(z):
    ...     hat = np.maximum(1 - np.abs(np.arange(n) - z), 0.0)
    ...     return np.outer(hat, [1.0, 0, 0, 0, 0, 0])
    >>> stations = csc_array(np.column_stack([weights(float(z))[:, 0] for z in range(n)]))
    >>> reduction = reduce(LargeBody(csc_array(stiffness), csc_array(np.eye(n)), stations, rigid=ones), ActingLoads(20.0))
    >>> rigid = ones / np.sqrt(n)
    >>> table = tabulate(np.hstack([rigid, reduction.vectors]), weights, 0.0, position_max=29.0, step=1.0, is_checked=False)
    >>> body = SlidingBody(reduction, {"spring": table}, np.zeros((0, reduction.size + 1)))
    >>> spring = Surroundings(np.diag([1e6, 0, 0, 0, 0, 0]), np.zeros((6, 6)))
    >>> ends = [float(body.frequencies(z, spring, 1)[0][0]) for z in (0.0, 29.0)]
    >>> bool(abs(ends[0] / ends[1] - 1) < 1e-9)  # the chain is symmetric
    True
    >>> small = fit_to_surroundings(body, spring, np.array([0.0, 15.0, 29.0]), modes=3, size=8, kept=0)
    >>> bool(abs(float(small.frequencies(0.0, spring, 1)[0][0]) / ends[0] - 1) < 1e-6)
    True
    """
    full = body.reduction
    if not kept <= size <= full.size:
        fail("size", f"{size}", f"must be {kept} .. {full.size}")
    rigid = body.fixed.shape[1] - full.size
    parts = [body.coupled(float(z), surroundings, modes + modes // 2) for z in floats("positions", positions)]
    # A unit vector stores unit energy here, so that every mode counts by the error of its frequency.
    answers = np.hstack([np.sqrt(full.squares)[:, None] * vectors[rigid:rigid + full.size] / np.sqrt(squares)
                         for squares, vectors in parts])
    left = np.linalg.svd(answers[kept:], full_matrices=False)[0][:, :size - kept]
    mix = np.zeros((full.size, kept + left.shape[1]))
    mix[:kept, :kept] = np.eye(kept)
    mix[kept:, kept:] = left / np.sqrt(full.squares[kept:])[:, None]
    reduced = full.combined(mix)
    turn = np.linalg.lstsq(full.vectors, reduced.vectors, rcond=None)[0]
    tables = {name: table.mixed(turn, rigid) for name, table in body.tables.items()}
    return SlidingBody(reduced, tables, np.hstack([body.fixed[:, :rigid], body.fixed[:, rigid:] @ turn]))
