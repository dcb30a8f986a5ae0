"""A wide search: the same fit from starts over decades, where modes alone lead into many minima that look like ends.

A joint that is ten times softer than its file says lies beyond what restarts near the start reach, and a minimum with small
intervals says nothing of the others. Minima that the evidence does not tell from the best widen its intervals; a misfit above
the stated deviations widens them, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._threads import on_one_thread
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.identifiability import identifiability
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.problem import Problem

# The search in the parameters' coordinates (from a factor 1/90 to 7: joints are softer than their files more often), points
# where the misfit is asked for a start, evaluations of each start, minima that are refined.
LOWEST, HIGHEST, POINTS, EVALUATIONS, REFINED = -4.5, 2.0, 40, 60, 4
# Deviations of the search: wide, so that its valleys are.
FREQUENCY_SD, SHAPE_SD = 0.02, 0.1
# Chi-square, in its own scale, within which two minima are alike, and standard deviations by which their values differ.
ALIKE, APART = 9.0, 3.0
# Logarithm by which a number that is left alone may be off, and what it moves then over its slope: an effect goes with the
# number itself or with its inverse (a damper, a compliance), so at two deviations it is exp(2) - 1 of it, for 2 by the slope.
LEFT_ALONE_SD = 1.0
BEYOND_SLOPE = (np.exp(2 * LEFT_ALONE_SD) - 1) / (2 * LEFT_ALONE_SD)


@on_one_thread
def search_widely(problem: Problem, first: ParameterFit, *, starts: int = 24, limit: float = 0.5, least_influence: float = 0.02
                  ) -> ParameterFit:
    """Return the best minimum from `first` and from Halton points far about the problem's start, its intervals widened.

    Parameters
    ----------
    problem : Problem
    first : ParameterFit
        From near its start.
    starts : int
    limit, least_influence : float
        Of `identifiability`, asked at every minimum: what the data do not tell there goes back to its start.
    """
    ends = [_refined(problem, x, limit, least_influence) for x in _ends(problem, starts)]
    minima = [first, *(end for end in ends if end is not None)]
    best = min(minima, key=lambda result: (not result.converged, _cost(result)))
    scale = max(1.0, best.reduced_chi_square if np.isfinite(best.reduced_chi_square) else 1.0)
    if not best.scaled:
        best = replace(best, covariance=best.covariance * scale)
    rivals = [result for result in minima if result is not best and result.converged
              and _cost(result) - _cost(best) <= ALIKE * scale]
    return _widened(problem, _with_left_alone(problem, best), rivals)


def _with_left_alone(problem: Problem, best: ParameterFit) -> ParameterFit:
    """Return a fit whose intervals hold that the numbers left alone may be off by a factor: the others make up for them."""
    at = [problem.names.index(name) for name in best.free]
    rest = [k for k, parameter in enumerate(problem.parameters) if k not in at and parameter.log]
    if not at or not rest:
        return best
    jacobian = problem.evaluated(best.x, slopes=True).jacobian
    assert jacobian is not None
    moved = np.linalg.lstsq(jacobian[:, at], jacobian[:, rest], rcond=None)[0] * LEFT_ALONE_SD * BEYOND_SLOPE
    return replace(best, covariance=best.covariance + moved @ moved.T)


def _ends(problem: Problem, starts: int) -> list[FloatArray]:
    """Return where short fits from far starts end, the best first, those that are one taken once.

    Dampers turn neither frequencies nor shapes: they stay, and are fitted where the rest has ended.
    """
    wide = problem.with_targets([_relaxed(targets) for targets in problem.targets])
    moved = [name for name in problem.names if ".damping" not in name and "loss_factor" not in name]
    if not moved:
        return []
    at = [problem.names.index(name) for name in moved]
    ends: list[tuple[float, FloatArray]] = []
    for x in _far_points(wide, at, starts):
        try:
            rough = fit(wide, LeastSquares(evaluations=EVALUATIONS, tolerance=1e-4), free=tuple(moved), start=x)
        except ToolpointError:  # the model does not exist there
            continue
        ends.append((_cost(rough), rough.x))
    kept: list[FloatArray] = []
    for _, x in sorted(ends, key=lambda pair: pair[0]):
        if all(np.abs(x - other)[at].max() > 0.1 for other in kept):
            kept.append(x)
    return kept[:REFINED]


def _relaxed(targets: Targets) -> Targets:
    """Return targets of which frequencies and shapes alone count, with wide deviations."""
    if targets.modes is None:
        return targets
    modes = replace(targets.modes, covariance=None, shape_variance=None)
    return replace(targets, modes=modes, damping=False, frequency_sd=FREQUENCY_SD, shape_sd=SHAPE_SD)


def _far_points(wide: Problem, at: Sequence[int], starts: int) -> list[FloatArray]:
    """Return the Halton points of least misfit."""
    low, high = wide.bounds
    points = []
    for row in qmc.Halton(len(at), scramble=False).random(starts * POINTS + 1)[1:]:
        x = wide.start
        x[at] = np.clip(LOWEST + (HIGHEST - LOWEST) * row, low[at], high[at])
        try:
            points.append((float((wide.evaluated(x).values ** 2).sum()), x))
        except ToolpointError:
            continue
    return [x for _, x in sorted(points, key=lambda pair: pair[0])[:starts]]


def _refined(problem: Problem, x: FloatArray, limit: float, least: float) -> ParameterFit | None:
    """Return the fit from a far end with what the data tell there alone, None where there is none."""
    try:
        known = identifiability(problem, x, limit, least_influence=least).identifiable
        if not known:
            return None
        start = np.where(np.isin(problem.names, known), x, 0.0)
        return fit(problem, limit=limit, least_influence=least, free=tuple(known), start=start)
    except ToolpointError:
        return None


def _widened(problem: Problem, best: ParameterFit, rivals: Sequence[ParameterFit]) -> ParameterFit:
    """Return a fit with intervals that reach the minima that are as good, and a status that names what they differ in."""
    at = [problem.names.index(name) for name in best.free]
    covariance, names = best.covariance, []
    for rival in rivals:
        away = rival.x[at] - best.x[at]
        known = np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
        apart = np.abs(away) > APART * known
        if apart.any():
            # Anywhere between the two, as likely: the variance of an even distribution from one end.
            covariance = covariance + np.outer(away, away) / 3
            names += [name for name, is_apart in zip(best.free, apart, strict=True) if is_apart]
        names += [name for name in rival.free if name not in best.free]
    if not names:
        return best
    return replace(best, covariance=covariance, status=f"{best.status}; another minimum explains the data as well, with another"
                   f" {', '.join(dict.fromkeys(names))}: intervals reach it; measure where these move, or give them a prior")


def _cost(result: ParameterFit) -> float:
    return result.chi_square + result.prior_cost
