"""Paths of the tool for milling: squares, lines, arcs, points and programs, placed in space; every side with its motion law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from toolpoint._check import FloatArray, fail, floats, one_of, positive
from toolpoint._notebook import NotebookText
from toolpoint.drives import JerkLimits, Quintic, seven_phase
from toolpoint.drives.program.path import ARC_KIND, LINE_KIND, PLANES, Path

LAWS = ("quintic", "jerk-limited")
_MIN_CORNER_ANGLE = 1e-3  # rad: a smaller turn between segments is no corner
_MAX_DISTANCE_RATIO = 20.0  # distance of two points over the median distance


class MotionLaw(Protocol):
    """Length travelled over time."""

    @property
    def duration(self) -> float:
        """Duration, s."""
        ...

    def sample(self, time: FloatArray) -> FloatArray:
        """Return position, speed, acceleration, jerk at times, (n, 4)."""
        ...


@dataclass(frozen=True, eq=False)
class PathSide(NotebookText):
    """A smooth piece of a path from rest to rest: segments of `path` (m) in the frame `place` (4, 4), and its motion law."""

    name: str
    path: Path
    place: FloatArray
    law: MotionLaw

    @property
    def length(self) -> float:
        """Length, m."""
        return float(self.path.lengths.sum())

    def points(self, lengths: FloatArray) -> FloatArray:
        """Return places at lengths from the start, m, (n, 3)."""
        return self.path.at(lengths) @ self.place[:3, :3].T + self.place[:3, 3]

    def tangents(self, lengths: FloatArray) -> FloatArray:
        """Return unit tangents at lengths from the start, (n, 3)."""
        ends = np.cumsum(self.path.lengths)
        s = np.clip(np.asarray(lengths, float), 0.0, ends[-1])
        k = np.minimum(np.searchsorted(ends, s, side="left"), self.path.count - 1)
        share = 1 - (ends[k] - s) / self.path.lengths[k]
        return self.path.tangents(k, share) @ self.place[:3, :3].T

    def __repr__(self) -> str:
        return f"PathSide({self.name!r}, {1e3 * self.length:.6g} mm, {self.law.duration:.4g} s)"


def square(side: float, *, centre: ArrayLike = (0.0, 0.0, 0.0), first: ArrayLike = (1.0, 0.0, 0.0),
           second: ArrayLike = (0.0, 1.0, 0.0), feed: float = 0.005, law: str = "quintic", limits: JerkLimits | None = None
           ) -> tuple[PathSide, ...]:
    """Return the four sides of a square (m) in the plane of two directions, begun at its lower left corner along the first.

    Examples
    --------
    >>> square(0.1, feed=0.05)[0]
    PathSide('side 1', 100 mm, 3.75 s)
    """
    half = positive("side", side) / 2
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]])
    return along_points(np.column_stack([corners, np.zeros(5)]), place=plane_frame(centre, first, second), feed=feed, law=law,
                        limits=limits)


def line(start: ArrayLike, end: ArrayLike, *, feed: float = 0.005, law: str = "quintic", limits: JerkLimits | None = None
         ) -> tuple[PathSide, ...]:
    """Return a straight side between two places (m).

    Examples
    --------
    >>> line((0.0, 0.0, 0.0), (0.3, 0.4, 0.0), feed=0.05)[0].length
    0.5
    """
    return along_points(np.stack([floats("start", start, (3,)), floats("end", end, (3,))]), feed=feed, law=law, limits=limits)


def arc(radius: float, sweep: float, *, centre: ArrayLike = (0.0, 0.0, 0.0), first: ArrayLike = (1.0, 0.0, 0.0),
        second: ArrayLike = (0.0, 1.0, 0.0), feed: float = 0.005, law: str = "quintic", limits: JerkLimits | None = None
        ) -> tuple[PathSide, ...]:
    """Return an arc (m, rad) about a centre, begun along the first direction, turning towards the second.

    Examples
    --------
    >>> half_circle, = arc(0.02, np.pi)
    >>> half_circle.points(np.array([0.0, half_circle.length])).round(6).tolist()
    [[0.02, 0.0, 0.0], [-0.02, 0.0, 0.0]]
    """
    r, turn = positive("radius", radius), floats("sweep", sweep)
    end = r * np.array([np.cos(turn), np.sin(turn), 0.0])
    path = Path(np.array([ARC_KIND]), np.array([[r, 0.0, 0.0]]), end[None], np.zeros((1, 3)), np.array([float(turn)]),
                np.array([PLANES["xy"]]), np.array([positive("feed", feed)]), np.zeros(1, bool))
    return sides_of(path, place=plane_frame(centre, first, second), feed=feed, law=law, limits=limits)


def along_points(points: ArrayLike, *, place: FloatArray | None = None, feed: float = 0.005, law: str = "quintic",
                 limits: JerkLimits | None = None) -> tuple[PathSide, ...]:
    """Return straight sides through points (n, 3), m; neighbours in one direction are one side.

    Raises ToolpointError for fewer than two points, repeated ones, and a jump: one far longer than the others.

    Examples
    --------
    >>> along_points([(0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.05, 0.0)], feed=0.05)
    (PathSide('side 1', 100 mm, 3.75 s), PathSide('side 2', 50 mm, 1.875 s))
    """
    places = floats("points", points, (None, 3))
    if len(places) < 2:
        fail("points", f"{len(places)}", "must be at least two")
    step = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # Points closer than a nanometre have no direction between them.
    if step.min() < 1e-9:
        fail("points", f"point {int(step.argmin()) + 2} repeats the one before", "must move")
    # With fewer points the median says little about what is usual.
    if len(step) > 4 and step.max() > _MAX_DISTANCE_RATIO * np.median(step):
        k = int(step.argmax())
        fail("points",
             f"a jump of {1e3 * step[k]:.4g} mm from point {k + 1} to {k + 2}, the others are {1e3 * np.median(step):.4g} mm "
             "apart",
             "a path must be followed", remedy="add the points between, or give the parts as paths of their own")
    n = len(step)
    path = Path(np.full(n, LINE_KIND), places[:-1], places[1:], np.zeros((n, 3)), np.zeros(n), np.tile([0, 1], (n, 1)),
                np.full(n, float(feed)),
                np.zeros(n, bool))
    return sides_of(path, place=place, feed=feed, law=law, limits=limits)


def sides_of(path: Path, *, place: FloatArray | None = None, feed: float | None = None, law: str = "quintic",
             limits: JerkLimits | None = None) -> tuple[PathSide, ...]:
    """Return the smooth pieces of a path of segments, cut at corners and stops, each from rest to rest.

    The path may be that of a program.

    Positioning (G0) is left out: nothing is cut there. feed : m/s, the program's where left out; limits : speed, acceleration
    and jerk along the path (5 m/s^2 and 100 m/s^3 where left out).

    Examples
    --------
    >>> from toolpoint.drives.program.path import polyline
    >>> [side.length for side in sides_of(polyline([[0, 0], [0.1, 0], [0.1, 0.05]], feed=0.1))]
    [0.1, 0.05]
    """
    one_of("law", law, LAWS)
    frame = np.eye(4) if place is None else floats("place", place, (4, 4))
    cutting = np.flatnonzero(~path.rapid & (path.lengths > 0))
    if not cutting.size:
        fail("path", "no segment that cuts", "must have one", remedy="positioning alone (G0) mills nothing")
    turns = path.turns()
    groups: list[list[int]] = []
    for k in cutting:
        # A side ends at a corner, a stop, a rapid between, and where the program changes the feed.
        goes_on = groups and groups[-1][-1] == k - 1 and turns[k - 1] < _MIN_CORNER_ANGLE and not path.stop[k - 1]
        if goes_on and (feed is not None or path.feed[k] == path.feed[k - 1]):
            groups[-1].append(int(k))
        else:
            groups.append([int(k)])
    sides = []
    for number, group in enumerate(groups):
        part = path.taken(np.array(group))
        speed = positive("feed", float(part.feed[0]) if feed is None else feed)
        sides.append(PathSide(f"side {number + 1}", part, frame, _law(law, float(part.lengths.sum()), speed, limits)))
    return tuple(sides)


def lay_path(*, square_side: float | None = None, ends: Sequence[ArrayLike] = (), points: ArrayLike | None = None,
             path: Path | None = None, centre: ArrayLike = (0.0, 0.0, 0.0),
             plane: tuple[ArrayLike, ArrayLike] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), feed: float = 0.005,
             law: str = "quintic") -> tuple[PathSide, ...]:
    """Return the sides of the one path that is given, see `square`, `line`, `along_points` and `sides_of`.

    Parameters
    ----------
    square_side : float, optional
        m, of a square about the centre in the plane.
    ends : sequence of (3,) floats, optional
        Start and end of a line, m.
    points, path : optional
        Places (n, 3), m, or a program's path, whose zero is the centre; a program has its own feeds.
    centre, plane, feed, law
        m; two directions; m/s; motion law.

    Raises
    ------
    ToolpointError
        For none or several of them, and what those refuse.

    Examples
    --------
    >>> [side.length for side in lay_path(ends=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)))]
    [0.1]
    """
    if sum((square_side is not None, len(ends) > 0, points is not None, path is not None)) != 1:
        fail("accuracy", "none or several paths", "must be exactly one of `square`, `line` (twice), `points` and `program`")
    if square_side is not None:
        return square(square_side, centre=centre, first=plane[0], second=plane[1], feed=feed, law=law)
    if len(ends):
        if len(ends) != 2:
            fail("`line`", f"{len(ends)} places", "must be given twice, the start and the end")
        return line(*ends, feed=feed, law=law)
    place = plane_frame(centre, *plane)
    if points is not None:
        return along_points(points, place=place, feed=feed, law=law)
    assert path is not None
    return sides_of(path, place=place, law=law)


def _law(law: str, length: float, feed: float, limits: JerkLimits | None) -> MotionLaw:
    bounds = limits or JerkLimits(feed, 5.0, 100.0)
    # The feed is the programmed speed: limits of the machine may lower it only.
    bounds = JerkLimits(min(feed, bounds.speed), bounds.acceleration, bounds.jerk)
    return Quintic.fastest(length, bounds) if law == "quintic" else seven_phase(length, bounds)


def plane_frame(centre: ArrayLike, first: ArrayLike, second: ArrayLike) -> FloatArray:
    """Return the frame (4, 4) of a plane: its x along the first direction, y towards the second.

    Examples
    --------
    >>> plane_frame((0.0, 0.0, 0.5), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)).tolist()
    [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]]
    """
    a, b = floats("first", first, (3,)), floats("second", second, (3,))
    x = a / np.linalg.norm(a)
    # The second direction is made perpendicular to the first.
    y = b - x * float(x @ b)
    # What is left across the first direction is rounding: both lie along each other.
    if np.linalg.norm(y) < 1e-9:
        fail("second", str(b.tolist()), "must not be along the first direction")
    y = y / np.linalg.norm(y)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = np.column_stack([x, y, np.cross(x, y)]), floats("centre", centre, (3,))
    return frame


