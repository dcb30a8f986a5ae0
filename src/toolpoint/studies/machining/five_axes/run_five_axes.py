"""One call: a five-axis program over its stock on a machine: tri-dexels, loads and stability at the pose of every place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.drives.program.path import Path as DrivePath
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovalSettings
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval, remove_by_turned_tool
from toolpoint.studies.cuts.described_cut import unit_doubts
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics
from toolpoint.studies.machining.advice import AdviceCase, ProgramAdvice, advise
from toolpoint.studies.machining.arc_doubts import question_arcs
from toolpoint.studies.machining.block_lobes import EngagementLobes, lobes_of_blocks
from toolpoint.studies.machining.blocks import table_blocks
from toolpoint.studies.machining.contacts import contact_doubts, question_loads
from toolpoint.studies.machining.engagement_classes import PlaceArcs, arcs_of_places, group_places
from toolpoint.studies.machining.errors.block_errors import BlockErrors
from toolpoint.studies.machining.errors.floor_errors import floor_errors
from toolpoint.studies.machining.errors.wall_errors import wall_errors
from toolpoint.studies.machining.five_axes.axis_course import AxisCourse, find_axis_course, question_travels
from toolpoint.studies.machining.five_axes.axis_times import StepTimes, plan_steps, question_feeds
from toolpoint.studies.machining.five_axes.tool_directions import RotaryAxes
from toolpoint.studies.machining.five_axes.turned_course import check_drives, follow_turned
from toolpoint.studies.machining.five_axes.turned_doubts import feed_doubts, way_doubts
from toolpoint.studies.machining.five_axes.turned_errors import list_error_grounds, table_turned_errors
from toolpoint.studies.machining.five_axes.turned_gouges import question_gouges
from toolpoint.studies.machining.five_axes.turned_path import (
    MAX_STEP_TURN,
    FiveAxisProgram,
    TurnedPath,
    find_ends,
    split_turned,
)
from toolpoint.studies.machining.five_axes.turned_poses import (
    TURNED_POSE_STEP,
    TURNED_POSE_TURN,
    find_turned_poses,
)
from toolpoint.studies.machining.five_axes.turned_surface import find_turned_surface
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.limit_interval import find_limit_interval
from toolpoint.studies.machining.loads import CutLoads, place_loads
from toolpoint.studies.machining.margins import PlaceMargins, place_margins
from toolpoint.studies.machining.program_path import (
    SAFE_HEIGHT,
    ProgramPath,
    find_speed_lines,
    raise_reference_moves,
    refuse_rotary,
    tools_and_speeds,
)
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.studies.machining.run_program import ARC_RESOLUTION, NamedProgress, margin_doubts
from toolpoint.studies.machining.setup import STEP_RATIO, MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork
from toolpoint.studies.machining.thin_walls.work_along_program import refuse_turned_work
from toolpoint.studies.machining.tool_tips import ToolTips

FIVE_AXIS_SPACING_FACTOR = 2.0  # of the spacing that three axes have where none is given
_LEVER_OF_UNKNOWN_EDGES = 2.0  # diameters, where no length of the edges is given


def run_five_axes(program: FiveAxisProgram, setup: MachiningSetup, dynamics: Machine | ToolDynamics | None = None, *,
                  name: str = "program", text: str = "", with_advice: bool = False, lobes: int = 0, folder: Path | None = None,
                  tips: ToolTips | None = None, work: ClampedPart | MeasuredWork | None = None,
                  progress: NamedProgress = lambda name, finished, total: None) -> MachiningStudy:
    """Return what every block of a program with tool centre control meets.

    Parameters
    ----------
    program : Program
        As `io.read_program` gives it, with `is_five_axis`.
    setup, name, text, with_advice, lobes, folder, tips, progress : as in `run_program`
    dynamics : Machine or ToolDynamics, optional
        A machine turns the tool by its own rotary axes and is posed along the program. A tip alone is the same everywhere,
        along the tool's x and y; directions must then be programmed as vectors, which turn along great circles between blocks.

    work : must be left out, as the response of a part is taken along X, Y and Z

    Raises ToolpointError for what `run_program` refuses, for angles without a machine or of axes that it does not have, and
    for places that it does not reach.

    Examples
    --------
    A chamfer of 45 degrees along an edge, by the end of a tool that leans:

    >>> from toolpoint import studies
    >>> from toolpoint.cutting.description import CuttingDescription
    >>> from toolpoint.io.program.gcode import parse
    >>> text = "S9000\\nG0 X-8 Y0 Z20\\nG43.5 H1\\nG0 X-8 Y0 Z-3 J-1 K1\\nG1 X48 J-1 K1 F1800\\nG49\\nG0 Z50"
    >>> setup = studies.describe_machining(studies.stock_of("box", (0, 0, -0.01, 0.04, 0.02, 0)),
    ...     CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8, flute_length=0.02), spacing=5e-4)
    >>> study = studies.run_five_axes(parse(text, start=(0, 0, 0.05)), setup)
    >>> abs(1e9 * study.removed.total_volume - 180) < 1  # a prism of 3 x 3 / 2 x 40 mm, mm^3
    True
    """
    refuse_turned_work(work, "five axes")
    _check(program, setup)
    check_drives(setup.drives, dynamics if isinstance(dynamics, Machine) else None)
    if not setup.spacing:  # lines in three directions, cut one by one
        shapes = [setup.shape_of(number) for number in (0, *setup.cuts)]
        setup = replace(setup, spacing=FIVE_AXIS_SPACING_FACTOR * setup.spacing_for(shapes))
    rotary = RotaryAxes(dynamics, setup) if isinstance(dynamics, Machine) else None
    path = raise_reference_moves(program.tip_path(), text, float(setup.stock.upper[2]) + SAFE_HEIGHT)
    ends = find_ends(program, rotary, path.line)
    is_moving = (np.linalg.norm(path.end - path.start, axis=1) > 0) | (np.abs(ends[:, 1] - ends[:, 0]).max(axis=1) > 0)
    tool, speed, numbers, remarks = tools_and_speeds(program, path, is_moving, setup=setup)
    turned = _steps(path, ends, rotary, setup=setup, tool=tool, numbers=numbers, is_seen=~program.unseen)
    course = None if rotary is None else find_axis_course(rotary, turned)
    times = plan_steps(path, turned, course, setup=setup)
    removed, error = _remove(turned, setup, numbers, progress)
    laid = _lay(path, turned, removed, times, tool=tool, speed=speed, numbers=numbers, remarks=remarks)
    case = _Case(setup, laid, removed, arcs_of_places(removed), place_loads(removed, laid, setup), turned)
    verdicts = _Verdicts()
    if dynamics is not None and case.arcs.place.size:
        verdicts = _judge(case, dynamics, rotary, folder=folder, tips=tips or ToolTips(), progress=progress)
        if lobes:
            assert verdicts.judged is not None
            verdicts.charts = lobes_of_blocks(verdicts.judged, lobes,
                                              lambda finished, total: progress("lobes", finished, total))
        if with_advice:
            verdicts.advice = advise(_advice_case(case, verdicts), find_speed_lines(laid, text),
                                     lambda finished, total: progress("advice for tools", finished, total))
    errors = _errors(case, verdicts, course, times, machine=dynamics if isinstance(dynamics, Machine) else None)
    doubts = [*unit_doubts(setup.cut), *feed_doubts(removed, laid), *question_feeds(times, turned, path, setup=setup),
              *way_doubts(program, ends, rotary, line=path.line), *verdicts.doubts, *errors.doubts]
    if rotary is not None and course is not None:
        block = turned.moves.block
        doubts += question_travels(rotary, course, line=path.line[block], rapid=path.rapid[block])
    return _study(name, text, case, verdicts, errors, doubts=doubts, error=error, folder=folder)


@dataclass(frozen=True, eq=False)
class _Case:
    """Case of a study: setup, path, removal, arcs and loads of its places, and the steps."""

    setup: MachiningSetup
    laid: ProgramPath
    removed: TurnedRemoval
    arcs: PlaceArcs
    loads: CutLoads
    turned: TurnedPath


@dataclass(eq=False)
class _Verdicts:
    """Verdicts of the dynamics, empty without them."""

    margins: PlaceMargins | None = None
    judged: JudgedPlaces | None = None
    pose: np.ndarray | None = None
    notes: list[str] = field(default_factory=list)
    doubts: list[Doubt] = field(default_factory=list)
    charts: tuple[EngagementLobes, ...] = ()
    advice: ProgramAdvice | None = None


def _check(program: FiveAxisProgram, setup: MachiningSetup) -> None:
    refuse_rotary(program)
    if program.is_tilted:
        raise ToolpointError("program: it tilts planes and moves under tool centre control; program one of them")


def _steps(path: DrivePath, ends: FloatArray, rotary: RotaryAxes | None, *, setup: MachiningSetup, tool: np.ndarray,
           numbers: tuple[int, ...], is_seen: np.ndarray) -> TurnedPath:
    """Return the steps of the path, as short as the smallest tool asks for."""
    shapes = [setup.shape_of(number) for number in numbers]
    lever = max(min(shape.flute_length, _LEVER_OF_UNKNOWN_EDGES * shape.diameter) for shape in shapes)
    index = np.minimum(np.searchsorted(numbers, np.clip(tool, numbers[0], numbers[-1])), len(numbers) - 1)
    return split_turned(path, ends, rotary, step=STEP_RATIO * min(shape.radius for shape in shapes), lever=lever,
                        is_seen=is_seen, shape=index)


def _remove(turned: TurnedPath, setup: MachiningSetup, numbers: tuple[int, ...], progress: NamedProgress
            ) -> tuple[TurnedRemoval, float]:
    """Return the removal, and by how much arcs at twice the spacing differ from its own, rad: the 95 % point over places."""
    shapes, spacing = [setup.shape_of(number) for number in numbers], setup.spacing
    holders = [setup.holder_of(number) for number in numbers]
    fine = remove_by_turned_tool(turned.moves, setup.stock, shapes, settings=RemovalSettings(spacing, setup.slices),
                                 holders=holders, progress=lambda finished, total: progress("steps cut", finished, total))
    coarse = remove_by_turned_tool(
        turned.moves, setup.stock, shapes, settings=RemovalSettings(2 * spacing, setup.slices), with_volume=False,
        progress=lambda finished, total: progress("steps cut coarsely", finished, total))
    both = (fine.reach > 0) & (coarse.reach > 0)
    if not both.any():
        return fine, ARC_RESOLUTION
    # Slices of the two may lie at other heights: means over the height of the finer are compared.
    share = coarse.reach[both] / fine.reach[both]
    difference = fine.arc_length[both].mean(axis=1) - coarse.arc_length[both].mean(axis=1) * share
    return fine, max(float(np.quantile(np.abs(difference), 0.95)), ARC_RESOLUTION)


def _lay(path: DrivePath, turned: TurnedPath, removed: TurnedRemoval, times: StepTimes, *, tool: np.ndarray,
         speed: FloatArray, numbers: tuple[int, ...], remarks: list[str]) -> ProgramPath:
    """Return the path with times and feeds: the largest of each block; of a turn about the tip by its angle."""
    lengths = np.linalg.norm(path.end - path.start, axis=1)
    block = turned.moves.block
    time = np.where(turned.steps > 0, 0.0, lengths / np.where(path.feed > 0, path.feed, 1.0))
    np.add.at(time, block, times.times)
    peak = np.where(turned.steps > 0, 0.0, 1.0)
    np.maximum.at(peak, block, times.peaks)
    assert removed.feed_way is not None
    place_feed = removed.feed_way * (times.peaks / times.nominal)[removed.piece]
    return ProgramPath(path, removed.moves, speed, tool, numbers, np.where(lengths > 0, path.feed * peak, 0.0),
                       time + path.dwell, (*remarks, times.words), place_feed)


def _errors(case: _Case, verdicts: _Verdicts, course: AxisCourse | None, times: StepTimes, *, machine: Machine | None
            ) -> BlockErrors:
    """Return the errors of walls, of what the tool's end leaves, and of the servo."""
    judged = verdicts.judged
    walls = wall_errors(case.arcs, case.loads, verdicts.margins, laid=case.laid, removed=case.removed, setup=case.setup,
                        solver=None if judged is None else judged.solver, pose=verdicts.pose)
    servo = follow_turned(case.laid, case.removed, case.loads.force, drives=case.setup.drives, course=course, times=times,
                          machine=machine)
    floors = floor_errors(case.arcs, case.loads, verdicts.margins, laid=case.laid, removed=case.removed, setup=case.setup,
                          solver=None if judged is None else judged.solver, pose=verdicts.pose,
                          surface=find_turned_surface(case.turned, case.removed, case.laid.path.count))
    return table_turned_errors(walls, floors, servo, arcs=case.arcs, laid=case.laid, removed=case.removed)


