"""Servo along a program under its cutting forces: contour error, yielding and use of the drives of every block."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._doubt import Doubt
from toolpoint.drives.accuracy.contour import ContourError
from toolpoint.drives.build import build_servo
from toolpoint.drives.description import DriveDescription
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.path import Path
from toolpoint.drives.program.planner import plan_motion
from toolpoint.drives.simulation.simulate import ServoResult
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.servos.drive_contour import SPACE, match_axes, measure_contour
from toolpoint.studies.servos.drive_experiment import set_points_of, simulate_set_points
from toolpoint.studies.servos.drive_structure import structure_of

MAX_SERVO_TIME = 600.0  # s of motion: the histories of three axes take 0.4 GB
SATURATION_RATIO = 0.999  # of a limit of the drives, from which on the set point is taken as held by it


@dataclass(frozen=True, eq=False)
class ServoCourse:
    """Motion of the servo along a program, at the samples that cut, (n,) each.

    block : index of the segment; place : arc length of the foot along the path, m; error : (n, 2)
    deviation of the tables from the path without cutting force, in the plane, m;
    yielding : (n, 2) further motion of the motors under the cutting force, in the plane, m; tangent : (n, 2) unit direction.
    rise : (n,) deviation and further motion along the axis, m.
    contour, push : (blocks,) largest distance from the path under the cutting force, and largest further motion by it, m.
    use : (blocks,) largest share of the limit of torque or current of any axis; axis : (blocks,) index of that axis.
    feed_force : (blocks,) largest mean force against a driven axis, N.
    """

    axes: tuple[str, ...]
    block: np.ndarray
    place: FloatArray
    error: FloatArray
    yielding: FloatArray
    tangent: FloatArray
    rise: FloatArray
    contour: FloatArray
    push: FloatArray
    use: FloatArray
    axis: np.ndarray
    feed_force: FloatArray
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()


_Course = TypeVar("_Course", bound=ServoCourse)


def follow_program(laid: ProgramPath, removed: RemovedMaterial, force: FloatArray, *, setup: MachiningSetup,
                   machine: Machine | None = None) -> ServoCourse | Doubt | None:
    """Return the motion of the servo along a program; None without drives, a doubt where the program lasts too long.

    force : (places, 3) mean cutting force on the tool along the program's axes, N.

    The servo runs twice, without and with the force on its tables. The further motion is taken at the motors: what lies
    between motor and table bends in the machine's response too.

    Raises ToolpointError for drives of which none is linear, and an unstable servo.
    """
    if setup.drives is None:
        return None
    drives, clamped_notes = drives_of_path(setup.drives)
    duration = float(laid.time.sum())
    if duration > MAX_SERVO_TIME:
        return Doubt("servo", f"not simulated: the program lasts {duration:.0f} s, at most {MAX_SERVO_TIME:g} s are",
                     "cut the program to the part of interest")
    runs = _run_servo(laid, removed, force, drives=drives, machine=machine)
    largest_force = np.zeros(laid.path.count)
    np.maximum.at(largest_force, laid.moves.block[removed.piece], np.abs(force[:, runs.columns]).max(axis=1))
    return with_remarks(_course(laid, drives, runs, force=largest_force), laid, drives, notes=(*runs.notes, *clamped_notes))


def drives_of_path(drives: DriveDescription) -> tuple[DriveDescription, tuple[str, ...]]:
    """Return the drives of the linear axes, and a note on rotary ones: a program of three axes does not turn them.

    Raises ToolpointError where all axes are rotary.
    """
    rotary = [name for name, axis in drives.axes.items() if axis.mechanics.kind == "reducer"]
    if not rotary:
        return drives, ()
    linear = {name: axis for name, axis in drives.axes.items() if name not in rotary}
    if not linear:
        fail("drives", f"{', '.join(rotary)} behind reducers alone", "must hold linear axes, along which a program moves")
    return replace(drives, axes=linear), (f"The program does not turn {', '.join(rotary)}: these axes are taken as clamped.",)


@dataclass(frozen=True, eq=False)
class _ServoRuns:
    """Two runs, without and with the cutting force: arc length of the set points (n,), m; which samples cut (n,)."""

    free: ServoResult
    loaded: ServoResult
    place: FloatArray
    is_cutting: np.ndarray
    origin: FloatArray
    columns: list[int]
    lead: FloatArray
    notes: tuple[str, ...]


def _run_servo(laid: ProgramPath, removed: RemovedMaterial, force: FloatArray, *, drives: DriveDescription,
               machine: Machine | None) -> _ServoRuns:
    with_ends = any(axis.ends is not None for axis in drives.axes.values())
    # Without ends in the machine its structure would meet no drive: it is not built.
    servo = build_servo(drives, structure_of(drives, machine if with_ends else None))
    named = {name.upper() for name in drives.axes} & set(SPACE)
    driven = match_axes(laid.path, tuple(drives.axes), ideal=sorted(set(SPACE) - named) if named else ())
    command, place = set_points_of(laid.path, drives, servo)
    columns = list(driven.columns)
    chosen = Command(command.position[:, columns], command.sample_time, command.velocity[:, columns],
                     command.acceleration[:, columns])
    step = servo.controllers[0].sample_times[0] / drives.substeps
    times = np.arange(round(chosen.duration / step) + 1) * step
    load = _at_places(laid, removed, force[:, columns], places=np.interp(times, command.time, place))
    free, loaded = (simulate_set_points(drives, servo, chosen, load=each) for each in (None, load))
    reached = np.interp(free.time, command.time, place)
    # Half of an interpolated yes or no: the boundary between a cutting and a free place lies midway.
    cuts = _at_places(laid, removed, (removed.reach > 0)[:, None].astype(float), places=reached)[:, 0] >= 0.5
    lead = np.array([axis.mechanics.lead for axis in servo.plant.axes])
    return _ServoRuns(free, loaded, reached, cuts, command.position[0, columns], columns, lead, driven.notes)


def lengths_of_places(laid: ProgramPath, removed: RemovedMaterial) -> FloatArray:
    """Return the arc length along the path of every place of a removal, (places,), m."""
    ends = np.cumsum(laid.moves.length)
    return np.asarray(np.where(removed.at_start, ends[removed.piece] - laid.moves.length[removed.piece], ends[removed.piece]))


def _at_places(laid: ProgramPath, removed: RemovedMaterial, values: FloatArray, *, places: FloatArray) -> FloatArray:
    """Return values (n, m) of the places of a removal, between them linear, at arc lengths along the path (k,), m."""
    length = lengths_of_places(laid, removed)
    return np.stack([np.interp(places, length, column, left=0.0, right=0.0) for column in values.T], axis=1)


def _course(laid: ProgramPath, drives: DriveDescription, runs: _ServoRuns, *, force: FloatArray) -> ServoCourse:
    """Return the course of two runs at the samples that cut; loads of the drives count at all samples."""
    path, n, mask = laid.path, laid.path.count, runs.is_cutting
    following, under_force = (measure_contour(path, run.time, runs.place, actual=run.output("table") + runs.origin,
                                              columns=runs.columns) for run in (runs.free, runs.loaded))
    further = np.zeros((mask.size, 3))
    further[:, runs.columns] = (runs.loaded.output("angle") - runs.free.output("angle")) * runs.lead
    block, at_set_point = _segment_of(path, following.progress), _segment_of(path, runs.place)
    share = drive_use(drives, runs.loaded)
    contour, push, use = np.zeros(n), np.zeros(n), np.zeros(n)
    np.maximum.at(contour, _segment_of(path, under_force.progress)[mask], under_force.length[mask])
    np.maximum.at(push, block[mask], np.linalg.norm(further, axis=1)[mask])
    np.maximum.at(use, at_set_point, share.max(axis=1))
    return ServoCourse(tuple(drives.axes), block[mask], following.progress[mask], following.vector[mask][:, :2],
                       further[mask][:, :2], _tangents(path, block, following)[mask],
                       following.vector[mask][:, 2] + further[mask][:, 2], contour, push, use,
                       axis_of_largest(share, at_set_point, n), force)


def _segment_of(path: Path, progress: FloatArray) -> np.ndarray:
    return np.minimum(np.searchsorted(np.cumsum(path.lengths), progress, side="left"), path.count - 1)


def _tangents(path: Path, block: np.ndarray, error: ContourError) -> FloatArray:
    """Return the direction of the path in the plane at the feet, (n, 2), of unit length; zero where it goes along the axis."""
    starts, lengths = np.cumsum(path.lengths) - path.lengths, path.lengths
    share = (error.progress - starts[block]) / np.where(lengths[block] > 0, lengths[block], 1.0)
    tangent = path.tangents(block, np.clip(share, 0.0, 1.0))[:, :2]
    size = np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(np.where(size > 1e-9, tangent / np.where(size > 1e-9, size, 1.0), 0.0))


def drive_use(drives: DriveDescription, result: ServoResult) -> FloatArray:
    """Return the share of the limit that every axis uses, (n, axes): of current where it is modelled, and of torque."""
    share = np.zeros((result.time.size, len(drives.axes)))
    for k, axis in enumerate(drives.axes.values()):
        if axis.current is not None and axis.motor is not None:
            share[:, k] = np.abs(result.signal("current_set")[:, k]) / axis.current.limit
        if axis.velocity.limit is not None:
            share[:, k] = np.maximum(share[:, k], np.abs(result.signal("torque_set")[:, k]) / axis.velocity.limit)
    return share


def axis_of_largest(share: FloatArray, block: np.ndarray, count: int) -> np.ndarray:
    # Stable, so that of equal shares the later sample decides on every machine.
    order = np.argsort(share.max(axis=1), kind="stable")
    axis = np.zeros(count, int)
    axis[block[order]] = share.argmax(axis=1)[order]  # written last is the largest
    return axis


def with_remarks(course: _Course, laid: ProgramPath, drives: DriveDescription, *, notes: tuple[str, ...]) -> _Course:
    """Return the course with doubts of saturated drives and of axes that were taken as ideal."""
    doubts = []
    over = np.flatnonzero(course.use >= SATURATION_RATIO)
    if over.size:
        k = int(over[course.use[over].argmax()])
        doubts.append(Doubt("drives", f"axis {course.axes[course.axis[k]]} is at its limit in line {laid.path.line[k]} "
                            f"({over.size} blocks)", "a lower feed or acceleration, or less cutting force",
                            figure=float(course.use[k]), grave=True))
    limited = [name for name, axis in drives.axes.items() if axis.velocity.limit is None
               and (axis.current is None or axis.motor is None)]
    if limited:
        doubts.append(Doubt("drives", f"no limit of torque or current is given for {', '.join(limited)}: their use is not "
                            "judged",
                            "give `velocity: limit` in the drive file"))
    doubts += [Doubt("contour error", note, "describe the axis in the drive file") for note in notes if "in step" in note]
    return replace(course, doubts=tuple(doubts), notes=(*(note for note in notes if "in step" not in note),
                   "The servo meets the mean cutting force of each place; what passes with the teeth is faster than its loops "
                   "and stands in the surface location error."))


def find_rounded_corners(setup: MachiningSetup, laid: ProgramPath) -> list[str]:
    """Return a note where the drive file rounds corners and the loads are those of a stop at each."""
    drives = setup.drives
    if drives is None or not drives.corner_tolerance:
        return []
    limits = setup.planned
    assert limits is not None
    time = plan_motion(laid.path, limits, corner_tolerance=drives.corner_tolerance, corner=drives.corner,
                       look_ahead=drives.look_ahead).duration
    return [f"loads are those of stops at corners; with corners rounded by {1e6 * drives.corner_tolerance:.3g} µm the program "
            f"moves for {time:.1f} s"]
