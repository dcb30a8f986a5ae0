"""Look-ahead planner: set points along a path of lines and arcs within speed, acceleration and jerk."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, floats, frozen, nonnegative, one_of, positive
from toolpoint._notebook import NotebookText
from toolpoint.drives.program.clothoid import half_lengths, steady_speed
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.jerk_profile import JerkLimits, seven_phase
from toolpoint.drives.program.path import ARC_KIND, CLOTHOID_KIND, Path, blend_corners, soften_corners


@dataclass(frozen=True, eq=False)
class Plan(NotebookText):
    """Timed path: for every segment seven durations (s) and the speeds at its ends (n + 1, m/s)."""

    path: Path
    times: FloatArray
    junction: FloatArray
    jerk: FloatArray

    @property
    def duration(self) -> float:
        """Whole time, s, dwells included."""
        return float(self.times.sum() + self.path.dwell.sum())

    def command(self, sample_time: float, axes: int = 3) -> Command:
        """Return positions, velocities and accelerations every `sample_time` s of the first `axes` axes.

        Velocity is exact; the acceleration holds tangential and centripetal part.
        """
        step = positive("sample_time", sample_time)
        segment, share, motion = self._samples(step)
        tangent = self.path.tangents(segment, share)
        position = self.path.points(segment, share)
        acceleration = tangent * motion[:, 2:] + self._centripetal(segment, share, position, motion[:, 1])
        return Command(position[:, :axes], step, (tangent * motion[:, 1:2])[:, :axes], acceleration[:, :axes])

    def progress(self, sample_time: float, programmed: Path) -> FloatArray:
        """Return the arc length along the programmed path at the samples of `command`, m, (n,).

        A rounded corner is shorter than the programmed one: between the ends of a blend the length grows evenly.
        """
        _, _, motion = self._samples(positive("sample_time", sample_time))
        route = programmed.taken(programmed.lengths > 0)
        ends = np.cumsum(route.lengths)
        knots, piece = np.zeros(self.path.count + 1), 0
        for k in range(self.path.count):
            blend = piece >= route.count or self.path.kind[k] != route.kind[piece]
            if not blend:
                knots[k + 1] = ends[piece] - float(np.linalg.norm(route.end[piece] - self.path.end[k]))
                piece += 1
            else:
                previous = piece - 1
                knots[k + 1] = ends[previous] + float(np.linalg.norm(self.path.end[k] - route.end[previous]))
        return np.interp(motion[:, 0], np.concatenate([[0.0], np.cumsum(self.path.lengths)]), knots)

    def _samples(self, step: float) -> tuple[np.ndarray, FloatArray, FloatArray]:
        """Return segment, share of its length, and (length, speed, acceleration) at every sample."""
        from toolpoint.drives.program.planner_kernel import sample_motion

        n = int(np.ceil(float(self.times.sum()) / step)) + 2
        segment, share, motion = np.zeros(n, np.int64), np.zeros(n), np.zeros((n, 3))
        length = np.array(self.path.lengths)
        used = sample_motion(np.array(self.times), np.array(self.junction), np.array(self.jerk), length, step, segment, share,
                             motion)
        segment[used:], share[used:], motion[used:] = self.path.count - 1, 1.0, (length.sum(), 0.0, 0.0)
        waits = np.flatnonzero(self.path.dwell > 0)
        if not waits.size:
            return segment, share, motion
        # A rest of so many samples stands before the first sample of the next segment.
        first_after = np.searchsorted(segment, waits, side="right")
        number = np.rint(self.path.dwell[waits] / step).astype(int)
        place, ends = np.repeat(first_after, number), np.cumsum(length)
        dwell_motion = np.zeros((place.size, 3))
        dwell_motion[:, 0] = np.repeat(ends[waits], number)
        return (np.insert(segment, place, np.repeat(waits, number)), np.insert(share, place, 1.0),
                np.insert(motion, place, dwell_motion, axis=0))

    def _centripetal(self, segment: np.ndarray, share: FloatArray, position: FloatArray, speed: FloatArray) -> FloatArray:
        out = np.zeros_like(position)
        arc = np.flatnonzero(self.path.kind[segment] == ARC_KIND)
        k = segment[arc]
        plane_axes, rows = self.path.plane[k], np.arange(k.size)[:, None]
        flat = self.path.radius[k] * np.abs(self.path.sweep[k]) / self.path.lengths[k]
        inward = (self.path.center[k] - position[arc])[rows, plane_axes]
        out[arc[:, None], plane_axes] = inward * ((speed[arc] * flat / self.path.radius[k]) ** 2)[:, None]
        soft = np.flatnonzero(self.path.kind[segment] == CLOTHOID_KIND)
        out[soft] = self.path.blends(segment[soft]).curvatures(share[soft]) * speed[soft, None] ** 2
        return out

    def __repr__(self) -> str:
        return f"Plan({self.path!r}; {self.duration:.6g} s)"


def plan_motion(path: Path, limits: JerkLimits, *, corner_tolerance: float = 0.0, normal_acceleration: float | None = None,
            straight: float = 1e-3, corner: str = "arc",
            look_ahead: int | None = None) -> Plan:
    """Return the timed path.

    Parameters
    ----------
    path : Path
        Its feeds are upper bounds; zero feed is refused.
    limits : JerkLimits
        Along the path; on a straight line the acceleration and jerk of every axis stay within them.
    corner_tolerance : float
        m; corners between lines are rounded within it. Zero: the path stops at every corner.
    normal_acceleration : float, optional
        Largest v^2/R on arcs, m/s^2; the acceleration limit where left out.
    straight : float
        Angle (rad) below which a junction counts as tangent.
    corner : str
        How corners are rounded: ``arc``, or ``clothoid``, passed at a constant speed that keeps acceleration and jerk, so
        that with `straight` of next to nothing every axis keeps its jerk all along lines and corners; sharp corners where
        that creeps longer than a stop takes are stops.
    look_ahead : int, optional
        Blocks (program lines) beyond the one under way that the control knows: it is never faster than a stop by their end
        allows. As many as it needs where left out.

    The acceleration of an axis steps by v^2/R where a line meets an arc: `smooth_command` bounds the jerk there too.

    Examples
    --------
    >>> from toolpoint.drives.program.path import polyline
    >>> path = polyline([[0, 0], [0.1, 0], [0.1, 0.1]], feed=0.1)
    >>> plan = plan_motion(path, JerkLimits(0.5, 3.0, 100.0))
    >>> round(plan.duration, 6)  # two lines with a stop between: 2 (L/v + v/a + a/j)
    2.126667
    """
    one_of("corner", corner, ("arc", "clothoid"))
    if (path.feed <= 0).any():
        k = int(np.argmax(path.feed <= 0))
        fail("Path.feed", f"0 m/s on segment {k} (line {path.line[k]})", "must be above zero", remedy="program F before it")
    from toolpoint.drives.program.planner_kernel import look_ahead as lower_junctions
    from toolpoint.drives.program.planner_kernel import phases

    route = path.taken(path.lengths > 0)
    if corner_tolerance > 0 and route.count > 1:
        route = (blend_corners(route, corner_tolerance, straight) if corner == "arc"
                 else _soften_where_quicker(route, corner_tolerance, limits, straight))
    normal = limits.acceleration if normal_acceleration is None else positive("normal_acceleration", normal_acceleration)
    n, length = route.count, np.array(route.lengths)
    speed_max = np.minimum(np.minimum(route.feed, limits.speed), np.sqrt(normal * route.radius))
    steady = route.kind == CLOTHOID_KIND
    half = length[steady] / 2
    speed_max[steady] = np.minimum(speed_max[steady], steady_speed(route.sweep[steady], half, normal, jerk=limits.jerk))
    junction = np.zeros(n + 1)
    if n > 1:
        # At any other junction the direction jumps: a speed above zero would be an infinite acceleration of an axis.
        meets = (route.turns() <= straight) & ~route.stop[:-1]
        junction[1:-1] = np.where(meets, np.minimum(speed_max[:-1], speed_max[1:]), 0.0)
        if look_ahead is not None:
            junction[1:-1] = np.minimum(junction[1:-1], _reached_speed(sight_of(route.line, length, look_ahead)[1:-1], limits))
    a, j = np.full(n, limits.acceleration), np.full(n, limits.jerk)
    times = np.zeros((n, 7))
    lower_junctions(length, speed_max, junction, a, j, steady)
    # The look-ahead may have slowed a blend further: it is passed at one speed, that of its two ends.
    speed_max[steady] = junction[:-1][steady]
    phases(length, speed_max, junction, a, j, times)
    return Plan(route, frozen(times), frozen(junction), frozen(j))


def sight_of(line: np.ndarray, length: FloatArray, blocks: int) -> FloatArray:
    """Return how far the control sees at the start of every segment and at the end (n + 1,), in the unit of `length` (n,).

    line : (n,) of the program: segments of one line in a row are a block; blocks : beyond the one under way, which at the start
    of a block is the one before it.
    """
    first = np.flatnonzero(np.append(True, line[1:] != line[:-1]))
    block = np.repeat(np.arange(first.size), np.diff(np.append(first, line.size)))
    ends = np.concatenate([[0.0], np.cumsum(length)])
    is_first = np.append(True, line[1:] != line[:-1])
    last = block + blocks - is_first
    end_of_block = ends[np.append(first[1:], line.size)]
    sight = np.where(last >= 0, end_of_block[np.clip(last, 0, first.size - 1)], ends[:-1]) - ends[:-1]
    return np.append(np.maximum(sight, 0.0), 0.0)


def _soften_where_quicker(path: Path, tolerance: float, limits: JerkLimits, straight: float) -> Path:
    """Return the path with clothoid corners but where a stop at the corner is the faster way round."""
    turn, lengths = path.turns(), path.lengths
    flat = (path.kind[:-1] != ARC_KIND) & (path.kind[1:] != ARC_KIND) & (turn > straight) & (turn < np.pi - 0.05)
    k = np.flatnonzero(flat)
    if k.size == 0:
        return path
    line = np.minimum(lengths[k], lengths[k + 1])
    half, trim = half_lengths(turn[k], tolerance, 0.49 * line)
    slow = steady_speed(turn[k], half, limits.acceleration, jerk=limits.jerk)
    speed = np.minimum(np.minimum(path.feed[k], path.feed[k + 1]), limits.speed)
    speed = np.minimum(speed, _reached_speed(line / 2, limits))
    slow = np.minimum(slow, speed)
    # Against the stop the blend saves a stop and start, and loses the way round at its own speed and one change of speed.
    lost_time = 2 * (half / slow - trim / speed) + _change_time(speed - slow, limits) * (1 - slow / speed)
    stop = path.stop.copy()
    stop[k[lost_time > _change_time(speed, limits)]] = True
    return soften_corners(replace(path, stop=stop), tolerance, straight)


def _change_time(step: FloatArray, limits: JerkLimits) -> FloatArray:
    """Return the time of the fastest change of speed by `step` (m/s)."""
    a, j = limits.acceleration, limits.jerk
    return np.where(step >= a * a / j, step / a + a / j, 2 * np.sqrt(step / j))


def _reached_speed(distance: FloatArray, limits: JerkLimits) -> FloatArray:
    """Return the speed reached from rest within a distance (m), m/s: v t(v)/2 = distance, by bisection."""
    slow, fast = np.zeros_like(distance), np.full_like(distance, limits.speed)
    # Fifty halvings of the speed limit leave less than its rounding; the time is piecewise, so no closed form is worth it.
    for _ in range(50):
        middle = (slow + fast) / 2
        is_too_far = middle / 2 * _change_time(middle, limits) > distance
        slow, fast = np.where(is_too_far, slow, middle), np.where(is_too_far, middle, fast)
    return fast


def smooth_command(command: Command, window: float) -> Command:
    """Return the command averaged over `window` s (a moving mean, as controllers do): jerk at most (step of a)/window.

    Starts and ends at the same points, later by the window.

    Examples
    --------
    >>> from toolpoint.drives.program.command import step
    >>> smooth_command(step(1e-3, 1e-3, 0.05), window=0.01).position[-1].round(9).tolist()
    [0.001]
    """
    n = round(positive("window", window) / command.sample_time)
    if n < 1:
        fail("window", f"{window:g} s", f"must be at least one sample, {command.sample_time:g} s")
    parts = []
    # Beyond its ends a position stays, while speed and acceleration are zero: rest to rest remains rest to rest.
    for values, holds_ends in ((command.position, True), (command.velocity, False), (command.acceleration, False)):
        v = np.asarray(values)
        first, last = (v[:1], v[-1:]) if holds_ends else (np.zeros_like(v[:1]), np.zeros_like(v[:1]))
        padded = np.vstack([np.repeat(first, n, 0), v, np.repeat(last, n, 0)])
        # A difference of running sums costs no more for a long window.
        total = np.vstack([np.zeros_like(v[:1]), np.cumsum(padded, axis=0)])
        parts.append((total[n:] - total[:-n]) / n)
    position, velocity, acceleration = parts
    return Command(position, command.sample_time, velocity, acceleration)


def straight_move(start: FloatArray, end: FloatArray, limits: list[JerkLimits], *, sample_time: float) -> Command:
    """Return the fastest straight rest-to-rest move within the limits of every axis.

    The limits along the line are the smallest ``limit_i/|direction_i|``: the axes move in step.

    Examples
    --------
    >>> move = straight_move([0, 0], [0.1, 0], [JerkLimits(0.5, 3.0, 100.0)] * 2, sample_time=1e-3)
    >>> move.position[-1].round(9).tolist()
    [0.1, 0.0]
    """
    p, q = floats("start", start), floats("end", end, np.shape(start))
    d = q - p
    length = float(np.linalg.norm(d))
    if length == 0:
        return Command(np.vstack([p, p]), sample_time)
    u = np.abs(d) / length
    nonnegative("direction", u)
    # An axis that does not move along the line bounds nothing.
    each = [min(getattr(x, name) / w for x, w in zip(limits, u, strict=True) if w > 0)
            for name in ("speed", "acceleration", "jerk")]
    profile = seven_phase(length, JerkLimits(*each))
    t = np.arange(int(np.ceil(profile.duration / sample_time)) + 2) * sample_time
    s = profile.sample(t)
    along = d / length
    return Command(p + s[:, :1] * along, sample_time, s[:, 1:2] * along, s[:, 2:3] * along)
