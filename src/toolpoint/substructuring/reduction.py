r"""Reduction of a large body to a few coordinates that keep its dynamics at its interfaces.

A reduced body is a set of shapes V, orthonormal in the mass and orthogonal in the stiffness: :math:`V^T M V = I`,
:math:`V^T K V = diag(s)`; a free body keeps its six rigid motions beside them. What the error of a coupled solution needs is
kept with it, all small: :math:`K V = M X a + W t` over stored columns X, and the products of [M X, W] in
:math:`S = (K + s_0 M)^{-1}`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray, count, fail
from toolpoint._notebook import NotebookText
from toolpoint.substructuring.large_body import LargeBody, Preparation, prepare

DEPENDENT_ENERGY_RATIO = 1e-12  # energy of a response over that of the largest, below which it depends on the others
MIN_MASS_RATIO = 1e-15  # of the largest mass per stiffness: smaller ones are rounding
SNAPSHOT_COUNT = 5  # frequencies from 0 to the band at which the loads' responses are compared
MAX_RESONANCE_RATIO = 0.8  # lambda/lambda_r to which a response to loads is followed towards a resonance r


@dataclass(frozen=True, eq=False)
class RawShapes:
    """Shapes that a method keeps uncompressed (n, m), and the order of the responses to loads that complete them.

    inertial : (6 + m, m) and loads : (l, m) with K kept = M [R, kept] inertial + W loads; reach : frequency below which all
    free modes are among them, Hz (0: not known); order : 1, responses S W; 2, also what their inertia does, S M S W.
    """

    kept: FloatArray
    inertial: FloatArray
    loads: FloatArray
    reach: float
    order: int = 1


class ReductionMethod(Protocol):
    """Method of reduction: the shapes that span the reduced body."""

    @property
    def name(self) -> str:
        """The method's name."""
        ...

    @property
    def band(self) -> float:
        """Frequency up to which the coupled machine is asked for, Hz."""
        ...

    def shapes(self, prepared: Preparation) -> RawShapes:
        """Return the shapes before they are orthogonalised."""
        ...


@dataclass(frozen=True, eq=False)
class ResidualProducts:
    """K V = M X a + W t over columns X = [R, ...], and the products of [M X, W] in S.

    inertial : a (x, r); loads : t (l, r); shapes : (x, r), V in X; gram : (x + l + q, x + l + q), q the loads beside W of the
    body; shift : s0, rad^2/s^2.
    """

    inertial: FloatArray
    loads: FloatArray
    shapes: FloatArray
    gram: FloatArray
    shift: float


@dataclass(frozen=True, eq=False)
class Reduction(NotebookText):
    """Reduced body: shapes, their motions at the loads' places, and the products of its error estimate.

    Parameters
    ----------
    squares : (r,) floats
        s, rad^2/s^2, ascending.
    vectors : (n, r) floats
        V.
    participation : (l, r) floats
        W^T V: motion of the loads' places per coordinate.
    rigid_participation : (l, 6) or (l, 0) floats
        W^T R, R the rigid motions orthonormal in the mass.
    reach : float
        Frequency below which all free modes of the body are among the shapes, Hz; 0: not known.
    method, solver : str
    residual : ResidualProducts

    >>> from scipy.sparse import csc_array
    >>> from toolpoint.substructuring import ActingLoads, LargeBody
    >>> pair = LargeBody(csc_array([[1e6, -1e6], [-1e6, 1e6]]), csc_array(np.eye(2)), np.eye(2)[:, :1], rigid=np.ones((2, 1)))
    >>> reduction = reduce(pair, ActingLoads(20.0))
    >>> reduction.size, bool(np.isclose(reduction.frequency[0], np.sqrt(2e6) / (2 * np.pi)))  # one elastic shape
    (1, True)
    """

    squares: FloatArray
    vectors: FloatArray
    participation: FloatArray
    rigid_participation: FloatArray
    reach: float
    method: str
    solver: str
    residual: ResidualProducts

    @property
    def size(self) -> int:
        """Number of elastic coordinates."""
        return len(self.squares)

    @property
    def frequency(self) -> FloatArray:
        """Square roots of `squares`, Hz: free modes, and above them the frequencies of the responses to loads."""
        return np.sqrt(np.maximum(self.squares, 0)) / (2 * np.pi)

    def combined(self, mix: FloatArray) -> Reduction:
        """Return the reduction to combinations (r, k) of its coordinates, orthogonalised again."""
        squares, turn = eigh(_symmetrize(mix.T @ (self.squares[:, None] * mix)), _symmetrize(mix.T @ mix))
        vectors, products = mix @ turn, self.residual
        residual = replace(products, inertial=products.inertial @ vectors, loads=products.loads @ vectors,
                           shapes=products.shapes @ vectors)
        return replace(self, squares=squares, vectors=self.vectors @ vectors, participation=self.participation @ vectors,
                       residual=residual)

    def __repr__(self) -> str:
        reach = f", all free modes to {self.reach:.5g} Hz" if self.reach else ""
        return (f"Reduction({len(self.vectors)} -> {self.size} coordinates and {self.rigid_participation.shape[1]} rigid, "
                f"{self.method}{reach}, {self.solver})")


