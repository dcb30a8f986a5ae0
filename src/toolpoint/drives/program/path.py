"""Path of lines, arcs and clothoid blends in space: points and tangents by arc length, junctions, corner blends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from toolpoint._check import FloatArray, fail, floats, frozen, nonnegative, positive
from toolpoint._notebook import NotebookText
from toolpoint.drives.program.clothoid import Blend, half_lengths

LINE_KIND, ARC_KIND, CLOTHOID_KIND = 0, 1, 2  # codes of `Path.kind`
PLANES = {"xy": (0, 1), "zx": (2, 0), "yz": (1, 2)}


@dataclass(frozen=True, eq=False)
class Path(NotebookText):
    """Segments end to end; an arc turns by `sweep` about `center` in a coordinate plane, the third axis linear (helix).

    Parameters
    ----------
    kind : (n,) ints
        0 line, 1 arc, 2 clothoid blend of a corner.
    start, end, center : (n, 3) floats
        m; center is ignored for lines, and the corner of a clothoid blend.
    sweep : (n,) floats
        rad, positive from the plane's first to its second axis; zero for lines, the turn (positive) of a clothoid blend.
    plane : (n, 2) ints
        Indices of the plane's axes: (0, 1), (2, 0) or (1, 2).
    feed : (n,) floats
        m/s.
    stop : (n,) bools
        Exact stop at the segment's end.
    line : (n,) ints, optional
        Line of the program.
    rapid : (n,) bools, optional
        Positioning (G0): no cut, its accuracy is no matter.
    dwell : (n,) floats, optional
        s, waited at the segment's end.

    Examples
    --------
    >>> import numpy as np
    >>> path = polyline([[0, 0], [0.1, 0], [0.1, 0.1]], feed=0.1)
    >>> isinstance(path, Path), path.lengths.tolist(), np.degrees(path.turns()).round(6).tolist()
    (True, [0.1, 0.1], [90.0])
    """

    kind: np.ndarray
    start: FloatArray
    end: FloatArray
    center: FloatArray
    sweep: FloatArray
    plane: np.ndarray
    feed: FloatArray
    stop: np.ndarray
    line: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    rapid: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    dwell: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        put, n = object.__setattr__, len(self.kind)
        if n == 0:
            fail("Path", "no segments", "must have at least one")
        for name, shape in (("start", (n, 3)), ("end", (n, 3)), ("center", (n, 3)), ("sweep", (n,)), ("feed", (n,))):
            put(self, name, floats(f"Path.{name}", getattr(self, name), shape))
        nonnegative("Path.feed", self.feed)
        for name, kind in (("kind", int), ("plane", int), ("stop", bool)):
            put(self, name, frozen(np.array(getattr(self, name), dtype=kind)))
        for name, number in (("line", np.dtype(int)), ("rapid", np.dtype(bool)), ("dwell", np.dtype(float))):
            values = getattr(self, name)
            put(self, name, frozen(np.array(values if len(values) else np.zeros(n), dtype=number)))
        nonnegative("Path.dwell", self.dwell)
        put(self, "stop", frozen(self.stop | (self.dwell > 0)))
        gap = np.linalg.norm(self.start[1:] - self.end[:-1], axis=1)
        if gap.size and gap.max() > 1e-9:
            k = int(gap.argmax())
            fail("Path", f"gap of {gap[k]:g} m between segments {k} and {k + 1}", "must be continuous")

    @property
    def count(self) -> int:
        """Number of segments."""
        return int(self.kind.size)

    @property
    def radius(self) -> FloatArray:
        """Radius of every arc in its plane, m; infinite for lines."""
        rows = np.arange(self.count)[:, None]
        r = np.linalg.norm((self.start - self.center)[rows, self.plane], axis=1)
        return np.where(self.kind == ARC_KIND, r, np.inf)

    @property
    def lengths(self) -> FloatArray:
        """Arc length of every segment, m."""
        chord = self.end - self.start
        arc = self.kind == ARC_KIND
        flat = np.where(arc, np.where(arc, self.radius, 0.0) * self.sweep, 0.0)
        height = np.take_along_axis(chord, (3 - self.plane.sum(axis=1))[:, None], axis=1)[:, 0]
        out = np.where(arc, np.hypot(flat, height), np.linalg.norm(chord, axis=1))
        k = np.flatnonzero(self.kind == CLOTHOID_KIND)
        out[k] = 2 * self.blends(k).half_length
        return out

    def blends(self, segment: np.ndarray) -> Blend:
        """Return the geometry of clothoid blends, (n,) indices."""
        k = np.asarray(segment)
        return Blend(self.start[k], self.end[k], self.center[k], self.sweep[k])

    def points(self, segment: np.ndarray, share: FloatArray) -> FloatArray:
        """Return points at a share (0..1) of segments, (n, 3)."""
        k, u = np.asarray(segment), np.asarray(share, float)
        p = self.start[k] + u[:, None] * (self.end[k] - self.start[k])
        arc = np.flatnonzero(self.kind[k] == ARC_KIND)
        if arc.size:
            i = k[arc]
            plane_axes = self.plane[i]
            rows = np.arange(i.size)[:, None]
            d = (self.start[i] - self.center[i])[rows, plane_axes]
            c, s = np.cos(u[arc] * self.sweep[i]), np.sin(u[arc] * self.sweep[i])
            turned = np.stack([c * d[:, 0] - s * d[:, 1], s * d[:, 0] + c * d[:, 1]], axis=1)
            p[arc[:, None], plane_axes] = self.center[i][rows, plane_axes] + turned
        soft = np.flatnonzero(self.kind[k] == CLOTHOID_KIND)
        p[soft] = self.blends(k[soft]).points(u[soft])
        return p

    def tangents(self, segment: np.ndarray, share: FloatArray) -> FloatArray:
        """Return unit tangents at a share (0..1) of segments, (n, 3)."""
        k, u = np.asarray(segment), np.asarray(share, float)
        t = (self.end[k] - self.start[k]).copy()
        arc = np.flatnonzero(self.kind[k] == ARC_KIND)
        if arc.size:
            i = k[arc]
            plane_axes = self.plane[i]
            rows = np.arange(i.size)[:, None]
            d = (self.start[i] - self.center[i])[rows, plane_axes]
            c, s, w = np.cos(u[arc] * self.sweep[i]), np.sin(u[arc] * self.sweep[i]), self.sweep[i]
            t[arc[:, None], plane_axes] = w[:, None] * np.stack([-s * d[:, 0] - c * d[:, 1], c * d[:, 0] - s * d[:, 1]], axis=1)
        soft = np.flatnonzero(self.kind[k] == CLOTHOID_KIND)
        t[soft] = self.blends(k[soft]).tangents(u[soft])
        size = np.linalg.norm(t, axis=1, keepdims=True)
        return t / np.where(size > 0, size, 1.0)

    def turns(self) -> FloatArray:
        """Return the angle between the tangents at every inner junction, rad, (n - 1,)."""
        n = self.count
        tangent_in = self.tangents(np.arange(n - 1), np.ones(n - 1))
        tangent_out = self.tangents(np.arange(1, n), np.zeros(n - 1))
        # Exact to rounding also for nearly equal or opposite tangents, where an arc cosine loses half of the digits.
        return 2 * np.arctan2(np.linalg.norm(tangent_in - tangent_out, axis=1),
                              np.linalg.norm(tangent_in + tangent_out, axis=1))

    def at(self, length: FloatArray) -> FloatArray:
        """Return the points at arc lengths from the start, (n, 3)."""
        ends = np.cumsum(self.lengths)
        s = np.clip(np.asarray(length, float), 0.0, ends[-1])
        k = np.minimum(np.searchsorted(ends, s, side="left"), self.count - 1)
        size = self.lengths[k]
        return self.points(k, np.where(size > 0, 1 - (ends[k] - s) / np.where(size > 0, size, 1.0), 1.0))

    def taken(self, keep: np.ndarray) -> Path:
        """Return the segments at indices or where True (they must stay continuous)."""
        return replace(self, **{name: getattr(self, name)[keep] for name in _ARRAYS})

    def __repr__(self) -> str:
        return f"Path({self.count} segments, {int((self.kind == ARC_KIND).sum())} arcs, {self.lengths.sum():.6g} m)"


# Fields of a Path that hold one row a segment.
_ARRAYS = ("kind", "start", "end", "center", "sweep", "plane", "feed", "stop", "line", "rapid", "dwell")


def polyline(points: FloatArray, feed: float) -> Path:
    """Return straight segments through points (n, 2 or 3), m, at a feed in m/s, without stops."""
    p = np.asarray(points, float)
    p = np.hstack([p, np.zeros((len(p), 3 - p.shape[1]))])
    n = len(p) - 1
    return Path(np.zeros(n, int), p[:-1], p[1:], np.zeros((n, 3)), np.zeros(n), np.tile([0, 1], (n, 1)),
                np.full(n, float(feed)), np.zeros(n, bool))


def full_turns(radius: float, feed: float, turns: int = 2, *, columns: tuple[int, int] = (0, 1)) -> Path:
    """Return full turns about the origin, begun at R on the first of two coordinates, towards the second; m and m/s.

    columns : of the path, 0 to 2 for x, y, z; any two.
    """
    start = np.zeros((turns, 3))
    start[:, columns[0]] = positive("radius", radius)
    # A plane is named in the order of its right-handed turn: against that order the same circle sweeps the other way.
    sweep, plane = (2 * np.pi, columns) if columns in PLANES.values() else (-2 * np.pi, columns[::-1])
    return Path(np.full(turns, ARC_KIND), start, start, np.zeros((turns, 3)), np.full(turns, sweep), np.array([plane] * turns),
                np.full(turns, positive("feed", feed)), np.zeros(turns, bool))


def blend_corners(path: Path, tolerance: float, smallest_turn: float = 1e-4) -> Path:
    """Return the path with corners between lines replaced by tangent arcs that stay within `tolerance` (m) of the corner.

    A corner of deflection t gets the radius e cos(t/2)/(1 - cos(t/2)), smaller where a blend would use more than half of a
    line. Only lines in one coordinate plane are blended; other corners, and those marked as stops, keep their corner.
    """
    n, turn, lengths = path.count, path.turns(), path.lengths
    pairs = (path.kind[:-1] == LINE_KIND) & (path.kind[1:] == LINE_KIND) & (turn > smallest_turn) & (turn < np.pi - 1e-3)
    pairs &= ~path.stop[:-1]
    d = path.end - path.start
    plane = np.full((n - 1, 2), -1)
    for a, b in PLANES.values():
        # A pair of lines along one axis lies in two planes: the first of them counts.
        third = 3 - a - b
        flat = (d[:-1, third] == 0) & (d[1:, third] == 0)
        plane[flat & (plane[:, 0] < 0)] = a, b
    k = np.flatnonzero(pairs & (plane[:, 0] >= 0) & (tolerance > 0))
    # A line has a blend at either end: each takes less than a half of it, so that they never touch.
    half = np.tan(turn[k] / 2)
    trim = np.minimum(tolerance * np.cos(turn[k] / 2) / (1 - np.cos(turn[k] / 2)) * half,
                      0.49 * np.minimum(lengths[k], lengths[k + 1]))
    radius = trim / half
    direction_in, direction_out = path.tangents(k, np.ones(k.size)), path.tangents(k + 1, np.zeros(k.size))
    corner = path.end[k]
    first, last = corner - trim[:, None] * direction_in, corner + trim[:, None] * direction_out
    rows = np.arange(k.size)
    cross = (direction_in[rows, plane[k, 0]] * direction_out[rows, plane[k, 1]] - direction_in[rows, plane[k, 1]]
             * direction_out[rows, plane[k, 0]])
    inward = (direction_out - direction_in) / np.linalg.norm(direction_out - direction_in, axis=1, keepdims=True)
    start, end = path.start.copy(), path.end.copy()
    end[k], start[k + 1] = first, last
    trimmed = replace(path, kind=path.kind) if k.size == 0 else None
    if trimmed is not None:
        return trimmed
    arcs = {"kind": np.full(k.size, ARC_KIND), "start": first, "end": last,
            "center": corner + (radius / np.cos(turn[k] / 2))[:, None] * inward, "sweep": np.sign(cross) * turn[k],
            "plane": plane[k], "feed": np.minimum(path.feed[k], path.feed[k + 1]), "stop": np.zeros(k.size, bool),
            "line": path.line[k], "rapid": path.rapid[k] & path.rapid[k + 1],
              "dwell": np.zeros(k.size)}
    columns = {name: getattr(path, name) for name in _ARRAYS} | {"start": start, "end": end}
    place = k + 1
    return Path(**{name: np.insert(columns[name], place, arcs[name], axis=0) for name in _ARRAYS})


def soften_corners(path: Path, tolerance: float, smallest_turn: float = 1e-4) -> Path:
    """Return the path with corners between lines replaced by clothoid blends within `tolerance` (m) of the corner.

    The curvature is continuous, so that the acceleration is too. In any plane; a blend takes less than half of each line.
    Corners with arcs, those marked as stops and full reversals keep their corner.
    """
    turn, lengths = path.turns(), path.lengths
    between = (path.kind[:-1] == LINE_KIND) & (path.kind[1:] == LINE_KIND) & ~path.stop[:-1]
    # A path that runs back on itself has no blend: the curve would be longer than what it replaces.
    k = np.flatnonzero(between & (turn > smallest_turn) & (turn < np.pi - 0.05))
    if k.size == 0:
        return path
    trim = half_lengths(turn[k], tolerance, 0.49 * np.minimum(lengths[k], lengths[k + 1]))[1]
    direction_in, direction_out = path.tangents(k, np.ones(k.size)), path.tangents(k + 1, np.zeros(k.size))
    start, end, corner = path.start.copy(), path.end.copy(), path.end[k]
    end[k], start[k + 1] = corner - trim[:, None] * direction_in, corner + trim[:, None] * direction_out
    blends = {"kind": np.full(k.size, CLOTHOID_KIND), "start": end[k], "end": start[k + 1], "center": corner, "sweep": turn[k],
              "plane": path.plane[k], "feed": np.minimum(path.feed[k], path.feed[k + 1]), "stop": np.zeros(k.size, bool),
              "line": path.line[k], "rapid": path.rapid[k] & path.rapid[k + 1],
              "dwell": np.zeros(k.size)}
    columns = {name: getattr(path, name) for name in _ARRAYS} | {"start": start, "end": end}
    return Path(**{name: np.insert(columns[name], k + 1, blends[name], axis=0) for name in _ARRAYS})
