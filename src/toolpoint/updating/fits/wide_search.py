"""Wide search: the same fit from starts over decades, where modes alone lead into many minima that look like ends.

A joint that is ten times softer than its file says lies beyond what restarts near the start reach, and a minimum with small
intervals says nothing of the others. Minima that the evidence does not tell from the best widen its intervals, and so do
valleys about the best (`valleys`); a misfit above the stated deviations widens them, too.

Every number stays free, with a wide prior about its file's value. A number that was held at its file's value because the data
do not determine it would be taken as exact: the free ones would make up for its error with intervals that leave it out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._threads import on_one_thread
from toolpoint.updating.fits.far_starts import find_far_ends, relax_targets
from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import Bayesian
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.fits.valleys import with_valleys
from toolpoint.updating.parameter import Parameter
from toolpoint.updating.problem import Problem

MAX_REFINED_MINIMA = 4  # ends of far starts that are fitted whole
# Cost, in the scale of chi-square, within which two minima explain the data alike; standard deviations by which they differ.
MAX_COST_OF_RIVALS, MIN_DISTANCE_OF_RIVALS = 9.0, 3.0
# Prior of the logarithm of a number about its file's value: dampers are guessed within a factor 7 (95 %), springs within 400.
DAMPING_PRIOR_SD, STIFFNESS_PRIOR_SD = 1.0, 3.0
# Deviation over that of the prior from which the data do not determine a number.
UNDETERMINED_FRACTION = 0.5
# Evaluations of a fit with one number moved, which starts next to its end; how often and by which factor such a move is
# reduced; rise of chi-square at two standard deviations.
REFIT_EVALUATIONS, MAX_REDUCTIONS, MOVE_REDUCTION, TWO_SIGMA_RISE = 20, 9, 0.75, 4.0


@on_one_thread
def search_widely(problem: Problem, first: ParameterFit, *, starts: int = 24) -> ParameterFit:
    """Return the best minimum from `first` and from Halton points far about the problem's start, its intervals widened.

    All parameters are free; those without a prior get a wide one. Its deviation in `ParameterFit.parameters` tells, with
    `undetermined`, which of them the data do not determine.

    Parameters
    ----------
    problem : Problem
    first : ParameterFit
        From near its start.
    starts : int
    """
    held = _with_priors(problem)
    ends = [_refined(held, x) for x in [first.x, *_ends(problem, starts)]]
    minima = [end for end in ends if end is not None]
    if not minima:
        return first
    # An end that has not converged is last, whatever its cost: its covariance means nothing.
    best = min(minima, key=lambda result: (not result.converged, result.cost))
    scale = max(1.0, best.reduced_chi_square if np.isfinite(best.reduced_chi_square) else 1.0)
    best = replace(best, covariance=best.covariance * scale)
    rivals = [result for result in minima if result is not best and result.converged
              and result.cost - best.cost <= MAX_COST_OF_RIVALS * scale]
    moved = _with_undetermined_moved(held, best)
    determined = tuple(name for name in best.free if name not in name_undetermined(best))
    return _widened(with_valleys(held, moved, determined, cost=MAX_COST_OF_RIVALS * scale), rivals)


def name_undetermined(result: ParameterFit) -> tuple[str, ...]:
    """Return the free parameters of a fit that its data determine no better than their priors."""
    deviation = dict(zip(result.free, np.sqrt(np.maximum(np.diag(result.covariance), 0.0)), strict=True))
    return tuple(p.name for p in result.parameters if p.name in deviation and p.prior is not None
                 and deviation[p.name] > UNDETERMINED_FRACTION * p.prior)


def _with_priors(problem: Problem) -> Problem:
    """Return the problem with a wide prior for every parameter that has none."""
    parameters = [p if p.prior_sd is not None or not p.log else replace(p, prior_sd=_prior_sd(p)) for p in problem.parameters]
    # A number on a linear scale is a loss that may be zero: half of its range is as wide as its prior can be.
    parameters = [p if p.prior_sd is not None else replace(p, prior_sd=_half_range(p)) for p in parameters]
    return Problem(problem.models, parameters, problem.targets, problem.sensitivities, problem.frequency_weight)


def _prior_sd(parameter: Parameter) -> float:
    """Return the prior's standard deviation of the logarithm of a number."""
    return DAMPING_PRIOR_SD if parameter.kind in ("damping", "loss_factor", "damping_ratio") else STIFFNESS_PRIOR_SD


