"""Loads of every place along a program, by the force laws over its arcs; the largest of each block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.cutting.build import coefficients_of, tool_of
from toolpoint.cutting.force.arc_forces import ArcForces, arc_forces
from toolpoint.material_removal import MillShape, RemovedMaterial
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup

LOAD_COLUMNS = ("lateral", "axial", "torque", "peak_torque", "power", "bending", "chip")


@dataclass(frozen=True, eq=False)
class CutLoads:
    """Loads at every place, (n,): lateral and axial force (N), mean and largest torque (N m), power (W), bending moment at the
    holder (N m), largest chip (m); feed per tooth (m); force : (n, 3) mean force on the tool along the program's axes, N."""

    lateral: FloatArray
    axial: FloatArray
    torque: FloatArray
    peak_torque: FloatArray
    power: FloatArray
    bending: FloatArray
    chip: FloatArray
    feed_per_tooth: FloatArray
    force: FloatArray


def place_loads(removed: RemovedMaterial, laid: ProgramPath, setup: MachiningSetup) -> CutLoads:
    """Return the loads at every place of a removal."""
    block = laid.moves.block[removed.piece]
    columns: dict[str, FloatArray] = {name: np.zeros(removed.piece.size) for name in (*LOAD_COLUMNS, "feed_per_tooth")}
    columns["force"] = np.zeros((removed.piece.size, 3))
    shape_index = laid.moves.rows[removed.piece, 12].astype(int)
    for k, number in enumerate(laid.numbers):
        places = np.flatnonzero((shape_index == k) & (removed.reach > 0))
        if not places.size:
            continue
        cut = setup.cut_of(number)
        tool, shape = tool_of(cut), removed.shapes[k]
        speed = laid.speed[block[places]]
        rate = laid.feed[block[places]] if laid.place_feed is None else laid.place_feed[places]
        feed = rate * 60 / (speed * tool.teeth)
        way = removed.feed[places]
        direction = np.stack([np.hypot(way[:, 0], way[:, 1]), way[:, 2]], axis=1)
        lever = setup.stick_out or cut.tool.flute_length or 3 * tool.diameter
        forces = arc_forces(tool, coefficients_of(cut), removed.arcs[places], edges=slice_edges(shape, removed.reach[places],
                            removed.arcs.shape[1]), feed=feed, direction=direction, lever=lever)
        _put(columns, places, forces, speed, feed)
        columns["force"][places] = _along_axes(forces.mean, way)
    return CutLoads(**columns)


def _put(columns: dict[str, FloatArray], places: np.ndarray, forces: ArcForces, speed: FloatArray, feed: FloatArray) -> None:
    for name in ("lateral", "axial", "torque", "peak_torque", "bending", "chip"):
        columns[name][places] = getattr(forces, name)
    columns["power"][places] = forces.torque * speed * np.pi / 30
    columns["feed_per_tooth"][places] = feed


def _along_axes(force: FloatArray, way: FloatArray) -> FloatArray:
    """Return forces (n, 3) of the frames of unit feeds (n, 3) along the program's axes; of a plunge that of a feed in x."""
    level = np.hypot(way[:, 0], way[:, 1])
    safe = np.where(level > 1e-9, level, 1.0)
    x, y = np.where(level > 1e-9, way[:, 0] / safe, 1.0), np.where(level > 1e-9, way[:, 1] / safe, 0.0)
    return np.stack([force[:, 0] * x - force[:, 1] * y, force[:, 0] * y + force[:, 1] * x, force[:, 2]], axis=1)


def slice_edges(shape: MillShape, reach: FloatArray, slices: int) -> FloatArray:
    """Return height, kappa, radius and length of the slices of every place, (n, slices, 4)."""
    total = shape.edge_length(reach)[:, None]
    length = total * (np.arange(slices) + 0.5) / slices
    height, turn, c = shape.height_at(length), np.pi / 2 - shape.taper, shape.corner_radius
    kappa = np.minimum(length / c, turn) if c > 0 else np.full(length.shape, turn)
    flat = max(shape.flat, 0.0)
    radius = flat + c * np.sin(kappa) + np.maximum(length - c * turn, 0.0) * np.sin(shape.taper)
    return np.stack([height, kappa, radius, np.broadcast_to(total / slices, length.shape)], axis=-1)


def largest_of_blocks(values: FloatArray, block: np.ndarray, count: int) -> FloatArray:
    """Return the largest value of each block, 0 where it has none."""
    out = np.zeros(count)
    np.maximum.at(out, block, np.abs(values))
    return out
