"""Line through steady runs of both directions: dry part, slope and offset, each with the interval that the runs give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray

_SAME_SPEED_TOLERANCE = 0.03  # log of the ratio of two speeds of one group
_LINE_CONFIDENCE = 0.95  # of the intervals
_MISFIT_PROBABILITY = 0.05  # p-value below which the runs do not lie on a line within their scatter
_SEVERAL_LINES_FACTOR = 1.4  # on the interval, where several lines are tried for one that the slowest speed lies above
_WANDER_FACTOR = 1.1  # on the wander of a run: it shows less than all of what wanders over a way longer than itself
_COMMON_WANDER_FRACTION = 0.3  # of the wander, kept by the sum of both directions: they leave out opposite ends of the way


@dataclass(frozen=True, eq=False)
class SteadyLine:
    """y = dry sgn(v) + slope v + offset over runs of steady speed.

    Each value has a 95 % interval (low, high), not-a-number where the runs do not tell it: with one speed dry part and slope
    are lumped, with one direction dry part and offset. `slowest` and `fastest`: of the speeds that the line goes through;
    `excess` by how much the runs slower than `slowest` lie above the line (0: none was left out); `scatter` of the runs about
    the line, beyond what each mean is uncertain by; `speeds` their number.
    """

    dry: float
    slope: float
    offset: float
    dry_interval: tuple[float, float]
    slope_interval: tuple[float, float]
    offset_interval: tuple[float, float]
    slowest: float
    fastest: float
    excess: float
    scatter: float
    speeds: int

    def at(self, velocity: float) -> float:
        """Return y at a velocity."""
        return float(np.sign(velocity) * self.dry + self.slope * velocity + self.offset)


def fit_steady_line(velocity: FloatArray, values: FloatArray, error: FloatArray, *, wander: FloatArray | None = None,
                    resolution: float = 0.0) -> SteadyLine | None:
    """Return the line, None where fewer than two speeds were run in both directions.

    Parameters
    ----------
    velocity, values, error : (n_runs,) floats
        Of every run: speed, mean, and standard error of the mean.
    wander : (n_runs,) floats, optional
        What wanders through each run, for example with the place: the largest counts for all, since a slow run sees little.
    resolution : float
        Step to which the values were rounded: what no average takes away.

    Runs of one speed and direction are averaged: what repeats with the place repeats in all of them. Half the difference of
    both directions is dry + slope |v|, half their sum the offset; each is fitted with the scatter of its own. Where the scatter
    is larger than the runs explain, the rest is taken as a scatter between speeds and the intervals follow from it. Runs slower
    than the others that lie above the line of those are left out of it (friction falls with speed): their `excess` is stated.
    """
    speed, half_difference, half_sum, variance = _pair_directions(velocity, values, error, resolution=resolution)
    if speed.size < 2:
        return None
    drift = 0.0 if wander is None or not wander.size else (_WANDER_FACTOR * float(np.max(wander)))**2
    excess = 0.0
    # Slow speeds lie on the Stribeck rise, above the line of the viscous part: they are left out one by one from below.
    while speed.size > 2:
        above, n_slow = _above_line(speed, half_difference, variance, drift=drift)
        if not n_slow:
            break
        excess = max(excess, above)
        speed, half_difference = speed[n_slow:], half_difference[n_slow:]
        half_sum, variance = half_sum[n_slow:], variance[n_slow:]
    line = _fit_weighted(_design(speed), half_difference, variance, drift=drift)
    middle = _fit_weighted(np.ones((speed.size, 1)), half_sum, variance, drift=_COMMON_WANDER_FRACTION**2 * drift)
    (dry, dry_ends), (slope, slope_ends), (offset, offset_ends) = line.value(0), line.value(1), middle.value(0)
    return SteadyLine(dry, slope, offset, dry_ends, slope_ends, offset_ends, slowest=float(speed[0]), fastest=float(speed[-1]),
                      excess=excess, scatter=max(line.scatter, middle.scatter), speeds=speed.size)


def _above_line(speed: FloatArray, half_difference: FloatArray, variance: FloatArray, *, drift: float) -> tuple[float, int]:
    """Return the excess of the slowest speed over the line of the faster ones, and the number of slow speeds which that line
    leaves out; (0, 0) where there is none."""
    row = np.array([1.0, speed[0]])
    for n_slow in range(1, speed.size - 1):
        line = _fit_weighted(_design(speed[n_slow:]), half_difference[n_slow:], variance[n_slow:], drift=drift)
        above = float(half_difference[0] - row @ line.beta)
        spread = float(np.sqrt(row @ line.covariance @ row + variance[0] + drift + line.scatter**2))
        if above > (1.0 if n_slow == 1 else _SEVERAL_LINES_FACTOR) * line.quantile * spread:
            return above, n_slow
    return 0.0, 0


def mean_with_interval(values: FloatArray, error: FloatArray, *, wander: float = 0.0, resolution: float = 0.0
                       ) -> tuple[float, float, float]:
    """Return mean and 95 % interval of runs of one speed and direction."""
    within = float(np.mean(error**2))
    between, free = (float(np.var(values, ddof=1)), values.size - 1) if values.size > 1 else (0.0, 0)
    variance = max(between, within) / values.size + wander**2 + resolution**2 / 12
    half = _quantile(free if between > within else 7 * values.size) * np.sqrt(variance)
    return float(values.mean()), float(values.mean() - half), float(values.mean() + half)


def _group_speeds(velocity: FloatArray, values: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean speed, mean value and variance of it for every speed of one direction."""
    order = np.argsort(velocity)
    v, y, e = velocity[order], values[order], error[order]
    group = np.cumsum(np.r_[True, np.diff(np.log(v)) > _SAME_SPEED_TOLERANCE]) - 1 if v.size else np.zeros(0, int)
    number = np.bincount(group)
    mean = np.bincount(group, y) / number
    free = int((number - 1).sum())
    repeat = float(((y - mean[group])**2).sum()) / free if free >= 2 else 0.0
    within = np.bincount(group, e**2) / number
    # The error that a single run states is itself an estimate: half of it is shared with those of the others.
    within = np.maximum(0.5 * (within + within.mean()), repeat) if within.size else within
    return np.bincount(group, v) / number, mean, within / number


