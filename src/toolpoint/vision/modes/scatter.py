r"""Poles as the windows scatter about them: what the noise of the sensor does not hold is seen between windows.

Texture sampled by pixels, edges near a window's border and light make errors of displacement that repeat with the motion: far
below the noise of a frame, they do not average out over a thousand of them. They differ from window to window. With the
residual :math:`r_c` of every channel and the change :math:`D_c` of its motion by the poles, free of its amplitudes, the step of
Gauss and Newton is :math:`H^{-1} \sum_w g_w`, :math:`g_w = \sum_{c \in w} D_c^T r_c`, :math:`H = \sum_c D_c^T D_c`, and the
covariance of the poles that holds for whatever the errors of a window are is :math:`H^{-1} \sum_w g_w g_w^T H^{-1}`.
A window that decides a pole nearly alone pulls it towards its own error, and its residual is small for it: each sum is taken
as it would be about the poles of the others, :math:`(1 - H_w H^{-1})^{-1} g_w`. Student's factor stands for few windows.
Without both a weak mode that few windows see has too narrow an interval.
Sources: Liang, Zeger, Biometrika 73 (1986) 13 (clusters); Bell, McCaffrey, Survey Methodology 28 (2002) 169 (leverage).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy  # its rooms load on first use

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.vibration import Modes
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.modes.projection import decay_basis

MIN_SCATTER_WINDOWS = 4  # whose scatter has a variance that can be believed
DAMPING_LOSS_FACTOR = 2.8  # relative error of the damping over the loss (`Quality.loss`), largest seen in compressed films
MAX_WINDOW_LEVERAGE = 0.8  # share of one window in what decides a pole, above which it is not taken as known
MIN_WINDOW_FREEDOM = 2.0  # degrees of freedom, windows less one, that are counted at least
# Share of the damping to which windows follow a decay as it shrinks: fitted to random films
# (benchmarks/vision/ringing_films.py).
DAMPING_TRACKING_ERROR = 0.012


def inflate_by_windows(modes: Modes, field: DisplacementField, *, first: int, count: int) -> Modes:
    """Return the modes, covariance of frequency and damping inflated to the scatter between windows of a field.

    Parameters
    ----------
    modes : Modes
        Identified in the decay of this field, with covariance.
    field : DisplacementField
    first, count : int
        Frame in which the decay begins, and its frames.
    """
    if modes.covariance is None:
        return modes
    pole_covariance = pole_scatter(field, modes.poles, first=first, count=count)
    if pole_covariance is None:
        return modes
    pole_size, damped_fraction = modes.omega, np.sqrt(np.maximum(1 - modes.damping_ratio**2, 1e-12))
    # d(frequency, ratio) by d(sigma, omega): f = |s| / 2 pi, ratio = -sigma / |s|.
    jacobian = np.empty((modes.count, 2, 2))
    jacobian[:, 0, 0], jacobian[:, 0, 1] = -modes.damping_ratio / (2 * np.pi), damped_fraction / (2 * np.pi)
    jacobian[:, 1, 0], jacobian[:, 1, 1] = -damped_fraction**2 / pole_size, -modes.damping_ratio * damped_fraction / pole_size
    scatter = jacobian @ pole_covariance @ np.swapaxes(jacobian, 1, 2)
    stated = np.diagonal(modes.covariance, axis1=1, axis2=2)
    ratio = np.sqrt(np.maximum(np.diagonal(scatter, axis1=1, axis2=2) / np.maximum(stated, 1e-300), 1.0))
    # Variances that are not known stay so.
    ratio = np.where(stated >= 0, ratio, 1.0)
    return replace(modes, covariance=modes.covariance * ratio[:, :, None] * ratio[:, None, :])


def inflate_by_loss(modes: Modes, loss: float) -> Modes:
    """Return the modes with intervals as wide as pixels and compression may move them (`Quality.loss`; no law: seen in films).

    Small motion is smoothed more than large, so a decay looks faster: the ratio by up to `DAMPING_LOSS_FACTOR` times the loss,
    the frequency by half of the half-power width's change, both by no more than the ratio itself. Without compression windows
    follow a decay to `DAMPING_TRACKING_ERROR` of the damping.
    """
    if modes.covariance is None:
        return modes
    half_width = min(max(DAMPING_LOSS_FACTOR * loss, DAMPING_TRACKING_ERROR), 1.0) * modes.damping_ratio
    damping_deviation = half_width / NORMAL_QUANTILE_95
    added_variance = np.zeros(modes.covariance.shape)
    frequency_deviation = damping_deviation * modes.frequency * (0.5 if loss > 0 else 1.0)
    added_variance[:, 0, 0], added_variance[:, 1, 1] = frequency_deviation**2, damping_deviation**2
    return replace(modes, covariance=modes.covariance + np.where(modes.covariance[:, :1, :1] >= 0, added_variance, 0.0))


def pole_scatter(field: DisplacementField, poles: ComplexArray, *, first: int, count: int) -> FloatArray | None:
    """Return the covariance (r, 2, 2) of real and imaginary part of every pole, rad/s, by the scatter between windows.

    None where fewer than four windows see motion.
    """
    values, sigma, window, _ = field.measured()
    windows = np.unique(window)
    if windows.size < MIN_SCATTER_WINDOWS:
        return None
    part = values[first:first + count] / sigma
    times = np.arange(len(part)) / field.frame_rate
    basis = decay_basis(poles, times)
    amplitude = basis.amplitudes(part)
    waves = times[:, None] * np.exp(poles * times[:, None])
    slope_waves = np.stack([waves.real, -waves.imag], axis=-1).reshape(len(times), -1)
    slope_waves = basis.residual(slope_waves)
    gram, moments = slope_waves.T @ slope_waves, slope_waves.T @ part
    slope_factors = _slope_factors(amplitude)
    scores = np.einsum("cij,ic->cj", slope_factors, moments)
    of_channels = np.einsum("cki,kl,clj->cij", slope_factors, gram, slope_factors)
    inverse = np.linalg.pinv(of_channels.sum(axis=0), hermitian=True)
    window_sums, window_weights = (np.zeros((int(window.max()) + 1, *each.shape[1:])) for each in (scores, of_channels))
    np.add.at(window_sums, window, scores)
    np.add.at(window_weights, window, of_channels)
    window_scores = _without_leverage(window_sums[windows], window_weights[windows], inverse)
    window_scores = window_scores - window_scores.mean(axis=0)
    small_sample_factor = windows.size / max(windows.size - 1, 1)
    pole_covariance = inverse @ (window_scores.T @ window_scores * small_sample_factor
                                 + _shared(slope_factors, gram, field)) @ inverse
    factor = _student_factors(window_weights[windows], inverse)
    return np.stack([pole_covariance[2 * r:2 * r + 2, 2 * r:2 * r + 2] * factor[r] ** 2 for r in range(poles.size)])


def _without_leverage(scores: FloatArray, weights: FloatArray, inverse: FloatArray) -> FloatArray:
    """Return the scores (windows, p) about the poles of all other windows.

    weights : H_w (windows, p, p); inverse : (p, p) of their sum. A window that decides a pole alone has no others to be
    compared with: its leverage counts up to `MAX_WINDOW_LEVERAGE`.
    """
    # Symmetric form: the leverages H_w H^-1 and the roots R^T H_w R have the same eigenvalues.
    values, vectors = np.linalg.eigh(inverse)
    positive = values > 1e-12 * values.max(initial=0.0)
    root = vectors[:, positive] * np.sqrt(values[positive])
    inverse_root = vectors[:, positive] / np.sqrt(values[positive])
    leverage, directions = np.linalg.eigh(np.einsum("pi,wpq,qj->wij", root, weights, root))
    factor = 1 / (1 - np.clip(leverage, 0.0, MAX_WINDOW_LEVERAGE))
    turned = np.einsum("wij,wi->wj", directions, scores @ root) * factor
    return np.einsum("wij,wj->wi", directions, turned) @ inverse_root.T


def _student_factors(weights: FloatArray, inverse: FloatArray) -> FloatArray:
    """Return Student's 95 % quantile over the normal one, (r,), for as many windows as in effect decide each pole.

    With l_w the share of a window, these are :math:`1/\\sum_w l_w^2` windows.
    """
    leverage = np.einsum("wpq,qp->wp", weights, inverse)
    shares = np.maximum(leverage.reshape(len(leverage), -1, 2).sum(axis=2), 0.0)
    shares = shares / np.maximum(shares.sum(axis=0), 1e-300)
    freedom = np.maximum(1 / np.maximum((shares**2).sum(axis=0), 1e-300) - 1, MIN_WINDOW_FREEDOM)
    # Intervals downstream multiply by 1.96: the factor makes them Student's for so few windows.
    return np.asarray(scipy.special.stdtrit(freedom, 0.975) / scipy.special.ndtri(0.975))


def _shared(slope_factors: FloatArray, gram: FloatArray, field: DisplacementField) -> FloatArray:
    """Return the variance of the sum of scores by an error that all windows share, right and down."""
    _, sigma, _, direction = field.measured()
    total = np.zeros((slope_factors.shape[2], slope_factors.shape[2]))
    for component, variance in enumerate(field.common):
        summed_factors = np.einsum("cij,c->ij", slope_factors, direction[:, component] / sigma)
        total += variance * summed_factors.T @ gram @ summed_factors
    return total


def _slope_factors(amplitude: ComplexArray) -> FloatArray:
    """Return how each channel's motion changes by the parts of the poles, over the steep waves: (channels, 2 r, 2 r)."""
    r, channels = amplitude.shape
    turned = np.zeros((channels, 2 * r, 2 * r))
    for k in range(r):
        # The real part of s adds phi t e^(s t), the imaginary part i phi t e^(s t).
        turned[:, 2 * k, 2 * k], turned[:, 2 * k + 1, 2 * k] = amplitude[k].real, amplitude[k].imag
        turned[:, 2 * k, 2 * k + 1], turned[:, 2 * k + 1, 2 * k + 1] = -amplitude[k].imag, amplitude[k].real
    return turned
