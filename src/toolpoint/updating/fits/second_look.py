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
MIN_WEAK_DEVIATION, MIN_DISTANCE_OF_MINIMA, MAX_COST_OF_EQUAL_MINIMA = 0.005, 3.0, 9.0
# Chi-square above this minimum from which the minimum of few lines is none of all lines.
MAX_COST_ON_ALL_LINES = 100.0
SEARCH_STEPS = (0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
# Ways out that are followed, and evaluations that each of them may take: what is far from here is no rival of this minimum.
MAX_FOLLOWED_DIPS, EVALUATIONS_PER_DIP = 4, 40
MAX_WEAK_PARAMETERS, MAX_COVARIANCE_AXES = 10, 2


def look_again(problem: Problem, result: ParameterFit, method: LeastSquares | None = None, *,
               sparse_problem: Problem | None = None) -> ParameterFit:
    """Return the fit, or the better one that another way leads to; intervals hold both where the data do not tell them apart.

    The status says where another minimum is as good, and which parameters differ. `sparse_problem` : the same problem on
    fewer lines, on which others are looked for; the problem itself where left out.
    """
    weak = _weak_parameters(problem, result)
    if not result.converged or not weak:
        return result
    best, evaluations = result, result.evaluations
    for start in _other_starts(sparse_problem or problem, result, weak, method):
        if _cost_at(problem, start) - result.cost > MAX_COST_ON_ALL_LINES * _scale(result):
            continue
        try:
            other = fit(problem, method, free=result.free, start=start)
        except ToolpointError:  # the model does not exist there: nothing is learnt
            continue
        evaluations += other.evaluations
        best = _weighed(problem, best, other) if other.converged else best
    return replace(best, evaluations=evaluations, identifiability=result.identifiability, left_alone=result.left_alone,
                   start_chi_square=result.start_chi_square)


def _weak_parameters(problem: Problem, result: ParameterFit) -> list[int]:
    """Return the coordinates of free parameters that are little known, the least known first."""
    deviation = np.sqrt(np.maximum(np.diag(result.covariance), 0.0))
    order = [i for i in np.argsort(-deviation, kind="stable") if deviation[i] > MIN_WEAK_DEVIATION][:MAX_WEAK_PARAMETERS]
    return [problem.names.index(result.free[i]) for i in order]


def _other_starts(sparse_problem: Problem, result: ParameterFit, weak: Sequence[int], method: LeastSquares | None
                  ) -> list[FloatArray]:
    """Return coordinates near other minima that few lines make worth a fit on all: lower than here, or as low and apart."""
    reset = result.x.copy()
    reset[list(weak)] = 0.0
    scale = _scale(result)
    cost = _cost_at(sparse_problem, result.x)
    dips = _dips(sparse_problem, result.x, _search_directions(sparse_problem, result, weak), cost)
    tries = [reset, *(x for _, x in sorted(dips, key=lambda pair: pair[0])[:MAX_FOLLOWED_DIPS])]
    brief = method or LeastSquares()
    brief = replace(brief, evaluations=min(brief.evaluations, EVALUATIONS_PER_DIP))
    ends: list[tuple[float, FloatArray]] = []
    for start in tries:
        try:
            other = fit(sparse_problem, brief, free=result.free, start=start)
        except ToolpointError:
            continue
        # The minimum of few lines lies a little off that of all: a margin for what the others would decide.
        new = all(np.abs(other.x - x).max() > 10 * MIN_WEAK_DEVIATION for x in (result.x, *(x for _, x in ends)))
        if other.converged and new and other.cost - cost < 3 * MAX_COST_OF_EQUAL_MINIMA * scale:
            ends.append((other.cost, other.x))
    return [x for _, x in sorted(ends, key=lambda pair: pair[0])[:2]]


def _search_directions(sparse_problem: Problem, result: ParameterFit, weak: Sequence[int]) -> list[FloatArray]:
    """Return directions to go: single little-known numbers, and the widest axes of the covariance; of length 1 in their
    largest part."""
    free_columns = [sparse_problem.names.index(name) for name in result.free]
    directions = [np.eye(len(sparse_problem.names))[j] for j in weak]
    _, axes = np.linalg.eigh(result.covariance)
    # `eigh` ascends: the last axes are those along which the data tell least.
    for axis in axes.T[::-1][:MAX_COVARIANCE_AXES]:
        direction = np.zeros(len(sparse_problem.names))
        direction[free_columns] = axis / np.abs(axis).max()
        directions.append(direction)
    return directions


def _dips(sparse_problem: Problem, x: FloatArray, directions: Sequence[FloatArray], cost: float
          ) -> list[tuple[float, FloatArray]]:
    """Return (chi-square, coordinates) of places where it falls again on the way out from a minimum."""
    lower, upper = sparse_problem.bounds
    result = []
    for direction in directions:
        for sign in (1.0, -1.0):
            places = [y for y in (x + sign * step * direction for step in SEARCH_STEPS) if ((lower < y) & (y < upper)).all()]
            costs = [cost, *(_cost_at(sparse_problem, y) for y in places)]
            # A fall on the way out is all that a point can show of another minimum: the fit from there finds it, or comes
            # back.
            result += [(current, y) for (previous, current), y in zip(pairwise(costs), places, strict=True)
                       if current < previous]
    return result


def _cost_at(problem: Problem, x: FloatArray) -> float:
    """Return chi-square at coordinates; infinite where the model does not exist."""
    try:
        return float((problem.evaluated(x).values ** 2).sum())
    except ToolpointError:
        return float("inf")


def _weighed(problem: Problem, first: ParameterFit, second: ParameterFit) -> ParameterFit:
    """Return the better of two fits, with intervals that reach the other where the data do not tell them apart."""
    free_columns = [problem.names.index(name) for name in first.free]
    excess = (second.cost - first.cost) / _scale(first)
    kept, rejected = (second, first) if excess < -1.0 else (first, second)
    distance = rejected.x[free_columns] - kept.x[free_columns]
    deviation = np.sqrt(np.maximum(np.diag(kept.covariance), 1e-300))
    distant_names = [name for name, part, sd in zip(first.free, distance, deviation, strict=True)
                     if abs(part) > MIN_DISTANCE_OF_MINIMA * sd]
    if not distant_names or abs(excess) > MAX_COST_OF_EQUAL_MINIMA:
        return kept
    # Anywhere between the two, as likely: the variance of an even distribution from one end.
    return replace(kept, covariance=kept.covariance + np.outer(distance, distance) / 3, status=kept.status
                   + f"; another minimum explains the data as well, with another {', '.join(distant_names)}: intervals reach "
                   "it; measure where these move, or give them a prior")


def _scale(result: ParameterFit) -> float:
    """Return the chi-square of one degree of freedom: as the residuals show it where deviations are assumed, else 1."""
    return max(result.reduced_chi_square, 1e-300) if result.scaled else 1.0
