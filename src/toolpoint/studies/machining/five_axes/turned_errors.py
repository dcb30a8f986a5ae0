"""Errors of the blocks of a five-axis program: walls and what ends leave along the tool's own axes, and the servo's part."""

from __future__ import annotations

import numpy as np

from toolpoint._check import FloatArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.block_errors import BlockErrors
from toolpoint.studies.machining.errors.floor_errors import FloorErrors
from toolpoint.studies.machining.errors.wall_errors import WallErrors, larger_of, largest_of_sign, total_errors
from toolpoint.studies.machining.five_axes.turned_course import TurnedServoCourse
from toolpoint.studies.machining.program_path import ProgramPath


def table_turned_errors(walls: WallErrors, floors: FloorErrors, course: TurnedServoCourse | Doubt | None, *, arcs: PlaceArcs,
                        laid: ProgramPath, removed: TurnedRemoval) -> BlockErrors:
    """Return the errors of the segments of a five-axis program from those of its walls, of its ends and of its servo."""
    n = laid.path.count
    location, _ = total_errors(walls, arcs, None, laid=laid, removed=removed)
    unknown = np.full(n, np.nan)
    marks = larger_of(_largest(walls.marks, laid.moves.block[removed.piece[arcs.place]], n), floors.marks)
    columns = {"total": larger_of(location, floors.location), "location": location, "floor": floors.location,
               "contour": unknown, "push": unknown, "marks": marks, "cusp": floors.cusp, "feed_force": unknown,
               "drive_use": unknown}
    if not isinstance(course, TurnedServoCourse):
        doubts = (*walls.doubts, *floors.doubts, *([course] if isinstance(course, Doubt) else []))
        return BlockErrors(columns, doubts, floors.notes, walls, floors)
    limited = course.use if course.use.any() else unknown
    columns |= {"total": total_along_normals(walls, floors, course, arcs=arcs, removed=removed), "contour": course.contour,
                "push": course.push, "feed_force": course.feed_force, "drive_use": limited}
    return BlockErrors(columns, (*walls.doubts, *floors.doubts, *course.doubts), (*floors.notes, *course.notes), walls, floors)


def total_along_normals(walls: WallErrors, floors: FloorErrors, course: TurnedServoCourse, *, arcs: PlaceArcs,
                        removed: TurnedRemoval) -> FloatArray:
    """Return the total error of every block, m: vibration and servo along the normal of the wall, or of what the end leaves.

    At the samples of the servo, with the frame of the tool in their step; positive where material is left, the largest in size.
    """
    assert removed.frame is not None
    n = floors.location.size
    at_step = np.full(removed.moves.count, -1)
    at_step[removed.piece[arcs.place]] = np.arange(arcs.place.size)  # ends stand behind starts
    samples = np.flatnonzero(at_step[course.step] >= 0)
    step, block = course.step[samples], course.block[samples]
    place = at_step[step]
    deviation = np.einsum("nij,ni->nj", removed.frame[arcs.place[place]], course.deviation[samples])
    angle = arcs.angle[place]
    to_left = deviation[:, 1] * np.cos(angle) - deviation[:, 0] * np.sin(angle)
    totals = [largest_of_sign(walls.location[place, k] - sign * to_left, block, n) for k, sign in ((0, 1.0), (1, -1.0))]
    normal = floors.surface.normal_at(step, block)
    outward = (deviation * normal).sum(axis=1)
    return larger_of(larger_of(*totals), largest_of_sign(floors.location[block] + outward, block, n))


def list_error_grounds(errors: BlockErrors, cutting: np.ndarray) -> list[str]:
    """Return what the errors of the blocks rest on, where any is known."""
    names = {name for name, values in errors.columns.items() if np.isfinite(values[cutting]).any()}
    notes = []
    if "location" in names:
        notes.append("Errors of walls are across the feed and the tool's axis, of stable forced vibration; of bull noses and "
                     "balls only what the cylinder above leaves.")
    if names & {"floor", "cusp"}:
        notes.append("Errors and cusps of what the tool's end leaves (balls, corners, flat ends and their rims) are along the "
                     "mean normal in the step with the largest force of a block; cusps are those of straight tracks, beside "
                     "neighbours of other blocks; between tracks nearer than the dexels some are not known.")
    if "marks" in names:
        notes.append("Feed marks are those of a rigid tool with its run-out and pitch, on what its cylinder or its ball "
                     "leaves; of rims and corners that lean they are not known.")
    if "contour" in names:
        notes.append("The contour is the deviation of the tip across its way in the work; the total takes of it what points "
                     "along the normal of the wall or of what the end leaves. The servo meets the mean cutting force of "
                     "each place.")
    return notes


def _largest(values: FloatArray, block: np.ndarray, count: int) -> FloatArray:
    largest = np.full(count, -1.0)
    has_value = ~np.isnan(values)
    np.maximum.at(largest, block[has_value], values[has_value])
    return np.where(largest >= 0, largest, np.nan)
