"""Compiled drawing of magnified frames: bodies as layers, each pixel from where it has come."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, inline="always", fastmath=True)
def _weights(f, w):
    """Weights of cubic convolution (Keys, a = -1/2)."""
    g = 1.0 - f
    w[0] = -0.5 * f * g * g
    w[1] = 1.0 + f * f * (1.5 * f - 2.5)
    w[2] = 1.0 + g * g * (1.5 * g - 2.5)
    w[3] = -0.5 * g * f * f


@njit(cache=True, inline="always", fastmath=True)
def _sample(picture, x, y, wx, wy):
    rows, columns = picture.shape
    ix, iy = int(np.floor(x)), int(np.floor(y))
    ix, iy = min(max(ix, 1), columns - 3), min(max(iy, 1), rows - 3)
    _weights(min(max(x - ix, 0.0), 1.0), wx)
    _weights(min(max(y - iy, 0.0), 1.0), wy)
    total = 0.0
    for j in range(4):
        line = picture[iy - 1 + j]
        total += wy[j] * (wx[0] * line[ix - 1] + wx[1] * line[ix] + wx[2] * line[ix + 1] + wx[3] * line[ix + 2])
    return total


@njit(cache=True, fastmath=True)
def draw_layers(frame, rest, wall, fills, owner, boxes, moved, moved_rest, share, out):
    """Draw a frame with its bodies moved further.

    frame : (rows, columns) grey levels; rest : the picture at rest, float32; wall : the picture at rest without bodies;
    fills : (n, rows, columns) each body's picture at rest without those before it; owner : (rows, columns) body in front at
    every pixel, -1 for none, -2 for none but close to one; boxes : (n, 4) left, top, width, height, from back to front;
    moved, moved_rest : (n, 2, 6) displacement from the frame and from rest over (1, a, b, a^2, a b, b^2), a and b in pixels
    from the box' centre; share : part that is taken from the picture at rest; out : (rows, columns) uint8 or uint16.
    """
    rows, columns = frame.shape
    count = boxes.shape[0]
    wx, wy = np.empty(4), np.empty(4)
    reach = np.empty(count)
    for b in range(count):
        half = max(boxes[b, 2], boxes[b, 3]) / 2.0
        top = 0.0
        for i in range(2):
            m = moved[b, i]
            top = max(top, abs(moved_rest[b, i, 0]) + half * (abs(moved_rest[b, i, 1]) + abs(moved_rest[b, i, 2])), abs(m[0])
                      + half * (abs(m[1]) + abs(m[2])))
        reach[b] = top + 2.0
    white = 65535.0 if out.itemsize == 2 else 255.0
    for y in range(rows):
        for x in range(columns):
            value, left = 0.0, 1.0
            for k in range(count):
                b = count - 1 - k
                r = reach[b]
                if x < boxes[b, 0] - r or x > boxes[b, 0] + boxes[b, 2] + r:
                    continue
                if y < boxes[b, 1] - r or y > boxes[b, 1] + boxes[b, 3] + r:
                    continue
                cx, cy = boxes[b, 0] + (boxes[b, 2] - 1) / 2.0, boxes[b, 1] + (boxes[b, 3] - 1) / 2.0
                ax, ay = x - cx, y - cy
                dx, dy = _motion(moved_rest, b, ax, ay)
                dx, dy = _motion(moved_rest, b, ax - dx, ay - dy)
                px, py = x - dx, y - dy
                inside = min(min(px - boxes[b, 0], boxes[b, 0] + boxes[b, 2] - 1 - px),
                             min(py - boxes[b, 1], boxes[b, 1] + boxes[b, 3] - 1 - py)) + 1.0
                if inside <= 0.0:
                    continue
                cover = min(1.0, inside) * left
                ix, iy = int(px + 0.5), int(py + 0.5)
                ix, iy = min(max(ix, 0), columns - 1), min(max(iy, 0), rows - 1)
                if owner[iy, ix] == b:
                    grey = share * _sample(rest, px, py, wx, wy) if share > 0.0 else 0.0
                    if share < 1.0:
                        ex, ey = _motion(moved, b, ax - dx, ay - dy)
                        grey += (1.0 - share) * _sample(frame, x - ex, y - ey, wx, wy)
                else:
                    grey = _sample(fills[b], px, py, wx, wy)
                value += cover * grey
                left -= cover
                if left < 0.01:
                    break
            if left >= 0.01:
                if owner[y, x] == -1:
                    value += left * (share * rest[y, x] + (1.0 - share) * frame[y, x])
                else:
                    value += left * wall[y, x]
            else:
                value /= 1.0 - left
            out[y, x] = min(max(value + 0.5, 0.0), white)


@njit(cache=True, inline="always", fastmath=True)
def _motion(field, b, ax, ay):
    c = field[b]
    dx = c[0, 0] + ax * (c[0, 1] + ax * c[0, 3] + ay * c[0, 4]) + ay * (c[0, 2] + ay * c[0, 5])
    dy = c[1, 0] + ax * (c[1, 1] + ax * c[1, 3] + ay * c[1, 4]) + ay * (c[1, 2] + ay * c[1, 5])
    return dx, dy


@njit(cache=True, fastmath=True)
def draw_field(frame, rest, shift, shift_rest, share, out):
    """Draw a frame moved by a smooth field: `shift` and `shift_rest` (rows, columns, 2), pixels, right and down."""
    rows, columns = frame.shape
    wx, wy = np.empty(4), np.empty(4)
    white = 65535.0 if out.itemsize == 2 else 255.0
    for y in range(rows):
        for x in range(columns):
            value = 0.0
            if share < 1.0:
                value += (1.0 - share) * _sample(frame, x - shift[y, x, 0], y - shift[y, x, 1], wx, wy)
            if share > 0.0:
                value += share * _sample(rest, x - shift_rest[y, x, 0], y - shift_rest[y, x, 1], wx, wy)
            out[y, x] = min(max(value + 0.5, 0.0), white)
