r"""Compiled signed distance from an end mill as a body of revolution, and the least one over a small step of its motion.

The mill is convex, so that its distance is a convex function of the place; over a step in which the tool moves straight and its
axis turns a little, the distance at a place is nearly convex in the share u of the step, and its least value is bisected.
Columns of a row of a motion: tip at both ends (m), axis at both ends (unit vectors, from the tip upwards), index of the tool's
shape.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit

from toolpoint._kernel_options import BORROWS

MOTION_WIDTH = 13  # numbers of a row
_STEP_BISECTIONS = 16  # halvings of a step: below 2e-5 of it
_FLAT_SLOPE = 1e-13  # m over a step: less is rounding
_MIN_RADIUS = 1e-12  # m, from the axis: nearer places have no direction across it


@njit(cache=True, nogil=True, inline="always")
def meridian_distance(radius, height, shape):
    """Return the signed distance (m) of a place from the mill's meridian and its normal, outwards and upwards.

    radius, height : m, from the axis and above the tip; shape : flat, corner, sine and cosine of the taper, upper radius, upper
    end.
    """
    flat, corner, sine, cosine, upper_radius, upper_end = shape[0], shape[1], shape[2], shape[3], shape[4], shape[5]
    across, up = radius - flat, height - corner
    along_wall = across * sine + up * cosine
    if across > 0.0 and along_wall < 0.0:
        size = math.hypot(across, up)
        return (size - corner, across / size, up / size) if size > 0.0 else (-corner, 0.0, -1.0)
    over_radius, above = radius - upper_radius, height - upper_end
    if above > 0.0 and over_radius > 0.0 and over_radius * sine + above * cosine > 0.0:
        size = math.hypot(over_radius, above)
        return size, over_radius / size, above / size
    if radius <= flat and height <= 0.0:
        return -height, 0.0, -1.0
    if above > 0.0 and over_radius <= 0.0:
        return above, 0.0, 1.0
    wall = across * cosine - up * sine - corner
    if wall >= -height and wall >= above:
        return wall, cosine, -sine
    return (-height, 0.0, -1.0) if -height >= above else (above, 0.0, 1.0)


@njit(cache=True, nogil=True, inline="always")
def axis_at(row, share):
    """Return the unit axis at a share of a step."""
    x = row[6] + share * (row[9] - row[6])
    y = row[7] + share * (row[10] - row[7])
    z = row[8] + share * (row[11] - row[8])
    size = math.sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


@njit(cache=True, nogil=True, **BORROWS)
def distance_at(row, shape, share, place):
    """Return the distance (m) of a place from the tool at a share of a step, its slope over the share (m), and its gradient."""
    ax, ay, az = axis_at(row, share)
    rx = place[0] - row[0] - share * (row[3] - row[0])
    ry = place[1] - row[1] - share * (row[4] - row[1])
    rz = place[2] - row[2] - share * (row[5] - row[2])
    height = rx * ax + ry * ay + rz * az
    px, py, pz = rx - height * ax, ry - height * ay, rz - height * az
    radius = math.sqrt(px * px + py * py + pz * pz)
    distance, outward, upward = meridian_distance(radius, height, shape)
    factor = outward / radius if radius > _MIN_RADIUS else 0.0
    gx, gy, gz = factor * px + upward * ax, factor * py + upward * ay, factor * pz + upward * az
    # The tool's frame turns by a x a'; the place moves against it.
    tx, ty, tz = row[9] - row[6], row[10] - row[7], row[11] - row[8]
    along = tx * ax + ty * ay + tz * az
    tx, ty, tz = tx - along * ax, ty - along * ay, tz - along * az
    swing = rx * tx + ry * ty + rz * tz  # (a x a') x r = a' (a.r) - a (a'.r)
    vx = row[3] - row[0] + tx * height - ax * swing
    vy = row[4] - row[1] + ty * height - ay * swing
    vz = row[5] - row[2] + tz * height - az * swing
    return distance, -(gx * vx + gy * vy + gz * vz), (gx, gy, gz)


@njit(cache=True, nogil=True, **BORROWS)
def swept_distance(row, shape, place):
    """Return the least distance (m) of a place from the tool over a step, the share where it is, and its gradient."""
    distance, slope, gradient = distance_at(row, shape, 0.0, place)
    if slope >= -_FLAT_SLOPE:
        return distance, 0.0, gradient
    last, slope, last_gradient = distance_at(row, shape, 1.0, place)
    if slope <= _FLAT_SLOPE:
        return last, 1.0, last_gradient
    share, lower, upper = 0.0, 0.0, 1.0
    if last < distance:
        distance, share, gradient = last, 1.0, last_gradient
    for _ in range(_STEP_BISECTIONS):
        middle = 0.5 * (lower + upper)
        new_distance, slope, new_gradient = distance_at(row, shape, middle, place)
        if new_distance < distance:
            distance, share, gradient = new_distance, middle, new_gradient
        # Below a flat end the distance is level over part of a step, and any place of it is the least.
        if abs(slope) <= _FLAT_SLOPE:
            break
        if slope > 0.0:
            upper = middle
        else:
            lower = middle
    return distance, share, gradient


@njit(cache=True, nogil=True, **BORROWS)
def sweeps(rows, shapes, k, now, place):
    """Whether step k, or a step before or after it up to `now`, has swept a place (m)."""
    row = rows[k]
    distance, share, _ = swept_distance(row, shapes[int(row[12])], place)
    if distance <= 0.0:
        return True
    way = 1 if share == 1.0 else -1 if share == 0.0 else 0
    m = k
    for _ in range(3):
        m += way
        if way == 0 or m < 0 or m > now or rows[m, 12] != row[12]:
            return False
        distance, share, _ = swept_distance(rows[m], shapes[int(rows[m, 12])], place)
        if distance <= 0.0:
            return True
        if (way == 1 and share < 1.0) or (way == -1 and share > 0.0):
            return False
    return False

# Code of other modules in these kernels: 814697192537
