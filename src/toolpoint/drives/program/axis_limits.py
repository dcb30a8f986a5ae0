r"""Times of a path whose axes have limits of their own: rotary axes beside linear ones, within speed and acceleration of each.

The path is given in steps of a nominal time :math:`\tau`, that of the programmed feed. With :math:`r = d\tau/dt \le 1` an
axis moves at :math:`\dot q = q' r` and accelerates by :math:`\ddot q = q'' r^2 + q' \dot r`. The largest r that keeps both is
found by a pass forward and one back (Shin and McKay's phase plane, here with :math:`|q''| r^2 + |q'| |\dot r| \le a`, which is
sufficient). Jerk is not bounded here: `axis_jerk` bounds it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail

_MAX_CENTRIPETAL_SHARE = 0.9  # of an axis' acceleration that a curved way may take: what is left changes the speed
_MIN_RATIO = 1e-6  # of the nominal speed, at joints of steps between two stops


@dataclass(frozen=True, eq=False)
class AxisTimes:
    """Times of the steps of a path (n,), s, and ratios r of speed to the nominal one: at their ends (n + 1,), largest (n,)."""

    times: FloatArray
    ratio: FloatArray
    peaks: FloatArray


def plan_within_axes(position: FloatArray, nominal: FloatArray, *, speed: FloatArray, acceleration: FloatArray,
                     stops: np.ndarray, corner_tolerance: FloatArray, ceiling: FloatArray | None = None) -> AxisTimes:
    """Return the times of the steps of a path within the limits of every axis.

    Parameters
    ----------
    position : (n, 2, axes) floats
        Of every axis at both ends of the steps, m or rad.
    nominal : (n,) floats
        Time of every step at the programmed feed, s, above zero.
    speed, acceleration : (axes,) floats
        Limits, infinite where an axis has none.
    stops : (n + 1,) ints
        At the joints of steps: 2 a stop, 1 a corner between blocks, 0 within a smooth block.
    corner_tolerance : (axes,) floats
        By which an axis may round a corner between blocks, m or rad: its speed may jump by sqrt(8 a e) there.
    ceiling : (n + 1,) floats, optional
        Largest r at the joints by what the control sees (`sight_ceiling`).

    Raises ToolpointError for arrays that do not fit.

    Examples
    --------
    An axis over 1 m at 0.5 m/s with 2 m/s^2: 2 s at the feed, and v/a more for a stop at both ends.

    >>> way = np.linspace(0, 1, 21)
    >>> stops = np.array([2, *[0] * 19, 2])
    >>> plan = plan_within_axes(np.stack([way[:-1], way[1:]], axis=1)[..., None], np.full(20, 0.1), speed=np.array([np.inf]),
    ...                         acceleration=np.array([2.0]), stops=stops, corner_tolerance=np.zeros(1))
    >>> round(float(plan.times.sum()), 6)
    2.25
    """
    n = len(nominal)
    if position.shape[:2] != (n, 2) or stops.shape != (n + 1,) or (nominal <= 0).any():
        fail("position", f"{position.shape}, {stops.shape}", f"must be (n, 2, axes) and (n + 1,) for {n} steps of times above "
             "zero")
    from toolpoint.drives.program.axis_limits_kernel import pass_along, pass_times

    rate = np.ascontiguousarray((position[:, 1] - position[:, 0]) / nominal[:, None])
    size, caps = np.abs(rate), _caps(rate, speed)
    curve, squares = _bounds(rate, nominal, caps, acceleration=acceleration, stops=stops, tolerance=corner_tolerance)
    squares = squares if ceiling is None else np.minimum(squares, ceiling**2)
    pass_along(squares, size, curve, nominal, acceleration)
    backwards = np.ascontiguousarray(squares[::-1])
    pass_along(backwards, np.ascontiguousarray(size[::-1]), np.ascontiguousarray(curve[::-1]),
               np.ascontiguousarray(nominal[::-1]), acceleration)
    squares = np.ascontiguousarray(backwards[::-1])
    peaks, times = np.zeros(n), np.zeros(n)
    pass_times(squares, caps, size, curve, nominal, acceleration, peaks, times)
    return AxisTimes(times, np.sqrt(squares), peaks)


def sight_ceiling(position: FloatArray, nominal: FloatArray, *, speed: FloatArray, acceleration: FloatArray, stops: np.ndarray,
                  corner_tolerance: FloatArray, line: np.ndarray, blocks: int, window: float = 0.0) -> FloatArray:
    """Return the largest r at the joints (n + 1,) of a control that knows so many blocks beyond the one under way.

    At every joint all axes can stop by the end of the last block that is known. line : (n,) program line of every step;
    window : s, of an average that bounds the jerk, by half of which a stop takes longer; the others as in `plan_within_axes`.
    """
    from toolpoint.drives.program.axis_limits_kernel import pass_back_from_sight

    rate = np.ascontiguousarray((position[:, 1] - position[:, 0]) / nominal[:, None])
    curve, squares = _bounds(rate, nominal, _caps(rate, speed), acceleration=acceleration, stops=stops,
                             tolerance=corner_tolerance)
    first = np.append(np.flatnonzero(np.append(True, line[1:] != line[:-1])), len(nominal))
    out = np.full(squares.size, np.inf)
    pass_back_from_sight(first, blocks, squares, np.abs(rate), curve, nominal, acceleration, out)
    if window == 0:
        return np.sqrt(out)
    ends = np.concatenate([[0.0], np.cumsum(nominal)])
    block = np.searchsorted(first, np.arange(squares.size), side="left") - 1
    sight = ends[first[np.clip(block + 1 + blocks, 0, first.size - 1)]] - ends
    with np.errstate(divide="ignore", invalid="ignore"):
        # r^2/(2 c) + r W/2 = sight, c the mean slowdown of the stop without the average.
        slowdown = out / (2 * sight)
        slowed = slowdown * (np.sqrt(window**2 / 4 + 2 * sight / slowdown) - window / 2)
    return np.where(np.isfinite(out), np.where(out > 0, slowed, 0.0), np.inf)


def _caps(rate: FloatArray, speed: FloatArray) -> FloatArray:
    """Return the largest r of every step by the speeds of the axes, at most 1, (n,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.minimum(np.where(rate != 0, speed / np.abs(rate), np.inf).min(axis=1), 1.0))


def _bounds(rate: FloatArray, nominal: FloatArray, caps: FloatArray, *, acceleration: FloatArray, stops: np.ndarray,
            tolerance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return |q''| of every step (n, axes) and the largest squares of r at the joints (n + 1,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        squares = np.concatenate([[caps[0]], np.minimum(caps[:-1], caps[1:]), [caps[-1]]]) ** 2
        jump = np.abs(np.diff(rate, axis=0))
        is_smooth = stops[1:-1] == 0
        second = np.where(is_smooth[:, None], 2 * jump / (nominal[:-1] + nominal[1:])[:, None], 0.0)
        by_curve = np.where(second > 0, _MAX_CENTRIPETAL_SHARE * acceleration / second, np.inf).min(axis=1)
        by_corner = np.where(jump > 0, 8 * acceleration * tolerance / jump**2, np.inf).min(axis=1)
        squares[1:-1] = np.minimum(squares[1:-1], np.where(is_smooth, by_curve, by_corner))
    squares[stops == 2] = 0.0
    squares[stops < 2] = np.maximum(squares[stops < 2], _MIN_RATIO**2)
    curve = np.zeros_like(rate)
    curve[:-1] = second
    curve[1:] = np.maximum(curve[1:], second)
    return curve, squares
