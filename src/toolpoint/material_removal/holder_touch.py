"""Compiled look whether a body above the edges of a tool touches the work during a move."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from numba import njit

from toolpoint._kernel_options import BORROWS
from toolpoint.material_removal.envelope import lowest_of_arc, lowest_of_line
from toolpoint.material_removal.surface import box_of


@njit(cache=True, nogil=True, **BORROWS)
def touch_move(work, k, body, lift, box, place):
    """Whether a cylinder above the tool (shape row `body`, from `lift` m above the tip) touches material during piece k; the
    depth and place of the deepest contact are written to `place`, as in `cut_move`."""
    box_of(work, k, body[4], box)
    row, deepest = work.moves[k], 0.0
    bottom = min(row[2], row[5]) + lift
    for i in range(box[0], box[1] + 1):
        x = work.x0 + i * work.spacing
        for j in range(box[2], box[3] + 1):
            if work.height[i, j] <= bottom:
                continue
            y = work.y0 + j * work.spacing
            z = lift + (lowest_of_line(row, body, x, y) if row[6] == 0.0 else lowest_of_arc(row, body, x, y))
            if work.height[i, j] - z > deepest:
                deepest = work.height[i, j] - z
                place[0], place[1], place[2], place[3] = deepest, x, y, z
    return deepest > 0.0

# Code of other modules in these kernels: cf0a08960516
