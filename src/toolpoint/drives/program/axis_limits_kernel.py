"""Compiled passes of a path within the limits of its axes: largest speed reached from the one before, and times of steps."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def _speed_change(square, rate, curve, acceleration):
    """Return the largest rate of change of r (1/s) in a step at a square of r."""
    change = math.inf
    for a in range(rate.size):
        if rate[a] > 0.0 and acceleration[a] < math.inf:
            left = max(acceleration[a] - curve[a] * square, 0.0)
            change = min(change, left / rate[a])
    return change


@njit(cache=True, nogil=True)
def pass_along(squares, rate, curve, nominal, acceleration):
    """Lower the squares of r at the ends of steps (n + 1,) to what is reached from the start: b' = b + 2 tau dr/dt."""
    for k in range(nominal.size):
        if squares[k + 1] <= squares[k]:
            continue
        change = _speed_change(squares[k], rate[k], curve[k], acceleration)
        # At the end the curve takes more of the acceleration: what both ends leave counts.
        reached = squares[k] + 2.0 * nominal[k] * change
        if reached < squares[k + 1]:
            change = min(change, _speed_change(reached, rate[k], curve[k], acceleration))
            squares[k + 1] = squares[k] + 2.0 * nominal[k] * change


@njit(cache=True, nogil=True)
def pass_back_from_sight(first, blocks, squares, rate, curve, nominal, acceleration, out):
    """Lower `out` (n + 1,), squares of r at the ends of steps, to those from which a stop is reached where the sight ends.

    first : (blocks of the program + 1,) first step of each block, and the number of steps; blocks : known beyond the one
    under way; squares : (n + 1,) what the limits allow.
    """
    count = first.size - 1
    for last in range(count):
        under_way = last - blocks  # the block whose inner joints see to the end of `last`; its end sees so far, too
        begin = first[under_way] if under_way >= 0 else first[0]
        square = 0.0
        for k in range(first[last + 1] - 1, begin, -1):
            if square < squares[k]:
                change = _speed_change(square, rate[k], curve[k], acceleration)
                reached = square + 2.0 * nominal[k] * change
                change = min(change, _speed_change(min(reached, squares[k]), rate[k], curve[k], acceleration))
                square = min(squares[k], square + 2.0 * nominal[k] * change)
            else:
                square = squares[k]
            if under_way >= 0 and k <= first[under_way + 1]:
                out[k] = min(out[k], square)
    if blocks == 0:
        for b in range(1, count):
            out[first[b]] = 0.0


@njit(cache=True, nogil=True)
def pass_times(squares, caps, rate, curve, nominal, acceleration, peaks, times):
    """Write the largest r of every step and its time (s): up to a cap and down again where the way is straight."""
    for k in range(nominal.size):
        first, last = math.sqrt(squares[k]), math.sqrt(squares[k + 1])
        is_straight = True
        for a in range(rate.shape[1]):
            is_straight = is_straight and curve[k, a] * caps[k] ** 2 <= 1e-6 * acceleration[a]
        if not is_straight and first + last > 0.0:
            peaks[k], times[k] = max(first, last), 2.0 * nominal[k] / (first + last)
            continue
        change = _speed_change(max(squares[k], squares[k + 1]), rate[k], curve[k], acceleration)
        if change == math.inf:
            peaks[k], times[k] = caps[k], nominal[k] / caps[k]
            continue
        peak = math.sqrt(0.5 * (squares[k] + squares[k + 1]) + nominal[k] * change)
        if peak <= caps[k]:
            peaks[k], times[k] = peak, (2.0 * peak - first - last) / change
        else:
            way = (2.0 * caps[k] ** 2 - squares[k] - squares[k + 1]) / (2.0 * change)
            peaks[k] = caps[k]
            times[k] = (2.0 * caps[k] - first - last) / change + max(nominal[k] - way, 0.0) / caps[k]
