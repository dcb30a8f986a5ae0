r"""Bodies with all their coordinates, joined by springs and rigid links: their modes without a reduction, and counted.

Every body keeps its own sparse factors. The relative motion of a link is :math:`W^T u`; D is the compliance of the links, zero
for a rigid one. With :math:`A = K - \mu M`, body by body, the whole is solved by

.. math:: A^{-1} - A^{-1} W (D + W^T A^{-1} W)^{-1} W^T A^{-1}

(Woodbury; for D = 0 the multipliers of Lagrange), so no joint fills a sparse matrix. The eigenvalues of the whole below
:math:`\mu` number :math:`n_-(A) - n_-(D + W^T A^{-1} W)` (Haynsworth, Linear Algebra Appl. 1 (1968): inertias of a partitioned
matrix add).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import block_diag, csc_array, vstack
from scipy.sparse.linalg import LinearOperator, eigsh

from toolpoint._check import FloatArray, count, fail, positive
from toolpoint.vibration.sparse import EigenPairs, Factorisation, factorise
from toolpoint.vibration.sparse.eigenpairs import settle_rigid

MIN_LINK_RATIO = 1e-11  # of the largest eigenvalue of the scaled flexibility: below, a rigid link repeats others
_MAX_RELATIVE_RESIDUAL = 1e-7  # of a mode in the shifted inverse
_MIN_GAP_RATIO = 1e-4  # relative gap of two squares in which the count is taken


@dataclass(frozen=True, eq=False)
class FreeBody:
    """Body of a linked whole.

    stiffness, mass : (n, n) sparse; links : (n, m), its part of W, columns in the order of all links of the whole;
    coordinates : (n, 3), where each row is, m; helps the ordering.
    """

    stiffness: csc_array
    mass: csc_array
    links: csc_array
    coordinates: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class LinkedBodies:
    """Bodies and their links.

    Parameters
    ----------
    bodies : mapping of name to FreeBody
    compliance : (m,) floats
        Of every link, m/N and so on; 0 for a rigid one.

    Examples
    --------
    Two unit masses on a spring of 1 N/m between them, the first one held: 1 rad/s.

    >>> unit, none = csc_array([[1.0]]), csc_array((1, 1))
    >>> first = FreeBody(none, unit, csc_array([[1.0, -1.0]]))
    >>> second = FreeBody(none, unit, csc_array([[0.0, 1.0]]))
    >>> pair = LinkedBodies({"first": first, "second": second}, np.array([0.0, 1.0]))
    >>> pair.count_below(0.9), pair.count_below(1.1)
    (0, 1)
    """

    bodies: dict[str, FreeBody]
    compliance: FloatArray

    @property
    def size(self) -> int:
        """Number of coordinates of all bodies."""
        return sum(body.mass.shape[0] for body in self.bodies.values())

    @cached_property
    def links(self) -> csc_array:
        """W of the whole, (size, m)."""
        return csc_array(vstack([body.links for body in self.bodies.values()]))

    @cached_property
    def mass(self) -> csc_array:
        """Mass of the whole, (size, size)."""
        return csc_array(block_diag([body.mass for body in self.bodies.values()], format="csc"))

    def count_below(self, square: float) -> int:
        """Return the number of eigenvalues below `square`, rad^2/s^2."""
        independent = self.without_repeated_links(max(abs(square), 1.0))
        inverse = _Inverse(independent, square)
        return inverse.negative_pivots - int((np.linalg.eigvalsh(inverse.flexibility) < 0).sum())

    def modes(self, number: int, *, shift: float) -> EigenPairs:
        """Return the `number` lowest modes; a count confirms that none is missing.

        shift : rad^2/s^2, of the size of the lowest squares; the search begins at its negative.

        Raises ToolpointError where so many modes are not there, or the count disagrees.
        """
        linked = self.without_repeated_links(positive("shift", shift))
        available = linked.size - int((linked.compliance == 0).sum())
        if count("number", number) + 1 >= available:
            fail("number", f"{number}", f"must be below {available - 1}", remedy="the bodies have no more coordinates")
        inverse = _Inverse(linked, -shift)
        operator = LinearOperator((linked.size,) * 2, matvec=inverse.solve, dtype=float)
        # A random start has a part in every mode; its seed makes two runs alike. One step of the inverse takes out what the
        # links do not allow.
        start = inverse.solve(linked.mass @ np.random.default_rng(linked.size).standard_normal(linked.size))
        # One mode more: the count is taken in the gap beyond the last one.
        values, vectors = eigsh(linked.mass, number + 1, linked.mass, sigma=-shift, OPinv=operator, which="LM", v0=start)
        order = np.argsort(values)
        squares, vectors = settle_rigid(values[order], shift), vectors[:, order]
        residual = inverse.residual(values[order], vectors)
        if residual.max() > _MAX_RELATIVE_RESIDUAL:
            fail("modes", f"a residual of {residual.max():.2g}", f"must be below {_MAX_RELATIVE_RESIDUAL:g}",
                 remedy="give another shift, nearer to the lowest squares")
        counted = self._counted(squares)
        return EigenPairs(squares[:number], vectors[:, :number], residual[:number], counted, inverse.solver,
                          f"no mode is missing below {counted:.5g} Hz (counted)")

    def _counted(self, squares: FloatArray) -> float:
        """Return the frequency below which a count confirms the squares, Hz: in the last gap between two of them."""
        # A count within a cluster of equal squares depends on rounding: it is taken where two neighbours lie apart.
        gaps = np.flatnonzero(np.diff(squares) > _MIN_GAP_RATIO * squares[1:])
        if not len(gaps):
            fail("modes", "no gap among the squares", "must have one for the count", remedy="ask for more modes")
        last = int(gaps[-1])
        middle = (squares[last] + squares[last + 1]) / 2
        true_count = self.count_below(middle)
        if true_count != last + 1:
            fail("modes", f"{last + 1} below {np.sqrt(middle) / (2 * np.pi):.5g} Hz, and {true_count} by the count",
                 "must agree", remedy="ask for another number of modes")
        return float(np.sqrt(middle) / (2 * np.pi))

    def without_repeated_links(self, shift: float) -> LinkedBodies:
        """Return the same bodies with rigid links that do not repeat each other: combinations of those given."""
        rigid = np.flatnonzero(self.compliance == 0)
        if not len(rigid):
            return self
        flexibility = _Inverse(self, -shift).flexibility[np.ix_(rigid, rigid)]
        # Links in metres and in radians compare once each has unit flexibility.
        scale = 1 / np.sqrt(np.maximum(np.diag(flexibility), 1e-300))
        values, vectors = eigh(flexibility * scale[:, None] * scale)
        kept = vectors[:, values > MIN_LINK_RATIO * values[-1]]
        if kept.shape[1] == len(rigid):
            return self
        elastic = np.flatnonzero(self.compliance > 0)
        mixing = np.zeros((len(self.compliance), len(elastic) + kept.shape[1]))
        mixing[elastic, np.arange(len(elastic))] = 1.0
        mixing[np.ix_(rigid, np.arange(len(elastic), mixing.shape[1]))] = scale[:, None] * kept
        bodies = {name: replace(body, links=csc_array(body.links @ mixing)) for name, body in self.bodies.items()}
        return LinkedBodies(bodies, np.concatenate([self.compliance[elastic], np.zeros(kept.shape[1])]))


class _Inverse:
    """Inverse of the whole with the stiffness K - square M, from the factors of each body."""

    def __init__(self, linked: LinkedBodies, square: float) -> None:
        self._linked, self._square = linked, square
        self._factors: list[Factorisation] = []
        for name, body in linked.bodies.items():
            matrix = csc_array(body.stiffness - square * body.mass)
            if not abs(matrix).sum(axis=0).all():
                fail(name, "a coordinate without mass", "must have some",
                     remedy="give the body its inertia about all three axes")
            self._factors.append(factorise(matrix, coordinates=body.coordinates, is_positive=square < 0))
        self._answers = self._apart(linked.links.toarray())
        self.flexibility = np.diag(linked.compliance) + linked.links.T @ self._answers
        # Symmetric but for rounding, which the eigenvalues of `without_repeated_links` would read from one triangle.
        self.flexibility = (self.flexibility + self.flexibility.T) / 2
        self.negative_pivots = sum(factors.negative_pivots for factors in self._factors)
        self.solver = ", ".join(dict.fromkeys(factors.name for factors in self._factors))

    def _apart(self, right: FloatArray) -> FloatArray:
        """Return the answers of the bodies without links."""
        edges = np.cumsum([0, *(factors.size for factors in self._factors)])
        return np.concatenate([factors.solve(right[first:last]) for factors, first, last
                               in zip(self._factors, edges[:-1], edges[1:], strict=True)])

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the answer of the whole to loads (size,) or (size, k)."""
        unlinked = self._apart(np.asarray(right))
        forces = np.linalg.solve(self.flexibility, self._linked.links.T @ unlinked)
        return np.asarray(unlinked - self._answers @ forces)

    def residual(self, squares: FloatArray, vectors: FloatArray) -> FloatArray:
        """Return the relative residual of every mode in this inverse, (modes,)."""
        mass = self._linked.mass
        # Of the inverse and not of K: a residual force in a stiff direction looks large and moves nothing.
        left = self.solve(mass @ vectors) * (squares - self._square) - vectors
        return np.sqrt(np.maximum(np.einsum("im,im->m", left, mass @ left), 0.0))
