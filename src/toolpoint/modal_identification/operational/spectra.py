r"""Spectra of records of a machine at work: singular values (frequency-domain decomposition) and half spectra.

Singular values of the spectral matrix, line by line: near a mode the first singular vector is its shape. Source: Brincker,
Zhang, Andersen, Smart Mater. Struct. 10 (2001) 441. Half spectra are transforms of the correlations at positive lags; they
have the poles of a frequency response, with the references as its inputs, once each. Source: Cauberghe, PhD thesis, Brussels
(2004).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from toolpoint._check import ComplexArray, FloatArray
from toolpoint._notebook import NotebookText
from toolpoint.modal_identification.operational.correlations import Correlations
from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf

SHOWN_SINGULAR_VALUES = 4
SEGMENT_OVERLAP = 0.5  # Hann windows
HALF_SPECTRUM_END = 0.01  # of the exponential window at the longest lag


@dataclass(frozen=True, eq=False)
class SingularSpectra(NotebookText):
    """Singular values of the spectral matrix.

    Parameters
    ----------
    frequency : (n_lines,) floats
        Hz.
    values : (n_lines, n_values) floats
        Largest first, in units of the channels (each divided by its rms) squared per Hz.
    vectors : (n_lines, n_channels, n_values) complex
    """

    frequency: FloatArray
    values: FloatArray
    vectors: ComplexArray

    def __repr__(self) -> str:
        return f"SingularSpectra({self.frequency.size} lines up to {self.frequency[-1]:.4g} Hz, {self.values.shape[1]} values)"


def singular_spectra(samples: list[FloatArray], rate: float, lines: int) -> SingularSpectra:
    """Return the singular spectra of records (n_samples, n_channels), from Hann windows of 2 `lines` samples."""
    size = 2 * lines
    window = np.hanning(size)[:, None]
    total, count = np.zeros((lines + 1, samples[0].shape[1], samples[0].shape[1]), complex), 0
    for part in samples:
        for start in range(0, part.shape[0] - size + 1, int(size * (1 - SEGMENT_OVERLAP))):
            spectrum = fft.rfft(part[start:start + size] * window, axis=0)
            total += spectrum[:, :, None] * spectrum[:, None, :].conj()
            count += 1
    vectors, values, _ = np.linalg.svd(2 * total / (max(count, 1) * rate * (window**2).sum()))
    n_values = min(SHOWN_SINGULAR_VALUES, values.shape[1])
    return SingularSpectra(np.arange(1, lines + 1) * rate / size, values[1:, :n_values], vectors[1:, :, :n_values])


def half_spectra(correlations: Correlations, channels: tuple[Dof, ...]) -> Frf:
    """Return the half spectra of the mean correlations as responses of the channels to the references.

    An exponential window brings the correlations to 1 % at the last lag; its rate is the `decay` of the result. The white noise
    of the channels lies in lag 0, which is left out.
    """
    mean = correlations.mean
    count = mean.shape[0]
    decay = -np.log(HALF_SPECTRUM_END) / (count * correlations.interval)
    time = np.arange(count) * correlations.interval
    values = mean * np.exp(-decay * time)[:, None, None]
    values[0] = 0.0
    spectrum = fft.rfft(values, 2 * count, axis=0) * correlations.interval
    frequency = np.arange(count + 1) / (2 * count * correlations.interval)
    return Frf(frequency[1:], spectrum[1:], channels, tuple(channels[k] for k in correlations.references), "receptance",
               decay=decay)
