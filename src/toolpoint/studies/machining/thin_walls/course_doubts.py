"""Doubts about the dynamics of a part that is cut: its mesh, its stages, its place, and what one response stands for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import UNKNOWN, Doubt
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.part_responses import GROUP_STEP, MIN_MODE_SHARE
from toolpoint.studies.machining.thin_walls.part_stages import STAGE_MODE_COUNT, StageCourse
from toolpoint.studies.machining.thin_walls.part_states import RESPONSE_CHANGE
from toolpoint.studies.machining.thin_walls.wall_contacts import ThicknessAtCuts
from toolpoint.vibration import Frf, Modes

MAX_VOLUME_DIFFERENCE = 0.02  # of the removed volume, between the stock and the part
MAX_STAGE_MESH_ERROR = 0.005  # of a frequency
FLANK_RATIO = 20  # relative change of a limit on the flank of a lobe over that of the wall's frequency
MIN_ELEMENTS_ACROSS = 1.5  # of a wall: fewer are one
MAX_SPREAD = 1.2  # mean square over squared mean of the motion along the cut's height
MIN_WIDTH_LINES = 2.0  # lines of a measured tool within the half width of a resonance of the work
MAX_LOST_COMPLIANCE = 0.02  # of a place's static compliance, above the band of a measured tool
MAX_DISTANCE = 1e-3  # m, of a contact from the part


def question_course(part: ClampedPart, course: StageCourse, *, removed: RemovedMaterial, distance: FloatArray,
                    spread: FloatArray, walls: Sequence[ThicknessAtCuts], error: float | None, line: IndexArray,
                    states: int, step: float) -> tuple[list[Doubt], list[str]]:
    """Return the doubts and the notes of a part's course.

    distance (m), spread, line : (m,) of the places that cut; error : of the mesh, relative; states : number of those at which
    the response is taken; step : largest relative change of a frequency from one to the next.
    """
    doubts = [*part.doubts, *_place(course, removed, distance, line), *_mesh(walls, error), *_height(spread, line)]
    last = course.stages[-1].state
    loose = max(stage.state.loose_volume for stage in course.stages)
    if loose > 0:
        doubts.append(Doubt("loose pieces", f"{1e9 * loose:.3g} mm^3 of the part are cut off and left out of its response",
                            "hold them too, or leave a bridge", figure=loose))
    if course.is_capped:
        doubts.append(Doubt("stages of the work", f"{len(course.stages)} stages are solved at most; a frequency changes by "
                            f"up to {100 * course.change.max():.0f} % between two", "judge a part of the program",
                            figure=float(course.change.max())))
    if step > 2 * RESPONSE_CHANGE:
        doubts.append(Doubt("states of the work", f"{states} are solved at most; a frequency changes by up to "
                            f"{100 * step:.1f} % between two, and a limit on a lobe's flank by {FLANK_RATIO} times that",
                            "judge a part of the program", figure=step))
    ratio = course.stages[-1].damping_ratio
    damping = f"{100 * part.damping_ratio:.2g} %, as given" if part.damping_ratio else \
        f"{100 * ratio.min():.2g} % of the last stage's modes, by the loss factors of the material alone"
    notes = [f"The work's own response: {part.name}, {course.cut.model.element_count} elements, {len(course.stages)} "
             f"stages, the lowest frequencies within {100 * course.change.max(initial=0.0):.1f} % from one to the next, and "
             f"{states} states by the modes of the stages around, within {100 * step:.2g} %; {STAGE_MODE_COUNT} modes of "
             f"each, up to {course.stages[-1].frequency[-1]:.0f} Hz at the "
             f"end, where their peak is above {100 * MIN_MODE_SHARE:.0f} % of the largest at a place, and what answers "
             f"at once; damping {damping}; {1e9 * last.volume:.5g} mm^3 left.",
             "Held faces of the work do not move, and the tool and the work stand on structures that do not move each other; "
             f"places whose amplitudes differ by less than {100 * GROUP_STEP:.0f} % of the largest share the response of the "
             "one that gives way most. The motion of the wall is averaged over the height of the cut."]
    notes += [] if error is None else [
        f"The mesh of the work errs by about {100 * max(error, 1e-5):.2g} % in the lowest frequencies, twice that in "
        "compliance (from a second mesh at three stages, no bound). The stated error of every limit holds what that changes."]
    if not part.damping_ratio:
        doubts.append(Doubt("damping of the work", f"{100 * ratio.min():.2g} %, of its material alone; clamped faces rub, and "
                            "add to it", "strike the clamped work, and give its damping ratio"))
    return doubts, notes


def question_lines(tool: Modes | Frf, work: Sequence[ToolDynamics]) -> list[Doubt]:
    """Return the doubts about modes of the work that the lines of a measured tool cannot show; none beside modes of a tool."""
    modes = [each.response for each in work if isinstance(each.response, Modes)]
    if not isinstance(tool, Frf) or not modes:
        return []
    spacing, last = float(np.diff(tool.frequency).max()), float(tool.frequency[-1])
    doubts = list[Doubt]()
    width = [np.where(part.frequency < last, part.frequency * part.damping_ratio, np.inf).min() for part in modes]
    if min(width) < MIN_WIDTH_LINES * spacing:
        doubts.append(Doubt("response of the work", f"its sharpest resonance is {2 * min(width):.2g} Hz wide, and the tool "
                            f"was measured every {spacing:.2g} Hz: peaks between lines are missed", "identify the tool's modes "
                            "(toolpoint identify), and give them (--modes)", grave=min(width) < 0.5 * spacing))
    compliance = [(np.abs(part.shape) ** 2 / part.omega**2).sum(axis=0) for part in modes]
    share = max(float(each[part.frequency > last].sum() / each.sum()) for part, each in zip(modes, compliance, strict=True))
    if share > MAX_LOST_COMPLIANCE:
        doubts.append(Doubt("response of the work", f"up to {100 * share:.0f} % of its compliance comes from modes above the "
                            f"tool's last line, {last:.0f} Hz, and is left out", "identify the tool's modes, and give them "
                            "(--modes)", figure=share))
    return doubts


def _place(course: StageCourse, removed: RemovedMaterial, distance: FloatArray, line: IndexArray) -> list[Doubt]:
    """Doubt a part that is not the stock, and cuts beside it."""
    doubts = list[Doubt]()
    states = [course.stages[k].state for k in (0, -1)]
    taken = -float(np.diff([state.volume + state.loose_volume for state in states])[0])
    difference = abs(taken / removed.total_volume - 1) if removed.total_volume > 0 else 0.0
    if difference > MAX_VOLUME_DIFFERENCE:
        doubts.append(Doubt("part and stock", f"the program takes {1e9 * removed.total_volume:.5g} mm^3 from the stock and "
                            f"{1e9 * taken:.5g} mm^3 from the part by finite elements", "give both the same shape, in the same "
                            "coordinates", figure=difference, grave=difference > 0.2))
    is_beside = distance > MAX_DISTANCE
    if is_beside.any():
        first = int(line[is_beside].min())
        doubts.append(Doubt("place of the cut", f"{int(is_beside.sum())} of {is_beside.size} places cut up to "
                            f"{1e3 * distance.max():.2g} mm beside the part, the first in line {first}: the response of its "
                            "nearest place is taken", "give part and stock the same shape", figure=float(is_beside.mean())))
    return doubts


def _mesh(walls: Sequence[ThicknessAtCuts], error: float | None) -> list[Doubt]:
    """Doubt a mesh that is coarse for its walls, in one sentence: how thick they are, and what is known of its error."""
    elements = np.concatenate([part.elements[np.isfinite(part.thickness)] for part in walls])
    thickness = np.concatenate([part.thickness[np.isfinite(part.thickness)] for part in walls])
    is_thin = bool(elements.size) and float(elements.min()) < MIN_ELEMENTS_ACROSS
    words = []
    if is_thin:
        k = int(elements.argmin())
        words.append(f"a wall of {1e3 * thickness[k]:.2g} mm is {elements[k]:.2g} elements thick")
    if error is None:
        words.append("what it errs by is not known")
    elif is_thin or error > MAX_STAGE_MESH_ERROR:
        words.append(f"its frequencies err by about {100 * max(error, 1e-5):.2g} %, its compliance by "
                     f"{200 * max(error, 1e-5):.2g} %; the stated errors of limits hold that, on the flank of a lobe up to "
                     f"about {100 * FLANK_RATIO * max(error, 1e-5):.2g} %")
    if not words:
        return []
    remedy = "a finer mesh shows what that changes"
    if error is None:
        remedy = "compare a finer mesh; of boxes (elastic) its error is estimated"
    return [Doubt("mesh of the work", "; ".join(words), remedy,
                  figure=float(elements.min()) if is_thin else UNKNOWN if error is None else error)]


def _height(spread: FloatArray, line: IndexArray) -> list[Doubt]:
    """Doubt deep cuts along which the wall moves unevenly: one response stands for their whole height."""
    uneven = spread > MAX_SPREAD
    if not uneven.any():
        return []
    k = int(np.where(np.isfinite(spread), spread, 0.0).argmax())
    return [Doubt("height of the cut", f"in {int(uneven.sum())} of {uneven.size} places the wall moves unevenly along "
                  f"the edge, most in line {int(line[k])} (mean square {spread[k]:.2f} of the squared mean): its mean stands "
                  "for the whole height", "judge shallower passes", figure=float(spread[k]))]