def _half_range(parameter: Parameter) -> float:
    """Return half of a parameter's range, or its scale where that is open."""
    span = parameter.high - parameter.low
    return span / 2 if np.isfinite(span) else parameter.scale


def _ends(problem: Problem, starts: int) -> list[FloatArray]:
    """Return where short fits from far starts end, the best first.

    Dampers turn neither frequencies nor shapes: they stay, and are fitted where the rest has ended.
    """
    moved = [name for name in problem.names if ".damping" not in name and "loss_factor" not in name]
    if not moved:
        return []
    relaxed = problem.with_targets([relax_targets(targets) for targets in problem.targets])
    return find_far_ends(relaxed, moved, starts=starts)[:MAX_REFINED_MINIMA]


def _refined(problem: Problem, x: FloatArray) -> ParameterFit | None:
    """Return the fit of all numbers from a far end, None where the model does not exist on the way."""
    try:
        return fit(problem, Bayesian(), limit=None, start=x)
    except ToolpointError:
        return None


def _with_undetermined_moved(problem: Problem, best: ParameterFit) -> ParameterFit:
    """Return a fit whose intervals hold where the determined numbers go when an undetermined one is anywhere in its prior.

    The covariance at the best point has their slopes alone. A damper enters the damping of a mode as itself, not as its
    logarithm, and a frequency by its square: two deviations up move the others by more than twice the slope.
    """
    covariance, deviation = best.covariance, np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
    others = np.array([name not in name_undetermined(best) for name in best.free])
    for name in name_undetermined(best):
        k = problem.names.index(name)
        two_deviations = 2 * (problem.parameters[k].prior or 0.0)
        displacements = [_displacement(problem, best, k, sign * two_deviations) for sign in (-1.0, 1.0)]
        # The move is that of two deviations: its half is one, as a covariance has it.
        largest = max(displacements, key=lambda move: float(np.abs(move / deviation).max())) / 2 * others
        covariance = covariance + np.outer(largest, largest)
    return replace(best, covariance=covariance)


def _displacement(problem: Problem, best: ParameterFit, k: int, move: float) -> FloatArray:
    """Return how far all coordinates go when coordinate k is held away from the best; zero where no model exists there.

    A move that the data contradict is reduced until their chi-square rises by no more than two deviations of one number do.
    """
    lower, upper = problem.bounds
    others = tuple(name for i, name in enumerate(problem.names) if i != k)
    for _ in range(MAX_REDUCTIONS):
        start = best.x.copy()
        start[k] = np.clip(start[k] + move, lower[k], upper[k])
        try:
            moved = fit(problem, Bayesian(evaluations=REFIT_EVALUATIONS), start=start, free=others)
        except ToolpointError:
            return np.zeros_like(best.x)
        if moved.chi_square - best.chi_square <= TWO_SIGMA_RISE:
            return np.asarray(moved.x - best.x)
        move *= MOVE_REDUCTION
    return np.zeros_like(best.x)


def _widened(best: ParameterFit, rivals: Sequence[ParameterFit]) -> ParameterFit:
    """Return a fit with intervals that reach the minima that are as good, and a status that names what they differ in."""
    covariance, names = best.covariance, []
    deviation = np.sqrt(np.maximum(np.diag(best.covariance), 1e-300))
    for rival in rivals:
        distance = rival.x - best.x
        is_apart = np.abs(distance) > MIN_DISTANCE_OF_RIVALS * deviation
        if is_apart.any():
            # Anywhere between the two, as likely: the variance of an even distribution from one end.
            covariance = covariance + np.outer(distance, distance) / 3
            names += [name for name, differs in zip(best.free, is_apart, strict=True) if differs]
    if not names:
        return best
    return replace(best, covariance=covariance, status=f"{best.status}; another minimum explains the data as well, with another"
                   f" {', '.join(dict.fromkeys(names))}: intervals reach it; measure where these move, or give them a prior")
