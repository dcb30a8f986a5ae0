"""LargeBody: sparse matrices of a body with the loads that act on it, prepared once for all its reductions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail, floats
from toolpoint.vibration.sparse import EigenPairs, Factorisation
from toolpoint.vibration.sparse.factorisation import check_finite, check_symmetric
from toolpoint.vibration.sparse.lanczos import modes_of
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, SymmetricMatrix
from toolpoint.vibration.sparse.pencil import Pencil

RIGID_FORCE_TOLERANCE = 1e-8  # force of a rigid motion over the largest stiffness times that motion
MIN_MODE_ALLOWANCE = 500  # modes of a band that are always allowed
MODE_ALLOWANCE_DIVISOR = 8  # of the coordinates: where modes are more than this part too, they are those of single elements
LOAD_CHUNK_SIZE = 48  # columns of answers that are held at once where only their products are kept


@dataclass(frozen=True, eq=False)
class LargeBody:
    """A body's matrices and the loads that act on it.

    Parameters
    ----------
    stiffness, mass : (n, n) sparse
    loads : (n, l)
        Columns W of consistent weights of every place that carries force, six for a patch: the place moves by W^T u, its
        wrench f acts as W f.
    rigid : (n, 6), optional
        Rigid motions of a free body; none for a body that is held in its matrices.
    weights : (l,), optional
        Size of each load where responses are compressed: the square root of the joint's stiffness. Where left out, as large
        as gives equal energies.
    repeats : (l,), optional
        How many of the loads stand for the same place, as stations of a sliding one do: together they count as one.
    coordinates : (n, 3), optional
        Where every row is, m: helps the ordering.
    estimate_loads : (n, q) sparse, optional
        Loads for which no shapes are computed, but which the products of the error estimate cover: a sliding place between its
        stations.

    Raises
    ------
    ToolpointError
        For matrices of different shape, entries that are not finite, and rigid motions that strain the body.

    Examples
    --------
    Two unit masses on a spring of 1 N/m, with a force on the first:

    >>> import numpy as np
    >>> from scipy.sparse import csc_array
    >>> stiffness, mass = csc_array([[1.0, -1.0], [-1.0, 1.0]]), csc_array(np.eye(2))
    >>> LargeBody(stiffness, mass, [[1.0], [0.0]], rigid=[[1.0], [1.0]]).size
    2
    """

    stiffness: SymmetricMatrix
    mass: SymmetricMatrix
    loads: FloatArray
    rigid: FloatArray | None = None
    weights: FloatArray | None = None
    repeats: FloatArray | None = None
    coordinates: FloatArray | None = None
    estimate_loads: csc_array | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("stiffness", "mass"):
            matrix = getattr(self, name)
            put(self, name, (check_finite if isinstance(matrix, NodeMatrix) else check_symmetric)(name, matrix))
        n = self.size
        if self.mass.shape != self.stiffness.shape:
            fail("mass", f"shape {self.mass.shape}", f"must be that of the stiffness, {self.stiffness.shape}")
        put(self, "loads", floats("loads", csc_array(self.loads).toarray()))
        if self.loads.ndim != 2 or self.loads.shape[0] != n or not self.loads.shape[1]:
            fail("loads", f"shape {self.loads.shape}", f"must be ({n}, any)",
                 remedy="columns of every place that carries force")
        if self.weights is not None:
            put(self, "weights", floats("weights", self.weights, (self.loads.shape[1],)))
        if self.repeats is not None:
            put(self, "repeats", floats("repeats", self.repeats, (self.loads.shape[1],)))
        if self.estimate_loads is not None and self.estimate_loads.shape[0] != n:
            fail("estimate_loads", f"shape {self.estimate_loads.shape}", f"must be ({n}, any)")
        if self.rigid is not None:
            put(self, "rigid", floats("rigid", self.rigid, (n, None)))
            self._check_rigid(self.rigid)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.stiffness.shape[0])

    def _check_rigid(self, rigid: FloatArray) -> None:
        force = float(np.abs(self.stiffness @ rigid).max())
        largest = self.stiffness.largest if isinstance(self.stiffness, NodeMatrix) else float(abs(self.stiffness).max())
        scale = largest * float(np.abs(rigid).max())
        if force > RIGID_FORCE_TOLERANCE * scale:
            fail("rigid", f"motions that strain the body (force {force / scale:.2g} of the largest)", "must be rigid motions",
                 remedy="a body that is held in its matrices has none")


@dataclass(frozen=True, eq=False)
class Preparation:
    """Shifted matrices of a body with one order of elimination, and its rigid motions orthonormal in the mass.

    Factors and responses are computed on first use: the modes of a band are counted before any factor exists.
    """

    body: LargeBody
    pencil: Pencil
    rigid: FloatArray

    @property
    def shift(self) -> float:
        """s0, rad^2/s^2."""
        return self.pencil.shift

    @cached_property
    def inverse(self) -> Factorisation:
        """Factors of K + s0 M."""
        inverse = self.pencil.inverse
        if inverse.negative_pivots:
            fail("stiffness", f"{inverse.negative_pivots} negative eigenvalues", "must be positive semidefinite",
                 remedy="an element of negative stiffness, or a load beyond buckling?")
        return inverse

    @property
    def solver(self) -> str:
        """Name of what made the factors."""
        return self.pencil.solver_name

    def let_go(self) -> None:
        """Release the factors once nothing large is solved any more."""
        self.__dict__.pop("inverse", None)
        self.pencil.let_go()

    @cached_property
    def responses(self) -> FloatArray:
        """Responses to all loads in balance with inertia, free of rigid motion, (n, l)."""
        loads, rigid = self.body.loads, self.rigid
        # A free body has no static answer: loads are balanced by the inertia of the rigid motion that they cause.
        inertial = self.body.mass @ rigid
        responses = self.inverse.solve(loads - inertial @ (rigid.T @ loads))
        # Solving leaves a rigid part of rounding over the small shift: it is taken off again.
        return responses - rigid @ (inertial.T @ responses)

    @property
    def answers(self) -> FloatArray:
        """S W: responses to the loads as they are, rigid motion included, (n, l)."""
        if not self.rigid.shape[1]:
            return self.responses
        return self.responses + self.rigid @ (self.rigid.T @ self.body.loads) / self.shift

    @cached_property
    def estimate_products(self) -> FloatArray:
        """B^T S B of the loads B of the error estimate, (q, q): a few columns at a time, as the answers are large."""
        estimate_loads = self.body.estimate_loads
        if estimate_loads is None:
            return np.zeros((0, 0))
        parts = [estimate_loads.T @ self.inverse.solve(estimate_loads[:, first:first + LOAD_CHUNK_SIZE].toarray())
                 for first in range(0, estimate_loads.shape[1], LOAD_CHUNK_SIZE)]
        return np.hstack([np.zeros((estimate_loads.shape[1], 0)), *parts])

    @property
    def load_weights(self) -> FloatArray:
        """Size of the loads in the compression, (l,): square root of the stiffness of joint and body in series.

        A wrench through a joint much stiffer than the body is bounded by the body, not by the joint.
        """
        flexibility = np.einsum("nl,nl->l", self.responses, self.body.loads)
        if self.body.weights is not None:
            flexibility = flexibility + 1 / np.maximum(self.body.weights, 1e-300) ** 2
        if self.body.repeats is not None:
            flexibility = flexibility * self.body.repeats
        return 1 / np.sqrt(np.maximum(flexibility, 1e-300))

    def elastic_modes(self, below: float) -> EigenPairs:
        """Return the free modes below a frequency (Hz), counted, without the rigid ones."""
        allowance = max(MIN_MODE_ALLOWANCE, self.body.size // MODE_ALLOWANCE_DIVISOR)
        pairs = modes_of(self.pencil, below=below, max_modes=allowance)
        if pairs.rigid_count != self.rigid.shape[1]:
            fail("rigid", f"{self.rigid.shape[1]} motions given, {pairs.rigid_count} modes at 0 Hz", "must be all of them",
                 remedy="a part that hangs loose, a mechanism, or a body that is held after all")
        if not pairs.is_complete:
            fail("modes", pairs.status, "must all be known", remedy="give another shift")
        # The rigid ones are kept apart, exactly: those found numerically are mixed with each other.
        keep = pairs.squares > 0
        equation = None if pairs.equation_residual is None else pairs.equation_residual[keep]
        return replace(pairs, squares=pairs.squares[keep], vectors=pairs.vectors[:, keep], residual=pairs.residual[keep],
                       equation_residual=equation)


def prepare(body: LargeBody, shift: float) -> Preparation:
    """Prepare the matrices K + shift M of a body, factorised once on first use; shift in rad^2/s^2."""
    rigid: FloatArray = np.zeros((body.size, 0))
    if body.rigid is not None:
        lower = np.linalg.cholesky(body.rigid.T @ (body.mass @ body.rigid))
        rigid = np.linalg.solve(lower, body.rigid.T).T
    return Preparation(body, Pencil(body.stiffness, body.mass, shift, coordinates=body.coordinates), rigid)
