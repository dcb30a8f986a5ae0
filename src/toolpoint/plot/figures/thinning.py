"""Long curves for a screen: of every bin of samples the lowest and the highest are drawn, so that no peak is lost."""

from __future__ import annotations

import itertools

import numpy as np

from toolpoint._check import Array, FloatArray, IndexArray

POINTS = 1600  # more than a screen has columns


def extreme_samples(values: FloatArray, most: int = POINTS) -> IndexArray:
    """Return the places (increasing) of the lowest and highest value of each of `most`/2 equal bins; all where few."""
    count = len(values)
    if count <= most:
        return np.arange(count)
    edges = np.linspace(0, count, most // 2 + 1).astype(int)
    kept = {0, count - 1}
    for first, last in itertools.pairwise(edges):
        part = values[first:last]
        kept |= {first + int(np.argmin(part)), first + int(np.argmax(part))}
    return np.array(sorted(kept))


def thin_curve(x: Array, y: Array, most: int = POINTS) -> tuple[Array, Array]:
    """Return a curve by its extreme samples."""
    at = extreme_samples(np.asarray(y), most)
    return np.asarray(x)[at], np.asarray(y)[at]
