"""Noise of measured lines from their scatter."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray

_MIN_SCATTER_LINES = 12  # below, the median of nine differences or fewer is no estimate


def line_noise(values: ComplexArray) -> FloatArray:
    r"""Return the standard deviation (...,) of the error :math:`|e|` of lines (n_f, ...) by their scatter.

    Third differences of a smooth curve are small, of white noise :math:`E|\Delta^3 e|^2 = 20 \sigma^2`; the median over the
    lines (ln 2 times the mean for complex normal noise) leaves sharp resonances out. Zero where there are fewer than 12 lines:
    too few to tell.
    """
    if len(values) < _MIN_SCATTER_LINES:
        return np.zeros(values.shape[1:])
    third_differences = np.abs(np.diff(values, 3, axis=0)) ** 2 / 20
    return np.asarray(np.sqrt(np.median(third_differences, axis=0) / np.log(2)))
