"""Doubts about the dynamics of a part that is cut: its mesh, its stages, its place, and what one response stands for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.part_responses import GROUP_STEP, MIN_MODE_SHARE
from toolpoint.studies.machining.thin_walls.part_stages import MODE_COUNT, StageCourse
from toolpoint.studies.machining.thin_walls.wall_contacts import WallThickness

MAX_VOLUME_DIFFERENCE = 0.02  # of the removed volume, between the stock and the part
MAX_MESH_ERROR = 0.02  # of a frequency
MIN_ELEMENTS_ACROSS = 1.5  # of a wall: fewer are one
MAX_SPREAD = 1.2  # mean square over squared mean of the motion along the cut's height
MAX_DISTANCE = 1e-3  # m, of a contact from the part


def question_course(part: ClampedPart, course: StageCourse, *, removed: RemovedMaterial, distance: FloatArray,
                    spread: FloatArray, walls: Sequence[WallThickness], error: float | None, line: IndexArray
                    ) -> tuple[list[Doubt], list[str]]:
    """Return the doubts and the notes of a part's course.

    distance (m), spread, line : (m,) of the places that cut; error : of the mesh, relative.
    """
    doubts = [*_place(course, removed, distance, line), *_mesh(walls, error), *_height(spread, line)]
    last = course.stages[-1].state
    loose = max(stage.state.loose_volume for stage in course.stages)
    if loose > 0:
        doubts.append(Doubt("loose pieces", f"{1e9 * loose:.3g} mm^3 of the part are cut off and left out of its response",
                            "hold them too, or leave a bridge", figure=loose))
    if course.is_capped:
        doubts.append(Doubt("stages of the work", f"{len(course.stages)} stages are solved at most; a frequency changes by "
                            f"up to {100 * course.change.max():.0f} % between two", "judge a part of the program",
                            figure=float(course.change.max())))
    ratio = course.stages[-1].damping_ratio
    damping = f"{100 * part.damping_ratio:.2g} %, as given" if part.damping_ratio else \
        f"{100 * ratio.min():.2g} % of the last stage's modes, by the loss factors of the material alone"
    notes = [f"The work's own response: {part.name}, {course.cut.model.element_count} elements, {len(course.stages)} "
             f"stages, the lowest frequencies within {100 * course.change.max(initial=0.0):.1f} % from one to the next (the "
             f"nearer stage counts); {MODE_COUNT} modes of each, up to {course.stages[-1].frequency[-1]:.0f} Hz at the end, "
             f"where their peak is above {100 * MIN_MODE_SHARE:.0f} % of the largest at a place, and what answers "
             f"at once; damping {damping}; {1e9 * last.volume:.5g} mm^3 left.",
             "Held faces of the work do not move, and the tool and the work stand on structures that do not move each other; "
             f"places whose amplitudes differ by less than {100 * GROUP_STEP:.0f} % of the largest share the response of the "
             "one that gives way most. The motion of the wall is averaged over the height of the cut."]
    notes += ["What the mesh of the work errs by is not known."] if error is None else [
        f"The mesh of the work errs by about {100 * max(error, 1e-5):.2g} % in the lowest frequencies of the last stage, twice "
        "that in compliance (from a mesh 1.5 times as coarse, no bound)."]
    if not part.damping_ratio:
        doubts.append(Doubt("damping of the work", f"{100 * ratio.min():.2g} %, of its material alone; clamped faces rub, and "
                            "add to it", "strike the clamped work, and give its damping ratio"))
    return doubts, notes


def _place(course: StageCourse, removed: RemovedMaterial, distance: FloatArray, line: IndexArray) -> list[Doubt]:
    """Doubt a part that is not the stock, and cuts beside it."""
    doubts = list[Doubt]()
    first, last = (course.stages[k].state for k in (0, -1))
    taken = first.volume - last.volume - last.loose_volume + first.loose_volume
    difference = abs(taken / removed.total_volume - 1) if removed.total_volume > 0 else 0.0
    if difference > MAX_VOLUME_DIFFERENCE:
        doubts.append(Doubt("part and stock", f"the program takes {1e9 * removed.total_volume:.5g} mm^3 from the stock and "
                            f"{1e9 * taken:.5g} mm^3 from the part by finite elements", "give both the same shape, in the same "
                            "coordinates", figure=difference, grave=difference > 0.2))
    away = distance > MAX_DISTANCE
    if away.any():
        doubts.append(Doubt("place of the cut", f"{int(away.sum())} of {away.size} places cut up to {1e3 * distance.max():.2g} "
                            f"mm beside the part, the first in line {int(line[away].min())}: the response of its nearest place "
                            "is taken", "give part and stock the same shape", figure=float(away.mean())))
    return doubts


def _mesh(walls: Sequence[WallThickness], error: float | None) -> list[Doubt]:
    """Doubt a mesh that is coarse for its walls."""
    doubts = list[Doubt]()
    elements = np.concatenate([part.elements[np.isfinite(part.thickness)] for part in walls])
    thickness = np.concatenate([part.thickness[np.isfinite(part.thickness)] for part in walls])
    if elements.size and elements.min() < MIN_ELEMENTS_ACROSS:
        k = int(elements.argmin())
        known = "" if error is None else f"; by a coarser mesh its frequencies err by about {100 * max(error, 1e-5):.2g} %"
        doubts.append(Doubt("mesh of the work", f"a wall of {1e3 * thickness[k]:.2g} mm is {elements[k]:.2g} elements thick"
                            + known, "a finer mesh shows what that changes", figure=float(elements[k])))
    if error is not None and error > MAX_MESH_ERROR:
        doubts.append(Doubt("mesh of the work", f"frequencies of the last stage err by about {100 * error:.2g} %, its "
                            f"compliance by {200 * error:.2g} %", "a finer mesh", figure=error))
    return doubts


def _height(spread: FloatArray, line: IndexArray) -> list[Doubt]:
    """Doubt deep cuts along which the wall moves unevenly: one response stands for their whole height."""
    uneven = spread > MAX_SPREAD
    if not uneven.any():
        return []
    k = int(np.where(np.isfinite(spread), spread, 0.0).argmax())
    return [Doubt("height of the cut", f"in {int(uneven.sum())} of {uneven.size} places the wall moves unevenly along "
                  f"the edge, most in line {int(line[k])} (mean square {spread[k]:.2f} of the squared mean): its mean stands "
                  "for the whole height", "judge shallower passes", figure=float(spread[k]))]
