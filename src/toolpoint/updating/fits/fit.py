r"""Fits: bounded least squares, regularised, and Bayesian with Laplace's posterior.

All minimise :math:`\|r(x)\|^2 + \|x / s\|^2` with weighted residuals r and the coordinates x of the parameters: s infinite
(least squares), 1/strength (regularised towards the start), or the prior's standard deviation (Bayesian: the posterior is
taken normal about its mode with covariance :math:`(J^T J + S^{-2})^{-1}`). scipy's trust-region Gauss-Newton (`trf`, bounded),
`dogbox` or Levenberg-Marquardt (`lm`). Sources: Branch, Coleman, Li, SIAM J. Sci. Comput. 21 (1999); Tarantola, Inverse
Problem Theory, 2005, ch. 3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import chdtrc

from toolpoint._check import BoolArray, FloatArray, fail, positive
from toolpoint._doubt import Doubt, status_of
from toolpoint._threads import on_one_thread
from toolpoint.updating.fits.fit_methods import Bayesian, LeastSquares, Regularised
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.fits.solver import Solver
from toolpoint.updating.identifiability import Identifiability, identifiability
from toolpoint.updating.problem import Problem
from toolpoint.updating.residuals import Residuals

STATIONARY_FRACTION = 1e-3  # of chi-squared: what a Gauss-Newton step may still promise at a minimum
MAX_REDUCED_CHI_SQUARE = 10.0  # where noise is assumed: misfits of three assumed deviations are still the assumption's
MIN_MISFIT_PROBABILITY = 1e-6  # where noise is measured: models that are right are then refused once in a million


@on_one_thread
def fit(
    problem: Problem, method: LeastSquares | None = None, limit: float | None = 0.5, *, least_influence: float = 0.02,
    free: tuple[str, ...] | None = None, start: FloatArray | None = None,
) -> ParameterFit:
    """Return the fit of a problem; parameters that the data cannot tell stay where they are and are named.

    Parameters
    ----------
    problem : Problem
    method : LeastSquares, Regularised or Bayesian, optional
    limit, least_influence : float
        Of `identifiability`; with `limit` None all parameters are free (a prior may then decide what the data do not).
    free : names, optional
        These are free, whatever the data can tell.
    start : (n,) floats, optional
        Coordinates to start from; the parameters' values (0) where left out.

    Raises
    ------
    ToolpointError
        For a Bayesian fit of a parameter without a prior, and for what the model refuses.

    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> round(fit(problem).values["k"])
    8000000
    """
    method = method or LeastSquares()
    x0 = problem.start if start is None else np.array(start, float)
    identifiable = None
    if limit is not None and free is None:
        identifiable = identifiability(problem, x0, limit, least_influence=least_influence)
    names = problem.names if identifiable is None else identifiable.identifiable
    names = tuple(names if free is None else free)
    unknown = [n for n in names if n not in problem.names]
    if unknown:
        fail("free", ", ".join(unknown), f"must be of {', '.join(problem.names)}")
    reasons = (dict.fromkeys([n for n in problem.names if n not in names], "not asked for") if identifiable is None
               else identifiable.reasons)
    free_columns = [j for j, name in enumerate(problem.names) if name in names]
    counted = problem.evaluations
    if not free_columns:
        return _unmoved(problem, x0, method, problem.evaluated(x0), identifiable, reasons)
    solver = Solver(problem, free_columns, x0, _prior(problem, free_columns, method), method.loss == "linear")
    first = solver.residuals_at(x0[free_columns])[0] if problem.sensitivities == "exact" else problem.evaluated(x0)
    result = _solved(solver, method)
    return _finished(solver, result, method, first, identifiable, reasons, problem.evaluations - counted)


def _prior(problem: Problem, free_columns: list[int], method: LeastSquares) -> FloatArray:
    """Return 1/s of every free parameter."""
    if isinstance(method, Regularised):
        return np.full(len(free_columns), positive("strength", method.strength))
    if not isinstance(method, Bayesian):
        return np.zeros(len(free_columns))
    without = [problem.parameters[j].name for j in free_columns if problem.parameters[j].prior is None]
    if without:
        fail("parameters", f"no prior for {', '.join(without)}", "a Bayesian fit needs prior_sd for every parameter",
             remedy="give prior_sd, or use LeastSquares()")
    return np.array([1 / (problem.parameters[j].prior or 1.0) for j in free_columns])


def _solved(solver: Solver, method: LeastSquares) -> object:
    """Return the end of the solver within the bounds; `lm`, which knows none, is refused where there are some."""
    lower, upper = solver.bounds()
    start = solver.x0[solver.columns]
    if method.algorithm == "lm":
        if np.isfinite(lower).any() or np.isfinite(upper).any():
            fail("algorithm", "lm with bounds", "lm knows no bounds", remedy="use 'trf' or 'dogbox', or remove the bounds")
        lower, upper = np.full_like(lower, -np.inf), np.full_like(upper, np.inf)
    return least_squares(
        solver.residual, np.clip(start, lower, upper), solver.jacobian, (lower, upper), method.algorithm, method.tolerance,
        method.tolerance, method.tolerance, loss=method.loss, max_nfev=method.evaluations,
        x_scale=1.0)


def _finished(
    solver: Solver, result: OptimizeResult, method: LeastSquares, first: Residuals, identifiable: Identifiability | None,
    reasons: dict[str, str], evaluations: int,
) -> ParameterFit:
    problem, free = solver.problem, np.asarray(result.x)
    x, (last, values, jacobian) = solver.full(free), solver.residuals_at(free)
    lower, upper = solver.bounds()
    # Of the logarithm: `trf` stays inside its bounds and comes within this of one that holds it.
    width = 1e-4
    stuck = (free - lower < width) | (upper - free < width)
    # Zero is the least damping that there is, not a limit of the search: a joint found without losses is an answer.
    lossless = np.array([not problem.parameters[j].log and problem.parameters[j].low == 0 for j in solver.columns])
    limited = stuck & ~(lossless & (free - lower < width))
    names = tuple(problem.names[j] for j in solver.columns)
    chi = float((last.values**2).sum())
    scaled, covariance = _covariance(solver, free, method)
    fitted = ParameterFit(
        problem.parameters, x, problem.values(x), names, reasons, covariance, scaled, chi, float((first.values**2).sum()),
        float(((solver.prior * free) ** 2).sum()), False, "", evaluations, method, last, identifiable,
        tuple(n for n, s in zip(names, limited, strict=True) if s), _weights(problem))
    gain = _gain(values, jacobian, stuck)
    return _judged(fitted, problem, gain, result)


def _covariance(solver: Solver, free: FloatArray, method: LeastSquares) -> tuple[bool, FloatArray]:
    """Return whether assumed deviations were set right by the residuals, and the covariance of the free coordinates."""
    problem, (last, _, jacobian) = solver.problem, solver.residuals_at(free)
    covariance = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    freedom, chi = last.values.size - len(free), float((last.values**2).sum())
    if not problem.assumed or isinstance(method, Bayesian) or freedom <= 0:
        return False, covariance
    if (spread := solver.spread_at(free)) is not None:
        # The pull towards the start is assumed as the data's deviations are, and is scaled as these.
        spread = spread + np.diag(solver.prior**2) * chi / freedom
        return True, covariance @ spread @ covariance
    if problem.measured and chi < freedom:  # an assumption too wide makes no measurement better
        return False, covariance
    return True, covariance * chi / freedom


def _gain(residual: FloatArray, jacobian: FloatArray, stuck: BoolArray) -> float:
    """Return the decrease of the sum of squares that a full Gauss-Newton step in the unbounded parameters still promises."""
    unbounded_columns = jacobian[:, ~stuck]
    if unbounded_columns.shape[1] == 0:
        return 0.0
    step, *_ = np.linalg.lstsq(unbounded_columns, -residual, rcond=1e-12)
    return float((residual**2).sum() - ((residual + unbounded_columns @ step) ** 2).sum())


def _judged(fitted: ParameterFit, problem: Problem, gain: float, result: OptimizeResult) -> ParameterFit:
    """Return the fit with its doubts: no minimum, modes without a partner, bounds, data that it does not explain."""
    limit = STATIONARY_FRACTION * (1.0 + fitted.chi_square + fitted.prior_cost)
    # The promise is that of least squares: a robust loss ends elsewhere, and its own end is taken.
    stationary = gain <= limit or (fitted.method.loss != "linear" and bool(result.success))
    converged = bool(stationary and np.isfinite(fitted.chi_square))
    doubts = [] if converged else [Doubt(
        "fit", f"NOT converged ({result.message.rstrip('.')}, and a step still promises {gain:.3g} of chi-square "
        f"{fitted.chi_square:.3g})", "allow more evaluations, or start from the result")]
    for k, (tracking, targets) in enumerate(zip(fitted.residuals.trackings, problem.targets, strict=True)):
        doubtful = tracking.doubtful(targets.lowest_mac) if tracking else ()
        if doubtful:
            set_words = f" of set {k + 1}" if len(problem.targets) > 1 else ""
            doubts.append(Doubt(f"measured modes {', '.join(str(i + 1) for i in doubtful)}{set_words}",
                                "no predicted partner with "
                                f"MAC above {targets.lowest_mac:g}",
                                "look at the pairing, start from other values, or leave them out"))
    if fitted.at_bounds:
        doubts.append(Doubt(", ".join(fitted.at_bounds), "at a bound", "widen it, or ask what the model lacks"))
    if converged and not is_explained(fitted, problem.assumed):
        doubts.append(Doubt("model", f"it does not explain the data (reduced chi-square {fitted.reduced_chi_square:.3g})",
                            "start from other values, update other parameters, or look for what the model lacks",
                            figure=fitted.reduced_chi_square))
    return replace(fitted, converged=converged, status=status_of(doubts, "converged"))


def is_explained(result: ParameterFit, assumed: bool) -> bool:
    """Whether chi-square is one that the data's deviations allow.

    Measured deviations: its probability of being exceeded is at least 1e-6. Assumed ones: at most 10 per degree of freedom.
    """
    freedom = max(result.n_data - len(result.free), 1)
    if assumed:
        return result.chi_square <= MAX_REDUCED_CHI_SQUARE * freedom
    return bool(chdtrc(freedom, result.chi_square) >= MIN_MISFIT_PROBABILITY)


def _weights(problem: Problem) -> tuple[str, ...]:
    """Return what the weights of all sets of targets come from, in words."""
    if len(problem.targets) == 1:
        return problem.targets[0].weights
    return tuple(f"set {k + 1}, {words}" for k, targets in enumerate(problem.targets) for words in targets.weights)


def _unmoved(
    problem: Problem, x: FloatArray, method: LeastSquares, first: Residuals, identifiable: Identifiability | None,
    reasons: dict[str, str],
) -> ParameterFit:
    chi = float((first.values**2).sum())
    return ParameterFit(problem.parameters, x, problem.values(x), (), reasons, np.zeros((0, 0)), False, chi, chi, 0.0,
               False, "NOT converged: no parameter can be told by the data, nothing was moved; measure more modes or "
               "responses, or raise the limit", 1, method, first, identifiable, weights=_weights(problem))