@dataclass(frozen=True, eq=False)
class ShapeSpan:
    """All shapes of a method on a body with their small matrices: reductions of any size follow without a large solution.

    columns : X = [R, kept, responses] (n, x); mass, stiffness : X^T M X, X^T K X; K X = M X inertial + W loads.
    """

    prepared: Preparation
    method: ReductionMethod
    columns: FloatArray
    mass: FloatArray
    stiffness: FloatArray
    inertial: FloatArray
    loads: FloatArray
    gram: FloatArray
    kept: int
    reach: float

    @property
    def largest(self) -> int:
        """Number of independent elastic shapes."""
        return self.kept + self._compressed.shape[1]

    def reduced(self, size: int | None = None) -> Reduction:
        """Return the reduction to `size` coordinates (all independent shapes where left out): the kept shapes, then the
        combinations of responses with most energy under the weighted loads. Raises ToolpointError for another size."""
        size_max = self.largest
        number = size_max if size is None else count("size", size, 0)
        if not self.kept <= number <= size_max:
            fail("size", f"{number}", f"must be {self.kept} .. {size_max}",
                 remedy="the kept shapes, and responses to the loads")
        basis, k, m = (matrix[:, :number] for matrix in self._basis)
        squares, mix = _stiff_modes(k[:number], m[:number])
        shapes = basis @ mix
        vectors, body = self.columns @ shapes, self.prepared.body
        residual = ResidualProducts(self.inertial @ shapes, self.loads @ shapes, shapes, self.gram, self.prepared.shift)
        return Reduction(squares, vectors, body.loads.T @ vectors, body.loads.T @ self.prepared.rigid, self.reach,
                         self.method.name, self.prepared.solver, residual)

    @cached_property
    def _basis(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the kept shapes and the compressed responses over the columns, and their stiffness and mass.

        These are summed from the shapes themselves: differences of responses that are nearly alike have lost digits.
        """
        r, body = self.prepared.rigid.shape[1], self.prepared.body
        basis = np.zeros((self.columns.shape[1], self.largest))
        basis[r:r + self.kept, :self.kept] = np.eye(self.kept)
        basis[:, self.kept:] = self._compressed
        shapes = self.columns @ basis
        return basis, _symmetrize(shapes.T @ (body.stiffness @ shapes)), _symmetrize(shapes.T @ (body.mass @ shapes))

    @cached_property
    def _compressed(self) -> FloatArray:
        """Return combinations of responses, free of the kept shapes, most energy first, unit stiffness; over the columns.

        The energy is that of responses to the weighted loads at frequencies from 0 to the band, within the span.
        """
        r, first = self.prepared.rigid.shape[1], self.prepared.rigid.shape[1] + self.kept
        kept, added = slice(r, first), slice(first, None)
        parts = np.zeros((self.columns.shape[1], self.columns.shape[1] - first))
        parts[added] = np.eye(parts.shape[1])
        if self.kept:
            parts[kept] = -np.linalg.solve(self.mass[kept, kept], self.mass[kept, added])
        parts = _select_independent(parts, self.stiffness, np.diag(self.stiffness)[added])
        values, shapes = np.linalg.eigh(_symmetrize(parts.T @ self.mass @ parts))  # of M where K is one
        # Modal responses of the span at frequencies from 0 to the band, 1/(1 - lambda/lambda_r): their SVD orders them.
        driven = shapes.T @ parts.T @ self._driving()
        square_max = (2 * np.pi * self.method.band) ** 2
        factors = [1 / (1 - np.minimum(square * values, MAX_RESONANCE_RATIO))
                   for square in np.linspace(0, square_max, SNAPSHOT_COUNT)]
        answers = np.hstack([driven * factor[:, None] for factor in factors])
        left, size, _ = np.linalg.svd(answers, full_matrices=False)
        return parts @ shapes @ left[:, size > np.sqrt(DEPENDENT_ENERGY_RATIO) * size.max(initial=0.0)]

    def _driving(self) -> FloatArray:
        """Return X^T W, each load times its weight; where weights are left out, times that of equal static energies."""
        driving = self.columns.T @ self.prepared.body.loads
        return driving * self.prepared.load_weights


def _stiff_modes(stiffness: FloatArray, mass: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return squares, ascending, and shapes of unit mass, of matrices whose stiffness is the better conditioned one.

    Responses that differ little carry hardly any mass, so little that rounding may make it negative; what they add to the
    flexibility is kept, at a frequency beyond all others.
    """
    scale = 1 / np.sqrt(np.diag(stiffness))
    inverse, mix = eigh(mass * scale[:, None] * scale, stiffness * scale[:, None] * scale)
    inverse = np.maximum(inverse, MIN_MASS_RATIO * inverse.max(initial=0.0))[::-1]
    return 1 / inverse, scale[:, None] * mix[:, ::-1] / np.sqrt(inverse)


def _select_independent(parts: FloatArray, stiffness: FloatArray, energies: FloatArray) -> FloatArray:
    """Return combinations of shapes with unit stiffness matrix; those whose energy is rounding of `energies` are dropped."""
    energy = parts.T @ stiffness @ parts
    # Scaled by the energy before the kept shapes were taken off: what is left below rounding of that has no digits.
    size = 1 / np.sqrt(np.maximum(energies, 1e-300))
    values, vectors = np.linalg.eigh(_symmetrize(energy * size[:, None] * size))
    keep = values > DEPENDENT_ENERGY_RATIO
    return parts @ (size[:, None] * vectors[:, keep] / np.sqrt(values[keep]))


def reduce(body: LargeBody, method: ReductionMethod, size: int | None = None, *, shift: float | None = None) -> Reduction:
    """Reduce a body to `size` coordinates, or to all shapes of the method; see `span` for the shift.

    Examples
    --------
    A free chain of 30 unit masses on springs of 1e6 N/m, loaded at its first mass, in the band to 20 Hz:

    >>> import numpy as np
    >>> from scipy.sparse import csc_array, diags_array
    >>> from toolpoint.substructuring import ActingLoads, LargeBody
    >>> n = 30
    >>> stiffness = 1e6 * diags_array([-np.ones(n - 1), [1.0, *2.0 * np.ones(n - 2), 1.0], -np.ones(n - 1)], offsets=[-1, 0, 1])
    >>> body = LargeBody(csc_array(stiffness), csc_array(np.eye(n)), np.eye(n)[:, :1], rigid=np.ones((n, 1)))
    >>> reduction = reduce(body, ActingLoads(20.0))
    >>> bool(abs(reduction.frequency[0] - 1e3 / np.pi * np.sin(np.pi / (2 * n))) < 1e-6)
    True
    """
    return span(body, method, shift=shift).reduced(size)


def span(body: LargeBody, method: ReductionMethod, *, shift: float | None = None) -> ShapeSpan:
    """Compute all shapes of a method on a body: one factorisation, the modes, two solutions for every load.

    shift : s0, rad^2/s^2; where left out 0 for a held body, (2 pi band/10)^2 for a free one.
    """
    if shift is None:
        # A tenth of the band: K of a free body gets an inverse, and modes in the band hardly notice.
        shift = 0.0 if body.rigid is None else (2 * np.pi * 0.1 * method.band) ** 2
    prepared = prepare(body, shift)
    raw = method.shapes(prepared)
    r, m, l = prepared.rigid.shape[1], raw.kept.shape[1], body.loads.shape[1]
    mix = _leading_loads(prepared)
    k = mix.shape[1]
    responses: list[FloatArray] = [prepared.responses @ mix]
    for _ in range(raw.order - 1):
        responses.append(prepared.inverse.solve(body.mass @ responses[-1]))
    # S M R = R / s0 and S M q = q' are known; the kept shapes and the last responses are solved for, then no more is.
    solved = [prepared.inverse.solve(body.mass @ part) for part in (raw.kept, responses[-1])]
    static, estimate_products = prepared.answers, prepared.estimate_products
    prepared.let_go()
    columns = np.hstack([prepared.rigid, raw.kept, *responses])
    inertial, loads = np.zeros((columns.shape[1],) * 2), np.zeros((l, columns.shape[1]))
    inertial[:r + m, r:r + m], loads[:, r:r + m] = raw.inertial, raw.loads
    first, remaining = np.arange(r + m, r + m + k), np.arange(r + m, columns.shape[1])
    # (K + s0 M) q = (W - M R R^T W) mix, and of the next order (K + s0 M) q' = M q.
    inertial[:r, first], inertial[remaining, remaining] = -prepared.rigid.T @ body.loads @ mix, -shift
    inertial[remaining[:-k], remaining[k:]] = 1.0
    loads[:, first] = mix
    weighty = body.mass @ columns
    answers = np.hstack([prepared.rigid / shift if r else prepared.rigid, solved[0], *responses[1:], solved[1], static])
    gram = _symmetrize(np.hstack([weighty, body.loads]).T @ answers)
    if body.estimate_loads is not None:
        cross = body.estimate_loads.T @ answers
        gram = np.block([[gram, cross.T], [cross, _symmetrize(estimate_products)]])
    return ShapeSpan(prepared, method, columns, _symmetrize(columns.T @ weighty),
                     _symmetrize(columns.T @ (body.stiffness @ columns)),
                     inertial, loads, gram, m, raw.reach)


def _leading_loads(prepared: Preparation) -> FloatArray:
    """Return combinations of loads whose responses do not depend on each other, (l, k)."""
    weights = prepared.load_weights
    energy = _symmetrize(prepared.body.loads.T @ prepared.responses) * weights[:, None] * weights
    values, vectors = np.linalg.eigh(energy)
    keep = np.flatnonzero(values > DEPENDENT_ENERGY_RATIO * max(float(values.max(initial=0.0)), 1e-300))[::-1]
    return weights[:, None] * vectors[:, keep] / np.sqrt(values[keep])


def _symmetrize(matrix: FloatArray) -> FloatArray:
    return (matrix + matrix.T) / 2
