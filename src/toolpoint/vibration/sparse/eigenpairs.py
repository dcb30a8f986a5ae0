"""EigenPairs: the lowest eigenvalues and vectors of K and M, with what was done to be sure that none is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText


@dataclass(frozen=True, eq=False)
class EigenPairs(NotebookText):
    r"""Lowest modes of :math:`K \phi = \omega^2 M \phi`, ascending.

    Parameters
    ----------
    squares : (n_modes,) floats
        rad^2/s^2; 0 for rigid-body modes.
    vectors : (n, n_modes) floats
        phi^T M phi = 1.
    residual : (n_modes,) floats
        Norm of the residual in the shifted inverse, relative to its eigenvalue: the relative error of the square is at most
        this, and of its order squared where the mode stands alone. That before the last inverse iteration, so an upper bound.
    counted_below : float
        Frequency up to which the modes were counted by the signs of pivots, Hz; 0 where they were not.
    solver : str
        Name of the factorisation.
    status : str
        Whether all is well, and what to try next where not.
    equation_residual : (n_modes,) floats, optional
        :math:`\|K \phi - \omega^2 M \phi\| / (\omega^2 \|M \phi\|)` of the vectors as they are, 0 for rigid-body modes; not
        known of a dense solution.
    """

    squares: FloatArray
    vectors: FloatArray
    residual: FloatArray
    counted_below: float
    solver: str
    status: str
    equation_residual: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "squares", floats("EigenPairs.squares", self.squares, (None,)))
        count = len(self.squares)
        vectors = np.asarray(self.vectors)
        if vectors.ndim != 2 or vectors.shape[1] != count:
            fail("EigenPairs.vectors", f"shape {vectors.shape}", f"must be (any, {count})")
        vectors.flags.writeable = False
        put(self, "vectors", vectors)
        put(self, "residual", floats("EigenPairs.residual", self.residual, (count,)))
        if self.equation_residual is not None:
            put(self, "equation_residual", floats("EigenPairs.equation_residual", self.equation_residual, (count,)))

    @property
    def frequency(self) -> FloatArray:
        """Natural frequencies, Hz."""
        return np.sqrt(np.maximum(self.squares, 0)) / (2 * np.pi)

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(self.squares)

    @property
    def rigid_count(self) -> int:
        """Number of rigid-body modes."""
        return int((self.squares == 0).sum())

    @property
    def is_complete(self) -> bool:
        """Whether it is certain that no mode below `counted_below` is missing."""
        return self.counted_below > 0

    def __repr__(self) -> str:
        top = f"{self.frequency[-1]:.6g} Hz" if self.count else "none"
        return f"EigenPairs({self.count} modes to {top}, {self.rigid_count} rigid, {self.solver}; {self.status})"
