"""One call: the dynamics of the work along a program, of a part by finite elements or of measured responses."""

from __future__ import annotations

from collections.abc import Callable

from toolpoint._check import fail
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork, follow_responses
from toolpoint.studies.machining.thin_walls.part_course import follow_part
from toolpoint.studies.machining.thin_walls.work_course import WorkCourse


def follow_work(work: ClampedPart | MeasuredWork, arcs: PlaceArcs, *, removed: RemovedMaterial, laid: ProgramPath,
                damping: str = "viscous", progress: Callable[[int, int], None] = lambda finished, total: None
                ) -> WorkCourse:
    """Return the response of the work at every place that cuts.

    damping : of the tool's modes, so that both can be joined as modes; progress : of stages solved.

    Raises ToolpointError where the program does not meet the part, or cuts before the first measured response.
    """
    if isinstance(work, MeasuredWork):
        return follow_responses(work, arcs, removed=removed, laid=laid)
    return follow_part(work, arcs, removed=removed, laid=laid, damping=damping, progress=progress)


def refuse_turned_work(work: ClampedPart | MeasuredWork | None, kind: str) -> None:
    """Refuse work that gives way in a program that turns the tool; kind : of the program, in words.

    Raises ToolpointError; nothing where the work is rigid.
    """
    if work is not None:
        fail("work", f"given with a program of {kind}", "must be of three axes upright: the response of the part is taken "
             "along X, Y and Z", remedy="judge the upright part of the program by itself")
