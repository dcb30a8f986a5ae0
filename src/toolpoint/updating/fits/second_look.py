"""A second look at a minimum: the numbers that it knows least are moved away, one by one and together, and fitted again.

The covariance of a fit tells of the neighbourhood of its minimum alone. A stiffness that acts near the end of the measured
lines or beyond may have several minima that explain the data alike, each with a small interval and the truth in none. They are
looked for along every little-known number, along what the data tell least of all numbers together, and from where these numbers
began; what else would move is the work of the fit that follows. It costs some fits from close by, on few lines where there are
many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.problem import Problem

# Standard deviation on the parameters' scale above which a number is little known; standard deviations between two minima that
# are not one; chi-square (over its scale) that the data do not tell apart: three standard deviations; steps of the search.
_LITTLE, _APART, _ALIKE = 0.005, 3.0, 9.0
# Chi-square above this minimum from which the minimum of few lines is none of all lines.
_FAR = 100.0
_STEPS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
# Ways out that are followed, and evaluations that each of them may take: what is far from here is no rival of this minimum.
_MOST, _EVALUATIONS = 4, 40
_WEAKEST, _AXES = 10, 2


def look_again(problem: Problem, result: ParameterFit, method: LeastSquares | None = None, *, few: Problem | None = None
               ) -> ParameterFit:
    """Return the fit, or the better one that another way leads to; intervals hold both where the data do not tell them apart.

    The status says where another minimum is as good, and which parameters differ. `few` : the same problem on fewer lines, on
    which others are looked for; the problem itself where left out.
    """
    weak = _little_known(problem, result)
    if not result.converged or not weak:
        return result
    best, evaluations = result, result.evaluations
    for start in _other_starts(few or problem, result, weak, method):
        if _cost_at(problem, start) - _cost(result) > _FAR * _scale(result):
            continue
        try:
            other = fit(problem, method, free=result.free, start=start)
        except ToolpointError:  # the model does not exist there: nothing is learnt
            continue
        evaluations += other.evaluations
        best = _weighed(problem, best, other) if other.converged else best
    return replace(best, evaluations=evaluations, identifiability=result.identifiability, left_alone=result.left_alone,
                   start_chi_square=result.start_chi_square)


def _little_known(problem: Problem, result: ParameterFit) -> list[int]:
    """Return the coordinates of free parameters that are little known, the least known first."""
    deviation = np.sqrt(np.maximum(np.diag(result.covariance), 0.0))
    order = [i for i in np.argsort(-deviation, kind="stable") if deviation[i] > _LITTLE][:_WEAKEST]
    return [problem.names.index(result.free[i]) for i in order]


def _other_starts(few: Problem, result: ParameterFit, weak: Sequence[int], method: LeastSquares | None) -> list[FloatArray]:
    """Return coordinates near other minima that few lines make worth a fit on all: lower than here, or as low and apart."""
    back = result.x.copy()
    back[list(weak)] = 0.0
    scale = _scale(result)
    here = _cost_at(few, result.x)
    dips = _dips(few, result.x, _ways(few, result, weak), here)
    tries = [back, *(x for _, x in sorted(dips, key=lambda pair: pair[0])[:_MOST])]
    brief = method or LeastSquares()
    brief = replace(brief, evaluations=min(brief.evaluations, _EVALUATIONS))
    ends: list[tuple[float, FloatArray]] = []
    for start in tries:
        try:
            other = fit(few, brief, free=result.free, start=start)
        except ToolpointError:
            continue
        # The minimum of few lines lies a little off that of all: a margin for what the others would decide.
        new = all(np.abs(other.x - x).max() > 10 * _LITTLE for x in (result.x, *(x for _, x in ends)))
        if other.converged and new and _cost(other) - here < 3 * _ALIKE * scale:
            ends.append((_cost(other), other.x))
    return [x for _, x in sorted(ends, key=lambda pair: pair[0])[:2]]


def _ways(few: Problem, result: ParameterFit, weak: Sequence[int]) -> list[FloatArray]:
    """Return directions to go: single little-known numbers, and the widest axes of the covariance; of length 1 in their
    largest part."""
    at = [few.names.index(name) for name in result.free]
    ways = [np.eye(len(few.names))[j] for j in weak]
    _, axes = np.linalg.eigh(result.covariance)
    for axis in axes.T[::-1][:_AXES]:
        way = np.zeros(len(few.names))
        way[at] = axis / np.abs(axis).max()
        ways.append(way)
    return ways


def _dips(few: Problem, x: FloatArray, ways: Sequence[FloatArray], here: float) -> list[tuple[float, FloatArray]]:
    """Return (chi-square, coordinates) of places where it falls again on the way out from a minimum."""
    low, high = few.bounds
    result = []
    for way in ways:
        for sign in (1.0, -1.0):
            places = [y for y in (x + sign * step * way for step in _STEPS) if ((low < y) & (y < high)).all()]
            costs = [here, *(_cost_at(few, y) for y in places)]
            result += [(after, y) for (before, after), y in zip(pairwise(costs), places, strict=True) if after < before]
    return result


def _cost_at(problem: Problem, x: FloatArray) -> float:
    try:
        return float((problem.evaluated(x).values ** 2).sum())
    except ToolpointError:
        return float("inf")


def _weighed(problem: Problem, first: ParameterFit, second: ParameterFit) -> ParameterFit:
    """Return the better of two fits, with intervals that reach the other where the data do not tell them apart."""
    at = [problem.names.index(name) for name in first.free]
    more = (_cost(second) - _cost(first)) / _scale(first)
    better, worse = (second, first) if more < -1.0 else (first, second)
    away = worse.x[at] - better.x[at]
    known = np.sqrt(np.maximum(np.diag(better.covariance), 1e-300))
    apart = [name for name, distance, sd in zip(first.free, away, known, strict=True) if abs(distance) > _APART * sd]
    if not apart or abs(more) > _ALIKE:
        return better
    # Anywhere between the two, as likely: the variance of an even distribution from one end.
    return replace(better, covariance=better.covariance + np.outer(away, away) / 3, status=better.status
                   + f"; another minimum explains the data as well, with another {', '.join(apart)}: intervals reach it; "
                   "measure where these move, or give them a prior")


def _cost(result: ParameterFit) -> float:
    return result.chi_square + result.prior_cost


def _scale(result: ParameterFit) -> float:
    return max(result.reduced_chi_square, 1e-300) if result.scaled else 1.0
