"""The path of a program for its page: pieces of a polyline, quantities to colour by, the work that is left, lobes, text."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.drives.program.path import LINE_KIND
from toolpoint.plot import BlockLobes, BlockQuantity, ProgramView
from toolpoint.studies.machining.result import VERDICTS, MachiningStudy

MAX_SURFACE_CELLS = 120  # along the longer side
MAX_TEXT_LINES = 150_000  # of the program
MAX_SHOWN_DEMAND = 4.0  # of depth over stable depth: more is one colour
QUANTITY_OF_ERROR = {"total": ("Total error", "µm", 1e6), "location": ("Surface location error of walls", "µm", 1e6),
                     "floor": ("Error of the floor", "µm", 1e6), "cusp": ("Cusps", "µm", 1e6),
                     "contour": ("Contour error", "µm", 1e6), "push": ("Servo pushed by the force", "µm", 1e6),
                     "marks": ("Feed marks", "µm", 1e6), "feed_force": ("Feed force", "N", 1.0),
                     "drive_use": ("Drives, of their limit", "%", 100.0)}
QUANTITY_OF_LOAD = {"lateral": ("Force across the tool", "N", 1.0), "power": ("Power", "W", 1.0),
                    "peak_torque": ("Torque", "N m", 1.0), "bending": ("Bending at the holder", "N m", 1.0),
                    "chip": ("Thickest chip", "µm", 1e6)}


def program_part(result: MachiningStudy, name: str = "program") -> ProgramView:
    """Return the path of a program with everything to colour it by; name : of the view on its page."""
    path, blocks = result.laid.path, result.blocks
    points, block = _polyline(result)
    kind = np.where(path.rapid, 0, np.where(blocks.verdict > 0, 2, 1))
    lobes = [BlockLobes(each.blocks, each.speed, np.where(np.isfinite(each.limit), each.limit, np.nan), each.depth,
                        each.programmed) for each in result.lobes]
    left_out = len(result.text) - MAX_TEXT_LINES
    caption = "Cutting blocks in the colour of a quantity, over the work as it is left; grey: not known. Errors are shown " \
        "by their size." + (f" The last {left_out} lines of the text are left out." if left_out > 0 else "")
    return ProgramView(name, points, block, kind, np.cumsum(result.laid.time), blocks.line, _quantities(result),
                       result.text[:MAX_TEXT_LINES], blocks.verdict, VERDICTS, _surface(result), lobes, caption)


def _quantities(result: MachiningStudy) -> list[BlockQuantity]:
    """Return the quantities that are known of any block, the demand on stability first."""
    blocks, cuts, choices = result.blocks, result.blocks.verdict > 0, list[BlockQuantity]()
    if np.isfinite(blocks.ratio).any():
        ratio = np.where(blocks.ratio > 0, blocks.ratio, np.nan)
        demand = np.where(np.isinf(ratio), 0.0, np.minimum(1 / ratio, MAX_SHOWN_DEMAND))
        choices.append(BlockQuantity("Depth over stable depth", "", demand, 1.0))
    choices += [BlockQuantity(name, unit, np.where(cuts, scale * blocks.loads[column], np.nan))
              for column, (name, unit, scale) in QUANTITY_OF_LOAD.items()]
    columns = {} if result.errors is None else result.errors.columns
    for column, (name, unit, scale) in QUANTITY_OF_ERROR.items():
        values = np.where(cuts, scale * np.abs(columns[column]), np.nan) if column in columns else np.full(cuts.size, np.nan)
        if np.isfinite(values).any():
            choices.append(BlockQuantity(name, unit, values))
    if result.record is not None and result.record.is_placed:
        choices.append(BlockQuantity("Record less expected", "deviations", _scores(result)))
    time = np.cumsum(result.laid.time)
    return [*choices, BlockQuantity("Depth of cut", "mm", np.where(cuts, 1e3 * blocks.depth, np.nan)),
            BlockQuantity("Feed", "mm/min", 60e3 * result.laid.feed, digits=4),
            BlockQuantity("Time of the program", "s", time, digits=4)]


def _scores(result: MachiningStudy) -> FloatArray:
    """Return by how many deviations the record of every block differs, the largest of its windows."""
    scores = np.zeros(result.blocks.line.size)
    assert result.record is not None
    np.maximum.at(scores, result.record.windows.block, np.abs(result.record.fit.score))
    seen_blocks = np.isin(np.arange(scores.size), result.record.windows.block)
    return np.where(seen_blocks, scores, np.nan)


def _polyline(result: MachiningStudy) -> tuple[FloatArray, np.ndarray]:
    """Return the ends of the drawn pieces (n + 1, 3) and their segments (n,): lines whole, arcs in their pieces."""
    pieces, path = result.laid.moves, result.laid.path
    is_line = path.kind[pieces.block] == LINE_KIND
    is_last = np.append(pieces.block[1:] != pieces.block[:-1], True)
    kept = ~is_line | is_last
    ends = pieces.rows[kept, 3:6]
    return np.concatenate([pieces.rows[:1, 0:3], ends]), pieces.block[kept]


def _surface(result: MachiningStudy) -> tuple[FloatArray, np.ndarray]:
    """Return the surface of the work as it is left, as a coarse grid of triangles; beside the stock there are none."""
    height, spacing = result.removed.height, result.removed.settings.spacing
    step = max(1, int(np.ceil(max(height.shape) / MAX_SURFACE_CELLS)))
    coarse = height[::step, ::step]
    filled = np.where(np.isfinite(coarse), coarse, result.setup.stock.lower[2])
    x = result.removed.origin[0] + spacing * step * np.arange(coarse.shape[0])
    y = result.removed.origin[1] + spacing * step * np.arange(coarse.shape[1])
    nodes = np.stack([*np.meshgrid(x, y, indexing="ij"), filled], axis=-1).reshape(-1, 3)
    n, m = coarse.shape
    corner = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)).reshape(-1, 1)
    triangles = np.concatenate([corner + np.array([0, m, m + 1]), corner + np.array([0, m + 1, 1])])
    return nodes, triangles[np.isfinite(coarse).reshape(-1)[triangles].all(axis=1)]
