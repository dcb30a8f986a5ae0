r"""The one way to factorise a sparse symmetric matrix, by the best solver present, which gives its name.

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
_MAX_ASYMMETRY = 1e-9  # of the largest entry


class _Solver(Protocol):
    name: str
    negative_pivots: int

    def solve(self, right: FloatArray) -> FloatArray: ...


class Factorisation:
    """Factors of a symmetric matrix, kept for any number of solutions.

    `name` is that of the solver, `size` the number of rows, `negative_pivots` the number of negative eigenvalues.

    Examples
    --------
    >>> import numpy as np
    >>> from scipy.sparse import csc_array
    >>> from toolpoint.vibration.sparse import factorise
    >>> factors = factorise(csc_array([[2.0, 1.0], [1.0, -1.0]]))
    >>> factors
    Factorisation(2 rows by SuperLU, 1 negative pivots)
    >>> factors.solve([3.0, 0.0]).round(12).tolist()
    [1.0, 1.0]
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


_MIN_COMPILED_ROWS = 6000  # below, SuperLU is done before compiled code is loaded
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
        False where the matrix is known to be indefinite: no Cholesky factorisation is tried.

    Raises
    ------
    ToolpointError
        For a matrix that is not square, not symmetric, holds values that are not finite, or has no inverse.

    Examples
    --------
    >>> from scipy.sparse import csc_array
    >>> from toolpoint.vibration.sparse import factorise
    >>> factorise(csc_array([[2.0, 1.0], [1.0, 1.0]])).solve([3.0, 2.0]).round(12).tolist()
    [1.0, 1.0]
    """
    checked = check_symmetric("matrix", matrix)
    n = checked.shape[0]
    solver_name = chosen_solver(solver, n)
    coordinates = check_coordinates(coordinates, n)
    if solver_name == "CHOLMOD":
        from toolpoint.vibration.sparse.cholmod import Cholmod

        return Factorisation(Cholmod(checked), n)
    if solver_name == "SuperLU":
        return Factorisation(SuperLu(checked), n)
    from toolpoint.vibration.sparse.elimination import EliminationPlan
    from toolpoint.vibration.sparse.multifrontal import Multifrontal

    return Factorisation(Multifrontal(EliminationPlan(checked, coordinates), checked, is_positive=is_positive), n)


def chosen_solver(solver: str, size: int) -> str:
    """Return the name of the solver for a number of rows; ``auto`` chooses by size, and by what is present."""
    one_of("solver", solver, SOLVERS)
    if solver != "auto":
        return solver
    return "SuperLU" if size < _MIN_COMPILED_ROWS or not _has_compiled() else "multifrontal"


def check_coordinates(coordinates: FloatArray | None, size: int) -> FloatArray | None:
    """Return the coordinates of all rows after checking their shape; None where there are none."""
    if coordinates is None:
        return None
    points = floats("coordinates", coordinates, (None,))
    if points.ndim != 2 or len(points) != size:
        fail("coordinates", f"shape {points.shape}", f"must be ({size}, 3)")
    return points


def _has_compiled() -> bool:
    """Whether SciPy's BLAS can be called from compiled loops."""
    from toolpoint.vibration.sparse import dense_calls

    return dense_calls.addresses() is not None


def _asymmetry(columns: csc_array) -> float:
    """Return the largest difference between an entry and its mirror image; of large matrices without copies of them."""
    if columns.shape[0] < _MIN_COMPILED_ROWS or not columns.has_canonical_format:
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
    largest, smallest = float(columns.data.max(initial=0.0)), float(columns.data.min(initial=0.0))
    if not (np.isfinite(largest) and np.isfinite(smallest)):
        fail(name, "values that are not finite", "must be finite")
    size = max(largest, -smallest)
    error = _asymmetry(columns)
    if error > _MAX_ASYMMETRY * size:
        fail(name, f"unsymmetric by {error:g} (largest entry {size:g})", "must be symmetric",
             remedy="is only a triangle stored, or does it hold gyroscopic or follower terms?")
    return columns
