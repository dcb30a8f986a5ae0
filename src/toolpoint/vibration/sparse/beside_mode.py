r"""Solutions beside a mode: what derivatives of shapes, and the adjoints of functions of shapes, are made of.

For a mode :math:`K \phi_r = \lambda_r M \phi_r` of unit modal mass and any f, the x of :math:`(K - \lambda_r M) x = f - M
\phi_r (\phi_r^T f)` with :math:`\phi_r^T M x = 0`. With :math:`f = -(K' - \lambda_r M') \phi_r` it is the derivative of the
shape but for its scale; with the gradient g of a function h of the shape it is the adjoint a: :math:`dh = -a^T (dK - \lambda_r
dM) \phi_r - \tfrac12 (\phi_r^T g) \phi_r^T dM \phi_r` for any dK, dM. Along the modes that are known x is their sum; what is
left is positive definite and solved by conjugate gradients, preconditioned by the factors of K, for all right sides at once.
Source: Nelson, AIAA J. 14 (1976), by iteration in place of a factorisation for every mode.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail
from toolpoint.vibration.sparse.eigenpairs import EigenPairs
from toolpoint.vibration.sparse.factorisation import Factorisation

_TOLERANCE, _STEPS, _POLISH = 1e-12, 60, 3
# Squares nearer to each other than this share have no shapes of their own.
REPEATED = 1e-6


def polish(stiffness: csc_array, mass: csc_array, pairs: EigenPairs, *, inverse: Factorisation
           ) -> tuple[FloatArray, FloatArray]:
    """Return squares and vectors after some steps of inverse iteration with all pairs at once.

    The modes of a search end at an error that frequencies do not show, being of second order in it; slopes of shapes do.
    """
    vectors = np.array(pairs.vectors)
    squares = pairs.squares
    for _ in range(_POLISH):
        vectors = inverse.solve(mass @ vectors)
        squares, turn = eigh(vectors.T @ (stiffness @ vectors), vectors.T @ (mass @ vectors))
        vectors = vectors @ turn
    signs = np.sign((vectors * (mass @ pairs.vectors)).sum(axis=0))
    return squares, vectors * np.where(signs == 0, 1.0, signs)


def solve_beside(
    stiffness: csc_array, mass: csc_array, squares: FloatArray, *, vectors: FloatArray, which: np.ndarray, right: FloatArray,
    inverse: Factorisation,
) -> FloatArray:
    """Return the solutions beside modes, (n, k).

    Parameters
    ----------
    stiffness, mass : (n, n)
        Stiffness with an inverse: a held body or machine.
    squares, vectors : (m,), (n, m)
        The lowest modes, all of them, unit modal mass; more than those that are asked for, so that it converges fast.
    which : (k,) ints
        Mode of every right side.
    right : (n, k)
        f.
    inverse : Factorisation
        Of the stiffness.
    """
    moved = mass @ vectors
    projections = vectors.T @ right
    gaps = squares[:, None] - squares[which][None, :]
    same = np.abs(gaps) <= REPEATED * squares[which][None, :]
    known = vectors @ np.where(same, 0.0, projections / np.where(same, 1.0, gaps))
    rest = right - moved @ projections
    scale = np.linalg.norm(right, axis=0)
    if not (np.linalg.norm(rest, axis=0) > _TOLERANCE * scale).any():
        return known
    return known + _complement(stiffness, mass, squares[which], rest, vectors=vectors, moved=moved, inverse=inverse)


def _complement(stiffness: csc_array, mass: csc_array, shift: FloatArray, right: FloatArray, *, vectors: FloatArray,
                moved: FloatArray, inverse: Factorisation) -> FloatArray:
    """Return x of (K - shift M) x = right, M-orthogonal to the vectors, by conjugate gradients for all columns at once."""
    def clean(x: FloatArray) -> FloatArray:
        return x - vectors @ (moved.T @ x)

    x = np.zeros_like(right)
    residual = right
    step = direction = clean(inverse.solve(residual))
    power = (residual * step).sum(axis=0)
    first = power.copy()
    for _ in range(_STEPS):
        if (power <= _TOLERANCE**2 * first).all():
            return x
        change = stiffness @ direction - (mass @ direction) * shift
        curve = (direction * change).sum(axis=0)
        length = np.where(curve > 0, power / np.where(curve > 0, curve, 1.0), 0.0)
        x = x + direction * length
        residual = residual - change * length
        residual = residual - moved @ (vectors.T @ residual)
        step = clean(inverse.solve(residual))
        new = (residual * step).sum(axis=0)
        direction = step + direction * np.where(power > 0, new / np.where(power > 0, power, 1.0), 0.0)
        power = new
    fail("vectors", f"solutions beside modes did not converge in {_STEPS} steps", "must hold enough of the lowest modes",
         remedy="ask for more modes than those whose shapes are studied")
