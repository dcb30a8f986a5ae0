"""Residual function of the least-squares solver: residuals and Jacobian of the free coordinates, each point evaluated once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg.lapack import dgeqrf

from toolpoint._check import FloatArray
from toolpoint.updating.fits.error_spread import has_assumed_responses, spread_of_gradient
from toolpoint.updating.problem import Problem
from toolpoint.updating.residuals import Residuals


class Solver:
    """Residuals and Jacobian of the free coordinates (`columns`), with the rows of the prior (1/s each); the others stay at x0.

    scipy asks for the Jacobian of every accepted point. With exact sensitivities it is made along with the residual, since
    most trial points are accepted. With `compressed` (linear loss) both are handed over as the triangle of their QR
    decomposition: J^T J, J^T r and r^T r, all that a least-squares method uses, stay the same, with as many rows as
    parameters instead of data.
    """

    def __init__(self, problem: Problem, columns: list[int], x0: FloatArray, prior: FloatArray, compressed: bool) -> None:
        self.problem, self.columns, self.x0, self.prior = problem, columns, x0, prior
        self.compressed = compressed and problem.sensitivities == "exact"
        self._kept: dict[bytes, tuple[Residuals, FloatArray, FloatArray]] = {}

    def full(self, free: FloatArray) -> FloatArray:
        """Return all coordinates."""
        x = self.x0.copy()
        x[self.columns] = free
        return x

    def residuals_at(self, free: FloatArray) -> tuple[Residuals, FloatArray, FloatArray]:
        """Return the residuals, and vector and Jacobian for the solver, the prior's rows below or in the triangle."""
        # Bit for bit: the solver asks for residual and Jacobian of the same array, and a rounded key could give those of a
        # neighbour.
        key = free.tobytes()
        if key not in self._kept:
            if len(self._kept) > 2:
                del self._kept[next(iter(self._kept))]
            evaluation = self.problem.evaluated(self.full(free), slopes=True, columns=self.columns)
            assert evaluation.jacobian is not None
            values, rows = evaluation.values, evaluation.jacobian
            if self.prior.any():
                values = np.concatenate([values, self.prior * free])
                rows = np.concatenate([rows, np.diag(self.prior)])
            if self.compressed:
                values, rows = _triangle(values, rows)
            self._kept[key] = replace(evaluation, jacobian=None), values, rows
        return self._kept[key]

    def spread_at(self, free: FloatArray) -> FloatArray | None:
        """Return how J^T r scatters by what the residuals show, None where all deviations of responses are measured."""
        if not has_assumed_responses(self.problem.targets):
            return None
        residuals = self.problem.evaluated(self.full(free), slopes=True, columns=self.columns)
        return spread_of_gradient(self.problem.targets, residuals)

    def residual(self, free: FloatArray) -> FloatArray:
        """Return the residual vector as the solver sees it."""
        if self.problem.sensitivities == "exact":
            return self.residuals_at(free)[1]
        values = self.problem.evaluated(self.full(free)).values
        return np.concatenate([values, self.prior * free]) if self.prior.any() else values

    def jacobian(self, free: FloatArray) -> FloatArray:
        """Return its Jacobian."""
        return self.residuals_at(free)[2]

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds of the free coordinates."""
        lower, upper = self.problem.bounds
        return lower[self.columns], upper[self.columns]


def _triangle(values: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (r, J) as the last and the first columns of R in [J r] = QR."""
    both = np.empty((len(rows), rows.shape[1] + 1), order="F")
    both[:, :-1], both[:, -1] = rows, values
    # Without Q: the reflections that LAPACK leaves below the triangle are what `triu` takes off.
    triangle = np.triu(dgeqrf(both, overwrite_a=True)[0][:both.shape[1]])
    return triangle[:, -1], triangle[:, :-1]
