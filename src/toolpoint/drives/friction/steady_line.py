"""A line through steady runs of both directions, dry part, slope and offset, each with the interval that the runs give it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from toolpoint._check import FloatArray

_ALIKE, _CERTAIN = 0.03, 0.95
# Chance below which the runs are said not to lie on a line within their scatter.
_CHANCE = 0.05
# Wider by this where several lines are tried for one that the slowest speed lies above.
_MANY = 1.4
# A run shows less than all of what wanders over a way longer than itself.
_WIDER = 1.1
# Share of what wanders that the sum of both directions keeps: they leave out opposite ends of the way.
_ELSEWHERE = 0.3


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
    speed, odd, even, variance = _paired(velocity, values, error, resolution=resolution)
    if speed.size < 2:
        return None
    drift = 0.0 if wander is None or not wander.size else (_WIDER * float(np.max(wander)))**2
    excess = 0.0
    while speed.size > 2:
        above, many = _above_line(speed, odd, variance, drift=drift)
        if not many:
            break
        excess = max(excess, above)
        speed, odd, even, variance = speed[many:], odd[many:], even[many:], variance[many:]
    line = _weighted(_design(speed), odd, variance, drift=drift)
    middle = _weighted(np.ones((speed.size, 1)), even, variance, drift=_ELSEWHERE**2 * drift)
    (dry, dry_ends), (slope, slope_ends), (offset, offset_ends) = line.value(0), line.value(1), middle.value(0)
    return SteadyLine(dry, slope, offset, dry_ends, slope_ends, offset_ends, slowest=float(speed[0]), fastest=float(speed[-1]),
                      excess=excess, scatter=max(line.scatter, middle.scatter), speeds=speed.size)


def _above_line(speed: FloatArray, odd: FloatArray, variance: FloatArray, *, drift: float) -> tuple[float, int]:
    """Return by how much the slowest speed lies above the line of the faster ones, and how many slow ones that line leaves out;
    (0, 0) where it does not."""
    at = np.array([1.0, speed[0]])
    for many in range(1, speed.size - 1):
        less = _weighted(_design(speed[many:]), odd[many:], variance[many:], drift=drift)
        above = float(odd[0] - at @ less.beta)
        spread = float(np.sqrt(at @ less.covariance @ at + variance[0] + drift + less.scatter**2))
        if above > (1.0 if many == 1 else _MANY) * less.quantile * spread:
            return above, many
    return 0.0, 0


def mean_with_interval(values: FloatArray, error: FloatArray, *, wander: float = 0.0, resolution: float = 0.0
                       ) -> tuple[float, float, float]:
    """Return mean and 95 % interval of runs of one speed and direction."""
    within = float(np.mean(error**2))
    between, free = (float(np.var(values, ddof=1)), values.size - 1) if values.size > 1 else (0.0, 0)
    variance = max(between, within) / values.size + wander**2 + resolution**2 / 12
    half = _quantile(free if between > within else 7 * values.size) * np.sqrt(variance)
    return float(values.mean()), float(values.mean() - half), float(values.mean() + half)


def _grouped(velocity: FloatArray, values: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean speed, mean value and variance of it for every speed of one direction."""
    order = np.argsort(velocity)
    v, y, e = velocity[order], values[order], error[order]
    group = np.cumsum(np.r_[True, np.diff(np.log(v)) > _ALIKE]) - 1 if v.size else np.zeros(0, int)
    number = np.bincount(group)
    mean = np.bincount(group, y) / number
    free = int((number - 1).sum())
    repeat = float(((y - mean[group])**2).sum()) / free if free >= 2 else 0.0
    within = np.bincount(group, e**2) / number
    within = np.maximum(0.5 * (within + within.mean()), repeat) if within.size else within
    return np.bincount(group, v) / number, mean, within / number


def _paired(velocity: FloatArray, values: FloatArray, error: FloatArray, *, resolution: float
            ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return speeds that were run both ways, half the difference and half the sum of the values there, and their variance."""
    v, y, e = _grouped(velocity[velocity > 0], values[velocity > 0], error[velocity > 0])
    w, z, f = _grouped(-velocity[velocity < 0], values[velocity < 0], error[velocity < 0])
    pairs = [(i, int(np.argmin(np.abs(np.log(w / v[i]))))) for i in range(v.size)] if w.size else []
    pairs = [(i, k) for i, k in pairs if abs(np.log(w[k] / v[i])) < _ALIKE]
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


def _weighted(design: FloatArray, y: FloatArray, variance: FloatArray, *, drift: float) -> _Weighted:
    """Return the weighted fit; `drift` is the variance that every value has for itself however long it was averaged."""
    free = y.size - design.shape[1]
    floor = drift + 1e-24 * float(np.max(y**2)) + 1e-300

    def fit(more: float) -> tuple[FloatArray, FloatArray, float]:
        weight = 1 / np.sqrt(variance + more + floor)
        a = design * weight[:, None]
        inverse = np.linalg.pinv(a.T @ a)
        beta = inverse @ (a.T @ (y * weight))
        return beta, inverse, float((((y - design @ beta) * weight)**2).sum())

    beta, covariance, chi = fit(0.0)
    known = 7 * y.size
    if free < 1 or chi <= float(scipy.stats.chi2.ppf(1 - _CHANCE, free)):
        return _Weighted(beta, covariance * (chi + known) / (free + known), 0.0, _quantile(free + known))
    top = float(np.var(y)) + 1e-300
    more = float(scipy.optimize.brentq(lambda m: fit(m)[2] - free, 0.0, 10 * top))
    beta, covariance, _ = fit(more)
    return _Weighted(beta, covariance, float(np.sqrt(more)), _quantile(free))


def _quantile(free: int) -> float:
    return float(scipy.stats.t.ppf(0.5 + _CERTAIN / 2, max(free, 1)))
