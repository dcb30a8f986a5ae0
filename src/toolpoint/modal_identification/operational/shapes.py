r"""Shapes of operational modes, and what each contributes to the correlations.

With the poles known, the correlations at lags l >= 1 (white noise of the channels is in lag 0 alone) are linear in the
amplitudes,

.. math:: R_l = \sum_r A_r \mu_r^l + A_r^* \mu_r^{*l}, \qquad A_r = \phi_r g_r^T,

and the leading left singular vector of each :math:`A_r` is its shape. The deviations of the blocks go through the same least
squares, with the change of the poles beside them, and give the variance of every shape entry to first order.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import BoolArray, ComplexArray, FloatArray
from toolpoint.modal_identification.operational.correlations import Correlations


@dataclass(frozen=True, eq=False)
class OperationalShapes:
    """Shapes of unit length, in the scaling of the correlations.

    Parameters
    ----------
    shape : (n_channels, n_modes) complex
        Turned so that the sum of its squares is real and positive.
    deviations : (n_blocks, n_channels, n_modes) complex
        First-order change of each for each block.
    power_share : (n_modes,) floats
        Of the power of all channels: what the mode's own correlation has at lag 0, each channel weighted by its rms.
    """

    shape: ComplexArray
    deviations: ComplexArray
    power_share: FloatArray

    def chosen(self, kept: BoolArray) -> OperationalShapes:
        """Return the shapes of those modes that are kept."""
        return OperationalShapes(self.shape[:, kept], self.deviations[:, :, kept], self.power_share[kept])


def fit_shapes(correlations: Correlations, poles: ComplexArray, pole_deviations: ComplexArray, *,
               rows: int) -> OperationalShapes:
    """Return the shapes of poles (rad/s), fitted to the lags 1 .. 2 rows - 1.

    pole_deviations : (n_blocks, n_modes) complex, rad/s.
    """
    lags = np.arange(1, 2 * rows)
    blocks, _, channels, references = correlations.blocks.shape
    time = lags * correlations.interval
    waves = np.exp(time[:, None] * poles)
    inverse = np.linalg.pinv(np.concatenate([waves.real, -waves.imag], axis=1))
    amplitudes = _complex_amplitudes(inverse, correlations.mean[1:2 * rows].reshape(lags.size, -1))
    amplitudes = amplitudes.reshape(poles.size, channels, references)
    data = correlations.deviations.reshape(blocks, -1, channels * references)[:, 1:2 * rows]
    # A pole's change moves its own decay by t exp(s t) A ds: what the amplitudes of all modes must then make good.
    slopes = time[:, None] * waves
    shape = np.empty((channels, poles.size), complex)
    deviations = np.empty((blocks, channels, poles.size), complex)
    changes = np.empty((blocks, *amplitudes.shape), complex)
    for b in range(blocks):
        moved = np.einsum("lr,rci,r->lci", slopes, amplitudes, pole_deviations[b])
        changes[b] = _complex_amplitudes(inverse, data[b] - 2 * moved.real.reshape(lags.size, -1)).reshape(amplitudes.shape)
    for r in range(poles.size):
        left, size, right = np.linalg.svd(amplitudes[r], full_matrices=False)
        vector = left[:, 0]
        turn = np.exp(-0.5j * np.angle((vector**2).sum()))
        change = changes[:, r] @ right[0].conj() / size[0]
        change -= (change @ vector.conj())[:, None] * vector
        shape[:, r], deviations[:, :, r] = vector * turn, change * turn
    mode_power = 2 * np.einsum("rcc->rc", amplitudes[:, list(correlations.references), :]).real
    power = np.einsum("ccl->cl", correlations.mean[:1, list(correlations.references), :].transpose(1, 2, 0))[:, 0]
    return OperationalShapes(shape, deviations, np.clip((mode_power / power).mean(axis=1), 0.0, 1.0))


def _complex_amplitudes(inverse: FloatArray, values: FloatArray) -> ComplexArray:
    """Return complex amplitudes of decays, A exp(s t) + conjugate, fitted to values (n_lags, n)."""
    halves = inverse @ values
    count = halves.shape[0] // 2
    return np.asarray((halves[:count] + 1j * halves[count:]) / 2, complex)
