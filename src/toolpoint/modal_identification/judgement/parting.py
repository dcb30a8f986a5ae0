"""Bands in which the identified modes do not explain the measured responses."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.modal_identification.band import noise_level
from toolpoint.vibration.frf import Frf

MAX_UNEXPLAINED_POWER = 0.3  # of the power of the responses
MIN_RESIDUAL_TO_NOISE = 9.0  # powers
MIN_AVERAGED_LINES = 7
MAX_NAMED_BANDS = 3


def parting_remarks(frf: Frf, synthesis: ComplexArray) -> list[str]:
    """Return a remark on the worst three bands where more than 30 % of the responses' power is unexplained, above the noise.

    Each remark has the call that identifies the band alone. synthesis : like `frf.values`, the response of the modes and of the
    terms outside the band.
    """
    misfit = (frf.values - synthesis).reshape(frf.frequency.size, -1)
    if misfit.shape[0] < 4 * MIN_AVERAGED_LINES:
        return []
    noise = float((noise_level(misfit.real) ** 2 + noise_level(misfit.imag) ** 2).sum())
    width = max(MIN_AVERAGED_LINES, misfit.shape[0] // 200)
    residual = _smooth((np.abs(misfit) ** 2).sum(axis=1), width)
    power = _smooth((np.abs(frf.values) ** 2).reshape(misfit.shape).sum(axis=1), width)
    is_unexplained = (residual > MAX_UNEXPLAINED_POWER * power) & (residual > MIN_RESIDUAL_TO_NOISE * noise)
    runs = sorted(_runs(is_unexplained), key=lambda run: -float(residual[run].max()))
    return [_remark(frf.frequency, residual, power, run) for run in runs[:MAX_NAMED_BANDS]]


def _remark(frequency: FloatArray, residual: FloatArray, power: FloatArray, run: Array) -> str:
    """Return the remark on one run of lines: its ends (Hz), the unexplained power, the call for this band alone."""
    lower, upper = float(frequency[run[0]]), float(frequency[run[-1]])
    peak = run[int(np.argmax(residual[run]))]
    share, margin = 100 * min(residual[peak] / power[peak], 1.0), max(2 * (upper - lower), 0.05 * upper)
    band_min, band_max = max(lower - margin, float(frequency[0])), min(upper + margin, float(frequency[-1]))
    place = f"from {lower:.5g} to {upper:.5g} Hz, most at {frequency[peak]:.5g} Hz"
    return (f"synthesis and measurement part {place} ({share:.0f} % of the power is not explained): a mode may be missing; "
            f"identify that band alone (--band {band_min:.5g}:{band_max:.5g})")


def _smooth(values: FloatArray, width: int) -> FloatArray:
    """Return the mean of values over `width` lines about each; over fewer at the ends."""
    kernel = np.ones(width)
    return np.asarray(np.convolve(values, kernel, "same") / np.convolve(np.ones_like(values), kernel, "same"))


def _runs(mask: Array) -> list[Array]:
    """Return the places of every run of true values."""
    places = np.flatnonzero(mask)
    return [run for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if run.size]
