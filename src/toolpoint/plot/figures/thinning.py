"""Thinning of long curves for a screen: the lowest and the highest sample of every bin are drawn, so that no peak is lost."""

from __future__ import annotations

import itertools

import numpy as np

from toolpoint._check import Array, FloatArray, IndexArray

MAX_CURVE_SAMPLES = 1600  # drawn samples of a curve: more than a screen has columns


def extreme_samples(values: FloatArray, max_samples: int = MAX_CURVE_SAMPLES) -> IndexArray:
    """Return increasing indices of the samples to draw: all, or the extremes of bins where there are more than `max_samples`.

    Each of `max_samples` / 2 bins of equal length gives its lowest and its highest sample. The first and the last sample are
    always among them.
    """
    count = len(values)
    if count <= max_samples:
        return np.arange(count)
    edges = np.linspace(0, count, max_samples // 2 + 1).astype(int)
    kept = {0, count - 1}
    for first, last in itertools.pairwise(edges):
        part = values[first:last]
        kept |= {first + int(np.argmin(part)), first + int(np.argmax(part))}
    return np.array(sorted(kept))


def thin_curve(x: Array, y: Array, max_samples: int = MAX_CURVE_SAMPLES) -> tuple[Array, Array]:
    """Return the drawn samples of a curve, x and y (n,): the extremes of y (`extreme_samples`)."""
    drawn = extreme_samples(np.asarray(y), max_samples)
    return np.asarray(x)[drawn], np.asarray(y)[drawn]
