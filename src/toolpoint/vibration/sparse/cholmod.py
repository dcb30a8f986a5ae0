"""CHOLMOD through scikit-sparse, where a user has installed it: never needed, and in no extra (GPL parts)."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array, csc_matrix

from toolpoint._check import FloatArray, fail


class Cholmod:
    """Cholesky factors of a positive definite matrix."""

    name = "CHOLMOD"
    negative_pivots = 0

    def __init__(self, matrix: csc_array) -> None:
        try:
            from sksparse import cholmod
        except ImportError:
            fail("solver", "CHOLMOD", "needs the package scikit-sparse",
                 remedy="pip install scikit-sparse, or solver='multifrontal'")
        try:
            self._factor = cholmod.cholesky(csc_matrix(matrix))
        except cholmod.CholmodNotPositiveDefiniteError:
            fail("matrix", "not positive definite", "must be for CHOLMOD", remedy="take solver='multifrontal'")

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solution for one right side (n,) or several (n, k)."""
        return self._factor(np.asfortranarray(right))
