"""Contacts that must not be (rapids, holder, part, table) with line and place, and loads beyond their limits."""

from __future__ import annotations

from collections import Counter

import numpy as np

from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial, Stock
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.result import BlockTable
from toolpoint.studies.machining.setup import MachiningSetup

GOUGE_TOLERANCE = 2e-5  # m, below the part's surface
MAX_LISTED_CONTACTS = 3  # of each kind, by name
MAX_UNKNOWN_EDGE_RATIO = 2.0  # of the diameter: deeper cuts are doubted where no length of the edges is given
MAX_CHIP_RATIO = 0.25  # of the diameter: thicker chips break any tool
MIN_PLUNGE_SLOPE = 0.5  # of the unit feed along the axis: from it on a flat end cuts with its centre


def place_words(place: tuple[float, ...]) -> str:
    """Return a place in mm: ``X 10 Y 5 Z -3 mm``."""
    return " ".join(f"{name} {1e3 * value:.4g}" for name, value in zip("XYZ", place, strict=True)) + " mm"


def contact_doubts(removed: RemovedMaterial, laid: ProgramPath) -> list[Doubt]:
    """Return a grave doubt for every line whose rapid or holder meets material, the deepest first."""
    deepest: dict[tuple[str, int], tuple[float, tuple[float, float, float]]] = {}
    for contact in removed.collisions:
        what = contact.kind if not contact.body else f"{contact.body} in the work"
        key = what, int(laid.path.line[contact.block])
        if contact.depth > deepest.get(key, (0.0, contact.place))[0]:
            deepest[key] = contact.depth, contact.place
    kinds, doubts = Counter[str](), []
    for (what, line), (depth, place) in sorted(deepest.items(), key=lambda entry: -entry[1][0]):
        kinds[what] += 1
        if kinds[what] <= MAX_LISTED_CONTACTS:
            remedy = ("raise the rapid, or place the stock as it is" if "rapid" in what
                      else "a longer stick-out, or another way there")
            doubts.append(Doubt(what, f"line {line}, {1e3 * depth:.3g} mm deep at {place_words(place)}", remedy, grave=True))
    return [*doubts, *(Doubt(what, f"{number - MAX_LISTED_CONTACTS} more lines", grave=True) for what, number in kinds.items()
                       if number > MAX_LISTED_CONTACTS)]


def gouge_doubts(removed: RemovedMaterial, laid: ProgramPath, setup: MachiningSetup) -> list[Doubt]:
    """Return grave doubts about cuts below the part's surface and below the stock, with the line that cut there."""
    doubts = []
    lowest = float(removed.tip[removed.reach > 0, 2].min(initial=np.inf))
    if lowest < setup.stock.lower[2] - GOUGE_TOLERANCE:
        k = int(np.argmin(np.where(removed.reach > 0, removed.tip[:, 2], np.inf)))
        line = laid.path.line[laid.moves.block[removed.piece[k]]]
        doubts.append(Doubt("cut below the stock", f"line {line} goes to {1e3 * lowest:.4g} mm, the stock ends at "
                            f"{1e3 * setup.stock.lower[2]:.4g} mm", "see that neither table nor vice is there"))
    if not len(setup.part):
        return doubts
    part_height = _part_top(removed, setup)
    below = np.where((removed.owner >= 0) & np.isfinite(part_height), part_height - removed.height, -1.0)
    if below.max() > GOUGE_TOLERANCE:
        i, j = np.unravel_index(int(below.argmax()), below.shape)
        place = (removed.origin[0] + i * removed.settings.spacing, removed.origin[1] + j * removed.settings.spacing,
                 float(removed.height[i, j]))
        line = laid.path.line[laid.moves.block[removed.owner[i, j]]]
        doubts.append(Doubt("gouge", f"line {line} cuts {1e3 * below.max():.3g} mm into the part at {place_words(place)}",
                            "check the offset and the length of the tool", grave=True))
    return doubts


def _part_top(removed: RemovedMaterial, setup: MachiningSetup) -> np.ndarray:
    """Return the height of the part's top over the dexels of the stock, m; minus infinity beside it."""
    from toolpoint.material_removal.mesh_intervals import cross_mesh

    Stock.mesh(setup.part)  # refuses what encloses nothing
    nx, ny = removed.height.shape
    h = removed.settings.spacing
    intervals = cross_mesh(setup.part, removed.origin[0] + h * np.arange(nx), removed.origin[1] + h * np.arange(ny))
    with np.errstate(all="ignore"):
        return np.asarray(np.where(np.isnan(intervals[..., 1]), -np.inf, intervals[..., 1]).max(axis=2))


