r"""Motion along a path within speed, acceleration and jerk of every axis, linear and rotary.

With :math:`\sigma(t)` the nominal time reached, an axis moves by :math:`\dot q = q' \dot\sigma`,
:math:`\ddot q = q'' \dot\sigma^2 + q' \ddot\sigma` and
:math:`\dddot q = q''' \dot\sigma^3 + 3 q'' \dot\sigma \ddot\sigma + q' \dddot\sigma`. The fastest law within speed and
acceleration (`axis_limits`) is averaged over a window W, as controls do: with :math:`W = a/j` a trapezoid of speed becomes the
seven-phase motion. Only the law is averaged, so the axes stay on their path. Where a limit is passed all the same, the law
before averaging is slowed there, until none is; what is left is taken off by a longer time of that stretch between two stops.
Every stretch takes the window that makes it quickest.

Sources: Shin, McKay, IEEE Trans. Automatic Control 30 (1985) 531 (phase plane); Biagiotti, Melchiorri, Control Engineering
Practice 20 (2012) 1385 (averages that bound the jerk).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, IndexArray, fail
from toolpoint.drives.program.rounded_path import RoundedPath

WINDOW_DIVISORS = tuple(2 ** (k / 4) for k in range(21))  # of the longest window, those that are tried
MAX_ROUNDS = 40  # slowdowns of the law, until no limit is passed
STATED_EXCESS = 0.01  # of a limit: by so much it may be passed between the samples of the last look
_MIN_SLOWED_EXCESS = 2e-3  # of a limit, from which on the law is slowed further
_MIN_PARTS, _MAX_PARTS, _PARTS_OF_PATH = 6, 200, 1200  # parts of a step, and of a whole path of few steps
_MIN_SQUARE = 1e-12  # of the rate at joints between two stops
_CURVE_SHARE = 0.9  # of acceleration and jerk that the curve of the path alone may take
_EXAMINED_SHARES = (0.003, 0.25, 0.5, 0.75, 0.997)  # shares of a piece of constant jerk at which the last look is taken
_PIECES_AT_ONCE = 200_000
_JOINT_ITERATIONS = 12  # from a linear start to the time of a joint within a piece


@dataclass(frozen=True, eq=False)
class MotionBounds:
    """Limits of every axis (axes,): speed, acceleration and jerk in m or rad, infinite where there is none."""

    speed: FloatArray
    acceleration: FloatArray
    jerk: FloatArray


@dataclass(frozen=True, eq=False)
class AxisMotion:
    """Motion along a rounded path in pieces of constant jerk of its nominal time.

    time, sigma, rate, change : (k,) at the beginning of each piece and the end: s, s, -, 1/s; times : (n,) of the steps, s;
    ratio : (n + 1,) speed over the nominal one at the joints; peaks : (n,) its largest value in each step; share : (axes, 3)
    largest used share of speed, acceleration and jerk.
    """

    path: RoundedPath
    limits: MotionBounds
    time: FloatArray
    sigma: FloatArray
    rate: FloatArray
    change: FloatArray
    times: FloatArray
    ratio: FloatArray
    peaks: FloatArray
    share: FloatArray

    @property
    def duration(self) -> float:
        """Whole time, s."""
        return float(self.time[-1])

    def sample(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return position, speed, acceleration and jerk of every axis at times (m,), each (m, axes)."""
        piece = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 2)
        return _axis_motion(self.path, *_state(self, piece, np.clip(time, 0.0, self.time[-1]) - self.time[piece]))


@dataclass(frozen=True, eq=False)
class _SmoothLaw:
    """Law of one window: the pieces as in `AxisMotion`, and the stretch of each (k,)."""

    time: FloatArray
    sigma: FloatArray
    rate: FloatArray
    change: FloatArray
    stretch: IndexArray


@dataclass(frozen=True, eq=False)
class _StepParts:
    """Parts of the steps: nominal times of their ends (m + 1,), step of each part (m,), stretch of each (m,), and of each what
    the passes take: sizes of q' and q'' (m, axes), largest rates (m,), largest squares of the rate at the ends (m + 1,)."""

    sigma: FloatArray
    step: IndexArray
    stretch: IndexArray
    size: FloatArray
    curve: FloatArray
    caps: FloatArray
    squares: FloatArray


