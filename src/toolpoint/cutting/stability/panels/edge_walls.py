"""Compiled places on the edge of a mill, and the pieces of it that lie between the walls of the work."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from toolpoint._check import FloatArray
from toolpoint._inner_kernels import inner_njit
from toolpoint._kernel_options import BORROWS
from toolpoint.cutting.stability.panels.records import Walls

TURN = 2 * math.pi
WALL_ROUNDS = 80  # evaluations at most in the search for a wall; about eight are needed


@nb.njit(cache=True, nogil=True)
def place(u: float, corner: float, radius: float) -> tuple[float, float, float]:
    """Return (height, axial immersion angle kappa, local radius) at edge length u from the tip."""
    rounded = 0.5 * math.pi * corner
    if u < rounded:
        kappa = u / corner
        return corner * (1 - math.cos(kappa)), kappa, radius - corner + corner * math.sin(kappa)
    return corner + (u - rounded), 0.5 * math.pi, radius


@nb.njit(cache=True, nogil=True)
def limits(entry: float, leave: float, ratio: float) -> tuple[float, float]:
    """Return entry and exit at a local radius (ratio = radius / local radius): the walls of the work are planes."""
    # Beside the corner nothing is to be computed, and arccos(cos(x)) would lose half of the digits near 0 and pi.
    if ratio == 1.0:
        return entry, leave
    # A local radius that does not reach a wall clips to 0 or pi: it is then in cut from or to the line of feed.
    return (math.acos(max(-1.0, min(1.0, math.cos(entry) * ratio))),
            math.acos(max(-1.0, min(1.0, math.cos(leave) * ratio))))


@inner_njit(cache=True, nogil=True, **BORROWS)
def beyond_walls(angle: float, slope: float, u: float, walls: Walls, out: FloatArray) -> None:
    """Write how far the edge at length u (m) is beyond its entry and before its exit, rad, into out (2,).

    angle : of the tip, rad, not wrapped within 0 .. pi; slope : lag over height, rad/m.
    """
    z, _, r = place(u, walls.corner, walls.radius)
    phi = angle - slope * z
    # The tip of a ball has no radius: the bound only keeps the quotient finite.
    a, b = limits(walls.entry, walls.leave, walls.radius / max(r, 1e-9 * walls.radius))
    out[0], out[1] = phi - a, b - phi


@inner_njit(cache=True, nogil=True, **BORROWS)
def wall_length(angle: float, slope: float, span: tuple[float, float], values: tuple[float, float], wall: int, walls: Walls,
                room: FloatArray) -> tuple[float, float]:
    """Return the edge lengths on the side of the first and of the last end of a span between which the edge meets a wall, equal
    to the last digit.

    values : how far the ends of the span are beyond the wall, rad, of unlike signs. Inverse quadratic interpolation where it
    falls well within the span, else its middle (Chandrupatla, 1997): eight evaluations where halving takes fifty.
    """
    a, b = span[1], span[0]
    fa, fb = values[1], values[0]
    c, fc, share = a, fa, 0.5
    for _ in range(WALL_ROUNDS):
        x = a + share * (b - a)
        beyond_walls(angle, slope, x, walls, room)
        fx = room[wall]
        if (fx > 0) == (fa > 0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        # One unit of the last place; the second term serves a wall at the tip, u = 0.
        tolerance = 2.3e-16 * abs(best) + 1e-24
        width = abs(b - a)
        if fa == 0.0:
            return a, a
        if tolerance > 0.5 * width:
            break
        share = 0.5
        if fc != fb and fc != fa:
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            if phi * phi < xi and (1 - phi) * (1 - phi) < 1 - xi:
                share = (fa / (fb - fa)) * (fc / (fb - fc)) + (c - a) / (b - a) * (fa / (fc - fa)) * (fb / (fc - fb))
        # A place within the tolerance of an end would be that end again, and the bracket would not shrink.
        edge = tolerance / width
        share = min(max(share, edge), 1 - edge)
    if (fa > 0) == (values[0] > 0):
        return a, b
    return b, a


@inner_njit(cache=True, nogil=True, **BORROWS)
def mark_walls(marks: FloatArray, walls: Walls, out: FloatArray) -> None:
    """Write (marks, 4): height (m), entry and exit (rad) at every mark, and the height in the middle before it.

    No rotation changes them, so a layout of hundreds of nodes takes them once.
    """
    for g in range(marks.size):
        out[g, 0], _, r = place(marks[g], walls.corner, walls.radius)
        out[g, 1], out[g, 2] = limits(walls.entry, walls.leave, walls.radius / max(r, 1e-9 * walls.radius))
        out[g, 3] = place(0.5 * (marks[g - 1] + marks[g]), walls.corner, walls.radius)[0] if g > 0 else out[g, 0]


@inner_njit(cache=True, nogil=True, **BORROWS)
def tooth_pieces(angle: float, slope: float, marks: tuple[FloatArray, FloatArray], walls: Walls, room: FloatArray,
                 out: FloatArray) -> int:
    """Write the pieces of the edge (u from, to, m) in cut when its tip is at `angle` (rad) into out (pieces, 2); return their
    number.

    Between marks entry and exit pass along the edge one way each, so each bounds a piece at one end at most.
    slope : lag over height, rad/m; marks : edge lengths (m), and the walls there (`mark_walls`); room : (3, 2) to work in.
    """
    number, (lengths, at_marks) = 0, marks
    for g in range(1, lengths.size):
        a, b = lengths[g - 1], lengths[g]
        # The turn in which the piece lies around pi/2: no wrap is near the cut then.
        unwrapped = angle - TURN * np.rint((angle - slope * at_marks[g, 3] - 0.5 * math.pi) / TURN)
        for end in range(2):
            phi = unwrapped - slope * at_marks[g - 1 + end, 0]
            room[end, 0], room[end, 1] = phi - at_marks[g - 1 + end, 1], at_marks[g - 1 + end, 2] - phi
        lower, upper = a, b
        for wall in range(2):
            first, last = room[0, wall] > 0, room[1, wall] > 0
            if first and last:
                continue
            if not first and not last:
                upper = lower
                break
            x, y = wall_length(unwrapped, slope, (a, b), (room[0, wall], room[1, wall]), wall, walls, room[2])
            if first:
                upper = min(upper, x)
            else:
                lower = max(lower, y)
        if upper > lower:
            out[number, 0], out[number, 1] = lower, upper
            number += 1
    return number

# Code of other modules in these kernels: 814697192537
