"""Compiled passes over frames: block means, differences, template products, Lucas-Kanade steps."""

from __future__ import annotations

import numpy as np
from numba import njit

from toolpoint._check import Array, BoolArray, FloatArray, IndexArray
from toolpoint.vision.displacement.phase_arrays import PhaseFilter, PhaseWindows

LANCZOS_TAPS = 8  # samples of the Lanczos kernel, each way


@njit(cache=True, nogil=True)
def sum_blocks(frames: Array, side: int, means: FloatArray, extremes: IndexArray, white: int) -> None:
    """Put the mean of every block (side x side) into `means`, and count black and white pixels of every eighth frame.

    frames : (n, rows, columns) uint8 or uint16; means : (n, rows // side, columns // side) float32; extremes : (rows, columns)
    int32; white : largest grey level.
    """
    n, rows, columns = frames.shape
    height, width = means.shape[1], means.shape[2]
    # Levels change from frame to frame by noise: a pixel counts as clipped at the ends of the scale only.
    for t in range(n):
        for by in range(height):
            for bx in range(width):
                total = 0
                for y in range(by * side, (by + 1) * side):
                    line = frames[t, y]
                    part = 0
                    for x in range(bx * side, (bx + 1) * side):
                        part += line[x]
                    total += part
                means[t, by, bx] = total / (side * side)
    for y in range(rows):
        for x in range(columns):
            # Clipping lasts as long as the light does: every eighth frame tells it at an eighth of the time.
            for t in range(0, n, 8):
                value = frames[t, y, x]
                if value == 0 or value == white:
                    extremes[y, x] += 1


@njit(cache=True, nogil=True)
def add_differences(previous_frame: FloatArray, frame: Array, next_frame: FloatArray, sums: FloatArray) -> None:
    """Add a frame's changes to sums (4, rows, columns), all float32.

    Squares of its change, products of its two changes, products with the change of the pixel to the left, fourth powers.
    """
    rows, columns = frame.shape
    for y in range(rows):
        for x in range(columns):
            change, next_change = frame[y, x] - previous_frame[y, x], next_frame[y, x] - frame[y, x]
            sums[0, y, x] += change * change
            sums[1, y, x] += change * next_change
            sums[3, y, x] += change * change * change * change
            if x > 0:
                sums[2, y, x] += change * (frame[y, x - 1] - previous_frame[y, x - 1])


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _product(frame: Array, template: FloatArray, first_row: int, first_column: int, sums: FloatArray) -> tuple[np.float32,
             np.float32]:
    """Return the products of a window of a frame (rows, columns) with two templates (2, h, w) float32; sums : (2, w) float32.

    d_i = sum over y, x of template[i, y, x] frame[first_row + y, first_column + x].
    """
    # Sums by column, added up at the end: so the loop over a row runs in full vectors, whatever the width.
    width = template.shape[2]
    sums[:] = 0.0
    for y in range(template.shape[1]):
        line, row_template, column_template = frame[first_row + y], template[0, y], template[1, y]
        for x in range(width):
            value = np.float32(line[first_column + x])
            sums[0, x] += row_template[x] * value
            sums[1, x] += column_template[x] * value
    total_x, total_y = np.float32(0.0), np.float32(0.0)
    for x in range(width):
        total_x += sums[0, x]
        total_y += sums[1, x]
    return total_x, total_y


@njit(cache=True, nogil=True)
def track(frames: Array, corners: IndexArray, templates: FloatArray, ready: IndexArray, step: int, reach: float,
          edges: BoolArray, normal: FloatArray, state: FloatArray, result: FloatArray, lost_frames: IndexArray) -> None:
    """Track windows by template products.

    corners : (n_points, 2) int64, first row and column; templates : (n_points, step, step, 2, h, w) float32 for the texture
    moved by (i, j)/step pixels down and right; ready : (step, step) int8, 1 for those that are built, 0 else, made 2 where one
    was needed; reach : largest distance from a template that counts, pixels; edges : (n_points,) bool, windows that see along
    `normal` (n_points, 2) only; state : (n_points, 2) float64, last displacement (right, down); result : (n, n_points, 2)
    float32; lost_frames : (n_points,) int64, frames without a settled place.

    d = (i, j) / step + P I, with P the templates of the texture at (i, j) / step and I the pixels of the window there.
    """
    n, rows, columns = frames.shape
    height, width = templates.shape[4], templates.shape[5]
    sums = np.zeros((2, width), np.float32)
    for p in range(corners.shape[0]):
        right, down = state[p, 0], state[p, 1]
        for t in range(n):
            settled = False
            # A place settles in two or three templates; more mean that the texture is not that of the window any more.
            for _ in range(6):
                i, j = int(np.floor(down * step + 0.5)), int(np.floor(right * step + 0.5))
                whole_y, whole_x = i // step, j // step
                first_row, first_column = corners[p, 0] + whole_y, corners[p, 1] + whole_x
                if first_row < 0 or first_column < 0 or first_row + height > rows or first_column + width > columns:
                    break
                row, column = i - whole_y * step, j - whole_x * step
                if ready[row, column] != 1:
                    # Templates are built outside, where they are asked for: most windows need a few of the many subpixel
                    # places.
                    ready[row, column] = 2
                    break
                dx, dy = _product(frames[t], templates[p, row, column], first_row, first_column, sums)
                right, down = j / step + dx, i / step + dy
                if edges[p]:  # across the normal nothing is known: it must not wander
                    along = right * normal[p, 0] + down * normal[p, 1]
                    right, down = along * normal[p, 0], along * normal[p, 1]
                if abs(dx) <= reach and abs(dy) <= reach:
                    settled = True
                    break
            if not settled:
                lost_frames[p] += 1
                right, down = state[p, 0], state[p, 1]
            result[t, p, 0], result[t, p, 1] = right, down
            state[p, 0], state[p, 1] = right, down


