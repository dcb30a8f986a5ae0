r"""Errors of the walls that blocks leave: surface location error of forced vibration, feed marks, total along the normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.cutting import Engagement
from toolpoint.cutting.build import tool_of
from toolpoint.cutting.cut.tool import Tool
from toolpoint.cutting.surface.location import location_error
from toolpoint.material_removal import RemovedMaterial
from toolpoint.studies.machining.engagement_classes import ARC_STEP, DIRECTION_STEP, PlaceArcs
from toolpoint.studies.machining.errors.servo_course import ServoCourse, lengths_of_places
from toolpoint.studies.machining.loads import CutLoads
from toolpoint.studies.machining.margins import PlaceMargins
from toolpoint.studies.machining.program_path import ProgramPath
from toolpoint.studies.machining.setup import MachiningSetup
from toolpoint.studies.machining.solver import StabilitySolver

WALL_REACH = np.radians(1.0)  # rad: an arc that ends so near to 0 or 180 degrees leaves a wall there
MAX_WALL_CUTS = 1500  # distinct ones whose location error is solved, those of the largest force
_DEPTH_STEP = 0.02  # of the depth, within which cuts are one
_MARK_POINTS = 400  # of a revolution's feed, at which feed marks are laid


@dataclass(frozen=True, eq=False)
class WallErrors:
    """Errors at the places that cut, (m,) as `PlaceArcs`; not a number where not known.

    location : (m, 2) surface location error of the walls to the left and to the right of the feed, m, positive where material
    is left; marks : height of the feed marks of a rigid tool, m.
    """

    location: FloatArray
    marks: FloatArray
    doubts: tuple[Doubt, ...] = ()


def wall_errors(arcs: PlaceArcs, loads: CutLoads, margins: PlaceMargins | None, *, laid: ProgramPath,
                removed: RemovedMaterial, setup: MachiningSetup, solver: StabilitySolver | None = None,
                pose: np.ndarray | None = None) -> WallErrors:
    """Return the errors of the walls that every place leaves.

    Location errors are those of stable forced vibration of a cylindrical tool, by the response at the place's pose and along
    its feed. Cuts alike in tool, arc (2 degrees), direction (15 degrees), depth (2 %), speed and pose are solved once, at two
    feeds: the error is linear in the feed.
    """
    n = arcs.place.size
    block = laid.moves.block[removed.piece[arcs.place]]
    left, right = arcs.entry < WALL_REACH, arcs.exit > np.pi - WALL_REACH
    feed = loads.feed_per_tooth[arcs.place]
    marks = _marks(feed, np.asarray(laid.tool[block]), left | right, setup=setup)
    location = np.full((n, 2), np.nan)
    if margins is None or solver is None or pose is None:
        return WallErrors(location, marks)
    judged = np.flatnonzero((left | right) & margins.stable & (feed > 0))
    keys = np.stack([laid.tool[block], np.rint(arcs.entry / ARC_STEP), np.rint(arcs.exit / ARC_STEP),
                     np.rint(arcs.angle / DIRECTION_STEP), np.rint(np.log(np.maximum(arcs.depth, 1e-9)) / _DEPTH_STEP),
                     np.rint(10 * laid.speed[block]), pose[arcs.place]], axis=1).astype(int)[judged]
    unique, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    strongest = np.zeros(len(unique))
    np.maximum.at(strongest, group.reshape(-1), loads.lateral[arcs.place[judged]])
    solved, doubts = np.argsort(-strongest)[:MAX_WALL_CUTS], list[Doubt]()
    lines = np.full((len(unique), 2, 2), np.nan)  # of each wall (left, right): error without feed, and slope
    failures = dict[str, None]()
    for k in solved.tolist():
        m = int(judged[first[k]])
        cut = _Cut(int(laid.tool[block[m]]), int(pose[arcs.place[m]]), (float(arcs.entry[m]), float(arcs.exit[m])),
                   float(arcs.angle[m]), float(laid.speed[block[m]]), float(arcs.depth[m]), float(feed[m]))
        try:
            lines[k] = _lines(solver, cut)
        except ToolpointError as error:
            failures[str(error).split(";")[0]] = None
    values = lines[group.reshape(-1)]
    location[judged] = values[:, :, 0] + values[:, :, 1] * feed[judged, None]
    if len(unique) > MAX_WALL_CUTS:
        doubts.append(Doubt("surface location error", f"solved for the {MAX_WALL_CUTS} of {len(unique)} distinct cuts with the "
                            "largest force, not for the others", "judge a part of the program"))
    doubts += [Doubt("surface location error", f"not known for some cuts: {text}") for text in list(failures)[:2]]
    return WallErrors(location, marks, tuple(doubts))


@dataclass(frozen=True)
class _Cut:
    tool: int
    pose: int
    arc: tuple[float, float]
    angle: float
    speed: float
    depth: float
    feed: float


def _lines(solver: StabilitySolver, cut: _Cut) -> FloatArray:
    """Return the location error of the left and the right wall without feed (m), and its slope over the feed per tooth."""
    entry = 0.0 if cut.arc[0] < WALL_REACH else cut.arc[0]
    leave = np.pi if cut.arc[1] > np.pi - WALL_REACH else cut.arc[1]
    out = np.full((2, 2), np.nan)
    speeds = np.array([cut.speed])
    problem = solver.problem(cut.tool, cut.pose).changed(engagement=Engagement(entry, leave), feed_angle=cut.angle)
    for k, (side, is_wall) in enumerate((("entry", entry == 0.0), ("exit", leave == np.pi))):
        if is_wall:
            at_half, at_full = (location_error(problem.changed(feed_per_tooth=share * cut.feed), speeds, cut.depth,
                                                  side=side)[0] for share in (0.5, 1.0))
            out[k] = 2 * at_half - at_full, (at_full - at_half) / (0.5 * cut.feed)
    return out


def _marks(feed: FloatArray, tools: np.ndarray, is_wall: np.ndarray, *, setup: MachiningSetup) -> FloatArray:
    """Return the height of the feed marks on the walls of places, m; not a number where a place leaves none."""
    marks = np.full(feed.size, np.nan)
    for number in np.unique(tools[is_wall]).tolist():
        members = np.flatnonzero(is_wall & (tools == number))
        tool = tool_of(setup.cut_of(number))
        unique, group = np.unique(np.round(feed[members], 8), return_inverse=True)
        heights = np.array([feed_mark_height(tool, float(value)) for value in unique])
        marks[members] = heights[group.reshape(-1)]
    return marks


def feed_mark_height(tool: Tool, feed_per_tooth: float, *, share: float = 1.0) -> float:
    r"""Return the height of the feed marks that a rigid tool leaves on a wall, m: peak to valley, with its run-out and pitch.

    :math:`h(x) = \min_j (x - x_j)^2/2R - e_j`, x_j the way of the axis at tooth j, e_j how far it stands out, of
    whose run-out a ball shows the `share` that lies along its normal.

    Examples
    --------
    f^2/(8 R) of equal teeth:

    >>> from toolpoint.cutting import Tool
    >>> round(1e6 * feed_mark_height(Tool(teeth=4, diameter=0.01), 1e-4), 4)
    0.25
    """
    revolution = feed_per_tooth * tool.teeth
    if revolution <= 0:
        return float("nan")
    turn = tool.angles(0.0) / (2 * np.pi)
    stands_out = share * tool.runout * np.cos(tool.runout_angle - tool.angles(0.0))
    x = np.linspace(0.0, revolution, _MARK_POINTS, endpoint=False)[:, None]
    places = np.concatenate([revolution * (turn + k) for k in (-1.0, 0.0, 1.0)])
    profile = ((x - places) ** 2 / tool.diameter - np.tile(stands_out, 3)).min(axis=1)
    return float(np.ptp(profile))


def total_errors(walls: WallErrors, arcs: PlaceArcs, course: ServoCourse | None, *, laid: ProgramPath,
                 removed: RemovedMaterial) -> tuple[FloatArray, FloatArray]:
    """Return location error and total error normal to the wall of every block, m, (blocks,) each; the largest in size.

    The total is the location error less the way that servo and its yielding move the tool towards the wall: positive where
    material is left. Not a number for blocks whose location error is not known.
    """
    n, block = laid.path.count, laid.moves.block[removed.piece[arcs.place]]
    location = larger_of(*(largest_of_sign(walls.location[:, k], block, n) for k in (0, 1)))
    if course is None or not arcs.place.size:
        return location, location
    length = lengths_of_places(laid, removed)[arcs.place]
    place = np.searchsorted((length[1:] + length[:-1]) / 2, course.place)
    left = np.stack([-course.tangent[:, 1], course.tangent[:, 0]], axis=1)
    towards = ((course.error + course.yielding) * left).sum(axis=1)
    totals = [largest_of_sign(walls.location[place, k] - sign * towards, course.block, n) for k, sign in ((0, 1.0), (1, -1.0))]
    return location, larger_of(*totals)


def larger_of(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the values of the larger size, not a number where neither is known."""
    return np.asarray(np.where(np.nan_to_num(np.abs(left), nan=-1.0) >= np.nan_to_num(np.abs(right), nan=-1.0), left, right))


def largest_of_sign(values: FloatArray, block: np.ndarray, count: int) -> FloatArray:
    """Return the value of largest size of each block with its sign, not a number where it has none."""
    largest = np.full(count, np.nan)
    order = np.argsort(np.where(np.isnan(values), -1.0, np.abs(values)), kind="stable")
    largest[block[order]] = values[order]  # written last is the largest
    return largest
