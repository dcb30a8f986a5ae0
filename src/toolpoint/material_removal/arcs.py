r"""Compiled arcs of cut: the angles at which a slice of the tool cuts, with material just outside the edge, which advances.

Angles as in a cut: phi clockwise from y, x along the feed; :math:`n = \sin\phi\, u + \cos\phi\, v`. At the axial immersion
angle kappa the outward normal of the edge is (sin kappa n, -cos kappa); where the feed has a component along it, the edge cuts
a chip. The ends of an arc are bisected between samples on either side.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.envelope import profile
from toolpoint.material_removal.surface import has_material

SAMPLE_ANGLE = 0.1048  # rad (6 degrees) between samples of a slice: an arc between two of them is missed
MAX_ARCS = 3  # of a slice; further ones are joined to the last
_EDGE_NUDGE = 1e-3  # rad, from the ends of the range of a chip to its first sample
_ARC_BISECTIONS = 10  # halvings of 6 degrees: 0.006 degrees
_WIDE_MARGIN = 1  # further dexels on each side, whose owners are asked at the ends of an arc too
_WALL_MARGIN = 3  # the same of an upright edge, that may lie along a wall where several passes of one level cross
_WALL_IMMERSION = 1.5  # rad: immersion angle from which on an edge is upright
OUTSIDE_GAP_RATIO = 1e-6  # of the radius (and 1 mm): distance outside the edge at which material is asked for
_TOUCH_FACTOR, _MAX_TOUCH = 1.5, 0.0087  # of the angle over which a wall that is only touched lies within that gap; rad
_REACH_MARGIN = 1.5  # cells by which the reach is widened at first: the slices show then where the edge cuts
_REACH_ROUNDS = 2  # largest number of times that slices are laid anew over a shorter reach, where not all of them cut
_REACH_BISECTIONS = 6  # halvings of the slice in which the reach ends


@njit(cache=True, nogil=True, **BORROWS)
def edge_at(length, shape):
    """Return height, immersion angle kappa and radius of the edge at a length (m) along its meridian from the flat end."""
    flat, corner, sine, cosine = shape[0], shape[1], shape[2], shape[3]
    turn = 0.5 * math.pi - math.atan2(sine, cosine)
    arc = corner * turn
    if length < arc:
        kappa = length / corner
        return corner * (1.0 - math.cos(kappa)), kappa, flat + corner * math.sin(kappa)
    straight_length = length - arc
    return corner * (1.0 - sine) + straight_length * cosine, turn, flat + corner * cosine + straight_length * sine


@njit(cache=True, nogil=True, **BORROWS)
def edge_length(height, shape):
    """Return the length of the edge's meridian (m) up to a height above the tip."""
    corner, sine, cosine = shape[1], shape[2], shape[3]
    tangent = corner * (1.0 - sine)
    if height < tangent:
        return corner * math.acos(max(1.0 - height / corner, -1.0))
    return corner * (0.5 * math.pi - math.atan2(sine, cosine)) + (height - tangent) / cosine


@njit(cache=True, nogil=True, **BORROWS)
def chip_range(kappa, level, rise):
    """Return first and last angle at which the edge advances outwards; equal where it does nowhere.

    level, rise : of the unit feed, across the axis and along it.
    """
    s, c = math.sin(kappa), math.cos(kappa)
    # The tool moves along its own axis: every angle cuts alike, or none does.
    if level < 1e-9:
        return (0.0, 2.0 * math.pi) if rise * c < -1e-12 else (0.0, 0.0)
    sine = rise * c / (s * level) if s > 0.0 else math.inf
    if sine >= 1.0:
        return 0.0, 0.0
    if sine <= -1.0:
        return -0.5 * math.pi, 1.5 * math.pi
    start = math.asin(sine)
    return start, math.pi - start


@njit(cache=True, nogil=True, **BORROWS)
def is_cut(work, tip, way, edge, phi, margin=0):
    """Whether there is material just outside the edge (height, kappa, radius) at an angle phi; margin as in `has_material`."""
    s, c = math.sin(phi), math.cos(phi)
    nx, ny = s * way[0] - c * way[1], s * way[1] + c * way[0]
    height, kappa, radius = edge
    gap = OUTSIDE_GAP_RATIO * (radius + 1e-3)
    r = radius + gap * math.sin(kappa)
    return has_material(work, tip[0] + r * nx, tip[1] + r * ny, tip[2] + height - gap * math.cos(kappa), margin)


