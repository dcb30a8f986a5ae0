r"""Alignment of a record with the computed load: start and pace of the whole, then of every stretch between pauses.

The start and the pace are those of the largest correlation; the time of the record t is the time of the program
:math:`p\,(t - t_0)`, p the pace (an override of 80 % has 0.8). Rapids and tool changes take other times than planned, so each
stretch of cutting may be moved by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.optimize import minimize

from toolpoint._check import FloatArray
from toolpoint.studies.machining.recorded.spindle_load import SpindleLoad

PACE_RANGE, PACE_COUNT = (0.5, 1.5), 81  # of the computed time; geometric
MIN_PAUSE_TIME = 0.3  # s without load between two stretches that are moved apart
MAX_STRETCH_SHIFT = 1.0  # s
IDLE_FRACTION = 0.02  # of the largest load, below which the spindle idles
MIN_RIVAL_DISTANCE = 0.5  # of the width of the correlation's peak: nearer maxima are the same place


@dataclass(frozen=True, eq=False)
class RecordAlignment:
    """Place of a record in a program.

    start : time of the program at the record's first sample, s (negative: the record begins before it); pace : time of the
    program over that of the record; time : (n,) time of the program at every sample, s; shifts : (stretches,) s; correlation :
    of record and load; within : correlation where the spindle cuts; rival : correlation at the next best other place.
    """

    start: float
    pace: float
    time: FloatArray
    shifts: FloatArray
    correlation: float
    within: float
    rival: float


def align_record(load: SpindleLoad, time: FloatArray, values: FloatArray) -> RecordAlignment:
    """Return where a record (n,) at times (n,), s, lies in the time of a program."""
    step = load.step
    clock = np.arange(time[0], time[-1], step)
    recorded = np.interp(clock, time, values) if clock.size > 1 else values
    total = load.total
    paces = np.geomspace(*PACE_RANGE, PACE_COUNT)
    candidates = [_best_start(_stretched(total, pace), recorded) for pace in paces]
    best = int(np.argmax([peak for peak, _, _ in candidates]))
    lag, curve = candidates[best][1], candidates[best][2]
    rival = _rival(curve)
    start, pace = _refined(load, (clock - clock[0], recorded), (lag * step * paces[best], float(paces[best])))
    course = start + pace * (time - time[0])
    shifts, moved = _shifted_stretches(load, course, values)
    model = np.interp(moved, load.time, total, left=0.0, right=0.0)
    cuts = model > IDLE_FRACTION * total.max(initial=1e-300)
    return RecordAlignment(start, pace, moved, shifts, _correlation(model, values),
                           _correlation(model[cuts], values[cuts]) if cuts.sum() > 2 else 0.0, rival)


def _stretched(total: FloatArray, pace: float) -> FloatArray:
    """Return the load as recorded at a pace, at the same step."""
    return np.interp(np.arange(0.0, total.size, pace), np.arange(total.size), total)


def _best_start(load: FloatArray, record: FloatArray) -> tuple[float, int, FloatArray]:
    """Return the largest correlation, the sample of the load at the record's start, and the correlation over all starts.

    Outside of the program the load is zero; starts run from one record before the load to its end.
    """
    n = record.size
    padded = np.concatenate([np.zeros(n), load, np.zeros(n)])
    size = next_fast_len(padded.size + n)
    centred = record - record.mean()
    product = irfft(rfft(padded, size) * np.conj(rfft(centred, size)), size)[:load.size + n]
    sums, squares = (np.concatenate([[0.0], np.cumsum(x)]) for x in (padded, padded**2))
    starts = np.arange(load.size + n)
    variance = (squares[starts + n] - squares[starts]) - (sums[starts + n] - sums[starts]) ** 2 / n
    scale = np.sqrt(np.maximum(variance, 1e-12 * max(float(variance.max()), 1e-300)) * max(float((centred**2).sum()), 1e-300))
    curve = np.asarray(product / scale)
    # A place where hardly anything of the program lies in the record correlates by chance.
    curve[variance < 0.05 * variance.max()] = -1.0
    best = int(np.argmax(curve))
    return float(curve[best]), best - n, curve


def _rival(curve: FloatArray) -> float:
    """Return the largest correlation at another place than the best: beyond the foot of its peak."""
    best = int(np.argmax(curve))
    width = max(int(MIN_RIVAL_DISTANCE * _peak_width(curve, best)), 2)
    others = curve.copy()
    others[max(best - width, 0):best + width + 1] = -1.0
    is_peak = (others[1:-1] >= others[:-2]) & (others[1:-1] >= others[2:])
    return float(others[1:-1][is_peak].max(initial=-1.0))


def _peak_width(curve: FloatArray, best: int) -> int:
    """Return the samples over which the correlation stays above half of its peak."""
    feet = np.flatnonzero(curve < 0.5 * curve[best])
    left, right = feet[feet < best], feet[feet > best]
    return int((right[0] if right.size else curve.size) - (left[-1] if left.size else 0))


def _refined(load: SpindleLoad, record: tuple[FloatArray, FloatArray], guess: tuple[float, float]) -> tuple[float, float]:
    """Return start (s) and pace of the largest correlation near a guess."""
    time, values = record
    total, clock = load.total, load.time
    length = max(float(time[-1]), 1e-9)

    def loss(x: FloatArray) -> float:
        start, end = x
        model = np.interp(start + (end - start) * time / length, clock, total, left=0.0, right=0.0)
        return -_correlation(model, values)

    first = np.array([guess[0], guess[0] + guess[1] * length])
    spread = max(2 * load.step, 0.003 * length)
    simplex = first + np.array([[0.0, 0.0], [spread, spread], [-spread, spread]])
    result = minimize(loss, first, method="Nelder-Mead", options={"initial_simplex": simplex, "xatol": load.step / 50,
                                                                 "fatol": 1e-9, "maxiter": 400})
    start, end = result.x if -result.fun > -loss(first) else first
    return float(start), float((end - start) / length)


def _shifted_stretches(load: SpindleLoad, course: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the shift of every stretch of cutting (s), and the time of the program with them; between stretches linear."""
    total = load.total
    active = np.flatnonzero(total > IDLE_FRACTION * total.max(initial=1e-300))
    if not active.size:
        return np.zeros(0), course
    gaps = np.flatnonzero(np.diff(active) * load.step > MIN_PAUSE_TIME)
    first, last = active[np.insert(gaps + 1, 0, 0)] * load.step, active[np.append(gaps, active.size - 1)] * load.step
    middles = np.concatenate([[-np.inf], (last[:-1] + first[1:]) / 2, [np.inf]])
    knots, shifts = list[float](), list[float]()
    for k in range(first.size):
        reach = min(MAX_STRETCH_SHIFT, *(x for x in (first[k] - middles[k], middles[k + 1] - last[k]) if np.isfinite(x)),
                    MAX_STRETCH_SHIFT)
        inside = (course > first[k] - reach) & (course < last[k] + reach)
        shift = _stretch_shift(load, course[inside], values[inside], reach) if inside.sum() > 8 else 0.0
        knots += [first[k], last[k]]
        shifts += [shift, shift]
    return np.array(shifts[::2]), course + np.interp(course, knots, shifts)


def _stretch_shift(load: SpindleLoad, course: FloatArray, values: FloatArray, reach: float) -> float:
    """Return the shift (s) within a reach at which a stretch correlates best, refined by a parabola through its peak."""
    shifts = np.arange(-reach, reach + load.step / 2, load.step)
    if shifts.size < 3:
        return 0.0
    total, clock = load.total, load.time
    fit = np.array([_correlation(np.interp(course + s, clock, total, left=0.0, right=0.0), values) for s in shifts])
    best = int(np.argmax(fit))
    if not 0 < best < shifts.size - 1:
        return 0.0
    curve = fit[best - 1] - 2 * fit[best] + fit[best + 1]
    return float(shifts[best] + (0.5 * (fit[best - 1] - fit[best + 1]) / curve * load.step if curve < 0 else 0.0))


def _correlation(model: FloatArray, values: FloatArray) -> float:
    a, b = model - model.mean(), values - values.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0 else 0.0
