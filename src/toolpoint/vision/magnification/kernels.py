"""Compiled drawing of magnified frames: bodies as layers, each pixel sampled at its place before the motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from toolpoint._check import FloatArray, IndexArray


@njit(cache=True, nogil=True, inline="always", fastmath=True)
def _sample(picture: FloatArray, x: float | np.floating[Any], y: float | np.floating[Any]) -> np.float32:
    """Cubic convolution (Keys, a = -1/2) of a float32 picture; places outside are those at its edge."""
    rows, columns = picture.shape
    # Four samples each way: two columns inside the edge the window is whole, and no pixel needs a test of its own.
    ix, iy = min(max(int(x), 1), columns - 3), min(max(int(y), 1), rows - 3)
    f, e = np.float32(x) - np.float32(ix), np.float32(y) - np.float32(iy)
    f, e = min(max(f, np.float32(0)), np.float32(1)), min(max(e, np.float32(0)), np.float32(1))
    h, unit, five_halves = np.float32(0.5), np.float32(1), np.float32(2.5)
    g, d = unit - f, unit - e
    a0, a1 = -h * f * g * g, unit + f * f * (np.float32(1.5) * f - five_halves)
    a2, a3 = unit + g * g * (np.float32(1.5) * g - five_halves), -h * g * f * f
    b0, b1 = -h * e * d * d, unit + e * e * (np.float32(1.5) * e - five_halves)
    b2, b3 = unit + d * d * (np.float32(1.5) * d - five_halves), -h * d * e * e
    # Whole numbers without a sign: no check for places counted from the end. Down the columns first: four equal sums that the
    # processor forms at once.
    j, i = np.uint64(ix - 1), np.uint64(iy - 1)
    j1, j2, j3 = j + np.uint64(1), j + np.uint64(2), j + np.uint64(3)
    i1, i2, i3 = i + np.uint64(1), i + np.uint64(2), i + np.uint64(3)
    column0 = b0 * picture[i, j] + b1 * picture[i1, j] + b2 * picture[i2, j] + b3 * picture[i3, j]
    column1 = b0 * picture[i, j1] + b1 * picture[i1, j1] + b2 * picture[i2, j1] + b3 * picture[i3, j1]
    column2 = b0 * picture[i, j2] + b1 * picture[i1, j2] + b2 * picture[i2, j2] + b3 * picture[i3, j2]
    column3 = b0 * picture[i, j3] + b1 * picture[i1, j3] + b2 * picture[i2, j3] + b3 * picture[i3, j3]
    return a0 * column0 + a1 * column1 + a2 * column2 + a3 * column3


@njit(cache=True, nogil=True, inline="always", fastmath=True)
def _displacement_component(c: FloatArray, i: int, a: float, b: float) -> float:
    """Return component i of a displacement c (2, 6) over (1, a, b, a^2, a b, b^2), by Horner's rule."""
    return c[i, 0] + a * (c[i, 1] + a * c[i, 3] + b * c[i, 4]) + b * (c[i, 2] + b * c[i, 5])


@njit(cache=True, nogil=True, fastmath=True)
def draw_wall(frame: FloatArray, reference: FloatArray, wall: FloatArray, owner: IndexArray, rest_share: np.floating[Any],
              out: FloatArray) -> None:
    """Put the fixed background into `out`, out = share * reference + (1 - share) * frame; behind bodies the filled wall.

    frame, reference, wall, out : (rows, columns) float32; owner : (rows, columns) int16, see `draw_layers`.
    """
    for y in range(frame.shape[0]):
        for x in range(frame.shape[1]):
            out[y, x] = rest_share * reference[y, x] + (1 - rest_share) * frame[y, x] if owner[y, x] == -1 else wall[y, x]


