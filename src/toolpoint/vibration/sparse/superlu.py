"""SuperLU of SciPy in its symmetric mode: the solver that is always there, and the slowest."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from toolpoint._check import FloatArray, fail


class SuperLu:
    """L U of a symmetric matrix with diagonal pivots, so that the signs of U's diagonal are those of the pivots."""

    name = "SuperLU"

    def __init__(self, matrix: csc_array) -> None:
        try:
            self._factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            fail("matrix", f"singular ({error})", "must have an inverse",
                 remedy="hold the body, or shift a free body's stiffness: K + s M with s above zero")
        if not np.array_equal(self._factor.perm_r, self._factor.perm_c):
            fail("matrix", "a pivot off the diagonal", "must be factorised with diagonal pivots",
                 remedy="move the shift away from an eigenvalue")
        self.negative_pivots = int((self._factor.U.diagonal() < 0).sum())

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution for one right side (n,) or several (n, k)."""
        return self._factor.solve(np.ascontiguousarray(right))
