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
from scipy import linalg, optimize, stats

from toolpoint._check import FloatArray

_SEEN = 25.0
_SURE = 1.959964
_IMPROBABLE = 1e-6


@dataclass(frozen=True, eq=False)
class Lines:
    """Coordinates of one joint in every mode, and what drives them.

    q : (k, f); force : (k, f); spread : (k, n, n), covariance of all coordinates; own : the joint's among them; mass : (f, n),
    its rows of the mass matrix; square : (k,), omega^2.
    """

    q: FloatArray
    force: FloatArray
    spread: FloatArray
    own: slice
    mass: FloatArray
    square: FloatArray

    @property
    def noise(self) -> FloatArray:
        """Covariance of q, (k, f, f)."""
        return self.spread[:, self.own, self.own]

    def weights(self, matrix: FloatArray) -> FloatArray:
        """Return the inverse covariance (k, f, f) of the misfit of a stiffness matrix."""
        slope = self.square[:, None, None] * self.mass
        slope[:, :, self.own] -= matrix
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


def identify_matrix(lines: Lines) -> tuple[FloatArray, FloatArray]:
    """Return (matrix, weights) with weights that belong to the matrix."""
    f = lines.q.shape[1]
    start: FloatArray = np.zeros((f, f))
    for _ in range(3):
        start = solve(lines, lines.weights(start))
    entries, upper = symmetric_entries(f), np.triu_indices(f)
    scale = np.sqrt(np.maximum(np.abs(np.diag(start)), 1e-300))
    unit = np.outer(scale, scale)[upper]

    def misfit(x: FloatArray) -> FloatArray:
        matrix = entries @ (x * unit)
        roots = np.linalg.cholesky(lines.weights(matrix))
        return np.asarray(np.einsum("kac,ka->kc", roots, lines.force - lines.q @ matrix).ravel())

    solution = optimize.least_squares(misfit, start[upper] / unit, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    matrix = np.asarray(entries @ (solution.x * unit))
    return matrix, lines.weights(matrix)


def fault(lines: Lines) -> str:
    """Return why the data do not decide the matrix, or an empty text.

    Criterion: along every free twist the modes move five times more (rms) than noise alone; and the freedoms are fewer than
    the modes, or all six.
    """
    count, f = lines.q.shape
    ratio = linalg.eigh(lines.q.T @ lines.q, lines.noise.sum(axis=0), eigvals_only=True)
    seen = int((ratio > _SEEN).sum())
    if seen < f:
        return (f"stiffness matrix not determined: the {count} modes move the joint in {seen} of its {f} free ways more than "
                "noise; give modes that move it otherwise")
    if f < 6 and count <= f:
        return (f"stiffness matrix not determined: {count} modes cannot exclude more than {f} freedoms, and the forces on "
                "those would be missing; give more modes")
    return ""


def doubts(lines: Lines, matrix: FloatArray, weights: FloatArray, *, covariance: FloatArray) -> list[str]:
    """Return what speaks against a matrix whose upper triangle has this covariance: sign, width and misfit."""
    entries, result = symmetric_entries(len(matrix)), []
    # Translations and rotations have different units: eigenvalues over the size of each direction.
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), 1e-300))
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    turned = scale[:, None] * vectors
    slope = np.einsum("ia,ijb,ja->ab", turned, entries, turned)
    sd = np.sqrt(np.einsum("ab,bc,ac->a", slope, covariance, slope))
    if values[0] < -_SURE * sd[0]:
        result.append("stiffness matrix is not positive: check masses, frequencies and the chain")
    elif (values < _SURE * sd).any():
        weak = int((values < _SURE * sd).sum())
        result.append(f"stiffness matrix: {weak} of its {len(values)} principal stiffnesses cannot be told from zero")
    miss = lines.force - lines.q @ matrix
    chi2 = float(np.einsum("ka,kab,kb->", miss, weights, miss))
    share = np.sqrt(chi2 / np.einsum("ka,kab,kb->", lines.force, weights, lines.force))
    freedom = max(lines.q.size - covariance.shape[0], 1)
    if share > 0.05 and stats.chi2.sf(chi2, freedom) < _IMPROBABLE:
        result.append(f"stiffness matrix leaves {100 * share:.2g} % of the forces unexplained: check the masses")
    return result
