"""BlockErrors: what every block leaves beside its surface, of servo, forced vibration and feed, and how far drives are used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.servo_course import ServoCourse
from toolpoint.studies.machining.errors.wall_errors import WallErrors, total_errors
from toolpoint.studies.machining.program_path import ProgramPath

ERROR_HEADER = ("line", "total µm", "location µm", "contour µm", "push µm", "feed marks µm", "feed force N", "drives %")
ERROR_COLUMNS = ("total", "location", "contour", "push", "marks", "feed_force", "drive_use")
UNIT_OF_COLUMN = {"feed_force": "n", "drive_use": "ratio"}  # all others are lengths in m


@dataclass(frozen=True, eq=False)
class BlockErrors:
    """Errors of every segment by the names of `ERROR_COLUMNS`, (n,), not a number where not known.

    total : along the normal of the wall, m, positive where material is left; location : of the forced vibration, m; contour :
    largest distance of the tables from the path, m; push : further motion of the servo under the mean cutting force, m; marks :
    height of the feed marks, m; feed_force : N; drive_use : share of a limit of torque or current. `walls` : at the places.
    """

    columns: dict[str, FloatArray]
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()
    walls: WallErrors | None = None

    @property
    def order(self) -> np.ndarray:
        """Blocks of which an error is known, the largest total first, then the largest contour error."""
        total, contour = (np.nan_to_num(np.abs(self.columns[name]), nan=-1.0) for name in ("total", "contour"))
        order = np.lexsort((-contour, -total))
        return order[(total >= 0)[order] | (contour >= 0)[order]]

    def row(self, k: int, line: int) -> list[str]:
        """Return the cells of a block, see `ERROR_HEADER`."""
        c = self.columns
        lengths = [_cell(1e6 * c[name][k], ".2f") for name in ("total", "location", "contour", "push", "marks")]
        return [str(line), *lengths, _cell(c["feed_force"][k], ".0f"), _cell(100 * c["drive_use"][k], ".0f")]

    def rows(self, line: np.ndarray, cutting: np.ndarray, *, count: int) -> list[list[str]]:
        """Return the cells of the cutting blocks with the largest errors, one a line of the program."""
        rows, lines = list[list[str]](), set[int]()
        for k in self.order.tolist():
            if cutting[k] and int(line[k]) not in lines and len(rows) < count:
                lines.add(int(line[k]))
                rows.append(self.row(k, int(line[k])))
        return rows

    def to_dict(self, k: int) -> dict[str, float | None]:
        """Return plain numbers of a block, SI; None where not known."""
        return {f"{name}_{UNIT_OF_COLUMN.get(name, 'error_m')}": float(values[k]) if np.isfinite(values[k]) else None
                for name, values in self.columns.items()}


def table_errors(walls: WallErrors, arcs: PlaceArcs, course: ServoCourse | Doubt | None, *, laid: ProgramPath,
                 removed: RemovedMaterial) -> BlockErrors:
    """Return the errors of the segments of a program from those of its walls and of its servo."""
    n = laid.path.count
    motion = course if isinstance(course, ServoCourse) else None
    location, total = total_errors(walls, arcs, motion, laid=laid, removed=removed)
    marks, block = np.full(n, np.nan), laid.moves.block[removed.piece[arcs.place]]
    has_marks = ~np.isnan(walls.marks)
    marks[block[has_marks]] = 0.0
    np.maximum.at(marks, block[has_marks], walls.marks[has_marks])
    unknown = np.full(n, np.nan)
    columns = {"total": total, "location": location, "contour": unknown, "push": unknown, "marks": marks,
               "feed_force": unknown, "drive_use": unknown}
    if motion is None:
        return BlockErrors(columns, (*walls.doubts, *([course] if isinstance(course, Doubt) else [])), (), walls)
    limited = motion.use if motion.use.any() else unknown
    columns |= {"contour": motion.contour, "push": motion.push, "feed_force": motion.feed_force, "drive_use": limited}
    return BlockErrors(columns, (*walls.doubts, *motion.doubts), motion.notes, walls)


def error_notes(errors: BlockErrors, cutting: np.ndarray) -> Sequence[str]:
    """Return what the errors of the blocks rest on, where any is known."""
    names = {name for name, values in errors.columns.items() if np.isfinite(values[cutting]).any()}
    if not names:
        return []
    notes = ["Errors are those of walls, level and normal to the feed: of floors, of balls and bull noses the forced vibration "
             "is not computed, and blocks that chatter have none. Feed marks are those of a rigid tool with its run-out and "
             "pitch."]
    if {"location", "contour"} <= names:
        notes += ["The total adds servo and forced vibration as if both were largest at once. Springs of drives in the machine "
                  "file that hold the servo's own stiffness are counted twice."]
    elif "location" in names:
        notes += ["The total holds no error of the servo: no drives are given."]
    return notes


def _cell(value: float, digits: str) -> str:
    return f"{value:{digits}}" if np.isfinite(value) else "-"
