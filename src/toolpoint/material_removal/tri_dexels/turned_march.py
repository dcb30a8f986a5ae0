"""Steps of a turned tool in their order: bodies above it are looked at, material is taken, arcs at the ends are found."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit

from toolpoint._check import FloatArray
from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.tri_dexels.lines import TriWork, pass_step
from toolpoint.material_removal.tri_dexels.tilted_arcs import tool_arcs_at

_STEPS_PER_CALL = 500  # of the kernel: between calls progress is reported and an interruption heard
_REACH_CELLS = 1.5  # cells by which the reach is widened at first


class TurnedMarch(NamedTuple):
    """Results: reach (m), arcs (rad) and number of arcs of every place; volume (m^3) of every step, depth (m) and place of what
    each step meets (n, 4), and of what the bodies above its edges meet (n, bodies, 4)."""

    reach: np.ndarray
    arcs: np.ndarray
    arc_count: np.ndarray
    volume: np.ndarray
    touched: np.ndarray
    held: np.ndarray


class Places(NamedTuple):
    """Places at which arcs are taken: first of every step (n + 1,), whether at its start, the tool's axes there (n, 3, 3)."""

    first: np.ndarray
    at_start: np.ndarray
    frame: FloatArray


class Bodies(NamedTuple):
    """Bodies above the edges of each tool: how many, their heights above the tip (tools, n), their shapes (tools, n, 6)."""

    number: np.ndarray
    lift: FloatArray
    shape: FloatArray


def march_turned(work: TriWork, rates: FloatArray, rapid: np.ndarray, *, places: Places, bodies: Bodies, slices: int,
                 arc_room: int, progress: Callable[[int, int], None] | None) -> TurnedMarch:
    """Cut the steps in their order; return their volumes, contacts, and the arcs at their places."""
    n, steps = places.at_start.size, len(work.motions)
    out = TurnedMarch(np.zeros(n), np.full((n, slices, arc_room, 2), np.nan), np.zeros(n, np.int32), np.zeros(steps),
                      np.zeros((steps, 4)), np.zeros((steps, max(bodies.lift.shape[1], 1), 4)))
    for first in range(0, steps, _STEPS_PER_CALL):
        last = min(first + _STEPS_PER_CALL, steps)
        _march_steps(work, (first, last), rates, rapid, places, bodies, out)
        if progress is not None:
            progress(last, steps)
    return out


@njit(cache=True, nogil=True)
def _march_steps(work, span, rates, rapid, places, bodies, out):
    room, nothing = np.empty((3, 3)), np.empty(0)
    margin = _REACH_CELLS * work.spacing.max()
    for k in range(span[0], span[1]):
        row = work.motions[k]
        tool = int(row[12])
        shape = work.shapes[tool]
        for part in range(bodies.number[tool]):
            lifted = _lifted(row, bodies.lift[tool, part])
            pass_step(work, k, lifted, bodies.shape[tool, part], room, False, out.held[k, part])
        for n in range(places.first[k], places.first[k + 1]):
            if places.at_start[n] and not rapid[k]:
                out.reach[n], out.arc_count[n] = tool_arcs_at(work, row[0:3], places.frame[n], rates[k], shape,
                                                                  _stock_reach(work, row), out.arcs[n])
        work.now[0] = k
        out.volume[k], height = pass_step(work, k, row, shape, room, True, out.touched[k] if rapid[k] else nothing)
        for n in range(places.first[k], places.first[k + 1]):
            if not places.at_start[n] and not rapid[k] and height > -1.0:
                out.reach[n], out.arc_count[n] = tool_arcs_at(work, row[3:6], places.frame[n], rates[k], shape,
                                                                  max(height, 0.0) + margin, out.arcs[n])


@njit(cache=True, nogil=True)
def _lifted(row, lift):
    """Return the motion of a body that stands on the axis, a height (m) above the tip."""
    lifted = row.copy()
    for i in range(3):
        lifted[i] += lift * row[6 + i]
        lifted[3 + i] += lift * row[9 + i]
    return lifted


@njit(cache=True, nogil=True, **BORROWS)
def _stock_reach(work, row):
    """Return the height (m) above the tip of the farthest corner of the stock along the axis."""
    height = 0.0
    for i in range(3):
        height += max(row[6 + i] * (work.lower[i] - row[i]), row[6 + i] * (work.upper[i] - row[i]))
    return height

# Code of other modules in these kernels: 7bfb6235b2b3