def move_within_axes(position: FloatArray, nominal: FloatArray, limits: MotionBounds, *, stops: np.ndarray,
                     corner_tolerance: FloatArray, ceiling: FloatArray | None = None) -> AxisMotion:
    """Return the motion along a path within the limits of every axis.

    Parameters
    ----------
    position : (n, 2, axes) floats
        Of every axis at both ends of the steps, m or rad.
    nominal : (n,) floats
        Time of every step at the programmed feed, s, above zero: no step is passed faster.
    limits : MotionBounds
        At least one axis with a limit of jerk; each of these needs one of acceleration.
    stops : (n + 1,) ints
        At the joints of steps: 2 where all axes stand still.
    corner_tolerance : (axes,) floats
        By which an axis leaves a joint that is no stop, m or rad.
    ceiling : (n + 1,) floats, optional
        Largest rate at the joints by what the control sees (`axis_limits.sight_ceiling`).

    Raises ToolpointError for arrays that do not fit and for a jerk without an acceleration.

    Examples
    --------
    An axis over 1 m at 0.5 m/s with 2 m/s^2 and 20 m/s^3: L/v + v/a + a/j.

    >>> way = np.linspace(0, 1, 21)
    >>> limits = MotionBounds(*(np.array([value]) for value in (0.5, 2.0, 20.0)))
    >>> motion = move_within_axes(np.stack([way[:-1], way[1:]], axis=1)[..., None], np.full(20, 0.1), limits,
    ...                           stops=np.array([2, *[0] * 19, 2]), corner_tolerance=np.full(1, 1e-5))
    >>> round(motion.duration, 4)
    2.35
    """
    n = len(nominal)
    if position.shape[:2] != (n, 2) or stops.shape != (n + 1,) or (nominal <= 0).any():
        fail("position", f"{position.shape}, {stops.shape}", f"must be (n, 2, axes) and (n + 1,) for {n} steps of times above "
             "zero")
    is_bound = np.isfinite(limits.jerk)
    if not is_bound.any() or not np.isfinite(limits.acceleration[is_bound]).all():
        fail("limits", f"jerk {limits.jerk}, acceleration {limits.acceleration}", "must hold a jerk, and an acceleration of "
             "every axis that has one")
    stops = np.where(np.isin(np.arange(n + 1), (0, n)), 2, stops)
    path = RoundedPath.of(position, nominal, stops=stops, tolerance=corner_tolerance)
    grid = _lay_grid(path, limits, stops, np.full(n + 1, np.inf) if ceiling is None else ceiling)
    longest = longest_window(limits)
    laws: list[_SmoothLaw] = []
    for divisor in WINDOW_DIVISORS:
        law = _slow_down(path, grid, limits, longest / divisor, best=_least_times(laws))
        if law is not None:
            laws.append(law)
    return _as_motion(path, _quickest(laws), limits)


def longest_window(limits: MotionBounds) -> float:
    """Return the longest time (s) in which an axis reaches its acceleration."""
    is_bound = np.isfinite(limits.jerk)
    return float((limits.acceleration[is_bound] / limits.jerk[is_bound]).max())


