"""Doubts about the motion of a five-axis program: feed along the edge, way of the axis between vectors."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.machining.five_axes.tool_directions import RotaryAxes
from toolpoint.studies.machining.five_axes.turned_path import FiveAxisProgram
from toolpoint.studies.machining.program_path import ProgramPath

MAX_UNDOUBTED_WAY = 0.5  # degrees, beside the straight turn between two vectors
MAX_UNDOUBTED_FEED_SPREAD = 0.2  # of the feed of the middle of the edge


def feed_doubts(removed: TurnedRemoval, laid: ProgramPath) -> list[Doubt]:
    """Return the doubt about places whose cutting edge advances much faster at one end than at the other."""
    assert removed.feed_spread is not None
    spread = np.where(removed.reach > 0, removed.feed_spread, 0.0)
    if spread.max(initial=0.0) <= MAX_UNDOUBTED_FEED_SPREAD:
        return []
    k, place_count = int(spread.argmax()), int((spread > MAX_UNDOUBTED_FEED_SPREAD).sum())
    return [Doubt("feed along the edge", f"line {laid.path.line[laid.moves.block[removed.piece[k]]]}: the tool turns so fast "
                  f"that the ends of its cutting edge advance {100 * spread[k]:.0f} % otherwise than its middle, whose feed is "
                  f"taken for all of it ({place_count} places)", "the largest chip is thicker by as much",
                  figure=float(spread[k]))]


def way_doubts(program: FiveAxisProgram, ends: FloatArray, rotary: RotaryAxes | None, *, line: np.ndarray) -> list[Doubt]:
    """Return the doubt about vectors between which even rotary axes leave the plane that a control may keep (ORIVECT)."""
    if rotary is None:
        return []
    vectors = program.directions.reshape(-1, 2, 2, 3)[:, :, 1]
    rows = np.flatnonzero(program.is_controlled & ~np.isnan(vectors[:, 1, 0]))
    if not rows.size:
        return []
    first, middle, last = (rotary.frames((1 - share) * ends[rows, 0] + share * ends[rows, 1])[:, :, 2]
                           for share in (0.0, 0.5, 1.0))
    straight = first + last
    straight /= np.linalg.norm(straight, axis=1, keepdims=True)
    axis_deviation = np.degrees(np.arccos(np.clip(np.einsum("ni,ni->n", straight, middle), -1, 1)))
    k = int(np.argmax(axis_deviation))
    if axis_deviation[k] <= MAX_UNDOUBTED_WAY:
        return []
    return [Doubt("way of the tool's axis", f"line {line[rows[k]]}: between its vectors the axis goes "
                  f"{axis_deviation[k]:.2g}° beside the straight turn, as rotary axes move evenly here; a control may "
                  "turn it straight (ORIVECT, PATHCTRL VECTOR)",
                  "post shorter blocks there", figure=float(axis_deviation[k]))]
