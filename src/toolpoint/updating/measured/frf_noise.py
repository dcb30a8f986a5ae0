r"""Correlated errors of frequency responses: between lines and between outputs, and how they are made independent.

With :math:`e = \sigma \circ z` and :math:`E[z_{fo} z_{gp}^*] = \rho_{fg} c_{op}`, the whitened errors are
:math:`L_\rho^{-1} z L_c^{-*}` with the Cholesky factors of both correlations (Kronecker structure).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz

from toolpoint._check import Array, ComplexArray, FloatArray, complexes, count, fail


def check_correlation(name: str, value: Array, size: int) -> Array:
    """Return a correlation matrix (size, size) after refusing one that is not Hermitian, of unit diagonal and positive."""
    matrix = np.asarray(value)
    if matrix.shape != (size, size):
        fail(name, f"shape {matrix.shape}", f"must be ({size}, {size})")
    if np.abs(matrix - matrix.conj().T).max() > 1e-9 or np.abs(np.diag(matrix) - 1).max() > 1e-9:
        fail(name, "not Hermitian or not one on its diagonal", "must be a correlation matrix")
    if np.linalg.eigvalsh(matrix)[0] <= 1e-10:
        fail(name, "not positive definite", "must be", remedy="shrink it towards the identity: 0.99 C + 0.01 I")
    return matrix


@dataclass(frozen=True, eq=False)
class Whitening:
    """Inverse Cholesky factors of the correlations between lines (n_f, n_f) and outputs (n_o, n_o); None: independent."""

    lines: Array | None
    channels: Array | None

    @classmethod
    def of(cls, lines: Array | None, channels: Array | None) -> Whitening:
        """Return the whitening of two correlation matrices."""
        return cls(*(None if c is None else np.linalg.inv(np.linalg.cholesky(c)) for c in (lines, channels)))

    def applied(self, values: ComplexArray) -> ComplexArray:
        """Return whitened values (..., n_f, n_o, n_i)."""
        if self.channels is not None:
            values = self.channels @ values
        if self.lines is not None:
            flat = values.reshape(*values.shape[:-2], -1)
            values = (self.lines @ flat).reshape(values.shape)
        return values


def correlations(repeats: ComplexArray, lags: int = 8) -> tuple[FloatArray, ComplexArray]:
    """Return (correlation between lines (n_f, n_f), between outputs (n_o, n_o)) of repeated measurements.

    Parameters
    ----------
    repeats : (n_repeats, n_f, n_outputs, n_inputs) complex
        The same responses measured several times, any quantity; at least two.
    lags : int
        Correlation is looked for up to so many lines apart, averaged over the band (a window acts alike at all lines) and
        tapered to zero, which keeps the matrix positive definite. Lags within two standard errors of zero count as zero.
    """
    values = complexes("repeats", repeats, (None, None, None))
    if values.ndim != 4 or len(values) < 2:
        fail("repeats", f"shape {values.shape}", "must be (n_repeats, n_f, n_outputs, n_inputs) with at least two repeats")
    error = values - values.mean(axis=0)
    spread = np.sqrt((np.abs(error) ** 2).mean(axis=0))
    z = error / np.where(spread > 0, spread, 1.0)
    channels = np.einsum("rfoi,rfpi->op", z, z.conj())
    scale = np.sqrt(np.real(np.diag(channels)))
    channels = channels / np.outer(scale, scale)
    number = count("lags", lags)
    row = np.zeros(z.shape[1])
    row[0] = 1.0
    power = float((np.abs(z) ** 2).mean())
    for k in range(1, min(number, z.shape[1] - 1) + 1):
        products = z[:, k:] * z[:, :-k].conj()
        value = float(np.real(products.mean())) / power
        row[k] = value * (1 - k / (number + 1)) if abs(value) > 2 / np.sqrt(products.size) else 0.0
    return _positive(toeplitz(row)), _positive(channels)


def _positive(matrix: Array) -> Array:
    """Return the matrix shrunk towards the identity as far as it takes to be positive definite with margin."""
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    share = max(0.0, (1e-3 - smallest) / (1 - smallest)) if smallest < 1e-3 else 0.0
    return np.asarray((1 - share) * matrix + share * np.eye(len(matrix)))
