"""ParameterFit: what a fit gives, with its covariance, and its report in the manner of lmfit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail
from toolpoint._notebook import NotebookText
from toolpoint._rounding import NORMAL_QUANTILE_95
from toolpoint.updating.fits.fit_methods import LeastSquares
from toolpoint.updating.identifiability import Identifiability
from toolpoint.updating.models.prediction import Prediction
from toolpoint.updating.parameter import Parameter
from toolpoint.updating.residuals import Residuals

MAX_PRINTED_CORRELATIONS = 20  # correlations in a report, the largest


@dataclass(frozen=True, eq=False)
class ParameterFit(NotebookText):
    """Result of a fit.

    parameters : as given; x : (n,) coordinates found, zero for those left alone; values : all numbers of the model, SI, links
    included; free : names of those moved; left_alone : name to reason; covariance : (n_free, n_free) of x; chi_square : of the
    data; prior_cost : of the prior or the regularisation; converged : whether it is a minimum; status : in words, with what to
    try next; residuals : at the result; identifiability : at the start; weights : what the weights come from, in words.

    >>> from toolpoint.updating import Parameter, Prediction, Problem, Targets
    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 5e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes), "finite differences")
    >>> from toolpoint.updating import fit
    >>> result = fit(problem)
    >>> result.free, result.left_alone, result.n_data
    (('k',), {}, 1)
    """

    parameters: tuple[Parameter, ...]
    x: FloatArray
    values: dict[str, float]
    free: tuple[str, ...]
    left_alone: dict[str, str]
    covariance: FloatArray
    scaled: bool
    chi_square: float
    start_chi_square: float
    prior_cost: float
    converged: bool
    status: str
    evaluations: int
    method: LeastSquares
    residuals: Residuals
    identifiability: Identifiability | None = None
    at_bounds: tuple[str, ...] = ()
    weights: tuple[str, ...] = ()

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """Prediction of every model at the result."""
        return self.residuals.predictions

    @property
    def cost(self) -> float:
        """Chi-square of the data and cost of prior or regularisation together: what the fit makes least."""
        return self.chi_square + self.prior_cost

    @property
    def n_data(self) -> int:
        """Number of residuals of the data."""
        return int(self.residuals.values.size)

    @property
    def reduced_chi_square(self) -> float:
        """Chi-square per degree of freedom; not a number where there is none."""
        freedom = self.n_data - len(self.free)
        return self.chi_square / freedom if freedom > 0 else float("nan")

    @property
    def standard_error(self) -> dict[str, float]:
        """Standard error of every free parameter, SI."""
        index = {p.name: i for i, p in enumerate(self.parameters)}
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return {n: float(s * abs(self.parameters[index[n]].slope(float(self.x[index[n]]))))
                for n, s in zip(self.free, sd, strict=True)}

    @property
    def correlations(self) -> FloatArray:
        """Correlation matrix of the free parameters, (n_free, n_free)."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        return np.asarray(self.covariance / np.outer(sd, sd))

    def interval(self, name: str, factor: float = NORMAL_QUANTILE_95) -> tuple[float, float]:
        """Return the 95 % interval of a free parameter, SI; symmetric on the scale that it moves on."""
        if name not in self.free:
            fail("name", repr(name), f"must be of the free parameters {', '.join(self.free)}")
        k = [p.name for p in self.parameters].index(name)
        half = factor * float(np.sqrt(self.covariance[self.free.index(name), self.free.index(name)]))
        return self.parameters[k].at(float(self.x[k]) - half), self.parameters[k].at(float(self.x[k]) + half)

    def report(self, least_correlation: float = 0.1) -> str:
        """Return the fit report as text, in the manner of lmfit."""
        return _report(self, least_correlation)

    def __repr__(self) -> str:
        return (f"ParameterFit({len(self.free)} of {len(self.parameters)} parameters free, {self.n_data} data, "
                f"chi-square {self.start_chi_square:.4g} -> {self.chi_square:.4g}, {self.status})")


