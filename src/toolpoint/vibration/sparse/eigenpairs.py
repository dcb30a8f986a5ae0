"""EigenPairs: the lowest eigenvalues and vectors of K and M, with what was done to be sure that none is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText

RIGID_SHARE = 1e-5  # of the shift: squares that the solution itself leaves of rigid motions
_ROUNDING_SHARE = 1e-5  # of the first elastic square: most that the digits of matrices may leave of rigid motions
_ROUNDING_RANGE = 10.0  # times the most negative square: range in which squares are rigid motions as it is
_ELASTIC_RATIO = 1e3  # square over rounding from which a mode is elastic

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


def settle_rigid(squares: FloatArray, shift: float) -> FloatArray:
    """Return eigenvalues (rad^2/s^2) with those of rigid motions at zero.

    Matrices of another program have the digits that it wrote: a free body's squares are then zero within that rounding, of
    either sign. A negative square shows how large it is. It must be far below the first elastic one; what is not, is a
    stiffness that is truly negative.

    Parameters
    ----------
    squares : (n,) floats
    shift : float
        Of the search, rad^2/s^2.

    Raises
    ------
    ToolpointError
        For a negative eigenvalue that rounding does not explain.
    """
    settled = np.where(np.abs(squares) <= RIGID_SHARE * shift, 0.0, squares)
    rounding = -float(settled.min(initial=0.0))
    if rounding == 0:
        return settled
    elastic = settled[settled > _ELASTIC_RATIO * rounding]
    first = float(elastic.min()) if elastic.size else shift
    if rounding > _ROUNDING_SHARE * first:
        fail("stiffness", f"eigenvalue {-rounding:g} rad^2/s^2, the first elastic one {first:.4g}",
             f"must not be negative beyond rounding, {_ROUNDING_SHARE:g} of the latter",
             remedy="an element of negative stiffness, or a load beyond buckling? matrices written with few digits: write more")
    return np.where(np.abs(settled) <= _ROUNDING_RANGE * rounding, 0.0, settled)
