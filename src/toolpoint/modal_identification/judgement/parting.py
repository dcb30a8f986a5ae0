"""Where synthesis and measurement part: bands in which the identified modes do not explain what was measured."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray
from toolpoint.modal_identification.band import noise_level
from toolpoint.vibration.frf import Frf

SHARE = 0.3  # of the power of the responses left unexplained, above which they part
ABOVE_NOISE = 9.0  # power of the residual over that of the noise
FEWEST = 7  # lines averaged
MOST = 3  # bands named


def parting_remarks(frf: Frf, synthesis: ComplexArray) -> list[str]:
    """Return a remark on every band (the worst three) where more than 30 % of the responses' power is left unexplained and
    stands out of the noise (third differences of the residual), with the call that looks at it alone.

    synthesis : like `frf.values`, what the modes and the terms outside the band give.
    """
    left = (frf.values - synthesis).reshape(frf.frequency.size, -1)
    if left.shape[0] < 4 * FEWEST:
        return []
    noise = float((noise_level(left.real) ** 2 + noise_level(left.imag) ** 2).sum())
    width = max(FEWEST, left.shape[0] // 200)
    residual = _smoothed((np.abs(left) ** 2).sum(axis=1), width)
    power = _smoothed((np.abs(frf.values) ** 2).reshape(left.shape).sum(axis=1), width)
    apart = (residual > SHARE * power) & (residual > ABOVE_NOISE * noise)
    runs = sorted(_runs(apart), key=lambda run: -float(residual[run].max()))
    return [_remark(frf.frequency, residual, power, run) for run in runs[:MOST]]


def _remark(frequency: FloatArray, residual: FloatArray, power: FloatArray, run: Array) -> str:
    low, high = float(frequency[run[0]]), float(frequency[run[-1]])
    top = run[int(np.argmax(residual[run]))]
    share, margin = 100 * min(residual[top] / power[top], 1.0), max(2 * (high - low), 0.05 * high)
    below, above = max(low - margin, float(frequency[0])), min(high + margin, float(frequency[-1]))
    where = f"from {low:.5g} to {high:.5g} Hz, most at {frequency[top]:.5g} Hz"
    return (f"synthesis and measurement part {where} ({share:.0f} % of the power is not explained): a mode may be missing; "
            f"identify that band alone (--band {below:.5g}:{above:.5g})")


def _smoothed(values: FloatArray, width: int) -> FloatArray:
    kernel = np.ones(width)
    return np.asarray(np.convolve(values, kernel, "same") / np.convolve(np.ones_like(values), kernel, "same"))


def _runs(mask: Array) -> list[Array]:
    """Return the places of every run of true values."""
    places = np.flatnonzero(mask)
    return [run for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if run.size]