def _report(fit: ParameterFit, least_correlation: float = 0.1) -> str:
    """Return statistics, variables with standard errors, parameters left alone, and correlations above a size."""
    return "\n".join([*_statistics(fit), *_variables(fit), *_left_alone(fit), *_correlations(fit, least_correlation)])


def _statistics(fit: ParameterFit) -> list[str]:
    """Return method, status, counts and chi-squares, a line each."""
    rows = [
        ("fitting method", f"{type(fit.method).__name__} ({fit.method.algorithm})"),
        ("status", fit.status),
        ("# function evals", str(fit.evaluations)),
        ("# data points", str(fit.n_data)),
        ("# variables", str(len(fit.free))),
        ("chi-square", f"{fit.chi_square:.6g} (at the start {fit.start_chi_square:.6g})"),
        ("reduced chi-square", f"{fit.reduced_chi_square:.6g}")]
    if fit.prior_cost:
        rows.append(("prior cost", f"{fit.prior_cost:.6g}"))
    rows += [(f"  {name}", f"{value:.6g} of {size} data") for name, (value, size) in fit.residuals.chi_square().items()]
    rows += [("weights", words) for words in fit.weights]
    return ["[[Fit Statistics]]", *(f"    {name:20} = {value}" for name, value in rows)]


def _variables(fit: ParameterFit) -> list[str]:
    """Return the fitted values with standard errors, starts, bounds and links, a line each."""
    lines = ["[[Variables]]"]
    width = max((len(p.name) for p in fit.parameters), default=0)
    for parameter in fit.parameters:
        if parameter.name not in fit.free:
            continue
        value, error = fit.values[parameter.name], fit.standard_error[parameter.name]
        relative = f"{100 * error / abs(value):.2f}%" if value else "-"
        bound = "  AT A BOUND" if parameter.name in fit.at_bounds else ""
        lines.append(f"    {parameter.name + ':':{width + 1}} {value:.8g} ± {error:.4g} ({relative}) "
                     f"(init = {parameter.value:.6g}, bounds {parameter.low:.4g} .. {parameter.high:.4g}){bound}")
        lines += [f"    {'':{width + 1}} = {name} / {factor:g}" for name, factor in parameter.links.items()]
    if fit.scaled:
        lines.append("    (standard errors by what the residuals show: the data's deviations are assumed)")
    return lines


def _left_alone(fit: ParameterFit) -> list[str]:
    """Return the parameters that were left alone with their reasons, a line each."""
    if not fit.left_alone:
        return []
    value = {p.name: p.value for p in fit.parameters}
    return ["[[Left alone]]", *(f"    {name}: {value[name]:.6g} ({reason})" for name, reason in fit.left_alone.items())]


def _correlations(fit: ParameterFit, least_correlation: float) -> list[str]:
    """Return the correlations above a size, the largest first, a line each."""
    matrix = fit.correlations
    pairs = [(abs(matrix[i, j]), fit.free[i], fit.free[j], matrix[i, j])
             for i in range(len(fit.free)) for j in range(i + 1, len(fit.free)) if abs(matrix[i, j]) >= least_correlation]
    pairs.sort(key=lambda pair: -pair[0])
    if not pairs:
        return []
    width = max(len(f"C({a}, {b})") for _, a, b, _ in pairs[:MAX_PRINTED_CORRELATIONS])
    left_out = len(pairs) - MAX_PRINTED_CORRELATIONS
    unprinted = f"; {left_out} smaller ones are not shown" if left_out > 0 else ""
    head = f"[[Correlations]] (unreported correlations are < {least_correlation:.3f}{unprinted})"
    return [head, *(f"    {f'C({a}, {b})':{width}} = {np.sign(c) * size:+.4f}"
                    for size, a, b, c in pairs[:MAX_PRINTED_CORRELATIONS])]
