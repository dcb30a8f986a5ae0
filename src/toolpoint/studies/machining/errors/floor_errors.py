r"""Errors of floors and of what balls leave, along the surface's normal n: stable forced vibration of the tip.

The force of the arcs, periodic with the teeth, moves the tip by :math:`u(t) = \sum_k G(i k \omega_T) c_k e^{i k \omega_T t}`. A
flat end leaves a floor twice passed by its edges, in front of the axis and behind: the lower of both counts. A ball leaves a
point of its surface when a tooth passes there; at its tip, where teeth always are, the lowest moment counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray
from toolpoint._doubt import Doubt
from toolpoint.cutting import MillingProblem
from toolpoint.cutting.build import tool_of
from toolpoint.cutting.cut.tool import Tool
from toolpoint.cutting.force.arc_forces import force_history
from toolpoint.cutting.surface.location import response_with_static
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import PlaceArcs
from toolpoint.studies.machining.errors.left_surface import LeftSurface, find_left_surface
from toolpoint.studies.machining.errors.servo_course import ServoCourse
from toolpoint.studies.machining.errors.wall_errors import feed_mark_height, largest_of_sign
from toolpoint.studies.machining.loads import CutLoads, slice_edges
from toolpoint.studies.machining.margins import PlaceMargins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver

FLOOR_STEPS = 120  # of the rotation between two teeth
MAX_FLOOR_BLOCKS = 3000  # whose forced vibration is computed, those of the largest force
_BALL_SHARE = 0.999  # of the radius: a corner radius from which a tool is a ball
_TIP_SHARE = 0.05  # of the radius: contact nearer to a ball's axis is at its tip


@dataclass(frozen=True, eq=False)
class FloorErrors:
    """Errors of what ends of tools leave, of every block (n,), m, not a number where not known.

    location : along the outward normal, positive where material is left; cusp : height between neighbouring tracks of a ball;
    marks : feed marks of a ball; surface : normals; place : of those that cut (`PlaceArcs`) the one that stands for the block,
    -1 where it leaves nothing; notes : what is not known, and why.
    """

    location: FloatArray
    cusp: FloatArray
    marks: FloatArray
    surface: LeftSurface
    place: IndexArray
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[str, ...] = ()


def floor_errors(arcs: PlaceArcs, loads: CutLoads, margins: PlaceMargins | None, *, laid: ProgramPath, removed: RemovedMaterial,
                 setup: MachiningSetup, solver: StabilitySolver | None = None, pose: np.ndarray | None = None,
                 surface: LeftSurface | None = None) -> FloorErrors:
    """Return the errors of floors and of ball ends, of the blocks whose surface stays to the end of the program.

    Of each block the place with the largest force counts; those that chatter have no forced vibration.

    surface : of a tool that turns; that of the dexels along z where left out.
    """
    n, surface = laid.path.count, surface or find_left_surface(laid, removed)
    location, judged = np.full(n, np.nan), np.full(n, -1)
    piece = removed.piece[arcs.place]
    block = laid.moves.block[piece]
    normal = surface.normal_at(piece, block)
    leaves = ~np.isnan(normal[:, 0]) & (loads.feed_per_tooth[arcs.place] > 0)
    order = np.flatnonzero(leaves)[np.argsort(-loads.lateral[arcs.place[leaves]], kind="stable")]
    chosen = order[np.sort(np.unique(block[order], return_index=True)[1])]
    judged[block[chosen]] = chosen
    marks = _ball_marks(normal[chosen], loads.feed_per_tooth[arcs.place[chosen]], block[chosen], laid=laid, setup=setup)
    if margins is None or solver is None or pose is None:
        return FloorErrors(location, surface.cusp, marks, surface, judged)
    stable, unknown = chosen[margins.stable[chosen]], set[str]()
    for m in stable[:MAX_FLOOR_BLOCKS].tolist():
        k, place = int(block[m]), int(arcs.place[m])
        problem = solver.problem(int(laid.tool[k]), int(pose[place])).changed(feed_angle=float(arcs.angle[m]))
        reason = _unknown_reason(problem)
        if reason:
            unknown.add(reason)
            continue
        motion = _motion(problem, removed, place, feed=float(loads.feed_per_tooth[place]), speed=float(laid.speed[k]))
        location[k] = error_along(motion, problem.tool, _in_feed_frame(normal[m], float(arcs.angle[m])))
    notes = tuple(f"Errors of floors are {reason}; the response of the tip along z and the axial coefficient give them."
                  for reason in sorted(unknown))
    doubts = list[Doubt]()
    if stable.size > MAX_FLOOR_BLOCKS:
        doubts.append(Doubt("errors of floors", f"computed for the {MAX_FLOOR_BLOCKS} of {stable.size} blocks with the largest "
                            "force", "judge a part of the program"))
    return FloorErrors(location, surface.cusp, marks, surface, judged, tuple(doubts), notes)


def _ball_marks(normal: FloatArray, feed: FloatArray, block: np.ndarray, *, laid: ProgramPath, setup: MachiningSetup
                ) -> FloatArray:
    """Return the height of the feed marks that balls leave on their blocks, m; alike feeds and normals are computed once."""
    marks = np.full(laid.path.count, np.nan)
    lean = np.hypot(normal[:, 0], normal[:, 1])
    for number in np.unique(laid.tool[block]).tolist():
        tool = tool_of(setup.cut_of(number))
        if tool.corner_radius < _BALL_SHARE * tool.radius:
            continue
        rows = np.flatnonzero(laid.tool[block] == number)
        keys = np.stack([np.round(feed[rows], 8), np.round(lean[rows], 2)], axis=1)
        unique, group = np.unique(keys, axis=0, return_inverse=True)
        heights = np.array([feed_mark_height(tool, float(value), share=float(share)) for value, share in unique])
        marks[block[rows]] = heights[group.reshape(-1)]
    return marks


def total_along_normals(floors: FloorErrors, course: ServoCourse | None) -> FloatArray:
    """Return the total error of every block along the normal of what its tool's end leaves, m: with the servo's at its samples,
    the largest in size; not a number where the forced vibration is not known."""
    if course is None:
        return floors.location
    outward = (np.column_stack([course.error + course.yielding, course.rise]) * floors.surface.normal[course.block]).sum(axis=1)
    return largest_of_sign(floors.location[course.block] + outward, course.block, floors.location.size)


def _unknown_reason(problem: MillingProblem) -> str:
    """Return why the motion along a normal is not known, nothing where it is."""
    if not problem.tool.is_regular:
        return "not known for teeth of unequal pitch or helix"
    if problem.plane.size == 3:
        return ""
    if problem.coefficients.ka == 0 and problem.tool.corner_radius == 0:
        return "not known: without an axial coefficient nothing says how a flat end is lifted"
    return "not known: the response of the tip along its axis is not"


def _in_feed_frame(normal: FloatArray, angle: float) -> FloatArray:
    s, c = np.sin(angle), np.cos(angle)
    return np.array([c * normal[0] + s * normal[1], -s * normal[0] + c * normal[1], normal[2]])


def _motion(problem: MillingProblem, removed: RemovedMaterial, place: int, *, feed: float, speed: float) -> FloatArray:
    """Return the motion of the tip over the rotation between two teeth, (FLOOR_STEPS, 3), m, in the frame of the feed."""
    shape = removed.shapes[int(removed.moves.rows[removed.piece[place], 12])]
    edges = slice_edges(shape, removed.reach[place:place + 1], removed.arcs.shape[1])[0]
    way = removed.feed[place]
    force = force_history(problem.tool, problem.coefficients, removed.arcs[place], edges=edges, feed=feed,
                          direction=(float(np.hypot(way[0], way[1])), float(way[2])), steps=FLOOR_STEPS)
    return solve_forced_motion(problem, force, speed)


def solve_forced_motion(problem: MillingProblem, force: FloatArray, speed: float) -> FloatArray:
    """Return the periodic motion (n, 3) of the tip, m, under a force over the rotation between two teeth (n, 3), N."""
    spectrum = np.fft.rfft(force, axis=0)
    lines = np.arange(len(spectrum)) * problem.tool.teeth * speed / 60
    response = response_with_static(problem.plane_at(speed), lines)
    return np.fft.irfft(np.einsum("kab,kb->ka", response, spectrum), n=len(force), axis=0)


def error_along(motion: FloatArray, tool: Tool, normal: FloatArray) -> float:
    """Return by how much a surface of an outward normal (3,) stands out after a motion of the tip over the rotation between two
    teeth (n, 3), m, both in the frame of the feed."""
    outward, lean = motion @ normal, float(np.hypot(normal[0], normal[1]))
    if tool.corner_radius == 0 and lean < _TIP_SHARE:  # the end's edges sweep the floor before the axis and behind it
        phi = np.linspace(0.0, np.pi, len(motion))
        swept = np.minimum(_at_rotation(outward, tool, phi), _at_rotation(outward, tool, -phi))
        return float(swept[np.argmax(np.abs(swept))])
    if lean < _TIP_SHARE:
        return float(outward.min())
    # The point lies against the normal, clockwise from y: on the corner, or on the rim of a flat end that leans.
    phi = np.arctan2(-normal[0], -normal[1])
    height = tool.corner_radius * (1 - normal[2])
    return float(_at_rotation(outward, tool, np.array([phi + 2 * np.tan(np.mean(tool.helix)) / tool.diameter * height]))[0])


def _at_rotation(values: FloatArray, tool: Tool, rotation: FloatArray) -> FloatArray:
    """Return values over the rotation between two teeth at rotations, rad, between steps linear."""
    pitch = 2 * np.pi / tool.teeth
    place = (rotation % pitch) / pitch * len(values)
    return np.asarray(np.interp(place, np.arange(len(values) + 1), np.append(values, values[0])))
