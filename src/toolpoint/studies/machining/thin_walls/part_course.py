"""Course of a clamped part under a program: its stages, its contacts with the tool, and its response at each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray
from toolpoint.bodies.solid.cut_solid import CutSolid
from toolpoint.material_removal import RemovedMaterial
from toolpoint.material_removal.sweep_times import SweepTimes
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.course_doubts import question_course
from toolpoint.studies.machining.thin_walls.part_responses import dynamics_of, respond
from toolpoint.studies.machining.thin_walls.part_stages import StageCourse, choose_stages, estimate_mesh_error
from toolpoint.studies.machining.thin_walls.wall_contacts import ThicknessAtCuts, contacts_of, measure_walls
from toolpoint.studies.machining.thin_walls.work_course import WorkCourse

WALL_REACH = np.radians(1.0)  # rad: an arc that ends so near to 0 or 180 degrees leaves a wall there
_LISTED_MODES = 4


def follow_part(work: ClampedPart, arcs: PlaceArcs, *, removed: RemovedMaterial, laid: ProgramPath, damping: str,
                progress: Callable[[int, int], None]) -> WorkCourse:
    """Return the response of a part at every place that cuts, see `follow_work`."""
    sweep = SweepTimes(removed.moves, removed.shapes)
    cut = CutSolid(work.model, work.held_nodes, sweep, work.springs_on(work.model))
    course = choose_stages(work, cut, progress)
    contacts = contacts_of(arcs, removed, WALL_REACH)
    stage_of = course.stage_of(removed.piece[arcs.place])
    group, compliance = np.zeros(arcs.place.size, np.int64), np.full(arcs.place.size, np.nan)
    distance, spread = np.zeros(arcs.place.size), np.ones(arcs.place.size)
    dynamics, walls = list[ToolDynamics](), list[ThicknessAtCuts]()
    lines = laid.path.line[laid.moves.block[np.minimum([s.piece for s in course.stages], removed.moves.count - 1)]]
    for k, stage in enumerate(course.stages):
        members = np.flatnonzero(stage_of == k)
        if not members.size:
            walls.append(ThicknessAtCuts(np.zeros(0), np.zeros(0)))
            continue
        responses = respond(stage, contacts, members, cut=cut, damping=damping)
        group[members] = len(dynamics) + responses.group
        words = f"{work.name} at line {lines[k]}"
        dynamics += [dynamics_of(modes, words) for modes in responses.modes]
        distance[members], spread[members] = responses.distance, responses.spread
        soft = np.array([_along(modes.shape / modes.omega, contacts.wall[members[leader]])
                         for modes, leader in zip(responses.modes, responses.leader.tolist(), strict=True)])
        compliance[members] = soft[responses.group]
        walls.append(measure_walls(contacts, members[responses.leader], stage=stage, cut=cut))
    error = estimate_mesh_error(work, course)
    rows = tuple(_row(k, course, int(lines[k]), walls[k], compliance[stage_of == k]) for k in range(len(course.stages)))
    result = WorkCourse(group, tuple(dynamics), compliance, rows, (), (), course, error, tuple(walls))
    doubts, notes = question_course(work, course, removed=removed, distance=distance, spread=spread, walls=walls, error=error,
                                    line=laid.path.line[laid.moves.block[removed.piece[arcs.place]]])
    return replace(result, doubts=tuple(doubts), notes=tuple(notes))


def _along(amplitude: FloatArray, way: FloatArray) -> float:
    return float(((way @ amplitude) ** 2).sum())


def _row(k: int, course: StageCourse, line: int, walls: ThicknessAtCuts, compliance: FloatArray) -> tuple[str, ...]:
    """Return the cells of a stage."""
    modes = ", ".join(f"{f:.0f}" for f in course.stages[k].frequency[:_LISTED_MODES])
    change = "-" if k == 0 else f"{100 * course.change[k - 1]:.1f} %"
    ended = np.isfinite(walls.thickness)
    thinnest = "-" if not ended.any() else f"{1e3 * walls.thickness[ended].min():.2f}"
    across = "-" if not ended.any() else f"{walls.elements[ended].min():.1f}"
    soft = "-" if not compliance.size else f"{1e6 * np.nanmax(compliance):.3g}"
    return str(k + 1), str(line), modes, change, thinnest, across, soft
