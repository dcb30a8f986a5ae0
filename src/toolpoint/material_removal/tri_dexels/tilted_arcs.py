r"""Compiled arcs of cut of a tool of any direction: per slice, with the slice's own feed where the axis turns.

Angles as in a cut, phi clockwise from the normal of the feed, about the tool's axis; the feed is that of the edge's middle: of
a tool whose axis turns, other slices advance in other directions, and their edge cuts a chip over angles turned by as much. The
ends of an arc are bisected between samples on either side.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np
from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.arcs import SAMPLE_ANGLE, chip_range, edge_at, edge_length
from toolpoint.material_removal.tri_dexels.presence import has_material

_RANGE_NUDGE = 1e-3  # rad, from the ends of the range of a chip to its first sample
_ARC_END_BISECTIONS = 10  # halvings of 6 degrees: 0.006 degrees
_GAP_RATIO = 1e-5  # of the radius (and 1 mm): distance outside the edge at which material is asked for
_MAX_RELAYS = 4  # largest number of times that slices are laid anew where not all of them cut
_REACH_SHRINK_RATIO = 0.2  # of the reach, where no slice cuts
_REACH_HALVINGS = 7  # of the slice in which the reach ends


@njit(cache=True, nogil=True, **BORROWS)
def local_feed(frame, motion, height):
    """Return the feed (m per step) of a height above the tip: across the axis along the tool's x and y, and along the axis.

    frame : (3, 3) columns are the tool's axes; motion : (2, 3) rate of tip and of axis over the step.
    """
    x, y, z = 0.0, 0.0, 0.0
    for i in range(3):
        rate = motion[0, i] + height * motion[1, i]
        x, y, z = x + frame[i, 0] * rate, y + frame[i, 1] * rate, z + frame[i, 2] * rate
    return x, y, z


@njit(cache=True, nogil=True, **BORROWS)
def _is_cut(work, stand, way, edge, phi):
    """Whether there is material just outside the edge (height, kappa, radius) at an angle phi.

    way : (2,) unit feed across the axis.
    """
    tip, frame, place = stand
    s, c = math.sin(phi), math.cos(phi)
    nx, ny = s * way[0] - c * way[1], s * way[1] + c * way[0]
    height, kappa, radius = edge
    gap = _GAP_RATIO * (radius + 1e-3)
    r, z = radius + gap * math.sin(kappa), height - gap * math.cos(kappa)
    for i in range(3):
        place[i] = tip[i] + r * (nx * frame[i, 0] + ny * frame[i, 1]) + z * frame[i, 2]
    return has_material(work, place)


@njit(cache=True, nogil=True, **BORROWS)
def _slice_arcs(work, stand, way, edge, limits, arcs):
    """Write entry and exit (rad) of the arcs of one slice; return their number (those beyond the room join the last)."""
    first, last = limits[0] + _RANGE_NUDGE, limits[1] - _RANGE_NUDGE
    if last <= first:
        return 0
    number = max(math.ceil((last - first) / SAMPLE_ANGLE), 8)
    step, count = (last - first) / number, 0
    was_cut, previous, entry = _is_cut(work, stand, way, edge, first), first, limits[0]
    for k in range(1, number + 1):
        phi = first + k * step
        now = _is_cut(work, stand, way, edge, phi)
        if now != was_cut:
            a, b = previous, phi
            for _ in range(_ARC_END_BISECTIONS):
                middle = 0.5 * (a + b)
                if _is_cut(work, stand, way, edge, middle) == was_cut:
                    a = middle
                else:
                    b = middle
            if now:
                entry = 0.5 * (a + b)
            else:
                count = _keep(arcs, count, entry, 0.5 * (a + b))
        was_cut, previous = now, phi
    return _keep(arcs, count, entry, limits[1]) if was_cut else count


@njit(cache=True, nogil=True, inline="always")
def _keep(arcs, count, entry, leave):
    """Keep an arc; beyond the room the last one is lengthened. Return the number of arcs."""
    if count < arcs.shape[0]:
        arcs[count, 0], arcs[count, 1] = entry, leave
    else:
        arcs[arcs.shape[0] - 1, 1] = leave
    return count + 1


@njit(cache=True, nogil=True, **BORROWS)
def _arcs_at(work, stand, motion, edge, way, arcs):
    """Write the arcs of one slice, whose chip is that of its own feed; return their number."""
    x, y, z = local_feed(stand[1], motion, edge[0])
    level, size = math.hypot(x, y), math.sqrt(x * x + y * y + z * z)
    if size <= 0.0:
        return 0
    first, last = chip_range(edge[1], level / size, z / size)
    # Clockwise from the reference feed to that of this slice.
    turn = math.atan2(y * way[0] - x * way[1], x * way[0] + y * way[1]) if level > 1e-9 * size else 0.0
    return _slice_arcs(work, stand, way, edge, (first - turn, last - turn), arcs)


@njit(cache=True, nogil=True, **BORROWS)
def _lay(work, stand, motion, shape, reach, arcs):
    """Write the arcs of slices over a reach; return the largest number of arcs, and of slices up to the highest that cuts."""
    slices, arc_number_max, upper, total = arcs.shape[0], 0, 0, edge_length(reach, shape)
    way = _way(stand[1], motion, 0.5 * reach)
    arcs[:] = math.nan
    for k in range(slices):
        number = _arcs_at(work, stand, motion, edge_at((k + 0.5) / slices * total, shape), way, arcs[k])
        arc_number_max = max(arc_number_max, number)
        upper = k + 1 if number > 0 else upper
    return arc_number_max, upper


@njit(cache=True, nogil=True, **BORROWS)
def _way(frame, motion, height):
    """Return the unit feed across the axis at a height, along the tool's x and y; x where it goes along the axis alone."""
    x, y, _ = local_feed(frame, motion, height)
    level = math.hypot(x, y)
    return (x / level, y / level) if level > 1e-15 else (1.0, 0.0)


