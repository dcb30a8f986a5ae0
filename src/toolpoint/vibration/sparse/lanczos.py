r"""Lowest modes of large sparse K and M by block Lanczos on the shifted inverse, with a count that shows that none is missing.

The operator is :math:`(K + s M)^{-1} M` with s above zero, so that K of a free body has an inverse; a block finds repeated
modes together; every block is made orthogonal (in M) to all before it. Then the negative pivots of :math:`K - \mu M`, with
:math:`\mu` in the gap behind the last mode, are counted (Sylvester). Source: Grimes, Lewis, Simon, SIAM J. Matrix Anal.
Appl. 15 (1994).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.vibration.sparse.eigenpairs import MAX_RIGID_SQUARE, EigenPairs, settle_rigid
from toolpoint.vibration.sparse.factorisation import Factorisation, SparseMatrix, check_symmetric, factorise
from toolpoint.vibration.sparse.node_matrix import as_columns
from toolpoint.vibration.sparse.pencil import Pencil
from toolpoint.vibration.sparse.polish import polish_pairs

# Shift over the median of diag(K)/diag(M), which is about the highest frequency squared: far below the first elastic mode of a
# mesh with a million nodes, far above rounding.
_SHIFT_FRACTION = 1e-8
_MAX_MODE_RESIDUAL = 1e-8  # relative, in the shifted inverse
_COARSE_SHIFT_FACTOR = 100.0  # for matrices whose rounding exceeds the shift
_DENSE_MODE_RATIO, _MAX_DENSE_ROWS = 2, 6000  # rows with mass over modes, and rows, below which a dense solver is used
_MASSLESS_FRACTION = 1e-14  # of the largest 1/(square + shift): below, a row without mass
_CLUSTER_GAP = 1e-6  # relative distance of squares up to which a mode comes with the last

_Polished = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


def modes(
    stiffness: SparseMatrix, mass: SparseMatrix, number: int | None = None, *, below: float | None = None,
    shift: float | None = None, is_counted: bool = True, coordinates: FloatArray | None = None,
    solver: str = "auto", inverse: Factorisation | None = None,
) -> EigenPairs:
    """Return the lowest modes, rigid-body modes included.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse arrays
        Symmetric; stiffness positive semidefinite. Rows without mass are allowed.
    number : int, optional
        How many; modes that lie together with the last (within 1e-6) come too.
    below : float, optional
        All modes below this frequency, Hz, instead of a number.
    shift : float, optional
        s, rad^2/s^2; chosen from the diagonals where left out.
    is_counted : bool
        Whether the modes are counted (one more factorisation); without it nothing says that none is missing.
    coordinates, solver
        Passed to `factorise`; the count needs a solver of indefinite matrices.
    inverse : Factorisation, optional
        Of K + `shift` M where there is one already; the shift may be 0 then, for a held body.

    Raises
    ------
    ToolpointError
        For a stiffness with negative eigenvalues, matrices that do not fit each other, or both of `number` and `below`.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> from toolpoint.vibration.sparse import modes
    >>> chain = diags_array([[-1e6, -1e6], [1e6, 2e6, 1e6], [-1e6, -1e6]], offsets=[-1, 0, 1])  # three masses on two springs
    >>> modes(chain, diags_array([1.0, 1.0, 1.0]), 2).frequency.round(3).tolist()
    [0.0, 159.155]
    """
    k, m = check_symmetric("stiffness", stiffness), check_symmetric("mass", mass)
    if k.shape != m.shape:
        fail("mass", f"shape {m.shape}", f"must be that of the stiffness, {k.shape}")
    if (number is None) == (below is None):
        fail("number", f"{number} and below {below}", "must give either a number of modes or the band below a frequency")
    s = shift if inverse is not None and shift == 0 else positive("shift", shift) if shift is not None else default_shift(k, m)
    pencil = Pencil(k, m, s, coordinates=coordinates, solver=solver)
    if shift is None and inverse is None and pencil.inverse.negative_pivots:
        # Matrices of few digits leave rigid motions below -s: a true instability is refused with the larger shift too.
        pencil = Pencil(k, m, _COARSE_SHIFT_FACTOR * s, coordinates=coordinates, solver=solver)
    if inverse is not None:
        pencil.inverse, pencil.solver_name = inverse, inverse.name
    return modes_of(pencil, number, below=below, is_counted=is_counted, is_kept=inverse is not None)


def modes_of(pencil: Pencil, number: int | None = None, *, below: float | None = None, is_counted: bool = True,
             is_kept: bool = True, max_modes: int | None = None) -> EigenPairs:
    """Return the lowest modes as `modes` does, with the factors of a pencil; they are let go after use unless `is_kept`.

    max_modes : of a band; more are refused as soon as they are counted.
    """
    search = _Search(pencil, is_kept)
    if below is not None:
        return search.band((2 * np.pi * positive("below", below)) ** 2, max_modes)
    max_modes = min(count("number", number or 0), search.rank())
    if _DENSE_MODE_RATIO * max_modes > search.rank() and pencil.mass.shape[0] <= _MAX_DENSE_ROWS:
        return _dense_modes(search, max_modes)
    return search.lowest(max_modes, is_counted)


def _dense_modes(search: _Search, number: int) -> EigenPairs:
    """Return the lowest modes where most of all are asked for: there is no room left for a basis that grows beyond them.

    With the shifted stiffness positive, M x = t (K + s M) x has t = 1/(square + s), 0 of rows without mass.
    """
    search.inverse()  # refuses a stiffness with negative eigenvalues
    m = as_columns(search.m).toarray()
    shifted = as_columns(search.pencil.stiffness).toarray() + search.shift * m
    inverse, vectors = eigh(m, shifted)
    with_mass = np.flatnonzero(inverse > _MASSLESS_FRACTION * inverse[-1])[::-1]
    squares = 1 / inverse[with_mass] - search.shift
    keep = _cut_behind(squares, min(number, len(squares)), len(squares))[0]
    squares, with_mass = squares[:keep], with_mass[:keep]
    squares = settle_rigid(squares, search.shift)
    return EigenPairs(squares, vectors[:, with_mass] / np.sqrt(inverse[with_mass]), np.zeros(len(with_mass)),
                      float(np.sqrt(squares.max(initial=0.0))) / (2 * np.pi), search.pencil.solver_name,
                      "all modes found, by a dense solution")


def count_below(
    stiffness: SparseMatrix, mass: SparseMatrix, frequency: float, *, coordinates: FloatArray | None = None
) -> int:
    """Return the number of modes below a frequency (Hz): the negative pivots of K - (2 pi f)^2 M.

    Examples
    --------
    >>> from scipy.sparse import diags_array
    >>> from toolpoint.vibration.sparse import count_below
    >>> count_below(diags_array([1e6, 4e6, 9e6]), diags_array([1.0, 1.0, 1.0]), 400.0)
    2
    """
    square = (2 * np.pi * positive("frequency", frequency)) ** 2
    return factorise(csc_array(stiffness - square * mass), coordinates=coordinates, is_positive=False).negative_pivots


def default_shift(stiffness: csc_array, mass: csc_array) -> float:
    """Return a small positive shift, rad^2/s^2: far below the elastic modes, far above rounding."""
    inertias, springs = mass.diagonal(), stiffness.diagonal()
    is_elastic = (inertias > 0) & (springs > 0)
    if not is_elastic.any():
        fail("mass", "no positive entry on the diagonal", "must hold mass")
    return _SHIFT_FRACTION * float(np.median(springs[is_elastic] / inertias[is_elastic]))


@dataclass
class _Search:
    """One search: the pencil, and whether its factors are kept for later use."""
    pencil: Pencil
    is_kept: bool

    def __post_init__(self) -> None:
        self.m, self.shift = self.pencil.mass, self.pencil.shift

    def inverse(self) -> Factorisation:
        """Return the factors, of a stiffness without negative eigenvalues."""
        factors = self.pencil.inverse
        if factors.negative_pivots:
            fail("stiffness", f"{factors.negative_pivots} negative eigenvalues below {-self.shift:.3g} rad^2/s^2",
                 "must be positive semidefinite", remedy="an element of negative stiffness, or a load beyond buckling?")
        return factors

    def rank(self) -> int:
        """Upper bound of the number of modes: rows that hold mass."""
        return int((self.m.diagonal() > 0).sum())

    def lowest(self, number: int, is_counted: bool) -> EigenPairs:
        """Return a number of lowest modes; the basis grows until the count behind the last agrees."""
        basis = _Basis(self, number)
        basis.grow_to(number)
        if not is_counted:
            return self._pairs(basis.polished(number), 0.0,
                               "modes not counted: ask for a count to be sure that none is missing")
        missing_count, mu = 0, np.inf
        for _ in range(4):
            squares = basis.squares()
            squares = np.where(np.abs(squares) <= MAX_RIGID_SQUARE * self.shift, 0.0, squares)
            if len(squares) < number:
                basis.restart(number)
                continue
            keep, mu = _cut_behind(squares, number, self.rank())
            polished = basis.polished(keep)  # before the count, which lets the factors go
            missing_count = self._count(mu) - keep if np.isfinite(mu) else 0
            if missing_count == 0:
                return self._pairs(polished, np.sqrt(max(mu, 0.0)) / (2 * np.pi), "all modes found, by count")
            basis.restart(number + max(missing_count, 0))
        number = min(number, len(basis.squares()))
        return self._pairs(basis.polished(number), 0.0,
                           f"{missing_count} modes below {np.sqrt(mu) / 2 / np.pi:.6g} Hz were counted "
                                                        "and not found: give another shift")

    def band(self, square_max: float, max_modes: int | None = None) -> EigenPairs:
        """Return all modes below a square (rad^2/s^2): counted first, then searched until so many are there."""
        number = self._count(square_max)
        if max_modes is not None and number > max_modes:
            fail("band", f"{number} of {self.rank()} modes lie below {np.sqrt(square_max) / (2 * np.pi):.4g} Hz",
                 f"must be at most {max_modes}", remedy="the mesh carries no more: write a lower band or a finer "
                 "mesh; are the units of band and modulus right?")
        basis = _Basis(self, max(number, 1))
        for _ in range(4):
            basis.grow_to(max(number, 1))
            if int((basis.squares() < square_max).sum()) == number:
                return self._pairs(basis.polished(number), np.sqrt(square_max) / (2 * np.pi),
                                   "all modes of the band found, by count")
            basis.restart(number + 2)
        return self._pairs(basis.polished(int((basis.squares() < square_max).sum())), 0.0,
                           f"{number} modes of the band were counted, not all found: give another shift")

    def _count(self, mu: float) -> int:
        """Return the number of eigenvalues below mu, with the factors of the operator discarded first unless they are kept."""
        if not self.is_kept:
            self.pencil.let_go()  # a count needs the memory of factors, and is mostly the last step
        return self.pencil.count_below(mu)

    def _pairs(self, polished: _Polished, counted: float, status: str) -> EigenPairs:
        squares, vectors, residual, equation_residual = polished
        squares = settle_rigid(squares, self.shift)
        return EigenPairs(squares, vectors, residual, float(counted), self.pencil.solver_name, status, equation_residual)


def _cut_behind(squares: FloatArray, number: int, total: int) -> tuple[int, float]:
    """Return how many modes to keep and a square in the gap behind them."""
    keep = number
    while keep < len(squares) and squares[keep] <= squares[keep - 1] + _CLUSTER_GAP * max(abs(squares[keep]), 1e-300):
        keep += 1
    if keep >= total:
        return keep, np.inf
    last = max(squares[keep - 1], 0.0)
    following = squares[keep] if keep < len(squares) else 1.05 * last
    # Half-way where the next mode is close; else well below it, as its own value may still come down.
    return keep, last + 0.5 * (following - last) if following < 1.5 * last else 1.2 * last + 0.01 * (following - last)


class _Basis:
    """Basis orthonormal in M, and the operator projected on it."""

    def __init__(self, search: _Search, number: int) -> None:
        self._search = search
        n = search.m.shape[0]
        # Seeded by the size: the same matrices give the same modes to the last bit.
        self._random = np.random.default_rng(n)
        # Six to begin with: a free body in space has no more rigid motions.
        self._width = min(n, 6)
        self._store: FloatArray = np.empty((n, min(n, max(6 * number, 60)) + self._width), order="F")
        self._filled = 0
        self._mass_block: FloatArray = np.zeros((n, 0))
        self._projected: FloatArray = np.zeros((0, 0))
        self._coupling: FloatArray = np.zeros((0, 0))
        self._width = min(n, max(3, self._rigid_count()))
        self._next = self._orthonormal(self._start())[0]

    def _apply(self, mass_block: FloatArray) -> FloatArray:
        """Return the operator's image of a block whose product with M is given."""
        return self._search.inverse().solve(mass_block)

    def _start(self) -> FloatArray:
        """Return the image of random vectors that hold nothing of the basis: rigid-body modes would drown all else."""
        block = self._random.standard_normal((self._search.m.shape[0], self._width))
        for _ in range(2):
            block = block - self._vectors @ (self._vectors.T @ (self._search.m @ block))
        return self._apply(self._search.m @ block)

    def _rigid_count(self) -> int:
        """Return how many of six vectors one application turns into rigid-body modes: a block must hold them all."""
        block = self._orthonormal(self._start())[0]
        values = np.linalg.eigvalsh(self._mass_block.T @ self._apply(self._mass_block)) if block.shape[1] else np.zeros(0)
        # A rigid motion has the value 1/s, an elastic mode with a square far above s a small fraction of it.
        return int((values * self._search.shift > 0.5).sum())

    @property
    def _vectors(self) -> FloatArray:
        return self._store[:, :self._filled]

    def _orthonormal(self, block: FloatArray, others: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the block orthonormal in M and to the basis, its components along the basis, and its triangle.

        Its product with M is kept in `_mass_block`.
        """
        projection: FloatArray = np.zeros((self._filled, block.shape[1]))
        # What is left of a block that the basis holds already is rounding, and must not be blown up.
        mass_block = self._search.m @ block
        rounding = (1e-13**2) * float(np.einsum("ij,ij->j", block, mass_block).max(initial=0.0))
        # Once leaves rounding of what was taken away, which may exceed what remains; twice is enough (Kahan, Parlett).
        for sweep in range(2):
            if others is not None:
                block = block - others @ (others.T @ (self._search.m @ block))
            if others is not None or sweep:
                mass_block = self._search.m @ block
            part = self._vectors.T @ mass_block
            block = block - self._vectors @ part
            projection += part
        # By the eigenvalues of the Gram matrix, not by Cholesky or QR: columns that depend on others are left out where
        # they show.
        triangle: FloatArray = np.eye(block.shape[1])
        mass_block = self._search.m @ block
        # Twice: eigenvalues of a Gram matrix hold half of the digits of the columns, so the first pass is rough.
        for _ in range(2):
            gram = block.T @ mass_block
            values, rotations = np.linalg.eigh((gram + gram.T) / 2)
            keep = values > max(rounding, 1e-22 * values.max(initial=0.0), 1e-300)
            roots = np.sqrt(values[keep])
            block, mass_block = block @ (rotations[:, keep] / roots), mass_block @ (rotations[:, keep] / roots)
            triangle = (roots[:, None] * rotations[:, keep].T) @ triangle
            rounding = 0.0
        self._mass_block = mass_block
        return block, projection, triangle

    def _keep(self, block: FloatArray) -> None:
        """Put a block behind the basis; the store doubles when it is full."""
        end = self._filled + block.shape[1]
        if end > self._store.shape[1]:
            # Doubled: growing by a block each time would copy the basis as often as it has blocks.
            larger = np.empty((len(self._store), max(end, 2 * self._store.shape[1])), order="F")
            larger[:, :self._filled] = self._vectors
            self._store = larger
        self._store[:, self._filled:end] = block
        self._filled = end

    def _step(self) -> None:
        """Add the waiting block to the basis, and apply the operator to it: the projected operator grows by its columns."""
        self._keep(self._next)
        image = self._apply(self._mass_block)
        old_size = len(self._projected)
        self._next, projection, self._coupling = self._orthonormal(image)
        projected: FloatArray = np.zeros((self._filled, self._filled))
        projected[:old_size, :old_size] = self._projected
        projected[:, old_size:], projected[old_size:, :] = projection, projection.T
        # Both halves differ by rounding, and a symmetric solver reads one of them alone.
        self._projected = (projected + projected.T) / 2

    def grow_to(self, number: int) -> None:
        """Add blocks until so many modes are converged, with one more behind them where there is one."""
        n = self._search.m.shape[0]
        while self._filled < n:
            if self._next.shape[1] == 0:
                self._add_random()
            if self._next.shape[1] == 0:
                return
            self._step()
            if self._vectors.shape[1] >= number + 1:
                values, residual = self._values()
                # One mode behind the last must be roughly known: the count is taken in the gap between the two.
                if len(values) > number and (residual[:number] < _MAX_MODE_RESIDUAL).all() and residual[number] < 1e-4:
                    return

    def restart(self, number: int) -> None:
        """Go on from a new random block beside the basis, for modes that the first one did not hold."""
        self._add_random()
        for _ in range(2):
            if self._next.shape[1]:
                self._step()
        self.grow_to(number)

    def _add_random(self) -> None:
        """Put random vectors beside the waiting block."""
        waiting = self._next
        fresh = self._orthonormal(self._start(), waiting)[0]
        # The images of the last block stay inside the basis and `next`, so residuals keep their meaning.
        self._next = np.hstack([waiting, fresh])
        self._mass_block = self._search.m @ self._next
        self._coupling = np.vstack([self._coupling, np.zeros((fresh.shape[1], self._coupling.shape[1]))])

    def _decomposed(self) -> tuple[FloatArray, FloatArray]:
        """Return eigenvalues and vectors of the projected operator, the largest first."""
        values, rotations = eigh(self._projected)
        order = np.argsort(values)[::-1]
        return values[order], rotations[:, order]

    def _values(self) -> tuple[FloatArray, FloatArray]:
        """Return Ritz values, and their relative residuals from the coupling to the next block."""
        values, rotations = self._decomposed()
        last_width = self._coupling.shape[1]
        residual = np.linalg.norm(self._coupling @ rotations[-last_width:],
                                  axis=0) if self._coupling.size else np.zeros(len(values))
        return values, residual / np.maximum(np.abs(values), 1e-300)

    def squares(self) -> FloatArray:
        """Return the converged eigenvalues w^2, ascending."""
        values, residual = self._values()
        is_converged = (values > 0) & (residual < 1e-4)
        return 1 / values[is_converged] - self._search.shift

    def polished(self, keep: int) -> _Polished:
        """Return the lowest squares and vectors, their residuals in the shifted inverse, and those of the equation itself."""
        values, ritz = self._decomposed()
        _, residual = self._values()
        search = self._search
        squares, vectors, equation = polish_pairs(search.pencil, 1 / values[:keep] - search.shift,
                                                  self._vectors @ ritz[:, :keep], rigid_square=MAX_RIGID_SQUARE * search.shift)
        return squares, vectors, residual[:keep], equation
