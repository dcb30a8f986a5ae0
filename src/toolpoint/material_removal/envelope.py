r"""Compiled lower envelope of an end mill along a move: the height to which material is left at a place.

A tool whose profile f(d) is convex in the distance d from its axis leaves, after a straight move from P to Q,
:math:`E(x, y) = \min_t z(t) + f(d(t))`, t over the part of the move with d(t) <= R. The minimum of a convex function: closed
for flat ends and balls, by bisection of its slope for bull noses and cones. A level arc has its minimum where the axis is
nearest. Columns of a row of a move: x0 y0 z0 x1 y1 z1 (m, of the tip), kind (0 line, 1 arc in XY), centre x y and
radius (m), start angle and sweep (rad), index of the tool's shape.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit

from toolpoint._kernel_options import BORROWS

_SHARE_BISECTIONS = 34  # halvings of the part of a move: below 1e-10 of it
_SIDE_MARGIN = 1e-9  # of the square of a ball's radius: places nearer to its surface are left to the envelope itself
_HELIX_SECTIONS = 40  # golden sections of a helical arc


@njit(cache=True, nogil=True, inline="always")
def profile(d, shape):
    """Return the height (m) of the tool's surface above its tip at a distance d (m) from the axis; infinite beyond it."""
    flat, corner, sine, cosine, radius = shape[0], shape[1], shape[2], shape[3], shape[4]
    if d <= flat:
        return 0.0
    if d > radius * (1.0 + 1e-12):
        return math.inf
    tangent = flat + corner * cosine
    if d <= tangent or sine == 0.0:
        s = min(d - flat, corner)
        return corner - math.sqrt(max(corner * corner - s * s, 0.0))
    return corner * (1.0 - sine) + (d - tangent) * cosine / sine


@njit(cache=True, nogil=True, inline="always")
def profile_slope(d, shape):
    """Return the slope of the profile at a distance from the axis; large at a vertical wall."""
    flat, corner, sine, cosine = shape[0], shape[1], shape[2], shape[3]
    if d <= flat:
        return 0.0
    if d <= flat + corner * cosine or sine == 0.0:
        s = d - flat
        # The wall of a bull nose is vertical at its radius: a bound of 1e9 keeps bisection of the slope going.
        return s / math.sqrt(max(corner * corner - s * s, 1e-18 * corner * corner))
    return cosine / sine


@njit(cache=True, nogil=True, **BORROWS)
def lowest_of_line(move, shape, x, y):
    """Return the envelope (m) of a straight move at a place; infinite where the tool does not pass."""
    radius = shape[4]
    qx, qy = x - move[0], y - move[1]
    ax, ay, az = move[3] - move[0], move[4] - move[1], move[5] - move[2]
    square, distance2 = ax * ax + ay * ay, qx * qx + qy * qy
    # A plunge, or a move below a picometre: there is no direction in XY to divide by.
    if square < 1e-24:
        if distance2 > radius * radius:
            return math.inf
        return min(move[2], move[5]) + profile(math.sqrt(distance2), shape)
    middle = (qx * ax + qy * ay) / square
    across2 = max(distance2 - middle * middle * square, 0.0)
    if across2 > radius * radius:
        return math.inf
    half = math.sqrt((radius * radius - across2) / square)
    first, last = max(0.0, middle - half), min(1.0, middle + half)
    if first > last:
        return math.inf
    # The three frequent tools have their minimum in closed form, without the square roots of 34 halvings.
    if az == 0.0:
        t = min(max(middle, first), last)
    elif shape[1] == 0.0 and shape[2] == 0.0:
        t = first if az > 0.0 else last
    elif shape[0] == 0.0 and shape[2] == 0.0:
        # Ball: the lowest point of the tube is where k + s/sqrt(A^2 - s^2) = 0, s the way from the nearest point.
        k = az / math.sqrt(square)
        t = middle - k * math.sqrt((radius * radius - across2) / (1.0 + k * k) / square)
        t = min(max(t, first), last)
    else:
        t = _lowest_share(first, last, middle, across2, square, az, shape)
    d = math.sqrt(across2 + (t - middle) * (t - middle) * square)
    return move[2] + t * az + profile(min(d, radius), shape)


@njit(cache=True, nogil=True, **BORROWS)
def _lowest_share(first, last, middle, across2, square, rise, shape):
    """Return the share t of a move at which z(t) + f(d(t)) is least, by bisection of its slope.

    first, last, middle : shares within reach, and the nearest one; across2 : square of the least distance, m^2; square : of the
    move's length in XY, m^2; rise : m.
    """
    for _ in range(_SHARE_BISECTIONS):
        t = 0.5 * (first + last)
        d = math.sqrt(across2 + (t - middle) * (t - middle) * square)
        slope = rise + (profile_slope(d, shape) * (t - middle) * square / d if d > 0.0 else 0.0)
        if slope > 0.0:
            last = t
        else:
            first = t
    return 0.5 * (first + last)


