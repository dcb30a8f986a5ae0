"""Values between the lines of a measured response: the polynomial through the four nearest."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray


def interpolate(line: FloatArray, values: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the polynomial through the four nearest lines (all where fewer) at f, shape (n, d, d).

    line : (n_f,) increasing, Hz; values : (n_f, d, d); f : (n,) Hz.
    """
    lines, weight = interpolation(line, f)
    return np.einsum("nw,nwab->nab", weight, values[lines])


def interpolation(line: FloatArray, f: FloatArray) -> tuple[Array, FloatArray]:
    """Return the indices (n, 4) of the lines nearest to every f, and their weights (n, 4) in the polynomial through them."""
    width = min(4, line.size)
    first = np.clip(np.searchsorted(line, f) - width // 2, 0, line.size - width)
    lines = first[:, None] + np.arange(width)
    x = line[lines]
    weight = np.ones((f.size, width))
    # Lagrange's form, as the weights do not depend on the values: noise goes through them too.
    for i in range(width):
        for j in range(width):
            if i != j:
                weight[:, i] *= (f - x[:, j]) / (x[:, i] - x[:, j])
    return lines, weight