def _judge(case: _Case, dynamics: Machine | ToolDynamics, rotary: RotaryAxes | None, *, folder: Path | None, tips: ToolTips,
           progress: NamedProgress) -> _Verdicts:
    """Return stability at every place, by the response of its pose along its own feed."""
    laid, removed, arcs = case.laid, case.removed, case.arcs
    poses: Sequence[ToolDynamics]
    pose, poses, widened = np.zeros(removed.piece.size, int), [dynamics] if isinstance(dynamics, ToolDynamics) else [], 1.0
    if rotary is not None:
        at_end = case.turned.angles[removed.piece]
        line = laid.path.line[laid.moves.block[removed.piece]]
        pose, poses, widened = find_turned_poses(rotary, removed, at_end, line=line)
    solver = StabilitySolver(case.setup, poses, tips)
    groups = group_places(arcs, laid, removed.piece, pose=pose, isotropic=solver.is_isotropic)
    margins = place_margins(arcs, groups, laid, piece=removed.piece, solver=solver, pose=pose, folder=folder,
                            progress=lambda finished, total: progress("distinct engagements", finished, total))
    out = _Verdicts(margins, JudgedPlaces(laid, removed, arcs, groups, margins, solver), pose)
    out.notes += [*poses[0].notes, *_pose_notes(poses, widened), *solver.tips.notes(poses, laid.numbers)]
    out.doubts += [*solver.tips.doubts(case.setup, laid.numbers, poses[0]), *margin_doubts(margins, arcs)]
    if isinstance(dynamics, Machine):
        interval = find_limit_interval(dynamics, poses, arcs, margins=margins, pose=pose, laid=laid, piece=removed.piece,
                                       setup=case.setup, tips=solver.tips)
        out.doubts += [] if interval is None else interval.doubts
        out.notes += [] if interval is None else [interval.words]
    return out


