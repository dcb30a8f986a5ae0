r"""Solutions beside a mode: the parts of derivatives of shapes, and of adjoints of functions of shapes.

For a mode :math:`K \phi_r = \lambda_r M \phi_r` of unit modal mass and any f, the x of :math:`(K - \lambda_r M) x = f - M
\phi_r (\phi_r^T f)` with :math:`\phi_r^T M x = 0`. With :math:`f = -(K' - \lambda_r M') \phi_r` it is the derivative of the
shape but for its scale; with the gradient g of a function h of the shape it is the adjoint a: :math:`dh = -a^T (dK - \lambda_r
dM) \phi_r - \tfrac12 (\phi_r^T g) \phi_r^T dM \phi_r` for any dK, dM. Along the modes that are given x is their sum; the
remaining system is positive definite and solved by conjugate gradients, preconditioned by the factors of K, for all right sides
at once.
Source: Nelson, AIAA J. 14 (1976), by iteration in place of a factorisation for every mode.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array

from toolpoint._check import FloatArray, fail
from toolpoint.vibration.sparse.eigenpairs import EigenPairs
from toolpoint.vibration.sparse.factorisation import Factorisation

_GRADIENT_TOLERANCE = 1e-12  # residual norm over the first, and part beside the modes over the right side
_MAX_GRADIENT_STEPS, _POLISH_STEPS = 60, 3  # conjugate gradients; inverse iterations
CLUSTER_SQUARE_TOLERANCE = 1e-6  # relative distance of squares below which single shapes are not determined


def polish(stiffness: csc_array, mass: csc_array, pairs: EigenPairs, *, inverse: Factorisation
           ) -> tuple[FloatArray, FloatArray]:
    """Return squares and vectors after some steps of inverse iteration with all pairs at once.

    The search ends at an error of the vectors that enters frequencies squared, but slopes of shapes in the first order.
    """
    vectors = np.array(pairs.vectors)
    squares = pairs.squares
    for _ in range(_POLISH_STEPS):
        vectors = inverse.solve(mass @ vectors)
        squares, rotation = eigh(vectors.T @ (stiffness @ vectors), vectors.T @ (mass @ vectors))
        vectors = vectors @ rotation
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

    Raises
    ------
    ToolpointError
        Where the conjugate gradients do not converge: too few of the lowest modes were given.
    """
    mass_vectors = mass @ vectors
    projections = vectors.T @ right
    gaps = squares[:, None] - squares[which][None, :]
    is_same_root = np.abs(gaps) <= CLUSTER_SQUARE_TOLERANCE * squares[which][None, :]
    along_modes = vectors @ np.where(is_same_root, 0.0, projections / np.where(is_same_root, 1.0, gaps))
    remaining = right - mass_vectors @ projections
    right_norm = np.linalg.norm(right, axis=0)
    if not (np.linalg.norm(remaining, axis=0) > _GRADIENT_TOLERANCE * right_norm).any():
        return along_modes
    return along_modes + _complement(stiffness, mass, squares[which], remaining, vectors=vectors, mass_vectors=mass_vectors,
                                     inverse=inverse)


def _complement(stiffness: csc_array, mass: csc_array, shift: FloatArray, right: FloatArray, *, vectors: FloatArray,
                mass_vectors: FloatArray, inverse: Factorisation) -> FloatArray:
    """Return x of (K - shift M) x = right, M-orthogonal to the vectors, by conjugate gradients for all columns at once."""
    def project(x: FloatArray) -> FloatArray:
        return x - vectors @ (mass_vectors.T @ x)

    x = np.zeros_like(right)
    residual = right
    preconditioned = direction = project(inverse.solve(residual))
    power = (residual * preconditioned).sum(axis=0)
    initial_power = power.copy()
    for _ in range(_MAX_GRADIENT_STEPS):
        if (power <= _GRADIENT_TOLERANCE**2 * initial_power).all():
            return x
        image = stiffness @ direction - (mass @ direction) * shift
        curvature = (direction * image).sum(axis=0)
        step_length = np.where(curvature > 0, power / np.where(curvature > 0, curvature, 1.0), 0.0)
        x = x + direction * step_length
        residual = residual - image * step_length
        residual = residual - mass_vectors @ (vectors.T @ residual)
        preconditioned = project(inverse.solve(residual))
        new_power = (residual * preconditioned).sum(axis=0)
        direction = preconditioned + direction * np.where(power > 0, new_power / np.where(power > 0, power, 1.0), 0.0)
        power = new_power
    fail("vectors", f"solutions beside modes did not converge in {_MAX_GRADIENT_STEPS} steps",
         "must hold enough of the lowest modes",
         remedy="ask for more modes than those whose shapes are studied")
