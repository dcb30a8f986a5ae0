r"""Lowest modes of large sparse K and M by block Lanczos on the shifted inverse, counted so that none is missing.

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
from toolpoint.vibration.sparse.eigenpairs import RIGID_SHARE, EigenPairs, settle_rigid
from toolpoint.vibration.sparse.factorisation import Factorisation, SparseMatrix, check_symmetric, factorise
from toolpoint.vibration.sparse.node_matrix import as_columns
from toolpoint.vibration.sparse.pencil import Pencil
from toolpoint.vibration.sparse.polish import polish_pairs

# Of the median of diag(K)/diag(M), about the highest frequency squared: far below the first elastic mode of a mesh with a
# million nodes, far above rounding.
_SHIFT = 1e-8
_TOLERANCE = 1e-8
_COARSER = 100.0  # times the shift, for matrices whose rounding exceeds it
_DENSE_SHARE, _DENSE_ROWS = 2, 6000  # modes over all from which, and rows to which, they are solved for at once
_MASSLESS = 1e-14  # of the largest 1/(square + shift): no mode
_GAP = 1e-6

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
        pencil = Pencil(k, m, _COARSER * s, coordinates=coordinates, solver=solver)
    if inverse is not None:
        pencil.inverse, pencil.solver_name = inverse, inverse.name
    return modes_of(pencil, number, below=below, is_counted=is_counted, is_kept=inverse is not None)


def modes_of(pencil: Pencil, number: int | None = None, *, below: float | None = None, is_counted: bool = True,
             is_kept: bool = True, most: int | None = None) -> EigenPairs:
    """Return the lowest modes as `modes` does, with the factors of a pencil; they are let go after use unless `is_kept`.

    most : of a band; more are refused as soon as they are counted.
    """
    search = _Search(pencil, is_kept)
    if below is not None:
        return search.band((2 * np.pi * positive("below", below)) ** 2, most)
    most = min(count("number", number or 0), search.rank())
    if _DENSE_SHARE * most > search.rank() and pencil.mass.shape[0] <= _DENSE_ROWS:
        return _dense_modes(search, most)
    return search.lowest(most, is_counted)


def _dense_modes(search: _Search, number: int) -> EigenPairs:
    """Return the lowest modes where most of all are asked for: there is no room left for a basis that grows beyond them.

    With the shifted stiffness positive, M x = t (K + s M) x has t = 1/(square + s), 0 of rows without mass.
    """
    search.inverse()  # refuses a stiffness with negative eigenvalues
    m = as_columns(search.m).toarray()
    shifted = as_columns(search.pencil.stiffness).toarray() + search.shift * m
    inverse, vectors = eigh(m, shifted)
    held = np.flatnonzero(inverse > _MASSLESS * inverse[-1])[::-1]
    squares = 1 / inverse[held] - search.shift
    keep = _cut(squares, min(number, len(squares)), len(squares))[0]
    squares, held = squares[:keep], held[:keep]
    squares = settle_rigid(squares, search.shift)
    return EigenPairs(squares, vectors[:, held] / np.sqrt(inverse[held]), np.zeros(len(held)),
                      float(np.sqrt(squares.max(initial=0.0))) / (2 * np.pi), search.pencil.solver_name,
                      "all modes found, by a dense solution")


def count_below(
    stiffness: SparseMatrix, mass: SparseMatrix, frequency: float, *, coordinates: FloatArray | None = None
) -> int:
    """Return how many modes lie below a frequency (Hz): the negative pivots of K - (2 pi f)^2 M."""
    square = (2 * np.pi * positive("frequency", frequency)) ** 2
    return factorise(csc_array(stiffness - square * mass), coordinates=coordinates, is_positive=False).negative_pivots


def default_shift(stiffness: csc_array, mass: csc_array) -> float:
    """Return a small positive shift, rad^2/s^2: far below the elastic modes, far above rounding."""
    inertia, spring = mass.diagonal(), stiffness.diagonal()
    heavy = (inertia > 0) & (spring > 0)
    if not heavy.any():
        fail("mass", "no positive entry on the diagonal", "must hold mass")
    return _SHIFT * float(np.median(spring[heavy] / inertia[heavy]))


@dataclass
class _Search:
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
        basis = _Basis(self, number)
        basis.grow_to(number)
        if not is_counted:
            return self._pairs(basis.polished(number), 0.0,
                               "modes not counted: ask for a count to be sure that none is missing")
        missing, mu = 0, np.inf
        for _ in range(4):
            squares = basis.squares()
            squares = np.where(np.abs(squares) <= RIGID_SHARE * self.shift, 0.0, squares)
            if len(squares) < number:
                basis.restart(number)
                continue
            keep, mu = _cut(squares, number, self.rank())
            polished = basis.polished(keep)  # before the count, which lets the factors go
            missing = self._count(mu) - keep if np.isfinite(mu) else 0
            if missing == 0:
                return self._pairs(polished, np.sqrt(max(mu, 0.0)) / (2 * np.pi), "all modes found, by count")
            basis.restart(number + max(missing, 0))
        number = min(number, len(basis.squares()))
        return self._pairs(basis.polished(number), 0.0, f"{missing} modes below {np.sqrt(mu) / 2 / np.pi:.6g} Hz were counted "
                                                        "and not found: give another shift")

    def band(self, top: float, most: int | None = None) -> EigenPairs:
        number = self._count(top)
        if most is not None and number > most:
            fail("band", f"{number} of {self.rank()} modes lie below {np.sqrt(top) / (2 * np.pi):.4g} Hz",
                 f"must be at most {most}", remedy="the mesh carries no more: write a lower band or a finer "
                 "mesh; are the units of band and modulus right?")
        basis = _Basis(self, max(number, 1))
        for _ in range(4):
            basis.grow_to(max(number, 1))
            if int((basis.squares() < top).sum()) == number:
                return self._pairs(basis.polished(number), np.sqrt(top) / (2 * np.pi), "all modes of the band found, by count")
            basis.restart(number + 2)
        return self._pairs(basis.polished(int((basis.squares() < top).sum())), 0.0,
                           f"{number} modes of the band were counted, not all found: give another shift")

    def _count(self, mu: float) -> int:
        if not self.is_kept:
            self.pencil.let_go()  # a count needs the room of factors, and is mostly the last thing that is done
        return self.pencil.count_below(mu)

    def _pairs(self, polished: _Polished, counted: float, status: str) -> EigenPairs:
        squares, vectors, residual, equation_residual = polished
        squares = settle_rigid(squares, self.shift)
        return EigenPairs(squares, vectors, residual, float(counted), self.pencil.solver_name, status, equation_residual)


def _cut(squares: FloatArray, number: int, most: int) -> tuple[int, float]:
    """Return how many modes to keep and a square in the gap behind them."""
    keep = number
    while keep < len(squares) and squares[keep] <= squares[keep - 1] + _GAP * max(abs(squares[keep]), 1e-300):
        keep += 1
    if keep >= most:
        return keep, np.inf
    low = max(squares[keep - 1], 0.0)
    high = squares[keep] if keep < len(squares) else 1.05 * low
    return keep, low + 0.5 * (high - low) if high < 1.5 * low else 1.2 * low + 0.01 * (high - low)


class _Basis:
    """Vectors orthonormal in M, and the operator seen in them."""

    def __init__(self, search: _Search, number: int) -> None:
        self._search = search
        n = search.m.shape[0]
        self._random = np.random.default_rng(n)
        self._width = min(n, 6)
        self._store: FloatArray = np.empty((n, min(n, max(6 * number, 60)) + self._width), order="F")
        self._filled = 0
        self._heavy: FloatArray = np.zeros((n, 0))
        self._projected: FloatArray = np.zeros((0, 0))
        self._coupling: FloatArray = np.zeros((0, 0))
        self._width = min(n, max(3, self._rigid_count()))
        self._next = self._orthonormal(self._start())[0]

    def _apply(self, heavy: FloatArray) -> FloatArray:
        """Return the operator's image of a block whose product with M is given."""
        return self._search.inverse().solve(heavy)

    def _start(self) -> FloatArray:
        """Return the image of random vectors that hold nothing of the basis: rigid-body modes would drown all else."""
        block = self._random.standard_normal((self._search.m.shape[0], self._width))
        for _ in range(2):
            block = block - self._vectors @ (self._vectors.T @ (self._search.m @ block))
        return self._apply(self._search.m @ block)

    def _rigid_count(self) -> int:
        """Return how many of six vectors one application turns into rigid-body modes: a block must hold them all."""
        block = self._orthonormal(self._start())[0]
        values = np.linalg.eigvalsh(self._heavy.T @ self._apply(self._heavy)) if block.shape[1] else np.zeros(0)
        return int((values * self._search.shift > 0.5).sum())

    @property
    def _vectors(self) -> FloatArray:
        return self._store[:, :self._filled]

    def _orthonormal(self, block: FloatArray, beside: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the block orthonormal in M and to the basis (its product with M kept in `_heavy`), what was taken off along
        the basis, and its triangle."""
        along: FloatArray = np.zeros((self._filled, block.shape[1]))
        # What is left of a block that the basis holds already is rounding, and must not be blown up.
        heavy = self._search.m @ block
        rounding = (1e-13**2) * float(np.einsum("ij,ij->j", block, heavy).max(initial=0.0))
        for turn in range(2):
            if beside is not None:
                block = block - beside @ (beside.T @ (self._search.m @ block))
            if beside is not None or turn:
                heavy = self._search.m @ block
            part = self._vectors.T @ heavy
            block = block - self._vectors @ part
            along += part
        triangle: FloatArray = np.eye(block.shape[1])
        heavy = self._search.m @ block
        for _ in range(2):
            gram = block.T @ heavy
            values, turns = np.linalg.eigh((gram + gram.T) / 2)
            keep = values > max(rounding, 1e-22 * values.max(initial=0.0), 1e-300)
            roots = np.sqrt(values[keep])
            block, heavy = block @ (turns[:, keep] / roots), heavy @ (turns[:, keep] / roots)
            triangle = (roots[:, None] * turns[:, keep].T) @ triangle
            rounding = 0.0
        self._heavy = heavy
        return block, along, triangle

    def _keep(self, block: FloatArray) -> None:
        """Put a block behind the basis; the store doubles when it is full."""
        end = self._filled + block.shape[1]
        if end > self._store.shape[1]:
            larger = np.empty((len(self._store), max(end, 2 * self._store.shape[1])), order="F")
            larger[:, :self._filled] = self._vectors
            self._store = larger
        self._store[:, self._filled:end] = block
        self._filled = end

    def _step(self) -> None:
        self._keep(self._next)
        image = self._apply(self._heavy)
        old = len(self._projected)
        self._next, along, self._coupling = self._orthonormal(image)
        projected: FloatArray = np.zeros((self._filled, self._filled))
        projected[:old, :old] = self._projected
        projected[:, old:], projected[old:, :] = along, along.T
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
                if len(values) > number and (residual[:number] < _TOLERANCE).all() and residual[number] < 1e-4:
                    return

    def restart(self, number: int) -> None:
        """Go on from a new random block beside the basis, for modes that the first one did not hold."""
        self._add_random()
        for _ in range(2):
            if self._next.shape[1]:
                self._step()
        self.grow_to(number)

    def _add_random(self) -> None:
        old = self._next
        fresh = self._orthonormal(self._start(), old)[0]
        # The images of the last block stay inside the basis and `next`, so residuals keep their meaning.
        self._next = np.hstack([old, fresh])
        self._heavy = self._search.m @ self._next
        self._coupling = np.vstack([self._coupling, np.zeros((fresh.shape[1], self._coupling.shape[1]))])

    def _decomposed(self) -> tuple[FloatArray, FloatArray]:
        values, turns = eigh(self._projected)
        order = np.argsort(values)[::-1]
        return values[order], turns[:, order]

    def _values(self) -> tuple[FloatArray, FloatArray]:
        values, turns = self._decomposed()
        last = self._coupling.shape[1]
        tail = np.linalg.norm(self._coupling @ turns[-last:], axis=0) if self._coupling.size else np.zeros(len(values))
        return values, tail / np.maximum(np.abs(values), 1e-300)

    def squares(self) -> FloatArray:
        """Return the converged eigenvalues w^2, ascending."""
        values, residual = self._values()
        good = (values > 0) & (residual < 1e-4)
        return 1 / values[good] - self._search.shift

    def polished(self, keep: int) -> _Polished:
        """Return the lowest squares and vectors, their residuals in the shifted inverse, and those of the equation itself."""
        values, turns = self._decomposed()
        _, residual = self._values()
        search = self._search
        squares, vectors, equation = polish_pairs(search.pencil, 1 / values[:keep] - search.shift,
                                                  self._vectors @ turns[:, :keep], rigid_square=RIGID_SHARE * search.shift)
        return squares, vectors, residual[:keep], equation