@njit(cache=True, nogil=True, **BORROWS)
def reach_at(work, tip, shape, highest):
    """Return the height (m) above the tip below which all material within a cell of the tool stands.

    Columns beside the tool that rise above its surface moved inwards by a cell and a half: what it may touch now.
    """
    radius, margin = shape[4], _REACH_MARGIN * work.spacing
    span = radius + margin
    nx, ny = work.height.shape
    i0, i1 = math.ceil((tip[0] - span - work.x0) / work.spacing), math.floor((tip[0] + span - work.x0) / work.spacing)
    j0, j1 = math.ceil((tip[1] - span - work.y0) / work.spacing), math.floor((tip[1] + span - work.y0) / work.spacing)
    reach = 0.0
    for i in range(max(i0, 0), min(i1, nx - 1) + 1):
        for j in range(max(j0, 0), min(j1, ny - 1) + 1):
            rise = work.height[i, j] - tip[2]
            if rise <= reach:
                continue
            d = math.hypot(work.x0 + i * work.spacing - tip[0], work.y0 + j * work.spacing - tip[1])
            if d <= span and rise > profile(max(min(d, radius) - margin, 0.0), shape):
                outer_height = profile(d + margin, shape)
                reach = max(reach, min(rise, outer_height))
    return min(reach, highest)


@njit(cache=True, nogil=True, **BORROWS)
def slice_arcs(work, tip, way, edge, limits, arcs):
    """Write entry and exit (rad) of the arcs of one slice; return their number (arcs beyond the room are joined to the last).

    way : (2,) unit direction of feed across the axis; edge : (height, kappa, radius); limits : rad, see `chip_range`.
    """
    first, last = limits[0] + _EDGE_NUDGE, limits[1] - _EDGE_NUDGE
    if last <= first:
        return 0
    number = max(math.ceil((last - first) / SAMPLE_ANGLE), 8)
    step, count = (last - first) / number, 0
    was_cut, previous = is_cut(work, tip, way, edge, first), first
    entry = limits[0]
    for k in range(1, number + 1):
        phi = first + k * step
        is_cut_here = is_cut(work, tip, way, edge, phi)
        if is_cut_here != was_cut:
            a, b = previous, phi
            for _ in range(_ARC_BISECTIONS):
                middle = 0.5 * (a + b)
                if is_cut(work, tip, way, edge, middle) == was_cut:
                    a = middle
                else:
                    b = middle
            if is_cut_here:
                entry = 0.5 * (a + b)
            else:
                count = _keep_arc(work, tip, way, edge, (entry, 0.5 * (a + b)), arcs, count)
        was_cut, previous = is_cut_here, phi
    if was_cut:
        count = _keep_arc(work, tip, way, edge, (entry, limits[1]), arcs, count)
    return count


@njit(cache=True, nogil=True, **BORROWS)
def _keep_arc(work, tip, way, edge, ends, arcs, count):
    """Write an arc whose ends also the owners of further dexels leave standing; drop one of which they leave nothing."""
    entry = _checked_end(work, tip, way, edge, ends[0], ends[1])
    if math.isnan(entry):
        return count
    leave = _checked_end(work, tip, way, edge, ends[1], entry)
    if math.isnan(leave):  # only a touch at the other end, thinner than the look from this one
        return count
    # Along a wall that an earlier pass has left, material lies within the gap outside the edge over this angle: no chip.
    touch = math.sqrt(2.0 * OUTSIDE_GAP_RATIO * (edge[2] + 1e-3) / edge[2])
    if leave - entry < min(_TOUCH_FACTOR * touch, _MAX_TOUCH):
        return count
    if count < arcs.shape[0]:
        arcs[count, 0], arcs[count, 1] = entry, leave
    else:
        arcs[arcs.shape[0] - 1, 1] = leave
    return count + 1


