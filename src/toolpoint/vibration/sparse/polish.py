r"""Eigenpairs of Lanczos brought to the accuracy of the matrices: one inverse iteration, then Rayleigh-Ritz with K and M.

Lanczos knows :math:`1/(\omega^2 + s)`. With a small shift s the rigid-body modes of a free body are as large as 1/s, and
rounding at that size has been 1e-9 of the elastic modes, as much as the BLAS kernel made it. The Rayleigh quotient with K has
no such term. The inverse iteration damps what Lanczos leaves of high modes by :math:`(\omega^2 + s)/(\omega_j^2 + s)`, which
the residual of :math:`K \phi = \omega^2 M \phi` shows: 2e-7 before, where the squares were right to 1e-9.

Source: Parlett, The Symmetric Eigenvalue Problem, 1998, sections 4.3 and 11.4.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from toolpoint._check import FloatArray
from toolpoint.vibration.sparse.pencil import Pencil

POLISH_COLUMNS = 8  # vectors solved for and multiplied at once: a few columns of memory beside the vectors
POLISH_ROWS = 65536  # rows rotated at once, in place


def polish_pairs(pencil: Pencil, squares: FloatArray, vectors: FloatArray, *, rigid_square: float
                 ) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Return squares (rad^2/s^2), vectors with phi^T M phi = 1, and the residuals of the equation of motion.

    Parameters
    ----------
    squares, vectors : (k,) and (n, k) floats
        Of Lanczos, ascending; the vectors are overwritten.
    rigid_square : float
        Size (rad^2/s^2) up to which a square is that of a rigid-body mode and is kept as it is.

    Returns
    -------
    squares, vectors, residual : (k,), (n, k) and (k,) floats
        The residual is :math:`\|K \phi - \omega^2 M \phi\| / (\omega^2 \|M \phi\|)`, 0 for rigid-body modes.
    """
    if not len(squares):  # a band without modes: a stiff body that is held
        return squares, vectors, np.zeros(0)
    factors, blocks = pencil.inverse, [slice(i, i + POLISH_COLUMNS) for i in range(0, len(squares), POLISH_COLUMNS)]
    for block in blocks:
        vectors[:, block] = factors.solve(pencil.mass @ vectors[:, block]) * (squares[block] + pencil.shift)
    stiffness_form, mass_form = (np.hstack([vectors.T @ (matrix @ vectors[:, block]) for block in blocks])
                    for matrix in (pencil.stiffness, pencil.mass))
    rotation = eigh((stiffness_form + stiffness_form.T) / 2, (mass_form + mass_form.T) / 2)[1]
    for start in range(0, len(vectors), POLISH_ROWS):
        vectors[start:start + POLISH_ROWS] = vectors[start:start + POLISH_ROWS] @ rotation
    exact, residual = squares.copy(), np.zeros(len(squares))
    for block in blocks:
        part = vectors[:, block]
        elastic_force, inertia = pencil.stiffness @ part, pencil.mass @ part
        quotient = (part * elastic_force).sum(axis=0) / (part * inertia).sum(axis=0)
        scale = np.maximum(np.abs(quotient), rigid_square) * np.linalg.norm(inertia, axis=0)
        equation_error = np.linalg.norm(elastic_force - quotient * inertia, axis=0) / scale
        elastic = np.abs(squares[block]) > rigid_square
        exact[block] = np.where(elastic, quotient, squares[block])
        residual[block] = np.where(elastic, equation_error, 0.0)
    return exact, vectors, residual
