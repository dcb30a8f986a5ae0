"""Pencil: stiffness and mass with one order of elimination for all K + s M."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array

from toolpoint._check import FloatArray
from toolpoint.vibration.sparse.factorisation import Factorisation, check_coordinates, chosen_solver, factorise
from toolpoint.vibration.sparse.node_matrix import NodeMatrix, SymmetricMatrix, as_columns

if TYPE_CHECKING:
    from toolpoint.vibration.sparse.elimination import EliminationPlan


class Pencil:
    """K and M, the factors of K + `shift` M (made when they are first asked for), and counts of pivots of others.

    Sums of K and M are not made where our own solver works: large bodies have K and M in memory once.
    """

    def __init__(self, stiffness: SymmetricMatrix, mass: SymmetricMatrix, shift: float, *,
                 coordinates: FloatArray | None = None, solver: str = "auto") -> None:
        self.stiffness, self.mass, self.shift = stiffness, mass, shift
        self.coordinates = check_coordinates(coordinates, stiffness.shape[0])
        self.solver = self.solver_name = chosen_solver(solver, stiffness.shape[0])

    @cached_property
    def _plan(self) -> EliminationPlan:
        # Compiled code is loaded only when a matrix is factorised.
        from toolpoint.vibration.sparse.elimination import EliminationPlan

        return EliminationPlan(_common_pattern(self.stiffness, self.mass), self.coordinates)

    @cached_property
    def inverse(self) -> Factorisation:
        """Factors of K + shift M."""
        factors = self._factors()
        self.solver_name = factors.name
        return factors

    def _factors(self) -> Factorisation:
        """Return the factors of K + shift M, without the sum where our own solver works."""
        if self.solver == "multifrontal":
            from toolpoint.vibration.sparse.multifrontal import Multifrontal

            solver = Multifrontal(self._plan, self.stiffness, mass=self.mass, shift=self.shift)
            return Factorisation(solver, self.stiffness.shape[0])
        return factorise(self._sum(self.shift), solver=self.solver)

    def let_go(self) -> None:
        """Discard the factors: they are made anew when they are asked for again."""
        self.__dict__.pop("inverse", None)

    def count_below(self, square: float) -> int:
        """Return the number of eigenvalues below a square (rad^2/s^2): the negative pivots of K - square M."""
        if self.solver == "multifrontal":
            from toolpoint.vibration.sparse.multifrontal import count_negative

            return count_negative(self._plan, self.stiffness, self.mass, shift=-square)
        return factorise(self._sum(-square), solver=self.solver, is_positive=False).negative_pivots

    def _sum(self, shift: float) -> csc_array:
        """Return K + shift M as compressed columns."""
        stiffness = as_columns(self.stiffness)
        return csc_array(stiffness + shift * as_columns(self.mass)) if shift else stiffness


def _common_pattern(stiffness: SymmetricMatrix, mass: SymmetricMatrix) -> SymmetricMatrix:
    """Return a matrix on the pattern of both: the stiffness itself where it holds the mass's."""
    from toolpoint.vibration.sparse import symbolic

    if isinstance(stiffness, NodeMatrix) and isinstance(mass, NodeMatrix) and stiffness.pattern is mass.pattern:
        return stiffness
    stiffness, mass = as_columns(stiffness), as_columns(mass)
    if stiffness.has_canonical_format and mass.has_canonical_format and symbolic.holds(
            stiffness.indptr, stiffness.indices, mass.indptr, mass.indices):
        return stiffness
    # Ones in place of values: stiffness and mass may cancel in a sum, and the pattern must hold for every shift.
    first, second = (csc_array((np.ones(a.nnz, dtype=np.int8), a.indices, a.indptr), shape=a.shape) for a in (stiffness, mass))
    return csc_array(first.astype(bool) + second.astype(bool))
