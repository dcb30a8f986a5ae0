"""Compiled drawing of magnified frames: bodies as layers, each pixel from where it has come."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, inline="always", fastmath=True)
def _sample(picture, x, y):
    """Cubic convolution (Keys, a = -1/2) of a float32 picture; places outside are those at its edge."""
    rows, columns = picture.shape
    ix, iy = min(max(int(x), 1), columns - 3), min(max(int(y), 1), rows - 3)
    f, e = np.float32(x) - np.float32(ix), np.float32(y) - np.float32(iy)
    f, e = min(max(f, np.float32(0)), np.float32(1)), min(max(e, np.float32(0)), np.float32(1))
    h, unit, half = np.float32(0.5), np.float32(1), np.float32(2.5)
    g, d = unit - f, unit - e
    a0, a1 = -h * f * g * g, unit + f * f * (np.float32(1.5) * f - half)
    a2, a3 = unit + g * g * (np.float32(1.5) * g - half), -h * g * f * f
    p, q, r, s = picture[iy - 1], picture[iy], picture[iy + 1], picture[iy + 2]
    first = a0 * p[ix - 1] + a1 * p[ix] + a2 * p[ix + 1] + a3 * p[ix + 2]
    second = a0 * q[ix - 1] + a1 * q[ix] + a2 * q[ix + 1] + a3 * q[ix + 2]
    third = a0 * r[ix - 1] + a1 * r[ix] + a2 * r[ix + 1] + a3 * r[ix + 2]
    fourth = a0 * s[ix - 1] + a1 * s[ix] + a2 * s[ix + 1] + a3 * s[ix + 2]
    return (-h * e * d * d * first + (unit + e * e * (np.float32(1.5) * e - half)) * second
            + (unit + d * d * (np.float32(1.5) * d - half)) * third - h * d * e * e * fourth)


@njit(cache=True, fastmath=True)
def draw_wall(frame, rest, wall, owner, share, out):
    """Put what stands still into `out` (rows, columns), float32: the frame, or the wall behind the bodies."""
    for y in range(frame.shape[0]):
        for x in range(frame.shape[1]):
            out[y, x] = share * rest[y, x] + (1 - share) * frame[y, x] if owner[y, x] == -1 else wall[y, x]


@njit(cache=True, fastmath=True)
def draw_layers(frame, rest, fills, owner, boxes, moved, moved_rest, share, out):
    """Draw the bodies of a frame, from back to front, each moved further.

    frame, rest : (rows, columns) float32, the frame and the picture at rest; fills : (n, rows, columns) each body's picture
    at rest without those before it; owner : (rows, columns) body in front at every pixel, -1 for none, -2 for none but
    close to one; boxes : (n, 4) left, top, width, height; moved, moved_rest : (n, 2, 6) displacement from the frame and from
    rest over (1, a, b, a^2, a b, b^2), a and b in pixels from the box' centre; share : part that is taken from the picture at
    rest; out : (rows, columns) float32, holds what is behind.
    """
    rows, columns = frame.shape
    for b in range(boxes.shape[0]):
        left, top, width, height = boxes[b]
        centre_x, centre_y = left + (width - 1) / 2.0, top + (height - 1) / 2.0
        c, m = moved_rest[b], moved[b]
        half = max(width, height) / 2.0
        reach = 2.0 + max(abs(c[0, 0]), abs(c[1, 0]))
        for i in range(2):
            reach = max(reach, 2.0 + abs(c[i, 0]) + half * (abs(c[i, 1]) + abs(c[i, 2]))
                        + half * half * (abs(c[i, 3]) + abs(c[i, 4]) + abs(c[i, 5])))
        first_x, last_x = max(0, int(left - reach)), min(columns, int(left + width + reach) + 1)
        for y in range(max(0, int(top - reach)), min(rows, int(top + height + reach) + 1)):
            v = y - centre_y
            for x in range(first_x, last_x):
                u = x - centre_x
                dx = c[0, 0] + u * (c[0, 1] + u * c[0, 3] + v * c[0, 4]) + v * (c[0, 2] + v * c[0, 5])
                dy = c[1, 0] + u * (c[1, 1] + u * c[1, 3] + v * c[1, 4]) + v * (c[1, 2] + v * c[1, 5])
                p, q = u - dx, v - dy
                dx = c[0, 0] + p * (c[0, 1] + p * c[0, 3] + q * c[0, 4]) + q * (c[0, 2] + q * c[0, 5])
                dy = c[1, 0] + p * (c[1, 1] + p * c[1, 3] + q * c[1, 4]) + q * (c[1, 2] + q * c[1, 5])
                from_x, from_y = x - dx, y - dy
                inside = min(min(from_x - left, left + width - 1 - from_x), min(from_y - top, top + height - 1 - from_y)) + 1.0
                if inside <= 0.0:
                    continue
                ix, iy = min(max(int(from_x + 0.5), 0), columns - 1), min(max(int(from_y + 0.5), 0), rows - 1)
                if owner[iy, ix] != b:
                    grey = _sample(fills[b], from_x, from_y)
                else:
                    grey = np.float32(0)
                    if share > 0.0:
                        grey += share * _sample(rest, from_x, from_y)
                    if share < 1.0:
                        dx = m[0, 0] + p * (m[0, 1] + p * m[0, 3] + q * m[0, 4]) + q * (m[0, 2] + q * m[0, 5])
                        dy = m[1, 0] + p * (m[1, 1] + p * m[1, 3] + q * m[1, 4]) + q * (m[1, 2] + q * m[1, 5])
                        grey += (np.float32(1) - share) * _sample(frame, x - dx, y - dy)
                out[y, x] = grey if inside >= 1.0 else inside * grey + (1.0 - inside) * out[y, x]


@njit(cache=True, fastmath=True)
def draw_field(frame, rest, shift, shift_rest, share, out):
    """Draw a frame moved by a smooth field: `shift` and `shift_rest` (rows, columns, 2), right and down; all float32."""
    rows, columns = frame.shape
    for y in range(rows):
        for x in range(columns):
            value = np.float32(0)
            if share < 1.0:
                value += (np.float32(1) - share) * _sample(frame, x - shift[y, x, 0], y - shift[y, x, 1])
            if share > 0.0:
                value += share * _sample(rest, x - shift_rest[y, x, 0], y - shift_rest[y, x, 1])
            out[y, x] = value
