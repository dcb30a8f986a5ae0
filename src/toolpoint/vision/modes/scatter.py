r"""Poles as the windows scatter about them: what the noise of the sensor does not hold is seen between windows.

Texture sampled by pixels, edges near a window's border and light make errors of displacement that repeat with the motion: far
below the noise of a frame, they do not average out over a thousand of them. They differ from window to window. With the
residual :math:`r_c` of every channel and the change :math:`D_c` of its motion by the poles, free of its amplitudes, the step of
Gauss and Newton is :math:`H^{-1} \sum_w g_w`, :math:`g_w = \sum_{c \in w} D_c^T r_c`, :math:`H = \sum_c D_c^T D_c`, and the
covariance of the poles that holds for whatever the errors of a window are is :math:`H^{-1} \sum_w g_w g_w^T H^{-1}`.
Source: Liang, Zeger, Biometrika 73 (1986) 13 (clusters).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray
from toolpoint.vibration import Modes
from toolpoint.vision.displacement.result import DisplacementField
from toolpoint.vision.modes.projection import decay_basis

FEWEST_WINDOWS = 4
DAMPED = 2.8
# Share of the damping to which windows follow a decay as it shrinks: fitted to random films (benchmarks/video_records.py).
FOLLOWED = 0.012


def widen_by_windows(modes: Modes, field: DisplacementField, *, first: int, count: int) -> Modes:
    """Return the modes with the covariance of frequency and damping as wide as the windows of a field scatter, never narrower.

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
    seen = pole_scatter(field, modes.poles, first=first, count=count)
    if seen is None:
        return modes
    size, turn = modes.omega, np.sqrt(np.maximum(1 - modes.damping_ratio**2, 1e-12))
    # d(frequency, ratio) by d(sigma, omega): f = |s| / 2 pi, ratio = -sigma / |s|.
    by = np.empty((modes.count, 2, 2))
    by[:, 0, 0], by[:, 0, 1] = -modes.damping_ratio / (2 * np.pi), turn / (2 * np.pi)
    by[:, 1, 0], by[:, 1, 1] = -turn**2 / size, -modes.damping_ratio * turn / size
    scatter = by @ seen @ np.swapaxes(by, 1, 2)
    stated = np.diagonal(modes.covariance, axis1=1, axis2=2)
    ratio = np.sqrt(np.maximum(np.diagonal(scatter, axis1=1, axis2=2) / np.maximum(stated, 1e-300), 1.0))
    # Variances that are not known stay so.
    ratio = np.where(stated >= 0, ratio, 1.0)
    return replace(modes, covariance=modes.covariance * ratio[:, :, None] * ratio[:, None, :])


def widen_by_loss(modes: Modes, loss: float) -> Modes:
    """Return the modes with intervals as wide as pixels and compression may move them (`Quality.loss`; no law: seen in films).

    Small motion is smoothed more than large, so a decay looks faster: the ratio by up to `DAMPED` times the loss, the frequency
    by half of the half-power width's change, both by no more than the ratio itself. Without compression windows follow
    a decay to `FOLLOWED` of the damping.
    """
    if modes.covariance is None:
        return modes
    ratio = min(max(DAMPED * loss, FOLLOWED), 1.0) * modes.damping_ratio / 1.96
    more = np.zeros(modes.covariance.shape)
    part = ratio * modes.frequency * (0.5 if loss > 0 else 1.0)
    more[:, 0, 0], more[:, 1, 1] = part**2, ratio**2
    return replace(modes, covariance=modes.covariance + np.where(modes.covariance[:, :1, :1] >= 0, more, 0.0))


def pole_scatter(field: DisplacementField, poles: ComplexArray, *, first: int, count: int) -> FloatArray | None:
    """Return the covariance (r, 2, 2) of real and imaginary part of every pole, rad/s, by the scatter between windows.

    None where fewer than four windows see motion.
    """
    values, sigma, window, _ = field.measured()
    seen = np.unique(window)
    if seen.size < FEWEST_WINDOWS:
        return None
    part = values[first:first + count] / sigma
    times = np.arange(len(part)) / field.frame_rate
    basis = decay_basis(poles, times)
    amplitude = basis.amplitudes(part)
    waves = times[:, None] * np.exp(poles * times[:, None])
    steep = np.stack([waves.real, -waves.imag], axis=-1).reshape(len(times), -1)
    steep = basis.residual(steep)
    gram, moments = steep.T @ steep, steep.T @ part
    turned = _turned(amplitude)
    scores = np.einsum("cij,ic->cj", turned, moments)
    inverse = np.linalg.pinv(np.einsum("cki,kl,clj->ij", turned, gram, turned), hermitian=True)
    total = np.zeros((int(window.max()) + 1, scores.shape[1]))
    np.add.at(total, window, scores)
    groups = total[seen] - total[seen].mean(axis=0)
    more = seen.size / max(seen.size - 1, 1)
    every = inverse @ (groups.T @ groups * more + _shared(turned, gram, field)) @ inverse
    return np.stack([every[2 * r:2 * r + 2, 2 * r:2 * r + 2] for r in range(poles.size)])


def _shared(turned: FloatArray, gram: FloatArray, field: DisplacementField) -> FloatArray:
    """Return the variance of the sum of scores by an error that all windows share, right and down."""
    _, sigma, _, direction = field.measured()
    total = np.zeros((turned.shape[2], turned.shape[2]))
    for way, variance in enumerate(field.common):
        together = np.einsum("cij,c->ij", turned, direction[:, way] / sigma)
        total += variance * together.T @ gram @ together
    return total


def _turned(amplitude: ComplexArray) -> FloatArray:
    """Return how each channel's motion changes by the parts of the poles, over the steep waves: (channels, 2 r, 2 r)."""
    r, channels = amplitude.shape
    turned = np.zeros((channels, 2 * r, 2 * r))
    for k in range(r):
        # The real part of s adds phi t e^(s t), the imaginary part i phi t e^(s t).
        turned[:, 2 * k, 2 * k], turned[:, 2 * k + 1, 2 * k] = amplitude[k].real, amplitude[k].imag
        turned[:, 2 * k, 2 * k + 1], turned[:, 2 * k + 1, 2 * k + 1] = -amplitude[k].imag, amplitude[k].real
    return turned
