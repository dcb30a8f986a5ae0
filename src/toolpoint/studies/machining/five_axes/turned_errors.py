"""Errors of the blocks of a five-axis program: walls along the tool, feed marks, and the servo's way beside the path."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.block_errors import BlockErrors
from toolpoint.studies.machining.errors.servo_course import ServoCourse
from toolpoint.studies.machining.errors.wall_errors import WallErrors, total_errors
from toolpoint.studies.machining.program_path import ProgramPath

FLOORS_LEFT_OUT = Doubt("five axes", "errors of floors and of what balls leave, and their cusps, are not computed; those of "
                        "walls are along the tool's own normal to the feed", "judge what is cut with a constant direction as "
                        "tilted planes too")


def table_turned_errors(walls: WallErrors, course: ServoCourse | Doubt | None, *, arcs: PlaceArcs, laid: ProgramPath,
                        removed: RemovedMaterial) -> BlockErrors:
    """Return the errors of the segments of a five-axis program.

    The total is the location error of the wall and the whole way of the servo beside the path, whichever way that points: an
    upper bound of the size.
    """
    n = laid.path.count
    location, _ = total_errors(walls, arcs, None, laid=laid, removed=removed)
    unknown = np.full(n, np.nan)
    columns = {"total": location, "location": location, "floor": unknown, "contour": unknown, "push": unknown,
               "marks": _largest(walls.marks, laid.moves.block[removed.piece[arcs.place]], n), "cusp": unknown,
               "feed_force": unknown, "drive_use": unknown}
    if not isinstance(course, ServoCourse):
        return BlockErrors(columns, (*walls.doubts, *([course] if isinstance(course, Doubt) else [])), (), walls)
    limited = course.use if course.use.any() else unknown
    columns |= {"total": location + np.where(location < 0, -course.contour, course.contour), "contour": course.contour,
                "push": course.push, "feed_force": course.feed_force, "drive_use": limited}
    return BlockErrors(columns, (*walls.doubts, *course.doubts), course.notes, walls)


def list_error_grounds(errors: BlockErrors, cutting: np.ndarray) -> list[str]:
    """Return what the errors of the blocks rest on, where any is known."""
    names = {name for name, values in errors.columns.items() if np.isfinite(values[cutting]).any()}
    notes = []
    if "location" in names:
        notes.append("Errors of walls are across the feed and the tool's axis, of stable forced vibration; of bull noses and "
                     "balls only what the cylinder above leaves.")
    if "marks" in names:
        notes.append("Feed marks are those of a rigid tool with its run-out and pitch, on what its cylinder leaves.")
    if "contour" in names:
        notes.append("The contour is the deviation of the tip across its way in the work; the total adds it to the wall's "
                     "error whichever way it points, an upper bound. The servo meets the mean cutting force of each place.")
    return notes


def _largest(values: FloatArray, block: np.ndarray, count: int) -> FloatArray:
    largest = np.full(count, -1.0)
    has_value = ~np.isnan(values)
    np.maximum.at(largest, block[has_value], values[has_value])
    return np.where(largest >= 0, largest, np.nan)
