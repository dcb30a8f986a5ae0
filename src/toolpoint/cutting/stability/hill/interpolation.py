"""Values between the lines of a measured response: the polynomial through the four nearest."""

from __future__ import annotations

import numpy as np

from toolpoint._check import Array, ComplexArray, FloatArray


def interpolate(line: FloatArray, values: ComplexArray, f: FloatArray) -> ComplexArray:
    """Return the value at f of the polynomial through the four (or all) nearest lines, shape (n, ...)."""
    lines, weight = interpolation(line, f)
    return np.einsum("nw,nwab->nab", weight, values[lines])


def interpolation(line: FloatArray, f: FloatArray) -> tuple[Array, FloatArray]:
    """Return the four (or all) lines nearest to every f, shape (n, 4), and their weights in the polynomial through them."""
    width = min(4, line.size)
    first = np.clip(np.searchsorted(line, f) - width // 2, 0, line.size - width)
    lines = first[:, None] + np.arange(width)
    x = line[lines]
    weight = np.ones((f.size, width))
    for i in range(width):
        for j in range(width):
            if i != j:
                weight[:, i] *= (f - x[:, j]) / (x[:, i] - x[:, j])
    return lines, weight
