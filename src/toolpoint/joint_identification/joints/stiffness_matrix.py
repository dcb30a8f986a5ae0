r"""The stiffness matrix of a general joint over its free twists, from modes and modal forces.

Every mode obeys :math:`K q_r = g_r` with the joint's own coordinates :math:`q_r` and the modal forces
:math:`g_r = \omega_r^2 (M q)_r` on them: f equations for the f (f + 1)/2 entries of a symmetric K. It is determined where the
modes move the joint in f independent ways (:math:`K + u u^T` with u square to all :math:`q_r` would explain the same data) and
where more modes than f (or all six freedoms) say that there are no others. Both sides are noisy, so the entries minimise
:math:`\sum_r (g_r - K q_r)^T W_r(K) (g_r - K q_r)` with the inverse covariance :math:`W_r(K)` of that misfit (effective
variance: Orear, Am. J. Phys. 50 (1982) 912; with W held in turns the search does not settle at noise above a per cent).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from toolpoint._check import FloatArray

_MIN_SIGNAL_RATIO = 25.0  # mean square of a motion over that of its noise, from which the modes determine it


@dataclass(frozen=True, eq=False)
class Lines:
    """Coordinates of one joint in every mode, and what drives them.

    q : (k, f); force : (k, f); spread : (k, n, n), covariance of all coordinates; rows : the joint's among them; mass : (f, n),
    its rows of the mass matrix; square : (k,), omega^2.
    """

    q: FloatArray
    force: FloatArray
    spread: FloatArray
    rows: slice
    mass: FloatArray
    square: FloatArray

    @property
    def noise(self) -> FloatArray:
        """Covariance of q, (k, f, f)."""
        return self.spread[:, self.rows, self.rows]

    def weights(self, matrix: FloatArray) -> FloatArray:
        """Return the inverse covariance (k, f, f) of the misfit of a stiffness matrix."""
        slope = self.square[:, None, None] * self.mass
        slope[:, :, self.rows] -= matrix
        return np.linalg.inv(slope @ self.spread @ np.swapaxes(slope, 1, 2))


def symmetric_entries(f: int) -> FloatArray:
    """Return the map (f, f, f (f + 1)/2) from the entries of the upper triangle to the symmetric matrix."""
    rows, columns = np.triu_indices(f)
    result = np.zeros((f, f, rows.size))
    result[rows, columns, range(rows.size)] = result[columns, rows, range(rows.size)] = 1.0
    return result


def solve(lines: Lines, weights: FloatArray) -> FloatArray:
    """Return the symmetric matrix (f, f) of least squares with these weights (k, f, f)."""
    entries = symmetric_entries(lines.q.shape[1])
    # Rows of every mode: sum over b of K_ab q_b, whitened by the root of its weight.
    roots = np.swapaxes(np.linalg.cholesky(weights), 1, 2)
    rows = np.einsum("kca,abi,kb->kci", roots, entries, lines.q, optimize=True).reshape(lines.q.size, -1)
    right = np.einsum("kca,ka->kc", roots, lines.force).ravel()
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    return np.asarray(entries @ (np.linalg.lstsq(rows / size, right, rcond=None)[0] / size))


def count_moved_directions(lines: Lines) -> int:
    """Return the number of independent directions in which the modes move the joint five times more (rms) than noise."""
    return int((linalg.eigh(lines.q.T @ lines.q, lines.noise.sum(axis=0), eigvals_only=True) > _MIN_SIGNAL_RATIO).sum())