@njit(cache=True, nogil=True, fastmath=True)
def follow(frames: Array, corners: IndexArray, texture: FloatArray, slopes: FloatArray, inverse: FloatArray,
           tolerance: float, state: FloatArray, result: FloatArray, lost_frames: IndexArray) -> None:
    """Track windows by Lucas-Kanade steps, inverse compositional, on frames interpolated by a Lanczos kernel of eight taps.

    texture : (n_points, h, w) of the reference, float32; slopes : (n_points, 2, h, w) float32; inverse : (n_points, 2, 2) of
    the Gauss-Newton matrix; the other arguments as in `track`.

    d <- d - H^-1 sum of g (I(x + d) - T), H = sum of g g^T, with the slopes g of the reference T.
    """
    n, rows, columns = frames.shape
    height, width = texture.shape[1], texture.shape[2]
    wx, wy = np.empty(LANCZOS_TAPS, np.float32), np.empty(LANCZOS_TAPS, np.float32)
    lines = np.empty((height + LANCZOS_TAPS, width), np.float32)
    for p in range(corners.shape[0]):
        right, down = state[p, 0], state[p, 1]
        for t in range(n):
            settled = False
            # Far from the reference each step gains a digit or so; twenty without an end mean that the window has lost its
            # texture.
            for _ in range(20):
                whole_y, whole_x = int(np.floor(down)), int(np.floor(right))
                first_row, first_column = (corners[p, 0] + whole_y - LANCZOS_TAPS // 2 + 1,
                                           corners[p, 1] + whole_x - LANCZOS_TAPS // 2 + 1)
                if (first_row < 0 or first_column < 0 or first_row + height + LANCZOS_TAPS > rows
                        or first_column + width + LANCZOS_TAPS > columns):
                    break
                _lanczos(right - whole_x, wx)
                _lanczos(down - whole_y, wy)
                # Lanczos's kernel is a product: along rows once, kept in `lines`, then along columns.
                for y in range(height + LANCZOS_TAPS - 1):
                    line = frames[t, first_row + y]
                    for x in range(width):
                        total = np.float32(0.0)
                        for k in range(LANCZOS_TAPS):
                            total += wx[k] * np.float32(line[first_column + x + k])
                        lines[y, x] = total
                gx, gy = np.float32(0.0), np.float32(0.0)
                for y in range(height):
                    for x in range(width):
                        total = -texture[p, y, x]
                        for k in range(LANCZOS_TAPS):
                            total += wy[k] * lines[y + k, x]
                        gx += slopes[p, 0, y, x] * total
                        gy += slopes[p, 1, y, x] * total
                # Slopes are the reference's, so the Gauss-Newton matrix is inverted once for all frames; the step is undone.
                dx = inverse[p, 0, 0] * gx + inverse[p, 0, 1] * gy
                dy = inverse[p, 1, 0] * gx + inverse[p, 1, 1] * gy
                right, down = right - dx, down - dy
                if abs(dx) < tolerance and abs(dy) < tolerance:
                    settled = True
                    break
            if not settled:
                lost_frames[p] += 1
                right, down = state[p, 0], state[p, 1]
            result[t, p, 0], result[t, p, 1] = right, down
            state[p, 0], state[p, 1] = right, down


@njit(cache=True, nogil=True)
def _lanczos(f: float, w: FloatArray) -> None:
    """Put the weights of a Lanczos kernel at f, 0 <= f < 1, into w; their sum is one."""
    total = 0.0
    half = LANCZOS_TAPS // 2
    for k in range(LANCZOS_TAPS):
        s = np.pi * (f - (k - half + 1))
        value = 1.0 if abs(s) < 1e-9 else half * np.sin(s) * np.sin(s / half) / (s * s)
        w[k] = value
        total += value
    for k in range(LANCZOS_TAPS):
        # Lanczos weights sum to one within a per cent only: uncorrected, the grey level would change with the fraction of a
        # pixel.
        w[k] /= total


@njit(cache=True, nogil=True, fastmath=True)
def filter_window(frame: Array, first_row: int, first_column: int, size: int, stride: int, wave_re: FloatArray,
                  wave_im: FloatArray, bell: FloatArray, across: bool, lines_re: FloatArray, lines_im: FloatArray,
                  out: FloatArray) -> None:
    """Put the complex band-pass of a window into `out` (2, rows, columns), every `stride` pixels.

    wave : (m,) complex weights along the columns (across: along the rows), bell : (m,) weights the other way; the window
    begins at (first_row, first_column) and its filters reach m // 2 pixels beyond it.
    """
    m = wave_re.size
    half = m // 2
    filter_count = (size + stride - 1) // stride
    if across:
        for y in range(filter_count):
            for x in range(size + 2 * half):
                re, im = np.float32(0.0), np.float32(0.0)
                for k in range(m):
                    value = np.float32(frame[first_row + y * stride + k - half, first_column + x - half])
                    re += wave_re[k] * value
                    im += wave_im[k] * value
                lines_re[y, x], lines_im[y, x] = re, im
        for y in range(filter_count):
            for x in range(filter_count):
                re, im = np.float32(0.0), np.float32(0.0)
                for k in range(m):
                    re += bell[k] * lines_re[y, x * stride + k]
                    im += bell[k] * lines_im[y, x * stride + k]
                out[0, y, x], out[1, y, x] = re, im
        return
    for y in range(filter_count):
        for x in range(size + 2 * half):
            total = np.float32(0.0)
            for k in range(m):
                total += bell[k] * np.float32(frame[first_row + y * stride + k - half, first_column + x - half])
            lines_re[y, x] = total
        for x in range(filter_count):
            re, im = np.float32(0.0), np.float32(0.0)
            for k in range(m):
                re += wave_re[k] * lines_re[y, x * stride + k]
                im += wave_im[k] * lines_re[y, x * stride + k]
            out[0, y, x], out[1, y, x] = re, im


@njit(cache=True, nogil=True)
def follow_phase(frames: Array, corners: IndexArray, side: int, stride: int, wave: PhaseFilter, windows: PhaseWindows,
                 result: FloatArray) -> None:
    """Displacement of windows (`PhaseWindows`) from their local phase, unwrapped in time, by a filter (`PhaseFilter`).

    The phases of the last frame and the turns since the first are kept in the windows.
    """
    (wave_re, wave_im, bell), (reference_bands, slopes, inverse, last, turns) = wave, windows
    m = wave_re.size
    filter_count = reference_bands.shape[3]
    lines_re = np.empty((filter_count, side + m), np.float32)
    lines_im = np.empty((filter_count, side + m), np.float32)
    out = np.empty((2, filter_count, filter_count), np.float32)
    for p in range(corners.shape[0]):
        for t in range(frames.shape[0]):
            gx, gy = 0.0, 0.0
            for o in range(2):
                filter_window(frames[t], corners[p, 0], corners[p, 1], side, stride, wave_re, wave_im, bell, o == 1, lines_re,
                              lines_im, out)
                for y in range(filter_count):
                    for x in range(filter_count):
                        a, b = reference_bands[p, o, 0, y, x], reference_bands[p, o, 1, y, x]
                        re, im = out[0, y, x] * a + out[1, y, x] * b, out[1, y, x] * a - out[0, y, x] * b
                        phase = np.arctan2(im, re)
                        # Phases are turned by whole turns as they go: a motion of more than half a wave between two frames
                        # is the limit.
                        step = phase - last[p, o, y, x]
                        if step > np.pi:
                            turns[p, o, y, x] -= 1
                        elif step < -np.pi:
                            turns[p, o, y, x] += 1
                        last[p, o, y, x] = phase
                        # Weights are of the reference alone: a weight of the frame would change with its light and pull on
                        # the result.
                        amplitude = a * a + b * b
                        weighted_phase = amplitude * (phase + 2 * np.pi * turns[p, o, y, x])
                        gx += slopes[p, o, 0, y, x] * weighted_phase
                        gy += slopes[p, o, 1, y, x] * weighted_phase
            result[t, p, 0] = inverse[p, 0, 0] * gx + inverse[p, 0, 1] * gy
            result[t, p, 1] = inverse[p, 1, 0] * gx + inverse[p, 1, 1] * gy


@njit(cache=True, nogil=True, fastmath=True)
def add_projection(frames: Array, weights: FloatArray, total: FloatArray) -> None:
    """Add frames times weights to `total`, total_k += sum over t of weight_kt frame_t.

    frames : (n, rows, columns) uint8 or uint16; weights : (k, n) float32; total : (k, rows, columns) float32.
    """
    n, rows, columns = frames.shape
    for y in range(rows):
        for k in range(weights.shape[0]):
            line = total[k, y]
            for t in range(n):
                weight, values = weights[k, t], frames[t, y]
                for x in range(columns):
                    line[x] += weight * np.float32(values[x])