def _pair_directions(velocity: FloatArray, values: FloatArray, error: FloatArray, *, resolution: float
                     ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return speeds that were run both ways, half the difference and half the sum of the values there, and their variance."""
    v, y, e = _group_speeds(velocity[velocity > 0], values[velocity > 0], error[velocity > 0])
    w, z, f = _group_speeds(-velocity[velocity < 0], values[velocity < 0], error[velocity < 0])
    pairs = [(i, int(np.argmin(np.abs(np.log(w / v[i]))))) for i in range(v.size)] if w.size else []
    pairs = [(i, k) for i, k in pairs if abs(np.log(w[k] / v[i])) < _SAME_SPEED_TOLERANCE]
    i, k = np.array(pairs, int).reshape(-1, 2).T
    return (v[i] + w[k]) / 2, (y[i] - z[k]) / 2, (y[i] + z[k]) / 2, (e[i] + f[k]) / 4 + resolution**2 / 12


def _design(speed: FloatArray) -> FloatArray:
    return np.column_stack([np.ones(speed.size), speed])


@dataclass(frozen=True, eq=False)
class _Weighted:
    """Parameters, their covariance, the scatter between speeds, and the quantile of the intervals."""

    beta: FloatArray
    covariance: FloatArray
    scatter: float
    quantile: float

    def value(self, which: int) -> tuple[float, tuple[float, float]]:
        """Return one parameter and its interval."""
        half = float(self.quantile * np.sqrt(self.covariance[which, which]))
        middle = float(self.beta[which])
        return middle, (middle - half, middle + half)


def _fit_weighted(design: FloatArray, y: FloatArray, variance: FloatArray, *, drift: float) -> _Weighted:
    """Return the weighted fit; `drift` is a variance of every value that no averaging reduces."""
    free = y.size - design.shape[1]
    floor = drift + 1e-24 * float(np.max(y**2)) + 1e-300

    def fit(extra: float) -> tuple[FloatArray, FloatArray, float]:
        weight = 1 / np.sqrt(variance + extra + floor)
        a = design * weight[:, None]
        inverse = np.linalg.pinv(a.T @ a)
        beta = inverse @ (a.T @ (y * weight))
        return beta, inverse, float((((y - design @ beta) * weight)**2).sum())

    beta, covariance, chi = fit(0.0)
    # The errors of the runs are estimates of about seven degrees of freedom each: a fit better than expected narrows the
    # interval only as far as they allow.
    freedom_of_variance = 7 * y.size
    if free < 1 or chi <= float(scipy.stats.chi2.ppf(1 - _MISFIT_PROBABILITY, free)):
        return _Weighted(beta, covariance * (chi + freedom_of_variance) / (free + freedom_of_variance), 0.0,
                         _quantile(free + freedom_of_variance))
    extra_max = float(np.var(y)) + 1e-300
    # The runs scatter by more than they state: a variance common to all speeds is added until chi-square is what it should
    # be.
    extra = float(scipy.optimize.brentq(lambda m: fit(m)[2] - free, 0.0, 10 * extra_max))
    beta, covariance, _ = fit(extra)
    return _Weighted(beta, covariance, float(np.sqrt(extra)), _quantile(free))


def _quantile(free: int) -> float:
    return float(scipy.stats.t.ppf(0.5 + _LINE_CONFIDENCE / 2, max(free, 1)))