def _lay_grid(path: RoundedPath, limits: MotionBounds, stops: np.ndarray, ceiling: FloatArray) -> _StepParts:
    """Return the parts of the steps: even ones, and those that roundings end and halve."""
    long = np.diff(path.sigma)
    n = long.size
    parts = int(np.clip(_PARTS_OF_PATH // n, _MIN_PARTS, _MAX_PARTS))
    left, right = path.width[:-1, None], path.width[1:, None]
    marks = np.concatenate([long[:, None] * np.arange(parts) / parts, left, left / 2, long[:, None] - right,
                            long[:, None] - right / 2], axis=1)
    marks = np.sort(np.clip(marks, 0.0, long[:, None]), axis=1)
    is_kept = np.concatenate([np.ones((n, 1), bool), np.diff(marks, axis=1) > 1e-7 * long[:, None]], axis=1)
    is_kept[:, 1:] &= marks[:, 1:] < long[:, None] * (1 - 1e-7)
    step = np.repeat(np.arange(n), is_kept.sum(axis=1))
    sigma = np.append((path.sigma[:-1, None] + marks)[is_kept], path.sigma[-1])
    ends = [path.derivatives(np.minimum(np.maximum(sigma[k:sigma.size - 1 + k], path.sigma[step]), path.sigma[step + 1]), step)
            for k in (0, 1)]
    size, curve, third = (np.maximum(np.abs(ends[0][order]), np.abs(ends[1][order])) for order in (1, 2, 3))
    with np.errstate(divide="ignore", invalid="ignore"):
        caps = np.minimum(np.where(size > 0, limits.speed / size, np.inf).min(axis=1), 1.0)
        squares = np.minimum(caps**2, np.where(curve > 0, _CURVE_SHARE * limits.acceleration / curve, np.inf).min(axis=1))
        by_jerk = np.where(third > 0, (_CURVE_SHARE * limits.jerk / third) ** (2 / 3), np.inf).min(axis=1)
    squares = np.minimum(squares, by_jerk)
    at_ends = np.concatenate([squares[:1], np.minimum(squares[1:], squares[:-1]), squares[-1:]])
    begins_step = np.append(True, step[1:] != step[:-1])
    at_ends[:-1] = np.where(begins_step, np.minimum(at_ends[:-1], ceiling[step] ** 2), at_ends[:-1])
    # No joint but a stop is passed at rest: the next block is known when the tool is there.
    at_ends = np.maximum(at_ends, _MIN_SQUARE)
    is_stop = np.append(begins_step & (stops[step] == 2), True)
    at_ends[is_stop] = 0.0
    return _StepParts(sigma, step, np.cumsum(is_stop[:-1]) - 1, size, curve, np.sqrt(squares), at_ends)


def _stretch_times(law: _SmoothLaw) -> FloatArray:
    """Return the time of every stretch of a law, s."""
    return np.asarray(np.bincount(law.stretch[:-1], weights=np.diff(law.time)), float)


def _least_times(laws: list[_SmoothLaw]) -> FloatArray:
    """Return the least time of every stretch, s; one infinite number where there is no law."""
    return np.min([_stretch_times(law) for law in laws], axis=0) if laws else np.array([np.inf])


def _slow_down(path: RoundedPath, grid: _StepParts, limits: MotionBounds, window: float, *, best: FloatArray
               ) -> _SmoothLaw | None:
    """Return the law averaged over a window (s), slowed until no axis passes a limit.

    None where it is slower than the best times of all stretches before it is slowed.
    """
    from toolpoint.drives.program.axis_jerk_kernel import slow_windows

    with np.errstate(invalid="ignore"):
        reduced = MotionBounds(limits.speed, np.minimum(limits.acceleration, limits.jerk * window), limits.jerk)
    squares = grid.squares
    for _ in range(MAX_ROUNDS):
        raw_time, reached = _fastest(grid, squares, reduced)
        law = _average(grid, raw_time, reached, window)
        if (_stretch_times(law) >= best).all():
            return None
        middle = (law.time[1:] + law.time[:-1]) / 2
        excess = _excess(path, law, limits, (0.5,))
        if excess.max() <= 1 + _MIN_SLOWED_EXCESS:
            break
        late = np.flatnonzero(excess > 1 + _MIN_SLOWED_EXCESS)
        squares = squares.copy()
        slow_windows(raw_time, reached, middle[late], excess[late], window, squares)
    return _scaled(law, _excess(path, law, limits, _EXAMINED_SHARES))


def _fastest(grid: _StepParts, squares: FloatArray, limits: MotionBounds) -> tuple[FloatArray, FloatArray]:
    """Return the times at the ends of the parts (m + 1,), s, without rests at stops, and the squares of the rate there."""
    from toolpoint.drives.program.axis_limits_kernel import pass_along

    nominal = np.diff(grid.sigma)
    reached = squares.copy()
    pass_along(reached, grid.size, grid.curve, nominal, limits.acceleration)
    reached = np.ascontiguousarray(reached[::-1])
    size, curve, backwards = (np.ascontiguousarray(part[::-1]) for part in (grid.size, grid.curve, nominal))
    pass_along(reached, size, curve, backwards, limits.acceleration)
    reached = np.ascontiguousarray(reached[::-1])
    rate = np.sqrt(reached)
    return np.concatenate([[0.0], np.cumsum(2 * nominal / np.maximum(rate[1:] + rate[:-1], 1e-12))]), reached


def _average(grid: _StepParts, raw_time: FloatArray, squares: FloatArray, window: float) -> _SmoothLaw:
    """Return the averaged law: pieces between the times of the parts' ends and the same a window later; a stop rests for the
    window. `raw_time` is moved by these rests."""
    first = np.flatnonzero(np.diff(grid.stretch, prepend=-1))
    rests = np.zeros(raw_time.size)
    rests[first[1:]] = window
    # The last end of a stretch stands before its rest, the first of the next one behind it.
    begin = raw_time[:-1] + np.cumsum(rests[:-1])
    nominal, rate = np.diff(grid.sigma), np.sqrt(squares)
    change = np.diff(squares) / (2 * nominal)
    last = np.append(first[1:], grid.step.size) - 1
    end_time = begin[last] + np.diff(raw_time)[last]
    raw_time[:-1] = begin
    raw_time[-1] = end_time[-1]
    # Pieces of the raw law, the rests among them: time, sigma, rate, change of rate.
    time = np.concatenate([begin, end_time])
    order = np.argsort(time, kind="stable")
    sigma = np.concatenate([grid.sigma[:-1], grid.sigma[last + 1]])[order]
    speed = np.concatenate([rate[:-1], np.zeros(last.size)])[order]
    growth = np.concatenate([change, np.zeros(last.size)])[order]
    time = time[order]
    stretch_end = end_time + window
    knots = np.unique(np.concatenate([time, time + window]))
    knots = knots[np.append(True, np.diff(knots) > 1e-9 * window)]
    raw = [_raw_state(time, sigma, speed, growth, times) for times in (knots, knots - window)]
    area = raw[0][0] - raw[1][0]
    return _SmoothLaw(knots, area / window, (raw[0][1] - raw[1][1]) / window, (raw[0][2] - raw[1][2]) / window,
                np.minimum(np.searchsorted(stretch_end, knots * (1 + 1e-12) + 1e-15, side="right"), last.size - 1))


def _raw_state(time: FloatArray, sigma: FloatArray, rate: FloatArray, change: FloatArray, instant: FloatArray
               ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the integral of sigma, sigma and rate of a raw law at times; before its start it rests."""
    long = np.diff(time)
    area = np.concatenate([[0.0], np.cumsum(long * (sigma[:-1] + long * (rate[:-1] / 2 + long * change[:-1] / 6)))])
    k = np.clip(np.searchsorted(time, instant, side="right") - 1, 0, time.size - 1)
    d = np.where(instant < time[0], 0.0, instant - time[k])
    early = np.minimum(instant - time[0], 0.0) * sigma[0]
    return (area[k] + d * (sigma[k] + d * (rate[k] / 2 + d * change[k] / 6)) + early,
            sigma[k] + d * (rate[k] + d * change[k] / 2), rate[k] + d * change[k])


def _state(law: _SmoothLaw | AxisMotion, piece: IndexArray, late: FloatArray) -> tuple[FloatArray, ...]:
    """Return sigma, its rate, change and jerk a time (s) after the beginning of pieces."""
    long = np.maximum(law.time[piece + 1] - law.time[piece], 1e-300)
    jerk = (law.change[piece + 1] - law.change[piece]) / long
    change = law.change[piece] + late * jerk
    rate = law.rate[piece] + late * (law.change[piece] + late * jerk / 2)
    sigma = law.sigma[piece] + late * (law.rate[piece] + late * (law.change[piece] / 2 + late * jerk / 6))
    return sigma, rate, change, jerk


def _axis_motion(path: RoundedPath, sigma: FloatArray, rate: FloatArray, change: FloatArray, jerk: FloatArray
                ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return position, speed, acceleration and jerk of the axes, each (k, axes), at sigma, rate, change and jerk of the law."""
    step = np.clip(np.searchsorted(path.sigma, sigma, side="right") - 1, 0, path.sigma.size - 2)
    q, first, second, third = path.derivatives(np.clip(sigma, path.sigma[step], path.sigma[step + 1]), step)
    r, c, j = rate[:, None], change[:, None], jerk[:, None]
    return q, first * r, second * r**2 + first * c, third * r**3 + 3 * second * r * c + first * j


def _excess(path: RoundedPath, law: _SmoothLaw, limits: MotionBounds, looks: tuple[float, ...]) -> FloatArray:
    """Return by which factor the time of every piece would have to be longer, (k - 1,): 1 at a limit."""
    pieces, excess = law.time.size - 1, np.zeros(law.time.size - 1)
    for first in range(0, pieces, _PIECES_AT_ONCE):
        piece = np.arange(first, min(first + _PIECES_AT_ONCE, pieces))
        long = law.time[piece + 1] - law.time[piece]
        for look in looks:
            _, *motion = _axis_motion(path, *_state(law, piece, look * long))
            bounds = limits.speed, limits.acceleration, limits.jerk
            for part, limit, power in zip(motion, bounds, (1.0, 0.5, 1 / 3), strict=True):
                excess[piece] = np.maximum(excess[piece], (np.abs(part) / limit).max(axis=1) ** power)
    return excess


def _scaled(law: _SmoothLaw, excess: FloatArray) -> _SmoothLaw:
    """Return the law with every stretch made longer by its largest excess."""
    factor = np.ones(int(law.stretch[-1]) + 1)
    np.maximum.at(factor, law.stretch[:-1], excess)
    each = factor[law.stretch[:-1]]
    at_knots = np.append(each, each[-1])
    time = np.concatenate([[0.0], np.cumsum(np.diff(law.time) * each)])
    return _SmoothLaw(time, law.sigma, law.rate / at_knots, law.change / at_knots**2, law.stretch)


def _quickest(laws: list[_SmoothLaw]) -> _SmoothLaw:
    """Return the law that takes of every stretch the quickest."""
    choice = np.argmin([_stretch_times(law) for law in laws], axis=0)
    count = choice.size
    if (choice == choice[0]).all():
        return laws[int(choice[0])]
    parts: list[tuple[FloatArray, ...]] = []
    start = 0.0
    for stretch, k in enumerate(choice.tolist()):
        law = laws[k]
        first, last = np.searchsorted(law.stretch[:-1], [stretch, stretch + 1])
        rows = np.arange(first, last)
        parts.append((law.time[rows] - law.time[first] + start, law.sigma[rows], law.rate[rows], law.change[rows],
                      np.full(rows.size, stretch)))
        start += float(law.time[last] - law.time[first])
    end = laws[0]
    parts.append((np.array([start]), end.sigma[-1:], np.zeros(1), np.zeros(1), np.array([count - 1])))
    return _SmoothLaw(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _as_motion(path: RoundedPath, law: _SmoothLaw, limits: MotionBounds) -> AxisMotion:
    """Return the motion with its times at the joints and the used shares of the limits."""
    sigma = np.maximum.accumulate(law.sigma)
    piece = np.clip(np.searchsorted(sigma, path.sigma, side="left") - 1, 0, law.time.size - 2)
    late = np.zeros(piece.size)
    long = law.time[piece + 1] - law.time[piece]
    for _ in range(_JOINT_ITERATIONS):
        place, rate, _, _ = _state(law, piece, late)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.where(rate > 0, (path.sigma - place) / rate, 0.5 * long)
        late = np.clip(late + move, 0.0, long)
    arrival = law.time[piece] + late
    arrival[0], arrival[-1] = 0.0, law.time[-1]
    ratio = np.maximum(_state(law, piece, late)[1], 0.0)
    peaks = np.maximum(ratio[1:], ratio[:-1])
    step = np.clip(np.searchsorted(path.sigma, law.sigma, side="right") - 1, 0, peaks.size - 1)
    np.maximum.at(peaks, step, law.rate)
    share = np.zeros((path.rate.shape[1], 3))
    pieces = np.arange(law.time.size - 1)
    for first in range(0, pieces.size, _PIECES_AT_ONCE):
        part = pieces[first:first + _PIECES_AT_ONCE]
        for look in _EXAMINED_SHARES:
            _, *motion = _axis_motion(path, *_state(law, part, look * (law.time[part + 1] - law.time[part])))
            for k, (values, limit) in enumerate(zip(motion, (limits.speed, limits.acceleration, limits.jerk), strict=True)):
                share[:, k] = np.maximum(share[:, k], (np.abs(values) / limit).max(axis=0))
    return AxisMotion(path, limits, law.time, law.sigma, law.rate, law.change, np.diff(arrival), ratio, peaks, share)
