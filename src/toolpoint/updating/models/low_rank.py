r"""Low-rank factors of matrix derivatives: a spring's dK is one outer product, a rigid body's dM has rank six at most.

:math:`dA/dp = L\,\mathrm{diag}(w)\,L^T` from the eigenvalues of the small block that is not zero, so that
:math:`\phi^T (dA/dp) \phi` and :math:`H (dA/dp) H` cost the products with a few columns and not those with whole matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import Array, FloatArray, fail
from toolpoint.vibration.sensitivity import MatrixDerivatives

TERMS = ("mass", "damping", "stiffness", "structural_damping")
NULL_EIGENVALUE_RATIO = 1e-14  # of the largest: a spring's own matrix has rank 1 to 6, what lies below is rounding


@dataclass(frozen=True, eq=False)
class Term:
    """Derivatives of one matrix to some of the parameters.

    used : (u,) indices of the parameters; columns : (u, r, n) L^T, padded with zeros; weights : (u, r) w per unit of the number
    that each column comes from; source : (u, r) index of that number.
    """

    used: np.ndarray
    columns: FloatArray
    weights: FloatArray
    source: np.ndarray

    def scaled(self, slopes: FloatArray) -> FloatArray:
        """Return the weights (u, r) per unit of the parameters; slopes : (n_numbers,), d number/d parameter."""
        return np.asarray(self.weights * slopes[self.source])

    def seen(self, vectors: Array) -> Array:
        """Return L^T @ vectors, (u, r, k), for vectors (n, k)."""
        return np.asarray(self.columns.reshape(-1, len(vectors)) @ vectors).reshape(*self.weights.shape, -1)


def factor_matrices(derivatives: MatrixDerivatives, owner: Sequence[int]) -> dict[str, Term]:
    """Return the factors of every matrix that depends on the numbers; number k belongs to parameter owner[k].

    derivatives : one pose. Raises ToolpointError for an unsymmetric derivative.
    """
    result = {}
    for name in TERMS:
        matrices = getattr(derivatives, name)
        if matrices is not None and np.any(matrices):
            result[name] = _term(name, matrices, np.asarray(owner))
    return result


def _term(name: str, matrices: FloatArray, owner: np.ndarray) -> Term:
    per: dict[int, list[tuple[int, FloatArray, FloatArray]]] = {}
    for number in np.flatnonzero(matrices.any(axis=(1, 2))).tolist():
        per.setdefault(int(owner[number]), []).append((number, *_factors(f"derivative of {name}", matrices[number])))
    used = sorted(per)
    rank = max(sum(w.size for _, w, _ in per[j]) for j in used)
    columns = np.zeros((len(used), rank, matrices.shape[-1]))
    weights, source = np.zeros((len(used), rank)), np.zeros((len(used), rank), int)
    for i, j in enumerate(used):
        position = 0
        for k, values, vectors in per[j]:
            part = slice(position, position + values.size)
            columns[i, part], weights[i, part], source[i, part] = vectors.T, values, k
            position = part.stop
    return Term(np.array(used), columns, weights, source)


def _factors(name: str, matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (w (r,), L (n, r)) of a symmetric matrix, from the block of its rows that are not zero."""
    if np.abs(matrix - matrix.T).max() > 1e-8 * np.abs(matrix).max():
        fail(name, "an unsymmetric matrix", "must be symmetric")
    rows = np.flatnonzero(matrix.any(axis=1))
    values, vectors = np.linalg.eigh(matrix[np.ix_(rows, rows)])
    keep = np.abs(values) > NULL_EIGENVALUE_RATIO * np.abs(values).max()
    result = np.zeros((len(matrix), int(keep.sum())))
    result[rows] = vectors[:, keep]
    return values[keep], result
