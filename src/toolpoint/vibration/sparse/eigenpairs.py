"""EigenPairs: the lowest eigenvalues and vectors of K and M, with the check that none is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, floats
from toolpoint._notebook import NotebookText

MAX_RIGID_SQUARE = 1e-5  # of the shift: size of squares that the solution itself leaves of rigid motions
_MAX_ROUNDING_SQUARE = 1e-5  # of the first elastic square: size that the digits of matrices may leave of rigid motions
_RIGID_RANGE_FACTOR = 10.0  # times the most negative square: squares of this size are rigid motions as well
_MIN_ELASTIC_RATIO = 1e3  # square over rounding from which a mode is elastic


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
        this, and of its order squared where the mode is alone. It is that before the last inverse iteration, an upper bound.
    counted_below : float
        Frequency up to which the modes were counted by the signs of pivots, Hz; 0 where they were not.
    solver : str
        Name of the factorisation.
    status : str
        Whether all is well, and what to try next where not.
    equation_residual : (n_modes,) floats, optional
        :math:`\|K \phi - \omega^2 M \phi\| / (\omega^2 \|M \phi\|)` of the vectors as they are, 0 for rigid-body modes; None
        for a dense solution.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> from toolpoint.vibration.sparse import modes
    >>> pairs = modes(diags_array([1e6, 4e6, 9e6]), diags_array([1.0, 1.0, 1.0]), 2)
    >>> pairs.frequency.round(3).tolist(), pairs.rigid_count
    ([159.155, 318.31], 0)
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
        band = f"{self.frequency[-1]:.6g} Hz" if self.count else "none"
        return f"EigenPairs({self.count} modes to {band}, {self.rigid_count} rigid, {self.solver}; {self.status})"


def settle_rigid(squares: FloatArray, shift: float) -> FloatArray:
    """Return eigenvalues (rad^2/s^2) with those of rigid motions set to zero.

    Matrices of another program have the digits that it wrote: a free body's squares are then zero within that rounding, of
    either sign. A negative square shows its size, which must be far below the first elastic square: else the stiffness is truly
    negative.

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
    settled = np.where(np.abs(squares) <= MAX_RIGID_SQUARE * shift, 0.0, squares)
    rounding = -float(settled.min(initial=0.0))
    if rounding == 0:
        return settled
    elastic = settled[settled > _MIN_ELASTIC_RATIO * rounding]
    first = float(elastic.min()) if elastic.size else shift
    if rounding > _MAX_ROUNDING_SQUARE * first:
        fail("stiffness", f"eigenvalue {-rounding:g} rad^2/s^2, the first elastic one {first:.4g}",
             f"must not be negative beyond rounding, {_MAX_ROUNDING_SQUARE:g} of the latter",
             remedy="an element of negative stiffness, or a load beyond buckling? matrices written with few digits: write more")
    return np.where(np.abs(settled) <= _RIGID_RANGE_FACTOR * rounding, 0.0, settled)
