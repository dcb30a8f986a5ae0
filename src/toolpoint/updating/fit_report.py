"""The text of a fit report, in the manner of lmfit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from toolpoint.updating.fit import Fit


def text(fit: Fit, least_correlation: float = 0.1) -> str:
    """Return statistics, variables with standard errors, parameters left alone, and correlations above a size."""
    return "\n".join([*_statistics(fit), *_variables(fit), *_left_alone(fit), *_correlations(fit, least_correlation)])


def _statistics(fit: Fit) -> list[str]:
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


def _variables(fit: Fit) -> list[str]:
    lines = ["[[Variables]]"]
    width = max((len(p.name) for p in fit.parameters), default=0)
    for parameter in fit.parameters:
        if parameter.name not in fit.free:
            continue
        value, error = fit.values[parameter.name], fit.standard_error[parameter.name]
        relative = f"{100 * error / abs(value):.2f}%" if value else "-"
        bound = "  AT A BOUND" if parameter.name in fit.at_bounds else ""
        lines.append(f"    {parameter.name + ':':{width + 1}} {value:.8g} +/- {error:.4g} ({relative}) "
                     f"(init = {parameter.value:.6g}, bounds {parameter.low:.4g} .. {parameter.high:.4g}){bound}")
        lines += [f"    {'':{width + 1}} = {name} / {factor:g}" for name, factor in parameter.links.items()]
    if fit.scaled:
        lines.append("    (standard errors scaled by the root of the reduced chi-square: the data's deviations are assumed)")
    return lines


def _left_alone(fit: Fit) -> list[str]:
    if not fit.left_alone:
        return []
    value = {p.name: p.value for p in fit.parameters}
    return ["[[Left alone]]", *(f"    {name}: {value[name]:.6g} ({reason})" for name, reason in fit.left_alone.items())]


def _correlations(fit: Fit, least: float) -> list[str]:
    matrix = fit.correlations
    pairs = [(abs(matrix[i, j]), fit.free[i], fit.free[j], matrix[i, j])
             for i in range(len(fit.free)) for j in range(i + 1, len(fit.free)) if abs(matrix[i, j]) >= least]
    pairs.sort(key=lambda pair: -pair[0])
    if not pairs:
        return []
    width = max(len(f"C({a}, {b})") for _, a, b, _ in pairs)
    head = f"[[Correlations]] (unreported correlations are < {least:.3f})"
    return [head, *(f"    {f'C({a}, {b})':{width}} = {np.sign(c) * size:+.4f}" for size, a, b, c in pairs)]
