"""Course of a clamped part under a program: its stages, its contacts with the tool, and its response at each of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint.bodies.solid.cut_solid import CutSolid
from toolpoint.material_removal import RemovedMaterial
from toolpoint.material_removal.sweep_times import SweepTimes
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.course_doubts import question_course
from toolpoint.studies.machining.thin_walls.part_responses import dynamics_of, respond
from toolpoint.studies.machining.thin_walls.part_stages import (
    StageCourse,
    choose_stages,
    estimate_mesh_error,
    largest_of_lowest,
    nearest_of,
)
from toolpoint.studies.machining.thin_walls.part_states import PartState, choose_states
from toolpoint.studies.machining.thin_walls.wall_contacts import ThicknessAtCuts, WallContacts, contacts_of, measure_walls
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
    # At the end of a piece its material is gone, at its start not yet.
    pieces = removed.piece[arcs.place] + np.where(removed.at_start[arcs.place], 0, 1)
    line = laid.path.line[laid.moves.block[removed.piece[arcs.place]]]
    states, step = choose_states(work, course, pieces)
    responses = _respond_along(work, states, contacts, pieces, cut=cut, line=line, damping=damping)
    stage_of = course.stage_of(pieces)
    walls = tuple(_walls_at(k, course, contacts, stage_of=stage_of, group=responses.group) for k in range(len(course.stages)))
    lines = laid.path.line[laid.moves.block[np.minimum([s.piece for s in course.stages], removed.moves.count - 1)]]
    mode_errors = estimate_mesh_error(work, course)
    error = largest_of_lowest(mode_errors, course)
    rows = tuple(_row(k, course, int(lines[k]), walls[k], responses.compliance[stage_of == k])
                 for k in range(len(course.stages)))
    result = WorkCourse(responses.group, responses.dynamics, responses.compliance, rows, (), (), course, error, mode_errors,
                        walls)
    doubts, notes = question_course(work, course, removed=removed, distance=responses.distance, spread=responses.spread,
                                    walls=walls, error=error, line=line, states=len(states), step=step)
    return replace(result, doubts=tuple(doubts), notes=tuple(notes))


@dataclass(frozen=True, eq=False)
class _CourseResponses:
    """Responses of all places: group and compliance as `WorkCourse`, distance and spread as `PartResponses`."""

    group: IndexArray
    dynamics: tuple[ToolDynamics, ...]
    compliance: FloatArray
    distance: FloatArray
    spread: FloatArray


def _respond_along(work: ClampedPart, states: Sequence[PartState], contacts: WallContacts, pieces: IndexArray, *,
                   cut: CutSolid, line: IndexArray, damping: str) -> _CourseResponses:
    """Return the responses at all contacts, each of the state nearest to it; pieces, line : of every contact."""
    count = pieces.size
    state_of = nearest_of(cut, np.array([state.piece for state in states]), pieces)
    group, compliance = np.zeros(count, np.int64), np.full(count, np.nan)
    distance, spread, dynamics = np.zeros(count), np.ones(count), list[ToolDynamics]()
    base, inverse = None, None
    for k in np.unique(state_of).tolist():
        state, members = states[k], np.flatnonzero(state_of == k)
        if inverse is None or base is not state.around[0]:
            base = state.around[0]
            inverse = base.solver()
        responses = respond(state, contacts, members, cut=cut, inverse=inverse, damping=damping)
        group[members] = len(dynamics) + responses.group
        dynamics += [dynamics_of(modes, f"{work.name} at line {line[members[0]]}") for modes in responses.modes]
        distance[members], spread[members] = responses.distance, responses.spread
        soft = np.array([_along(modes.shape / modes.omega, contacts.wall[members[leader]])
                         for modes, leader in zip(responses.modes, responses.leader.tolist(), strict=True)])
        compliance[members] = soft[responses.group]
    return _CourseResponses(group, tuple(dynamics), compliance, distance, spread)


def _walls_at(k: int, course: StageCourse, contacts: WallContacts, *, stage_of: IndexArray, group: IndexArray
              ) -> ThicknessAtCuts:
    """Return the thickness of the walls at the places nearest to a stage, one of each response."""
    chosen = np.flatnonzero(stage_of == k)
    if not chosen.size:
        return ThicknessAtCuts(np.zeros(0), np.zeros(0))
    members = chosen[np.unique(group[chosen], return_index=True)[1]]
    return measure_walls(contacts, members, stage=course.stages[k], cut=course.cut)


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
