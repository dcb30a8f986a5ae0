"""Valleys of the evidence: how far a number may go before the evidence is against it, where the covariance says less.

The covariance at the best point takes the misfit as a parabola. Where numbers make up for each other by their reciprocals (two
springs in a row, one of them nearly rigid), the misfit is a valley that bends: steep on one side, and on the other far flatter
than its curvature at the bottom. Each determined number is moved beyond where a parabola would have the evidence against it,
all others are fitted anew, and where the evidence allows the move, the interval reaches to where it does not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import Bayesian
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.problem import Problem

# Standard deviations at which a parabola has the cost that the evidence tells apart (the root of `cost`, 3) and a half more:
# fits that end short of their minimum would pass for valleys otherwise.
MIN_VALLEY_REACH = 3.5
STEP_GROWTH, MAX_STEPS = 1.4, 6  # of the moves along a valley: to 20 deviations, beyond which it is no less even
VALLEY_EVALUATIONS = 20  # of the fit of the others, which starts next to its end


def with_valleys(problem: Problem, best: ParameterFit, names: tuple[str, ...], *, cost: float) -> ParameterFit:
    """Return a fit whose intervals reach as far as the evidence lets the named numbers go.

    cost : rise of chi-square and prior cost from which the evidence is against a point. Anywhere in a valley is as likely: it
    brings the variance of an even distribution from the best point to its end.
    """
    covariance = best.covariance
    for name in names:
        k = problem.names.index(name)
        deviation = float(np.sqrt(max(covariance[k, k], 1e-300)))
        ends = [_valley_end(problem, best, k, move=sign * MIN_VALLEY_REACH * deviation, cost=cost) for sign in (-1.0, 1.0)]
        # A covariance is even about the best point: the longer arm of a bent valley decides for both.
        farthest = max(ends, key=lambda move: abs(float(move[k])))
        covariance = covariance + np.outer(farthest, farthest) / 3
    return replace(best, covariance=covariance)


def _valley_end(problem: Problem, best: ParameterFit, k: int, *, move: float, cost: float) -> FloatArray:
    """Return how far all coordinates go along the last allowed move of coordinate k; zero where the first is not allowed."""
    end = np.zeros_like(best.x)
    for moved in _moves(problem, best, k, move=move):
        if _cost_of(problem, moved) - _cost_of(problem, best) > cost:
            return end
        end = np.asarray(moved.x - best.x)
    return end


def _moves(problem: Problem, best: ParameterFit, k: int, *, move: float) -> Iterator[ParameterFit]:
    """Yield fits of all other numbers with coordinate k held farther and farther from the best, up to its bounds."""
    lower, upper = problem.bounds
    others = tuple(name for i, name in enumerate(problem.names) if i != k)
    start = best.x.copy()
    for _ in range(MAX_STEPS):
        start[k] = best.x[k] + move
        if not lower[k] < start[k] < upper[k]:
            return
        try:
            moved = fit(problem, Bayesian(evaluations=VALLEY_EVALUATIONS), start=start, free=others)
        except ToolpointError:  # the model does not exist there
            return
        yield moved
        # From the end of the last fit: the others have followed the valley that far.
        start, move = moved.x.copy(), STEP_GROWTH * move


def _cost_of(problem: Problem, result: ParameterFit) -> float:
    """Return chi-square and the prior's cost of all numbers, the held one among them."""
    priors = np.array([parameter.prior or np.inf for parameter in problem.parameters])
    return result.chi_square + float(((result.x / priors) ** 2).sum())