@njit(cache=True, nogil=True, **BORROWS)
def _checked_end(work, tip, way, edge, end, other):
    """Return the end of an arc moved inwards to where there is material by a wider look; not a number for none."""
    width = other - end
    margin = _WALL_MARGIN if edge[1] > _WALL_IMMERSION else _WIDE_MARGIN
    previous = end + math.copysign(min(_EDGE_NUDGE, 0.25 * abs(width)), width)
    if is_cut(work, tip, way, edge, previous, margin):
        return end
    number = math.ceil(abs(width) / SAMPLE_ANGLE) + 1
    for k in range(1, number + 1):
        phi = end + width * k / (number + 1)
        if is_cut(work, tip, way, edge, phi, margin):
            for _ in range(_ARC_BISECTIONS):
                middle = 0.5 * (previous + phi)
                if is_cut(work, tip, way, edge, middle, margin):
                    phi = middle
                else:
                    previous = middle
            return 0.5 * (previous + phi)
        previous = phi
    return math.nan


@njit(cache=True, nogil=True, **BORROWS)
def tool_arcs(work, tip, feed, shape, flute, arcs):
    """Write the arcs (slices, MAX_ARCS, 2) of the tool at a place; return axial reach (m) and the largest number of arcs.

    Slices have equal lengths along the edge's meridian, from the flat end to the reach; not a number where there is no arc.
    The reach returned is the height over which the slices are laid, 0 where none cuts.
    tip : (3,) m; feed : (3,) unit direction; flute : length of the edges, m.
    """
    level = math.hypot(feed[0], feed[1])
    way = (feed[0] / level, feed[1] / level) if level > 1e-9 else (1.0, 0.0)
    highest = min(work.upper[2] - tip[2], flute)
    if highest <= 0.0:
        return 0.0, 0
    reach = reach_at(work, tip, shape, highest)
    if reach <= 0.0:
        return 0.0, 0
    arc_number_max, upper = _lay_slices(work, tip, (way, level, feed[2]), shape, reach, arcs)
    if work.kind == 2 and upper == arcs.shape[0] and reach < highest:
        # A ridge of a mesh rises above the dexels on both sides of it: laid higher, the slices show where it ends.
        reach = min(reach + _REACH_MARGIN * work.spacing, highest)
        arc_number_max, upper = _lay_slices(work, tip, (way, level, feed[2]), shape, reach, arcs)
    for _ in range(_REACH_ROUNDS):
        if upper == 0 or upper == arcs.shape[0]:
            break
        reach = _upper_end(work, tip, (way, level, feed[2]), shape, (reach, upper), arcs)
        arc_number_max, upper = _lay_slices(work, tip, (way, level, feed[2]), shape, reach, arcs)
    return (reach if upper > 0 else 0.0), arc_number_max


@njit(cache=True, nogil=True, **BORROWS)
def _lay_slices(work, tip, feed, shape, reach, arcs):
    """Write the arcs of slices laid over a reach; return the largest number of arcs, and of slices up to the highest cut."""
    way, level, rise = feed
    slices, arc_number_max, upper, total = arcs.shape[0], 0, 0, edge_length(reach, shape)
    arcs[:] = math.nan
    for k in range(slices):
        edge = edge_at((k + 0.5) / slices * total, shape)
        number = slice_arcs(work, tip, way, edge, chip_range(edge[1], level, rise), arcs[k])
        arc_number_max = max(arc_number_max, number)
        upper = k + 1 if number > 0 else upper
    return arc_number_max, upper


@njit(cache=True, nogil=True, **BORROWS)
def _upper_end(work, tip, feed, shape, laid, arcs):
    """Return the height (m) at which the edge stops to cut, bisected between the highest slice that does and the next."""
    way, level, rise = feed
    total, slices = edge_length(laid[0], shape), arcs.shape[0]
    a, b = (laid[1] - 0.5) / slices * total, (laid[1] + 0.5) / slices * total
    for _ in range(_REACH_BISECTIONS):
        middle = 0.5 * (a + b)
        edge = edge_at(middle, shape)
        if slice_arcs(work, tip, way, edge, chip_range(edge[1], level, rise), arcs[0]) > 0:
            a = middle
        else:
            b = middle
    return edge_at(0.5 * (a + b), shape)[0]

# Code of other modules in these kernels: cf0a08960516