@njit(cache=True, nogil=True, fastmath=True)
def draw_layers(frame: FloatArray, reference: FloatArray, fills: FloatArray, owner: IndexArray, boxes: FloatArray,
                frame_shift: FloatArray, reference_shift: FloatArray, rest_share: np.floating[Any], out: FloatArray) -> None:
    """Draw the bodies of a frame, from back to front, each moved further.

    frame, reference : (rows, columns) float32, the frame and the picture at rest; fills : (n, rows, columns) each body's
    picture at rest without those before it; owner : (rows, columns) body in front at every pixel, -1 for none, -2 for none but
    close to one, int16; boxes : (n, 4) left, top, width, height; frame_shift, reference_shift : (n, 2, 6) displacement from the
    frame and from rest over (1, a, b, a^2, a b, b^2), a and b in pixels from the box' centre; rest_share : part that is taken
    from the picture at rest; out : (rows, columns) float32, holds what is behind.
    """
    rows, columns = frame.shape
    place = np.empty((4, columns), np.float32)
    # Numbers of the same kind throughout: one of double precision would turn the whole loop into double.
    edge, half_pixel = np.float32(1), np.float32(0.5)
    for b in range(boxes.shape[0]):
        first_column, first_row, width, height = boxes[b]
        centre_x, centre_y = first_column + (width - 1) / 2.0, first_row + (height - 1) / 2.0
        c, m = reference_shift[b], frame_shift[b]
        half_side = max(width, height) / 2.0
        reach = 2.0 + max(abs(c[0, 0]), abs(c[1, 0]))
        for i in range(2):
            # No pixel farther from the body's box than its largest displacement can show it: the rest of the picture is not
            # visited.
            reach = max(reach, 2.0 + abs(c[i, 0]) + half_side * (abs(c[i, 1]) + abs(c[i, 2]))
                        + half_side * half_side * (abs(c[i, 3]) + abs(c[i, 4]) + abs(c[i, 5])))
        first_x, last_x = max(0, int(first_column - reach)), min(columns, int(first_column + width + reach) + 1)
        for y in range(max(0, int(first_row - reach)), min(rows, int(first_row + height + reach) + 1)):
            _source_places(c, m, first_x, last_x, y, centre_x, centre_y, place)
            for x in range(first_x, last_x):
                from_x, from_y = place[0, x], place[1, x]
                inside = min(min(from_x - first_column, first_column + width - 1 - from_x),
                             min(from_y - first_row, first_row + height - 1 - from_y)) + edge
                if inside <= 0.0:
                    continue
                ix, iy = min(max(int(from_x + half_pixel), 0), columns - 1), min(max(int(from_y + half_pixel), 0), rows - 1)
                # Where another body was in front in the frame, this one's grey is not in the frame: it is taken from the
                # filled picture.
                if owner[np.uint64(iy), np.uint64(ix)] != b:
                    grey = _sample(fills[b], from_x, from_y)
                else:
                    grey = np.float32(0)
                    if rest_share > 0.0:
                        grey += rest_share * _sample(reference, from_x, from_y)
                    if rest_share < 1.0:
                        grey += (np.float32(1) - rest_share) * _sample(frame, place[2, x], place[3, x])
                # The last pixel is blended, else a body that moves by parts of a pixel would have edges that jump.
                out[y, x] = grey if inside >= 1.0 else inside * grey + (edge - inside) * out[y, x]


@njit(cache=True, nogil=True, fastmath=True)
def _source_places(c: FloatArray, m: FloatArray, first_x: int, end_x: int, y: int, centre_x: float, centre_y: float,
                   place: FloatArray) -> None:
    """Put the places of a row's pixels at rest (0: right, 1: down) and in the frame (2, 3) into `place` (4, columns): a loop
    without a branch, which the processor runs several pixels at a time."""
    v = y - centre_y
    for x in range(first_x, end_x):
        u = x - centre_x
        # The displacement is written over places at rest: once more with the first try.
        p, q = u - _displacement_component(c, 0, u, v), v - _displacement_component(c, 1, u, v)
        place[0, x], place[1, x] = x - _displacement_component(c, 0, p, q), y - _displacement_component(c, 1, p, q)
        place[2, x], place[3, x] = x - _displacement_component(m, 0, p, q), y - _displacement_component(m, 1, p, q)


@njit(cache=True, nogil=True, fastmath=True)
def draw_field(frame: FloatArray, reference: FloatArray, frame_shift: FloatArray, reference_shift: FloatArray,
               rest_share: np.floating[Any], out: FloatArray) -> None:
    """Draw a frame moved by a smooth field.

    frame, reference, out : (rows, columns); frame_shift, reference_shift : (rows, columns, 2), right and down; all float32.
    """
    rows, columns = frame.shape
    for y in range(rows):
        for x in range(columns):
            # The displacement is written over places at rest: once more with the first try.
            iy = min(max(int(y - reference_shift[y, x, 1] + np.float32(0.5)), 0), rows - 1)
            ix = min(max(int(x - reference_shift[y, x, 0] + np.float32(0.5)), 0), columns - 1)
            value = np.float32(0)
            if rest_share < 1.0:
                value += (np.float32(1) - rest_share) * _sample(frame, x - frame_shift[iy, ix, 0], y - frame_shift[iy, ix, 1])
            if rest_share > 0.0:
                value += rest_share * _sample(reference, x - reference_shift[iy, ix, 0], y - reference_shift[iy, ix, 1])
            out[y, x] = value
