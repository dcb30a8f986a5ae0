"""Textures as cubic splines: the coefficients are the truth, so a moved texture is known exactly between pixels.

There are two coefficients a pixel each way: with one, what a cubic spline holds above the camera's limit would be seen as
a motion that is 0.7 % too small.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

from toolpoint._check import FloatArray, positive

SPLINE_POINTS_PER_PIXEL = 2  # spline coefficients a pixel, each way


def random_texture(shape: tuple[int, int], rng: np.random.Generator, *, blur: float = 1.2, contrast: float = 35.0,
                   grey: float = 120.0) -> FloatArray:
    """Return spline coefficients (2 rows, 2 columns) of a random pattern, grey levels.

    Parameters
    ----------
    shape : rows and columns
    rng : numpy.random.Generator
    blur : float
        Standard deviation of the optical blur, pixels.
    contrast, grey : float
        Standard deviation and mean, grey levels.
    """
    size = (SPLINE_POINTS_PER_PIXEL * shape[0], SPLINE_POINTS_PER_PIXEL * shape[1])
    pattern = gaussian_filter(rng.standard_normal(size), SPLINE_POINTS_PER_PIXEL * positive("blur", blur), mode="wrap")
    pattern *= contrast / pattern.std()
    # Not to the ends of the scale: noise and motion blur on top must not clip.
    return np.clip(grey + pattern, 5.0, 250.0).astype(np.float32)


def plain(shape: tuple[int, int], grey: float = 120.0) -> FloatArray:
    """Return spline coefficients of a uniform grey, in which no motion shows."""
    return np.full((SPLINE_POINTS_PER_PIXEL * shape[0], SPLINE_POINTS_PER_PIXEL * shape[1]), grey, np.float32)