def question_loads(blocks: BlockTable, removed: RemovedMaterial, laid: ProgramPath, *, setup: MachiningSetup) -> list[Doubt]:
    """Return doubts about loads beyond the stated limits, cuts above the edges, thick chips and plunges of flat ends."""
    doubts = []
    limits, bending = setup.limits, np.full(laid.speed.size, setup.limits.bending)
    for what, column, limit, unit in (("spindle power", "power", limits.power_at(laid.speed), "W"),
                                      ("spindle torque", "peak_torque", limits.torque_at(laid.speed), "N m"),
                                      ("bending of the tool", "bending", bending, "N m")):
        values = blocks.loads[column]
        ratio = values / np.where(values > 0, limit, 1.0)
        if ratio.max(initial=0.0) > 1:
            k = int(ratio.argmax())
            doubts.append(Doubt(what, f"{values[k]:.4g} {unit} in line {blocks.line[k]}, the limit is {limit[k]:.4g} {unit} "
                                f"at {laid.speed[k]:.0f} rev/min ({int((ratio > 1).sum())} blocks beyond it)",
                                "a lower feed, or less depth", figure=float(ratio[k]) - 1, grave=True))
    fast = laid.speed[blocks.verdict > 0]
    if fast.size and fast.max() > setup.limits.speed:
        k = int(np.argmax(np.where(blocks.verdict > 0, laid.speed, 0.0)))
        doubts.append(Doubt("spindle speed", f"{laid.speed[k]:g} rev/min in line {blocks.line[k]}, the limit is "
                                             f"{setup.limits.speed:g} rev/min", grave=True))
    return [*doubts, *_question_chips(blocks, removed, laid), *_question_edges(removed, laid, setup)]


def _question_chips(blocks: BlockTable, removed: RemovedMaterial, laid: ProgramPath) -> list[Doubt]:
    """Doubt feeds of a tooth that no tool takes: S or F is not what was meant."""
    shape_index = laid.moves.rows[removed.piece, 12].astype(int)
    diameter_of = np.zeros(blocks.line.size)
    np.maximum.at(diameter_of, laid.moves.block[removed.piece], _diameters(removed, shape_index))
    chip = blocks.loads["chip"]
    ratio = chip / np.where(diameter_of > 0, diameter_of, np.inf)
    if ratio.max(initial=0.0) <= MAX_CHIP_RATIO:
        return []
    k = int(ratio.argmax())
    return [Doubt("chips", f"line {blocks.line[k]} feeds {1e3 * chip[k]:.3g} mm a tooth with a tool of "
                  f"{1e3 * diameter_of[k]:.3g} mm ({laid.speed[k]:g} rev/min, {60e3 * laid.feed[k]:.4g} mm/min)",
                  "S, F or the unit is not what was meant", figure=float(ratio[k]), grave=True)]


def _diameters(removed: RemovedMaterial, shape_index: np.ndarray) -> np.ndarray:
    return np.array([shape.diameter for shape in removed.shapes])[shape_index]


def _question_edges(removed: RemovedMaterial, laid: ProgramPath, setup: MachiningSetup) -> list[Doubt]:
    """Doubt cuts that stand higher than the edges, and plunges of flat ends, whose forces are not in the law."""
    doubts = []
    shape_index = laid.moves.rows[removed.piece, 12].astype(int)
    flutes = np.array([shape.flute_length for shape in removed.shapes])[shape_index]
    over = removed.reach > flutes * (1 - 1e-6)
    if over.any():
        k = int(np.argmax(over))
        doubts.append(Doubt("edges", f"line {laid.path.line[laid.moves.block[removed.piece[k]]]}: material stands as high "
                                     f"as the edges are long, "
                            f"{1e3 * flutes[k]:g} mm, or higher", "a tool with longer edges, or less depth", grave=True))
    unknown = np.isinf(flutes) & (removed.reach > MAX_UNKNOWN_EDGE_RATIO * _diameters(removed, shape_index))
    if unknown.any():
        k = int(np.argmax(np.where(unknown, removed.reach, 0.0)))
        doubts.append(Doubt("edges", f"line {laid.path.line[laid.moves.block[removed.piece[k]]]} cuts "
                                     f"{1e3 * removed.reach[k]:.3g} mm deep, and no "
                            "length of the edges is given", "give `flute_length`"))
    flat = np.array([shape.flat > 1e-6 * shape.radius for shape in removed.shapes])[shape_index]
    goes_down = removed.feed[:, 2] < -MIN_PLUNGE_SLOPE
    # Rapids are told by themselves.
    plunges = ~laid.moves.rapid[removed.piece] & flat & goes_down & (removed.volume[removed.piece] > 0)
    if plunges.any():
        lines = laid.path.line[laid.moves.block[removed.piece[plunges]]]
        count = len(set(lines.tolist()))
        which = f"line {lines[0]} plunges" if count == 1 else f"{count} lines plunge, the first line {lines[0]},"
        doubts.append(Doubt("plunging", f"{which} with a flat end: the force of its centre is not computed",
                            "their loads are too low" if count > 1 else "its load is too low"))
    return doubts