@njit(cache=True, nogil=True, **BORROWS)
def lowest_of_arc(move, shape, x, y):
    """Return the envelope (m) of an arc of at most half a rad in XY, its height linear along it."""
    radius, rho, sweep = shape[4], move[9], abs(move[11])
    qx, qy = x - move[7], y - move[8]
    m, way = math.hypot(qx, qy), 1.0 if move[11] > 0.0 else -1.0
    if m > rho + radius or m < rho - radius:
        return math.inf
    turn = way * (math.atan2(qy, qx) - move[10]) - 0.5 * sweep
    # Counted from the middle of the arc before it is wrapped: the jump of the angle then lies opposite the arc.
    turn = turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi)) + 0.5 * sweep
    rise = move[5] - move[2]
    if rise == 0.0:
        t = min(max(turn, 0.0), sweep)
        d2 = rho * rho + m * m - 2.0 * rho * m * math.cos(t - turn)
        return move[2] + profile(math.sqrt(max(d2, 0.0)), shape) if d2 <= radius * radius else math.inf
    cosine = (rho * rho + m * m - radius * radius) / max(2.0 * rho * m, 1e-300)
    if cosine >= 1.0:
        return math.inf
    window = math.pi if cosine <= -1.0 else math.acos(cosine)
    first, last = max(0.0, turn - window), min(sweep, turn + window)
    if first > last:
        return math.inf
    if shape[1] == 0.0 and shape[2] == 0.0:
        return move[2] + rise * (first if rise > 0.0 else last) / sweep
    return _lowest_on_helix(move, shape, m, turn, first, last)


@njit(cache=True, nogil=True, **BORROWS)
def _lowest_on_helix(move, shape, m, turn, first, last):
    """Return the least height (m) between the turns `first` and `last` (rad) of a helical arc, by golden sections: its
    slope is not monotonic.

    m : distance of the place from the centre, m; turn : angle of the place from the arc's start, rad.
    """
    rho, sweep, rise, radius = move[9], abs(move[11]), move[5] - move[2], shape[4]
    golden = 0.6180339887498949
    best = math.inf
    a, b = first, last
    for _ in range(_HELIX_SECTIONS):
        u, v = b - golden * (b - a), a + golden * (b - a)
        du = math.sqrt(max(rho * rho + m * m - 2.0 * rho * m * math.cos(u - turn), 0.0))
        dv = math.sqrt(max(rho * rho + m * m - 2.0 * rho * m * math.cos(v - turn), 0.0))
        hu = move[2] + rise * u / sweep + profile(min(du, radius), shape)
        hv = move[2] + rise * v / sweep + profile(min(dv, radius), shape)
        # The least of all that was seen: sections may close in on the wrong one of two minima at the arc's ends.
        best = min(best, hu, hv)
        if hu < hv:
            b = v
        else:
            a = u
    return best


@njit(cache=True, nogil=True, **BORROWS)
def lowest(rows, shapes, k, x, y):
    """Return the envelope (m) of row k of the moves at a place (m), with the shape that the row names."""
    shape = shapes[int(rows[k, 12])]
    return lowest_of_line(rows[k], shape, x, y) if rows[k, 6] == 0.0 else lowest_of_arc(rows[k], shape, x, y)


@njit(cache=True, nogil=True, inline="always")
def ball_side(row, shape, x, y, z):
    """Return -1 where the ball of a straight move passes below a place (m), 1 where it does not, 0 where `lowest` has to tell.

    By the distance of the place from the path of the ball's centre, which takes no root; a place within `_SIDE_MARGIN` of the
    surface, above the centre, or beside another shape is left to `lowest`.
    """
    if row[6] != 0.0 or shape[0] != 0.0 or shape[2] != 0.0 or shape[1] == 0.0:
        return 0
    square = shape[1] * shape[1]
    qx, qy, qz = x - row[0], y - row[1], z - row[2] - shape[1]
    ax, ay, az = row[3] - row[0], row[4] - row[1], row[5] - row[2]
    length2, along = ax * ax + ay * ay + az * az, qx * ax + qy * ay + qz * az
    distance2 = qx * qx + qy * qy + qz * qz
    if along >= length2:
        distance2 += length2 - 2.0 * along
    elif along > 0.0:
        distance2 -= along * along / length2
    if distance2 < square * (1.0 - _SIDE_MARGIN):
        return -1
    return 1 if distance2 > square * (1.0 + _SIDE_MARGIN) and qz < min(az, 0.0) else 0

# Code of other modules in these kernels: 814697192537
