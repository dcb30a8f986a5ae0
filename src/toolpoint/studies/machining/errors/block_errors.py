"""BlockErrors: what every block leaves beside its surface, of servo, forced vibration and feed, and how far drives are used."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.floor_errors import FloorErrors, total_along_normals
from toolpoint.studies.machining.errors.servo_course import ServoCourse
from toolpoint.studies.machining.errors.wall_errors import WallErrors, larger_of, total_errors
from toolpoint.studies.machining.program_path import ProgramPath

ERROR_HEADER = ("line", "total µm", "wall µm", "floor µm", "contour µm", "push µm", "feed marks µm", "cusp µm", "feed force N",
                "drives %")
ERROR_COLUMNS = ("total", "location", "floor", "contour", "push", "marks", "cusp", "feed_force", "drive_use")
UNIT_OF_COLUMN = {"feed_force": "n", "drive_use": "ratio"}  # all others are lengths in m


@dataclass(frozen=True, eq=False)
class BlockErrors:
    """Errors of every segment by the names of `ERROR_COLUMNS`, (n,), not a number where not known.

    total : along the normal of wall or floor, the larger, m, positive where material is left; location : of the forced
    vibration at walls, m; floor : of it along the normal of what the tool's end leaves, m; contour : largest distance of the
    tables from the path, m; push : further motion of the servo under the mean cutting force, m; marks : height of the feed
    marks, m; cusp : between neighbouring tracks of a ball, m; feed_force : N; drive_use : share of a limit of torque or
    current. `walls` at the places, `floors` of the blocks.
    """

    columns: dict[str, FloatArray]
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()
    walls: WallErrors | None = None
    floors: FloorErrors | None = None

    @property
    def order(self) -> np.ndarray:
        """Blocks of which an error is known, the largest total first, then the largest contour error."""
        total, contour = (np.nan_to_num(np.abs(self.columns[name]), nan=-1.0) for name in ("total", "contour"))
        order = np.lexsort((-contour, -total))
        return order[(total >= 0)[order] | (contour >= 0)[order]]

    def row(self, k: int, line: int) -> list[str]:
        """Return the cells of a block, see `ERROR_HEADER`."""
        c = self.columns
        lengths = [_cell(1e6 * c[name][k], ".2f") for name in
                   ("total", "location", "floor", "contour", "push", "marks", "cusp")]
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


def table_errors(walls: WallErrors, floors: FloorErrors, course: ServoCourse | Doubt | None, *, arcs: PlaceArcs,
                 laid: ProgramPath, removed: RemovedMaterial) -> BlockErrors:
    """Return the errors of the segments of a program from those of its walls, of its floors and of its servo."""
    n = laid.path.count
    motion = course if isinstance(course, ServoCourse) else None
    location, wall_total = total_errors(walls, arcs, motion, laid=laid, removed=removed)
    total = larger_of(wall_total, total_along_normals(floors, motion))
    marks, block = floors.marks.copy(), laid.moves.block[removed.piece[arcs.place]]
    has_marks = ~np.isnan(walls.marks)
    marks[block[has_marks]] = np.nan_to_num(marks[block[has_marks]])
    np.maximum.at(marks, block[has_marks], walls.marks[has_marks])
    unknown = np.full(n, np.nan)
    columns = {"total": total, "location": location, "floor": floors.location, "contour": unknown, "push": unknown,
               "marks": marks, "cusp": floors.cusp, "feed_force": unknown, "drive_use": unknown}
    if motion is None:
        doubts = (*walls.doubts, *floors.doubts, *([course] if isinstance(course, Doubt) else []))
        return BlockErrors(columns, doubts, floors.notes, walls, floors)
    limited = motion.use if motion.use.any() else unknown
    columns |= {"contour": motion.contour, "push": motion.push, "feed_force": motion.feed_force, "drive_use": limited}
    return BlockErrors(columns, (*walls.doubts, *floors.doubts, *motion.doubts), (*floors.notes, *motion.notes), walls,
                       floors)


def error_notes(errors: BlockErrors, cutting: np.ndarray) -> Sequence[str]:
    """Return what the errors of the blocks rest on, where any is known."""
    names = {name for name, values in errors.columns.items() if np.isfinite(values[cutting]).any()}
    if not names:
        return []
    notes = ["Errors of walls are level and normal to the feed. Those of floors and of what balls leave are along the normal "
             "of the surface that stays to the end, at the place of a block with the largest force; of bull noses only the "
             "flat floor counts. Blocks that chatter have no forced vibration. Feed marks are those of a rigid tool with its "
             "run-out and pitch; those of a flat end on a floor hang on its dish, which is not known."]
    if {"location", "contour"} <= names or {"floor", "contour"} <= names:
        notes += ["The total adds servo and forced vibration as if both were largest at once. Springs of drives in the machine "
                  "file that hold the servo's own stiffness are counted twice."]
    elif {"location", "floor"} & names:
        notes += ["The total holds no error of the servo: no drives are given."]
    return notes


def _cell(value: float, digits: str) -> str:
    return f"{value:{digits}}" if np.isfinite(value) else "-"
