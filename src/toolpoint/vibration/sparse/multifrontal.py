"""Our own supernodal multifrontal factorisation: nested dissection, Cholesky where the matrix is positive, else L D L^T."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint.vibration.sparse import dense_calls, kernels
from toolpoint.vibration.sparse.elimination import EliminationPlan
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, SymmetricMatrix

_MIN_PIVOT_RATIO = 1e-15  # of the largest entry: below, the matrix, or a leading part of it, has no inverse
_MAX_RIGHT_SIDES = 24  # solved for at once: the factor is read once for all of them, and they need memory of their own


class Multifrontal:
    """Factors of K + shift M (of K where there is no M) in a planned order; the sum itself is never made."""

    def __init__(self, plan: EliminationPlan, stiffness: SymmetricMatrix, *, mass: SymmetricMatrix | None = None,
                 shift: float = 0.0, is_positive: bool = True) -> None:
        self._plan, self._routines = plan, dense_calls.require_addresses()
        diagonal = stiffness.diagonal() if mass is None else stiffness.diagonal() + shift * mass.diagonal()
        self.is_positive = is_positive and bool((diagonal > 0).all())
        self._factor, self._diagonal = np.empty(plan.factor_size), np.ones(stiffness.shape[0])
        # A pivot that is not above zero shows only on the way; Cholesky, by BLAS alone, is faster where none comes.
        if not self.is_positive or self._eliminate(stiffness, mass, shift, True) >= 0:
            self.is_positive = False
            self._diagonal[:] = 1.0
            _refuse(plan, self._eliminate(stiffness, mass, shift, False))
        self.negative_pivots = int((self._diagonal < 0).sum())
        self.name = f"multifrontal {'Cholesky' if self.is_positive else 'L D L^T'} ({plan.name})"

    def _eliminate(self, stiffness: SymmetricMatrix, mass: SymmetricMatrix | None, shift: float, positive: bool) -> int:
        return _eliminate(self._plan, stiffness, mass, shift=shift, factor=self._factor, diagonal=self._diagonal,
                          positive=positive)

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution for one right side (n,) or several (n, k)."""
        plan, rows = self._plan, np.atleast_2d(right.T)
        result = np.empty(rows.shape)
        for part in (slice(start, start + _MAX_RIGHT_SIDES) for start in range(0, len(rows), _MAX_RIGHT_SIDES)):
            block = np.ascontiguousarray(rows[part][:, plan.order])
            kernels.solve_groups(block, plan.begins, plan.pointers, plan.rows, plan.starts, self._factor, self._diagonal,
                                 self._routines, self.is_positive)
            result[part][:, plan.order] = block
        return result[0] if right.ndim == 1 else result.T


def count_negative(plan: EliminationPlan, stiffness: SymmetricMatrix, mass: SymmetricMatrix, *, shift: float) -> int:
    """Return the number of negative pivots of K + shift M, whose factors are not kept."""
    diagonal = np.ones(stiffness.shape[0])
    _refuse(plan, _eliminate(plan, stiffness, mass, shift=shift, factor=np.empty(0), diagonal=diagonal, positive=False))
    return int((diagonal < 0).sum())


def _eliminate(plan: EliminationPlan, stiffness: SymmetricMatrix, mass: SymmetricMatrix | None, *, shift: float,
               factor: FloatArray, diagonal: FloatArray, positive: bool) -> int:
    """Eliminate in the planned order; return -1, or the first place without a usable pivot."""
    stiffness_arrays = _arrays(stiffness)
    mass_arrays = stiffness_arrays if mass is None else _arrays(mass)
    scale = 0.0 if mass is None else shift
    tiny = _MIN_PIVOT_RATIO * (_largest(stiffness) + (abs(scale) * _largest(mass) if mass is not None else 0.0))
    work, routines = plan.workspace(), dense_calls.require_addresses()
    for group_begin, group_end in plan.pieces():
        row = kernels.factorise_groups(group_begin, group_end, stiffness_arrays, mass_arrays, scale, plan.arrays, work, factor,
                                       diagonal,
                                       routines, positive,
                                       tiny)
        if row >= 0:
            return int(row)
    return -1


def _arrays(matrix: SymmetricMatrix) -> tuple[np.ndarray, ...]:
    """Return the arrays of a matrix as the kernels take them."""
    if isinstance(matrix, NodeMatrix):
        return matrix.pattern.pointers, matrix.pattern.columns, matrix.pattern.entries, matrix.blocks
    return matrix.indptr, matrix.indices, matrix.data


def _largest(matrix: SymmetricMatrix) -> float:
    """Return the size of the largest entry."""
    if isinstance(matrix, NodeMatrix):
        return matrix.largest
    return max(float(matrix.data.max(initial=0.0)), -float(matrix.data.min(initial=0.0)))


def _refuse(plan: EliminationPlan, place: int) -> None:
    """Raise the error of a row without a usable pivot; nothing for place -1."""
    if place < 0:
        return
    fail("matrix", f"no usable pivot in row {int(plan.order[place])}", "must have an inverse, as its leading parts must",
         remedy="hold the body, or shift a free body's stiffness: K + s M with s above zero; move a shift off an eigenvalue")
