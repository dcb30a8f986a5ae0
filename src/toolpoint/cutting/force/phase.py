r"""Phases of the force records of a cutting test: the angle of tooth 0 at the first sample, from the forces alone."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.cut.tool import Tool


def record_phases(model: FloatArray, data: FloatArray, tool: Tool, *, reference: int) -> FloatArray:
    """Return the rotation of tooth 0 at the first sample of every record, rad, to the nearest sample.

    The reference record is laid over the model at every sample of one tooth period (of a revolution for unequal pitch), the
    coefficients solved for each; the best one gives the coefficients and its phase. The other records are found by circular
    correlation with that model, and among the teeth of a regular tool by what run-out adds to every record alike.

    Parameters
    ----------
    model : (n, n_angle, d, p) floats
        Forces per unit of each coefficient without run-out, equal steps over a revolution.
    data : (n, n_angle, d) floats
        N.
    tool : Tool
    reference : int
        The record that is laid first, best the one of the largest feed.
    """
    n, steps, _, p = model.shape
    repeats = tool.teeth if tool.is_regular else 1
    period = int(np.ceil(steps / repeats))
    phase = model[reference].reshape(steps, -1, p)
    fits = [np.linalg.lstsq(np.roll(phase, -k, axis=0).reshape(-1, p), data[reference].ravel(), rcond=None)[0]
            for k in range(period)]
    misfit = [float(np.sum((np.roll(phase, -k, axis=0) @ x - data[reference]) ** 2)) for k, x in enumerate(fits)]
    best = int(np.argmin(misfit))
    expected = model @ fits[best]
    shift = np.empty(n, int)
    for i in range(n):
        shift[i] = best if i == reference else int(np.argmax(_correlation(expected[i], data[i])[:period]))
    residuals = [np.roll(data[i], shift[i], axis=0) - expected[i] for i in range(n)]
    for i in range(n):
        if i != reference and repeats > 1:
            correlation = _correlation(residuals[reference], residuals[i])
            turns = np.round(np.arange(repeats) * steps / repeats).astype(int)
            shift[i] += turns[int(np.argmax(correlation[turns % steps]))]
    return 2 * np.pi * (shift % steps) / steps


def _correlation(expected: FloatArray, data: FloatArray) -> FloatArray:
    """Return the circular correlation of data with the expected course rolled by -k samples, for every k, summed over
    directions."""
    a, b = np.fft.rfft(expected, axis=0), np.fft.rfft(data, axis=0)
    return np.fft.irfft((a * b.conj()).sum(1), expected.shape[0])
