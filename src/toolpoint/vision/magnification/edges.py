"""Edges of the deformed machine drawn over the machine at rest: how a shape is shown on paper (the source's figure).

Source: Canny, IEEE PAMI 8 (1986) 679.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label, maximum_filter

from toolpoint._check import BoolArray, FloatArray

BLUR, LOW, HIGH = 1.6, 0.35, 0.8
REST, DEFORMED = (40, 110, 200), (220, 60, 30)


def find_edges(picture: FloatArray, blur: float = BLUR, low: float = LOW, *, high: float = HIGH) -> BoolArray:
    """Return the edges of a picture (rows, columns), one pixel wide.

    blur : standard deviation, pixels; low, high : limits of hysteresis as shares of the slope that one pixel in twenty exceeds.
    """
    smooth = gaussian_filter(np.asarray(picture, float), blur)
    down, right = np.gradient(smooth)
    slope = np.hypot(down, right)
    level = float(np.quantile(slope, 0.95))
    if level < 0.5:
        return np.zeros(slope.shape, bool)
    ridge = slope >= _beside(slope, right, down)
    strong, weak = ridge & (slope > high * level), ridge & (slope > low * level)
    groups, count = label(weak, np.ones((3, 3)))
    kept = np.zeros(count + 1, bool)
    kept[np.unique(groups[strong])] = True
    kept[0] = False
    return np.asarray(kept[groups])


def overlay(rest: FloatArray, deformed: FloatArray) -> NDArray[np.uint8]:
    """Return the picture at rest, faint, with its edges in blue and those of the deformed one in red, (rows, columns, 3)."""
    grey = np.clip(np.asarray(rest, float), 0, None)
    grey = grey * (255 / max(float(grey.max()), 1.0))
    canvas = np.repeat((170 + grey[..., None] / 3), 3, axis=2).astype(np.uint8)
    blur = 4.0  # the outlines of parts, not of their texture
    for picture, colour in ((rest, REST), (deformed, DEFORMED)):
        canvas[maximum_filter(find_edges(picture, blur), 2)] = colour
    return canvas


def _beside(slope: FloatArray, right: FloatArray, down: FloatArray) -> FloatArray:
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