@njit(cache=True, nogil=True, **BORROWS)
def _upper_end(work, stand, motion, shape, laid, arcs):
    """Return the height (m) at which the edge stops to cut, between the highest slice that does and the next one."""
    total, slices = edge_length(laid[0], shape), arcs.shape[0]
    a, b = (laid[1] - 0.5) / slices * total, (laid[1] + 0.5) / slices * total
    way = _way(stand[1], motion, 0.5 * laid[0])
    for _ in range(_REACH_HALVINGS):
        middle = 0.5 * (a + b)
        if _arcs_at(work, stand, motion, edge_at(middle, shape), way, arcs[0]) > 0:
            a = middle
        else:
            b = middle
    return edge_at(0.5 * (a + b), shape)[0]


@njit(cache=True, nogil=True)
def tool_arcs_at(work, tip, frame, motion, shape, reach, arcs):
    """Write the arcs (slices, n, 2) of a tool at a place; return the height (m) over which the slices are laid, 0 where none
    cuts, and the largest number of arcs.

    tip : (3,) m; frame, motion : see `local_feed`; reach : height (m) above the tip below which all that is cut lies.
    """
    stand = (tip, frame, np.empty(3))
    reach = min(reach, shape[5])
    if reach <= 0.0:
        return 0.0, 0
    arc_number_max, upper = _lay(work, stand, motion, shape, reach, arcs)
    for _ in range(_MAX_RELAYS):
        if upper == arcs.shape[0]:
            break
        reach = _upper_end(work, stand, motion, shape, (reach, upper), arcs) if upper > 0 else _REACH_SHRINK_RATIO * reach
        arc_number_max, upper = _lay(work, stand, motion, shape, reach, arcs)
    return (reach if upper > 0 else 0.0), arc_number_max

# Code of other modules in these kernels: b5e25bc6901a
