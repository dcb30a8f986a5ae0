"""Engagement of the cutter along a side: one arc all along, or the arcs that the pixels of a block leave, side after side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.cutting import Engagement, MillingProblem
from toolpoint.cutting.simulation.pixel_bed import PixelBed
from toolpoint.studies.accuracy.cutting_table import CuttingTable, cutting_table
from toolpoint.studies.accuracy.tool_paths import PathSide

# Pixels between places at which the arc is read; points across the cutter; degrees to which arcs are rounded.
_STRIDE_PIXELS, _ACROSS_POINTS, _ARC_ROUNDING = 2, 361, 1.0
Arc = tuple[float, float] | None


@dataclass(frozen=True)
class WorkBlock:
    """A block that is milled, in the plane of the path (its x and y, m): low and high corner, and the side of its pixels.

    Examples
    --------
    >>> WorkBlock((0.0, 0.0), (0.1, 0.05), pixel=1e-3).bed().material.shape
    (1, 100, 50)
    """

    low: tuple[float, float]
    high: tuple[float, float]
    pixel: float = 1e-4

    def bed(self) -> PixelBed:
        """Return the block, nothing cut yet."""
        positive("pixel", self.pixel)
        if self.high[0] <= self.low[0] or self.high[1] <= self.low[1]:
            fail("work", f"{self.low} to {self.high}", "must have its high corner above the low one")
        return PixelBed.block(self.low, self.high, self.pixel)


@dataclass(frozen=True, eq=False)
class CutCourse:
    """Forces along a side: tables, each from a length (m, increasing, the first 0 or less) to the next.

    notes : what was simplified.
    """

    lengths: FloatArray
    tables: tuple[CuttingTable, ...]
    notes: tuple[str, ...] = ()

    @property
    def step(self) -> float:
        """Time step, s."""
        return self.tables[0].step

    @property
    def per_tooth(self) -> int:
        """Steps in a tooth period."""
        return self.tables[0].per_tooth

    def at(self, length: float) -> CuttingTable:
        """Return the table at a length."""
        return self.tables[int(self._numbers(np.array([length]))[0])]

    def parts(self, lengths: FloatArray) -> Iterator[tuple[int, int, CuttingTable]]:
        """Yield first and last + 1 of the lengths (increasing) that lie in one table, and that table."""
        number = self._numbers(lengths)
        edges = np.concatenate([[0], np.flatnonzero(np.diff(number)) + 1, [len(number)]])
        for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            yield first, last, self.tables[int(number[first])]

    def _numbers(self, lengths: FloatArray) -> np.ndarray:
        return np.clip(np.searchsorted(self.lengths, lengths, side="right") - 1, 0, len(self.tables) - 1)


def cut_course(problem: MillingProblem, arcs: Sequence[tuple[float, Arc]] | None, *, speed: float, depth: float,
               largest_feed: float, steps: int, with_force: bool = True, is_constant: bool = False) -> CutCourse:
    """Return the forces along a side.

    arcs : (length from which it holds, (entry, exit) in rad, or None where nothing is met); the problem's own arc all along
    where left out; is_constant : whether the chip is the largest one wherever the tool is.
    """
    def table_of(met: MillingProblem) -> CuttingTable:
        table = cutting_table(met, speed=speed, depth=depth, largest_feed=largest_feed, steps=steps)
        # A chip that never changes needs no other feed beside it.
        return replace(table, table=table.table[-1:].copy(), is_constant=True) if is_constant else table

    if arcs is None:
        table = table_of(problem)
        return CutCourse(np.zeros(1), (table if with_force else _without_force(table),))
    tables: dict[Arc, CuttingTable] = {}
    for _, arc in arcs:
        # Arcs are rounded to a degree, so that few tables serve many places.
        if arc not in tables:
            table = table_of(problem if arc is None else problem.changed(engagement=Engagement(*arc)))
            tables[arc] = table if arc is not None and with_force else _without_force(table)
    return CutCourse(np.array([length for length, _ in arcs]), tuple(tables[arc] for _, arc in arcs))


def _without_force(table: CuttingTable) -> CuttingTable:
    return replace(table, table=np.zeros_like(table.table), regeneration=np.zeros_like(table.regeneration))


def mill_bed(bed: PixelBed, side: PathSide, radius: float, *, is_left: bool) -> list[tuple[float, Arc]]:
    """Return the arcs that a cutter meets along a side, and cut the side out of the bed.

    Angles are clockwise from the normal to the feed, which points to the left of it (seen from above the plane of the path)
    where `is_left`, as a tool stands on it whose axis points up; rounded to a degree. Across the cutter it is looked up what
    lies just before its front; a gap between two pieces is cut as if it were filled.
    """
    count = max(int(np.ceil(side.length / (_STRIDE_PIXELS * bed.pixel))), 2)
    lengths = np.linspace(0.0, side.length, count + 1)
    centres = side.path.at(lengths)[:, :2]
    tangents = side.tangents(lengths) @ side.place[:3, :3]
    # A quarter of a pixel inside the tool: at its very edge rounding would decide whether a pixel is hit.
    across = np.linspace(-1, 1, _ACROSS_POINTS) * (radius - 0.25 * bed.pixel)
    # What is read lies just ahead of the rim: the disc under the cutter has been taken out already.
    front = np.sqrt(np.maximum(radius**2 - across**2, 0.0)) + (_STRIDE_PIXELS + 0.5) * bed.pixel
    arcs: list[tuple[float, Arc]] = []
    _remove_disc(bed, centres[0], radius)
    for length, centre, tangent in zip(lengths[:-1], centres[:-1], tangents[:-1], strict=True):
        feed = tangent[:2] / np.linalg.norm(tangent[:2])
        # The normal to the left of the feed, turned over for a tool seen from below.
        normal = np.array([-feed[1], feed[0]]) * (1 if is_left else -1)
        meets = _has_material(bed, centre + front[:, None] * feed + across[:, None] * normal)
        arc: Arc = None
        if meets.any():
            reach = across[meets] / radius
            entry, leave = np.degrees(np.arccos(np.clip([reach.max(), reach.min()], -1, 1)))
            ends = np.round(np.array([entry, leave]) / _ARC_ROUNDING) * _ARC_ROUNDING
            margin_angle = np.degrees(np.arccos(1 - 0.25 * bed.pixel / radius))
            # A quarter of a pixel at the rim is rounding: arcs that end so near the rim end at it.
            ends = np.where(ends <= margin_angle + _ARC_ROUNDING, 0.0,
                            np.where(ends >= 180 - margin_angle - _ARC_ROUNDING, 180.0, ends))
            arc = (float(np.radians(ends[0])), float(np.radians(ends[1]))) if ends[1] > ends[0] else None
        if not arcs or arcs[-1][1] != arc:
            arcs.append((float(length), arc))
        _remove_disc(bed, centre, radius)
    _remove_disc(bed, centres[-1], radius)
    return arcs


def _has_material(bed: PixelBed, places: FloatArray) -> np.ndarray:
    """Return whether there is material at places (n, 2)."""
    index = np.floor((places - np.array(bed.origin)) / bed.pixel).astype(int)
    layer = bed.material[0]
    inside = ((index >= 0) & (index < layer.shape)).all(axis=1)
    solid = np.zeros(len(places), bool)
    solid[inside] = layer[tuple(index[inside].T)]
    return solid


def _remove_disc(bed: PixelBed, centre: FloatArray, radius: float) -> None:
    """Remove a disc."""
    first_pixel = np.maximum(np.floor((centre - radius - bed.origin) / bed.pixel).astype(int), 0)
    last_pixel = np.minimum(np.ceil((centre + radius - bed.origin) / bed.pixel).astype(int) + 1, bed.material.shape[1:])
    if (last_pixel <= first_pixel).any():
        return
    x, y = (bed.origin[k] + (np.arange(first_pixel[k], last_pixel[k]) + 0.5) * bed.pixel - centre[k] for k in range(2))
    bed.material[0, first_pixel[0]:last_pixel[0], first_pixel[1]:last_pixel[1]] &= x[:, None] ** 2 + y[None, :] ** 2 > radius**2
