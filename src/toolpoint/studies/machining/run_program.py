"""One call: a program over its stock on a machine, from engagement over loads and stability to the table of its blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovalSettings, RemovedMaterial, remove_material
from toolpoint.studies.cuts.described_cut import unit_doubts
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.advice import AdviceCase, advise
from toolpoint.studies.machining.arc_doubts import question_arcs
from toolpoint.studies.machining.block_lobes import EngagementLobes, lobes_of_blocks
from toolpoint.studies.machining.blocks import table_blocks
from toolpoint.studies.machining.contacts import contact_doubts, gouge_doubts, question_loads
from toolpoint.studies.machining.engagement_classes import PlaceArcs, arcs_of_places, group_places
from toolpoint.studies.machining.errors.block_errors import error_notes, table_errors
from toolpoint.studies.machining.errors.floor_errors import floor_errors
from toolpoint.studies.machining.errors.servo_course import find_rounded_corners, follow_program
from toolpoint.studies.machining.errors.wall_errors import wall_errors
from toolpoint.studies.machining.judged_places import JudgedPlaces
from toolpoint.studies.machining.limit_interval import find_limit_interval
from toolpoint.studies.machining.loads import place_loads
from toolpoint.studies.machining.margins import NEAR_RATIO, PlaceMargins, place_margins
from toolpoint.studies.machining.program_path import (
    SAFE_HEIGHT,
    ParsedProgram,
    ProgramPath,
    find_speed_lines,
    lay_program,
    travel_doubts,
)
from toolpoint.studies.machining.result import MachiningStudy
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver
from toolpoint.studies.machining.thin_walls.clamped_part import ClampedPart
from toolpoint.studies.machining.thin_walls.course_doubts import question_lines
from toolpoint.studies.machining.thin_walls.measured_work import MeasuredWork
from toolpoint.studies.machining.thin_walls.work_along_program import follow_work
from toolpoint.studies.machining.tilted_poses import find_tilted_poses
from toolpoint.studies.machining.tool_tips import ToolTips
from toolpoint.vibration import Modes

POSE_STEP = 0.1  # m: positions of axes within which the dynamics are taken as one pose's
ARC_RESOLUTION = np.radians(0.1)  # rad: ends of arcs are not searched finer
MAX_SAMPLED_PLACES = 3000  # at which the arcs are computed at twice the spacing too
MIN_DOUBTED_HULL_FRACTION, MIN_DOUBTED_GROUPING = 0.01, 0.1  # of the places; of the limit over the depth
NamedProgress = Callable[..., None]


def run_program(program: ParsedProgram, setup: MachiningSetup, dynamics: Machine | ToolDynamics | None = None, *,
                name: str = "program", text: str = "", with_advice: bool = False, lobes: int = 0,
                folder: Path | None = None, rotation: FloatArray | None = None, tips: ToolTips | None = None,
                work: ClampedPart | MeasuredWork | None = None,
                progress: NamedProgress = lambda name, finished, total: None) -> MachiningStudy:
    """Return what every block of a program meets.

    Parameters
    ----------
    program : Program
        As `io.read_program` gives it.
    setup : MachiningSetup
    dynamics : Machine or ToolDynamics, optional
        A machine is posed along the program; without dynamics stability stays unknown.
    name, text : str
        Of the program, for the result.
    with_advice : bool
        Also which speeds and feeds to change.
    lobes : int
        Of how many engagements, those nearest to their limit, the lobes are computed too.
    rotation : (3, 3) floats, optional
        Columns are the axes of the tilted plane in which program and stock are written, in those of the work; a machine then
        stands as its chain brings the tool there.
    tips : ToolTips, optional
        Responses of tools that are not the tool of `dynamics`.
    work : ClampedPart or MeasuredWork, optional
        Part that gives way too, in the coordinates of the program: by finite elements, of which the program takes material, or
        by responses measured at stages. Rigid where left out; needs `dynamics`.
    folder : path, optional
        Where solved cuts are kept: a run that was interrupted goes on from there.
    progress : function of name, finished and total

    Raises ToolpointError for a stock that no cut meets, cuts without spindle speed, tools that are not given, work that the
    program does not meet or that stands in a tilted plane.

    Examples
    --------
    The force and power of a slot, its stability unknown:

    >>> from toolpoint.cutting.description import CuttingDescription
    >>> from toolpoint.io.program.gcode import parse
    >>> from toolpoint.material_removal import Stock
    >>> program = parse("S9000 G1 F1800 X-20 Y25 Z-2\\nX60", start=(-0.02, 0.025, 0.1))
    >>> cut = CuttingDescription.of(diameter=0.01, teeth=4, tangential=8e8, normal=3e8)
    >>> result = run_program(program, MachiningSetup(Stock.box((0, 0, -0.01), (0.04, 0.05, 0)), cut, spacing=5e-4))
    >>> round(1e9 * result.removed.total_volume)
    800
    """
    _check_work(work, dynamics, rotation)
    laid = lay_program(program, setup, text)
    shapes = [setup.shape_of(number) for number in laid.numbers]
    removed = remove_material(laid.moves, setup.stock, shapes,
                              settings=RemovalSettings(setup.spacing_for(shapes), setup.slices),
                              holders=[setup.holder_of(number) for number in laid.numbers],
                              progress=lambda finished, total: progress("pieces cut", finished, total))
    loads, arcs = place_loads(removed, laid, setup), arcs_of_places(removed)
    margins, classes, advice, notes, doubts = None, 0, None, list(laid.remarks), list[Doubt](unit_doubts(setup.cut))
    solver, pose, charts, judged, course = None, None, tuple[EngagementLobes, ...](), None, None
    if dynamics is not None and arcs.place.size:
        if rotation is not None and isinstance(dynamics, Machine):
            pose, poses, turns = find_tilted_poses(dynamics, removed, setup, rotation=rotation)
            arcs = replace(arcs, angle=arcs.angle + turns[pose[arcs.place]])
        else:
            pose, poses = _poses(dynamics, removed, setup)
        notes += poses[0].notes
        if work is not None:
            course = follow_work(work, arcs, removed=removed, laid=laid, damping=_damping_kind(poses[0]),
                                 progress=lambda finished, total: progress("stages of the work", finished, total))
            pose, chosen, yielding = course.joined(arcs.place, pose)
            poses = [poses[k] for k in chosen.tolist()]
            doubts += [*question_lines(poses[0].response, course.dynamics), *course.doubts]
            notes += course.notes
        solver = StabilitySolver(setup, poses, tips or ToolTips(), () if course is None else yielding,
                                 None if course is None else course.mode_errors)
        isotropic = solver.is_isotropic
        notes += solver.tips.notes(poses, laid.numbers)
        doubts += solver.tips.doubts(setup, laid.numbers, poses[0])
        groups = group_places(arcs, laid, removed.piece, pose=pose, isotropic=isotropic)
        classes = groups.count
        margins = place_margins(arcs, groups, laid, piece=removed.piece, solver=solver, pose=pose, folder=folder,
                                progress=lambda finished, total: progress("distinct engagements", finished, total))
        doubts += margin_doubts(margins, arcs)
        if isinstance(dynamics, Machine):
            interval = find_limit_interval(dynamics, poses, arcs, margins=margins, pose=pose, laid=laid, piece=removed.piece,
                                           setup=setup, tips=solver.tips, work=solver.work)
            doubts += [] if interval is None else interval.doubts
            notes += [] if interval is None else [interval.words]
        judged = JudgedPlaces(laid, removed, arcs, groups, margins, solver)
        if lobes:
            charts = lobes_of_blocks(judged, lobes, lambda finished, total: progress("lobes", finished, total))
        if with_advice:
            case = AdviceCase(setup, laid, removed, arcs, loads, margins, solver, pose, isotropic)
            advice = advise(case, find_speed_lines(laid, text),
                            lambda finished, total: progress("advice for tools", finished, total))
    if isinstance(dynamics, Machine) and rotation is None:
        axes = {axis.name: (axis.lower, axis.upper) for axis in dynamics.chain.axes}
        doubts += travel_doubts(laid.path, axes, dict(setup.zero), length=setup.stick_out,
                                height=float(setup.stock.upper[2]) + SAFE_HEIGHT)
    walls = wall_errors(arcs, loads, margins, laid=laid, removed=removed, setup=setup, solver=solver, pose=pose)
    if setup.drives is not None:
        progress("servo along the program", 0, 1)
    servo = follow_program(laid, removed, loads.force, setup=setup,
                            machine=dynamics if isinstance(dynamics, Machine) else None)
    floors = floor_errors(arcs, loads, margins, laid=laid, removed=removed, setup=setup, solver=solver, pose=pose)
    errors = table_errors(walls, floors, servo, arcs=arcs, laid=laid, removed=removed)
    doubts += errors.doubts
    notes += [*errors.notes, *find_rounded_corners(setup, laid)]
    blocks = table_blocks(laid, removed, loads, arcs=arcs, margins=margins)
    contacts = [*contact_doubts(removed, laid), *gouge_doubts(removed, laid, setup), *question_loads(blocks, removed, laid,
            setup=setup)]
    arc_error = _arc_error(removed, laid, setup)
    open_arcs, arc_notes = question_arcs(arc_error, judged, removed.settings.spacing, folder=folder)
    doubts, notes = [*doubts, *open_arcs], [*notes, *arc_notes]
    study = MachiningStudy(
        name, setup, laid, removed, blocks, tuple(dict.fromkeys([*contacts, *doubts, *doubts_among(notes)])),
        tuple(note for note in notes if not isinstance(note, Doubt)), arc_error, classes,
        0 if margins is None else margins.solutions, tuple(text.splitlines()), advice, arcs, margins, errors, loads,
        lobes=charts, judged=judged, work=course)
    return replace(study, notes=(*study.notes, *_assumptions(study)))


def _poses(dynamics: Machine | ToolDynamics, removed: RemovedMaterial, setup: MachiningSetup
           ) -> tuple[np.ndarray, Sequence[ToolDynamics]]:
    """Return the pose of every place, and the dynamics of each pose: positions within `POSE_STEP` are one."""
    if isinstance(dynamics, ToolDynamics):
        return np.zeros(removed.piece.size, int), [dynamics]
    letters = [axis.name for axis in dynamics.chain.axes if axis.name in ("X", "Y", "Z") and not axis.is_rotary]
    if not letters:
        return np.zeros(removed.piece.size, int), [machine_dynamics(dynamics, dict(setup.zero))]
    positions = np.stack([removed.tip[:, "XYZ".index(name)] + setup.zero.get(name, 0.0) for name in letters], axis=1)
    cells = np.rint(positions / POSE_STEP).astype(int)
    cuts = removed.reach > 0
    # Places that do not cut take the pose of the first that does: no dynamics are solved for them alone.
    cells[~cuts] = cells[np.argmax(cuts)]
    unique, pose = np.unique(cells, axis=0, return_inverse=True)
    pose = pose.reshape(-1)
    limits = {axis.name: (axis.lower, axis.upper) for axis in dynamics.chain.axes}
    poses = []
    for k in range(len(unique)):
        mean = positions[(pose == k) & cuts].mean(axis=0)
        # Beyond its travel the machine has no dynamics: those of the end are taken, and the travel is doubted.
        stand = {n: float(np.clip(value, *limits[n])) for n, value in zip(letters, mean, strict=True)}
        poses.append(machine_dynamics(dynamics, {**setup.zero, **stand}))
    return pose, poses


def _arc_error(removed: RemovedMaterial, laid: ProgramPath, setup: MachiningSetup) -> float:
    """Return by how much arcs at twice the spacing differ from those here, rad: the 95 % point over sampled places."""
    cutting = np.flatnonzero(removed.reach > 0)
    if not cutting.size:
        return 0.0
    chosen = cutting[np.linspace(0, cutting.size - 1, min(MAX_SAMPLED_PLACES, cutting.size)).astype(int)]
    is_sampled = np.zeros(removed.piece.size, bool)
    is_sampled[chosen] = True
    coarse = remove_material(laid.moves, setup.stock, removed.shapes, settings=RemovalSettings(2 * removed.settings.spacing,
                                                                                      setup.slices),
                             sampled=is_sampled)
    # Slices of the two may lie at other heights: means over the height of the finer are compared.
    fine_mean = removed.arc_length[chosen].mean(axis=1)
    coarse_mean = coarse.arc_length[chosen].mean(axis=1) * coarse.reach[chosen] / removed.reach[chosen]
    return max(float(np.quantile(np.abs(fine_mean - coarse_mean), 0.95)), ARC_RESOLUTION)


def margin_doubts(margins: PlaceMargins, arcs: PlaceArcs) -> list[Doubt]:
    """Return doubts about limits: hulls of arcs, grouping, and cuts that could not be solved."""
    doubts = [Doubt("stability", f"not computed for some engagements: {reason}") for reason in margins.failures[:3]]
    hull_fraction = float(arcs.is_hull.mean())
    if hull_fraction > MIN_DOUBTED_HULL_FRACTION:
        doubts.append(Doubt("stability", f"at {100 * hull_fraction:.0f} % of the places the arc differs along the axis or "
                                         f"is in "
                            "several pieces; one arc over all of them was solved", "look at those blocks in time domain",
                            figure=hull_fraction))
    if margins.unsolved:
        doubts.append(Doubt("stability", f"{margins.unsolved} places within {100 * NEAR_RATIO:g} % of a limit were judged "
                                         f"by their group of "
                            "engagements, not by their own arc", "judge a part of the program"))
    if margins.grouping > MIN_DOUBTED_GROUPING:
        doubts.append(Doubt("stability", f"grouping engagements changed limits by up to {100 * margins.grouping:.0f} % "
                                         f"where blocks "
                            "were solved by themselves", "blocks with more in hand than that are judged well",
                            figure=margins.grouping))
    with np.errstate(invalid="ignore"):
        is_open = np.abs(margins.limit - arcs.depth) <= margins.error
    if is_open.any():
        doubts.append(Doubt("verdict", f"at {int(is_open.sum())} of {is_open.size} places the depth lies within the stated "
                            "error of its limit", "cut with more in hand, or lower the error", figure=float(is_open.mean())))
    return doubts


def _assumptions(study: MachiningStudy) -> list[str]:
    """Return what the result rests on."""
    settings = study.removed.settings
    cutting = study.blocks.verdict > 0
    errors = [] if study.errors is None else error_notes(study.errors, cutting)
    return [*errors, f"Stock: {study.setup.stock.words}; dexels of {1e3 * settings.spacing:.3g} mm, {settings.slices} slices "
            "of the tool; rapids go straight. Arcs of less than 6° between others, and ribs and steps thinner "
            "than the spacing, may be "
            "missed.",
            "Forces are those of a rigid tool without run-out; a flat end that plunges has edge forces of its sides alone.",
            "Limits are those of groups of 2° of the arc and 15° of the feed, near a limit those of each block's own arc; "
            "positions "
            f"within {1e3 * POSE_STEP:g} mm are one pose.",
            *(["The work itself is rigid: thin walls and clamping are not in the dynamics."] if study.work is None else [])]


def _check_work(work: ClampedPart | MeasuredWork | None, dynamics: Machine | ToolDynamics | None, rotation: FloatArray | None
                ) -> None:
    """Refuse work that gives way beside an unknown tool, and in a tilted plane."""
    if work is not None and dynamics is None:
        fail("work", "given without the dynamics of the tool", "must stand beside them: both give way together",
             remedy="give a machine or a measured tip too")
    if work is not None and rotation is not None:
        fail("work", "in a tilted plane", "must be cut upright: the part's response is taken along X, Y and Z of the program")


def _damping_kind(dynamics: ToolDynamics) -> str:
    """Return the kind of damping that the modes of the work need to be joined with those of the tool."""
    response = dynamics.response
    return response.damping if isinstance(response, Modes) and response.scaling == "unit modal mass" else "viscous"
