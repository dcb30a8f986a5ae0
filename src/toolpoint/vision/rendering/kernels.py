"""Compiled rendering: each pixel takes the value of the body's spline at the material point that has moved there."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray
from toolpoint.vision.rendering.texture import SPLINE_POINTS_PER_PIXEL


@njit(cache=True, nogil=True, inline="always")
def _cubic(f: float, w: FloatArray) -> None:
    """Put the four weights of a cubic B-spline at the fraction f, 0 <= f < 1, into w (4,) float32."""
    g = 1.0 - f
    w[0] = g * g * g / 6.0
    w[1] = (4.0 - 3.0 * f * f * (2.0 - f)) / 6.0
    w[2] = (4.0 - 3.0 * g * g * (2.0 - g)) / 6.0
    w[3] = f * f * f / 6.0


@njit(cache=True, nogil=True, fastmath=True)
def draw_body(picture: FloatArray, texture: FloatArray, cover: FloatArray, corner: IndexArray, size: IndexArray,
              centre: FloatArray, extent: float, field: FloatArray, amplitude: FloatArray) -> None:
    """Draw one body into a picture (rows, columns), float32.

    texture, cover : (h, w) float32, spline coefficients of grey and of how much of the pixel the body covers,
    `SPLINE_POINTS_PER_PIXEL` a pixel, their corner at `corner` (2,) int64 (column, row); size : (2,) int64 (columns, rows)
    drawn around it; centre : (2,) float64, pixels; extent : pixels; field : (n_modes, 2, 6) float64 displacement over
    (1, a, b, a^2, a b, b^2), a and b from `centre` in units of `extent`; amplitude : (rows of picture or 1, n_modes) float64.
    """
    rows, columns = picture.shape
    h, w = texture.shape
    n_modes = field.shape[0]
    wx, wy = np.empty(4, np.float32), np.empty(4, np.float32)
    c = np.empty((2, 6), np.float64)
    first_row, first_column = max(0, corner[1] - 4), max(0, corner[0] - 4)
    end_row, end_column = min(rows, corner[1] + size[1] + 4), min(columns, corner[0] + size[0] + 4)
    for y in range(first_row, end_row):
        # One row of amplitudes for the whole picture, or one a line: a rolling shutter exposes line after line.
        q = amplitude[min(y, amplitude.shape[0] - 1)]
        c[:] = 0.0
        for r in range(n_modes):
            for i in range(2):
                for k in range(6):
                    c[i, k] += q[r] * field[r, i, k]
        b = (y - centre[1]) / extent
        for x in range(first_column, end_column):
            a = (x - centre[0]) / extent
            # Texture point X of pixel x: X = x - d(x), with d = c (1, a, b, a^2, a b, b^2)^T by Horner's rule.
            px = SPLINE_POINTS_PER_PIXEL * (x - (c[0, 0] + a * (c[0, 1] + a * c[0, 3] + b * c[0, 4]) + b
                                                 * (c[0, 2] + b * c[0, 5])) - corner[0])
            py = SPLINE_POINTS_PER_PIXEL * (y - (c[1, 0] + a * (c[1, 1] + a * c[1, 3] + b * c[1, 4]) + b
                                                 * (c[1, 2] + b * c[1, 5])) - corner[1])
            ix, iy = int(np.floor(px)), int(np.floor(py))
            if ix < 1 or iy < 1 or ix > w - 3 or iy > h - 3:
                continue
            _cubic(px - ix, wx)
            _cubic(py - iy, wy)
            if cover[iy - 1, ix - 1] * cover[iy - 1, ix + 2] * cover[iy + 2, ix - 1] * cover[iy + 2, ix + 2] >= 1.0:
                # Coefficients are cut to 0 or 1 away from edges: four full corners mean a pixel that is covered whole.
                share = 1.0
            else:
                share = 0.0
                for j in range(4):
                    for i in range(4):
                        share += wy[j] * wx[i] * cover[iy - 1 + j, ix - 1 + i]
                if share <= 0.0:
                    continue
            grey = 0.0
            for j in range(4):
                line = texture[iy - 1 + j]
                grey += wy[j] * (wx[0] * line[ix - 1] + wx[1] * line[ix] + wx[2] * line[ix + 1] + wx[3] * line[ix + 2])
            picture[y, x] += share * (grey - picture[y, x])


@njit(cache=True, nogil=True, fastmath=True)
def expose(picture: FloatArray, noise: FloatArray, start: int, gain: np.floating[Any], white: float, out: IndexArray) -> None:
    """Round a picture to grey levels, out = floor(gain * picture + noise + 1/2) between 0 and `white`.

    picture : (rows, columns) float32; noise : pool of float32 values, read from `start` on; out : (rows, columns) uint8 or
    uint16.
    """
    rows, columns = picture.shape
    k = start
    for y in range(rows):
        for x in range(columns):
            value = np.floor(picture[y, x] * gain + noise[k] + np.float32(0.5))
            out[y, x] = min(max(value, np.float32(0.0)), np.float32(white))
            k += 1

# Code of other modules in these kernels: d5c4ba13073d