def _pose_notes(poses: Sequence[ToolDynamics], widened: float) -> list[str]:
    if poses[0].machine is None:
        return ["The tip answers alike at every pose and along the tool's own x and y."]
    return [f"{len(poses)} poses: places within {1e3 * widened * TURNED_POSE_STEP:g} mm and rotary axes within "
            f"{np.degrees(widened * TURNED_POSE_TURN):.3g}° are one."]


def _advice_case(case: _Case, verdicts: _Verdicts) -> AdviceCase:
    judged = verdicts.judged
    assert judged is not None and verdicts.margins is not None and verdicts.pose is not None
    return AdviceCase(case.setup, case.laid, case.removed, case.arcs, case.loads, verdicts.margins, judged.solver,
                      verdicts.pose, judged.solver.is_isotropic)


def _study(name: str, text: str, case: _Case, verdicts: _Verdicts, errors: BlockErrors, *, doubts: list[Doubt], error: float,
           folder: Path | None) -> MachiningStudy:
    """Return the study with what was left out said first."""
    laid, removed = case.laid, case.removed
    blocks = table_blocks(laid, removed, case.loads, arcs=case.arcs, margins=verdicts.margins)
    contacts = [*contact_doubts(removed, laid), *question_gouges(removed, laid, case.setup),
                *question_loads(blocks, removed, laid, setup=case.setup)]
    open_arcs, arc_notes = question_arcs(error, verdicts.judged, removed.settings.spacing, folder=folder)
    notes = [*laid.remarks, *verdicts.notes, *errors.notes, *list_error_grounds(errors, blocks.verdict > 0), *arc_notes]
    all_doubts = dict.fromkeys([*contacts, *doubts, *open_arcs, *doubts_among(notes)])
    margins = verdicts.margins
    return MachiningStudy(
        name, case.setup, laid, removed, blocks, tuple(all_doubts),
        (*(note for note in notes if not isinstance(note, Doubt)), *_assumptions(case)), error,
        0 if verdicts.judged is None else verdicts.judged.groups.count, 0 if margins is None else margins.solutions,
        tuple(text.splitlines()), verdicts.advice, case.arcs, margins, errors, case.loads, lobes=verdicts.charts,
        judged=verdicts.judged)


