r"""The one way to factorise a sparse symmetric matrix: the best present solver works and says its name.

The number of negative pivots of :math:`K - \mu M = L D L^T` is the number of eigenvalues below :math:`\mu` (Sylvester's law
of inertia; Parlett, The Symmetric Eigenvalue Problem, section 3.3).
"""

from __future__ import annotations

from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, sparray, spmatrix

from toolpoint._check import FloatArray, fail, floats, one_of
from toolpoint.vibration.sparse.node_matrix import NodeMatrix
from toolpoint.vibration.sparse.superlu import SuperLu

SparseMatrix: TypeAlias = sparray | spmatrix
_SYMMETRY = 1e-9


class _Solver(Protocol):
    name: str
    negative_pivots: int

    def solve(self, right: FloatArray) -> FloatArray: ...


class Factorisation:
    """Factors of a symmetric matrix, kept for any number of solutions.

    `name` says which solver made them, `size` is the number of rows, `negative_pivots` the number of negative eigenvalues.
    """

    def __init__(self, solver: _Solver, size: int) -> None:
        self._solver = solver
        self.size = size
        self.name = solver.name
        self.negative_pivots = solver.negative_pivots

    def solve(self, right: ArrayLike) -> FloatArray:
        """Return x of A x = b for one right side (n,) or a block of them (n, k)."""
        values = np.asarray(right, dtype=float)
        if values.ndim not in (1, 2) or len(values) != self.size:
            fail("right", f"shape {values.shape}", f"must be ({self.size},) or ({self.size}, any)")
        return self._solver.solve(floats("right", values))

    def __repr__(self) -> str:
        return f"Factorisation({self.size} rows by {self.name}, {self.negative_pivots} negative pivots)"


# Below this many rows SuperLU is done before compiled code is loaded.
_SMALL = 6000
SOLVERS = ("auto", "multifrontal", "SuperLU", "CHOLMOD")


def factorise(matrix: SparseMatrix, *, coordinates: FloatArray | None = None, solver: str = "auto",
              is_positive: bool = True) -> Factorisation:
    """Return the factorisation of a symmetric matrix by the best solver that is present.

    Parameters
    ----------
    matrix : (n, n) sparse array
        Symmetric, both triangles stored, with an inverse.
    coordinates : (n, 3) floats, optional
        Where each row's point is, m: gives a better ordering. Rows of one point must follow each other.
    solver : str
        ``multifrontal`` (our own), ``SuperLU`` (SciPy's; slow above some ten thousand rows) or ``CHOLMOD`` (where
        scikit-sparse is installed; positive definite matrices only); ``auto`` takes the first two by size.
    is_positive : bool
        False where the matrix is known to be indefinite: spares the attempt.

    Raises
    ------
    ToolpointError
        For a matrix that is not square, not symmetric, holds values that are not finite, or has no inverse.
    """
    checked = check_symmetric("matrix", matrix)
    n = checked.shape[0]
    best = chosen_solver(solver, n)
    coordinates = check_coordinates(coordinates, n)
    if best == "CHOLMOD":
        from toolpoint.vibration.sparse.cholmod import Cholmod

        return Factorisation(Cholmod(checked), n)
    if best == "SuperLU":
        return Factorisation(SuperLu(checked), n)
    from toolpoint.vibration.sparse.elimination import EliminationPlan
    from toolpoint.vibration.sparse.multifrontal import Multifrontal

    return Factorisation(Multifrontal(EliminationPlan(checked, coordinates), checked, is_positive=is_positive), n)


def chosen_solver(solver: str, size: int) -> str:
    """Return which solver works on so many rows where one is asked for, ``auto`` included."""
    one_of("solver", solver, SOLVERS)
    if solver != "auto":
        return solver
    return "SuperLU" if size < _SMALL or not _has_compiled() else "multifrontal"


def check_coordinates(coordinates: FloatArray | None, size: int) -> FloatArray | None:
    """Return places of all rows, or none."""
    if coordinates is None:
        return None
    places = floats("coordinates", coordinates, (None,))
    if places.ndim != 2 or len(places) != size:
        fail("coordinates", f"shape {places.shape}", f"must be ({size}, 3)")
    return places


def _has_compiled() -> bool:
    from toolpoint.vibration.sparse import dense_calls

    return dense_calls.addresses() is not None


def _asymmetry(columns: csc_array) -> float:
    """Return the largest difference between an entry and its mirror image; of large matrices without copies of them."""
    if columns.shape[0] < _SMALL or not columns.has_canonical_format:
        difference = abs(columns - columns.T)
        return float(difference.max()) if difference.nnz else 0.0
    from toolpoint.vibration.sparse import symbolic

    return float(symbolic.asymmetry(columns.indptr, columns.indices, columns.data))


def check_finite(name: str, matrix: NodeMatrix) -> NodeMatrix:
    """Return a matrix of node pairs, which is symmetric as it is stored, after checking that it is finite."""
    if not np.isfinite(matrix.largest):
        fail(name, "values that are not finite", "must be finite")
    return matrix


def check_symmetric(name: str, matrix: SparseMatrix) -> csc_array:
    """Return the matrix as compressed columns after checking that it is square, finite and symmetric."""
    columns = csc_array(matrix, dtype=float)
    if columns.shape[0] != columns.shape[1] or columns.shape[0] == 0:
        fail(name, f"shape {columns.shape}", "must be square and not empty")
    high, low = float(columns.data.max(initial=0.0)), float(columns.data.min(initial=0.0))
    if not (np.isfinite(high) and np.isfinite(low)):
        fail(name, "values that are not finite", "must be finite")
    scale = max(high, -low)
    error = _asymmetry(columns)
    if error > _SYMMETRY * scale:
        fail(name, f"unsymmetric by {error:g} (largest entry {scale:g})", "must be symmetric",
             remedy="is only a triangle stored, or does it hold gyroscopic or follower terms?")
    return columns
