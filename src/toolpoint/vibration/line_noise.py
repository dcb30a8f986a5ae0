"""Noise of measured lines, by their scatter alone."""

from __future__ import annotations

import numpy as np

from toolpoint._check import ComplexArray, FloatArray

_LEAST_LINES = 12


def line_noise(values: ComplexArray) -> FloatArray:
    r"""Return the standard deviation (...,) of the error :math:`|e|` of lines (n_f, ...) by their scatter.

    Third differences of a smooth curve are small, of white noise :math:`E|\Delta^3 e|^2 = 20 \sigma^2`; the median over the
    lines (ln 2 times the mean for complex normal noise) leaves sharp resonances out. Zero where there are fewer than 12 lines:
    too few to tell.
    """
    if len(values) < _LEAST_LINES:
        return np.zeros(values.shape[1:])
    third = np.abs(np.diff(values, 3, axis=0)) ** 2 / 20
    return np.asarray(np.sqrt(np.median(third, axis=0) / np.log(2)))
