"""Edges of the deformed machine drawn over the machine at rest, the way to show a shape on paper.

Source: Canny, IEEE PAMI 8 (1986) 679.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label, maximum_filter

from toolpoint._check import BoolArray, FloatArray

# Standard deviation of the smoothing, pixels; limits of hysteresis as shares of the slope that one pixel in twenty exceeds.
EDGE_BLUR, WEAK_SLOPE_FRACTION, STRONG_SLOPE_FRACTION = 1.6, 0.35, 0.8
REST_COLOUR, DEFORMED_COLOUR = (40, 110, 200), (220, 60, 30)  # colours of the edges, red, green, blue


def find_edges(picture: FloatArray, blur: float = EDGE_BLUR, weak_fraction: float = WEAK_SLOPE_FRACTION, *,
               strong_fraction: float = STRONG_SLOPE_FRACTION) -> BoolArray:
    """Return the edges of a picture (rows, columns), one pixel wide.

    blur : standard deviation, pixels; weak_fraction, strong_fraction : limits of hysteresis as shares of the slope that one
    pixel in twenty exceeds.
    """
    smooth = gaussian_filter(np.asarray(picture, float), blur)
    down, right = np.gradient(smooth)
    slope = np.hypot(down, right)
    # Of each picture's own slopes: light and contrast differ from clip to clip.
    level = float(np.quantile(slope, 0.95))
    if level < 0.5:
        return np.zeros(slope.shape, bool)
    ridge = slope >= _neighbour_slopes(slope, right, down)
    # Hysteresis: a weak ridge counts where it is connected with a strong one.
    strong, weak = ridge & (slope > strong_fraction * level), ridge & (slope > weak_fraction * level)
    groups, count = label(weak, np.ones((3, 3)))
    has_strong = np.zeros(count + 1, bool)
    has_strong[np.unique(groups[strong])] = True
    has_strong[0] = False
    return np.asarray(has_strong[groups])


def overlay(reference: FloatArray, deformed: FloatArray) -> NDArray[np.uint8]:
    """Return the picture at rest, faint, with its edges in blue and those of the deformed one in red, (rows, columns, 3).

    >>> picture = np.zeros((16, 16))
    >>> picture[:, 8:] = 200.0
    >>> overlay(picture, picture).shape  # rows, columns, colours
    (16, 16, 3)
    """
    grey = np.clip(np.asarray(reference, float), 0, None)
    grey = grey * (255 / max(float(grey.max()), 1.0))
    canvas = np.repeat((170 + grey[..., None] / 3), 3, axis=2).astype(np.uint8)
    blur = 4.0  # the outlines of parts, not of their texture
    for picture, colour in ((reference, REST_COLOUR), (deformed, DEFORMED_COLOUR)):
        canvas[maximum_filter(find_edges(picture, blur), 2)] = colour
    return canvas


def _neighbour_slopes(slope: FloatArray, right: FloatArray, down: FloatArray) -> FloatArray:
    """Return the larger slope of the two neighbours across each pixel's edge."""
    sector = np.round(np.arctan2(down, right) / (np.pi / 4)).astype(int) % 4
    padded = np.pad(slope, 1)
    steps = ((0, 1), (1, 1), (1, 0), (1, -1))
    rows, columns = slope.shape
    result = np.zeros_like(slope)
    for k, (dy, dx) in enumerate(steps):
        both = [padded[1 + s * dy:1 + s * dy + rows, 1 + s * dx:1 + s * dx + columns] for s in (1, -1)]
        result = np.where(sector == k, np.maximum(*both), result)
    return result