def _lean_words(case: _Case) -> list[str]:
    """Return where the tool leans most while it cuts: a sign of a rotary axis that is wrong shows there."""
    removed = case.removed
    if removed.frame is None or not (removed.reach > 0).any():
        return []
    k = int(np.argmin(np.where(removed.reach > 0, removed.frame[:, 2, 2], np.inf)))
    x, y, z = removed.frame[k, :, 2] + 0.0
    return [f"The tool leans most in line {case.laid.path.line[case.laid.moves.block[removed.piece[k]]]}: along "
            f"({x:.3f}, {y:.3f}, {z:.3f}) in the work, from the tip upwards; see that it does on the machine."]


def _assumptions(case: _Case) -> list[str]:
    """Return what the result rests on."""
    settings = case.removed.settings
    has_holder = any(case.setup.holder_of(number).heights for number in case.laid.numbers)
    unseen = [] if has_holder else ["No holder is given: contacts of shank, holder and head are not looked at."]
    return [*_lean_words(case), *unseen,
            f"Stock: {case.setup.stock.words}; dexels of {1e3 * settings.spacing:.3g} mm along x, y and z, {settings.slices} "
            f"slices of the tool, steps of at most {np.degrees(MAX_STEP_TURN):g}°: between them the axis goes along a great "
            f"circle, at most {np.degrees(MAX_STEP_TURN**2 / 8):.2g}° beside its way.",
            "The removed volume is sampled, within about 0.1 %.",
            "Forces are those of a rigid tool without run-out; edges end at their length, and cut nothing above it.",
            "The work itself is rigid: thin walls and clamping are not in the dynamics."]
