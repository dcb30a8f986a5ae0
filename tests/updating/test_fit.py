"""Fits of a small chain: derivatives, what is found again, what is left alone, what is said when it goes wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_chain import chain, measured

from toolpoint._check import ToolpointError
from toolpoint.updating import (
    Bayesian,
    LeastSquares,
    Parameter,
    Problem,
    Regularised,
    Targets,
    fit,
    fit_with_restarts,
    identifiability,
    multi_start,
)
from toolpoint.updating.residuals import track_modes
from toolpoint.vibration import Modes

LINES = np.linspace(5.0, 120.0, 40)


def moved(parameters, factors):
    """Return parameters that start at factor times their value."""
    return [replace(p, value=p.value * f) for p, f in zip(parameters, factors, strict=True)]


@pytest.mark.parametrize("kind", ["real and imaginary", "log"])
def test_exact_derivatives_are_those_of_central_differences(kind):
    model, parameters = chain(lines=LINES)
    truth = measured(model)
    targets = Targets(truth.modes, truth.frf, damping=True, shape=True, mac=True, frf_kind=kind)
    problem = Problem(model, moved(parameters, [1.2, 0.9, 1.1, 0.8] * 2), targets)
    exact = problem.evaluated(problem.start, slopes=True).jacobian
    for j in range(len(parameters)):
        h = np.zeros(len(parameters))
        h[j] = 1e-5
        central = (problem.evaluated(h).values - problem.evaluated(-h).values) / 2e-5
        assert np.abs(central - exact[:, j]).max() < 1e-6 * np.abs(exact).max()


def test_complex_measured_shapes_have_the_same_law():
    model, parameters = chain()
    modes = measured(model).modes
    # Damping of this chain is proportional: each shape is real but for its own phase.
    modes = replace(modes, shape=np.real(modes.shape * np.exp(-1j * np.angle(modes.shape[-1]))))
    turned = Modes(modes.frequency, modes.damping_ratio, modes.shape * np.exp(0.7j), modes.dofs, "unscaled")
    problem = Problem(model, moved(parameters, [1.2, 0.9, 1.1, 0.8] * 2), Targets(turned, shape=True, mac=True))
    real = Problem(model, problem.parameters, Targets(modes, shape=True, mac=True))
    a, b = problem.evaluated(problem.start, True), real.evaluated(real.start, True)
    # Turning a measured shape by a common phase changes nothing but the weight of two for E|e|^2 shared by two parts.
    assert a.chi_square()["mac"][0] == pytest.approx(b.chi_square()["mac"][0])
    assert a.chi_square()["shape"][0] == pytest.approx(2 * b.chi_square()["shape"][0])


@pytest.mark.parametrize("method", [LeastSquares(), LeastSquares("dogbox"), LeastSquares(loss="soft_l1")])
def test_values_are_found_again_from_far_away(method):
    model, parameters = chain()
    targets = Targets(measured(model).modes, damping=True, shape=True)
    found = fit(Problem(model, moved(parameters, [1.3, 0.7, 1.3, 0.7] * 2), targets), method)
    assert found.converged and found.status == "converged"
    assert [found.values[p.name] for p in parameters] == pytest.approx([p.value for p in parameters], rel=1e-5)


def test_levenberg_marquardt_needs_open_bounds():
    model, parameters = chain()
    open_ones = [Parameter(p.name, 1.2 * p.value) for p in parameters]
    targets = Targets(measured(model).modes, damping=True, shape=True)
    assert fit(Problem(model, [replace(p, low=-np.inf, high=np.inf, log=False) for p in open_ones], targets),
               LeastSquares("lm")).converged
    with pytest.raises(ToolpointError, match="bounds"):
        fit(Problem(model, parameters, targets), LeastSquares("lm"))


def test_what_the_data_do_not_tell_stays_and_is_named():
    model, parameters = chain()
    problem = Problem(model, moved(parameters, [1.1] * 8), Targets(measured(model).modes))
    found = fit(problem)
    dampers = {p.name for p in parameters if "damping" in p.name}
    assert set(found.left_alone) == dampers
    assert all(found.values[p.name] == p.value for p in problem.parameters if p.name in dampers)
    assert all(name in found.report() for name in dampers)


def test_two_springs_in_series_are_told_apart_by_no_data():
    class Series:
        def __init__(self, model):
            self.model = model

        def __call__(self, values, names):
            result = self.model({"springs.0.stiffness": 1 / (1 / values["a"] + 1 / values["b"])},
                                ["springs.0.stiffness"] if names else ())
            if not names:
                return result
            both = values["a"] + values["b"]
            chain_rule = np.array([(values["b"] / both)**2, (values["a"] / both)**2])
            return replace(result, frequency_slopes=chain_rule[[("a", "b").index(n) for n in names], None]
                           * result.frequency_slopes, damping_slopes=np.zeros((len(names), 4)), shape_slopes=None)

    model, _ = chain()
    problem = Problem(Series(model), [Parameter("a", 8e5), Parameter("b", 8.5e5)], Targets(measured(model).modes))
    found = identifiability(problem)
    assert len(found.identifiable) == 1
    assert found.singular_values[-1] < 1e-6
    assert "imitate" in found.reasons[next(name for name in found.names if name not in found.identifiable)]


def test_covariance_holds_by_monte_carlo():
    model, parameters = chain()
    truth = measured(model).modes
    sd, rng, scores = 1e-3, np.random.default_rng(5), []
    covariance = np.array([np.diag([(sd * f)**2, 1e-6]) for f in truth.frequency])
    for _ in range(60):
        noisy = Modes(truth.frequency * (1 + sd * rng.normal(size=4)), truth.damping_ratio, truth.shape, truth.dofs,
                      covariance=covariance)
        found = fit(Problem(model, parameters[:3], Targets(noisy)))
        assert not found.scaled
        error = found.x / np.sqrt(np.diag(found.covariance))
        scores.append((error**2).mean())
    assert 0.7 < np.mean(scores) < 1.4


def test_an_assumed_deviation_that_is_too_wide_makes_measured_ones_no_better():
    """Shapes without error beside frequencies stated to 0.1 %: the standard errors stay those of the frequencies."""
    model, parameters = chain()
    truth, sd, rng = measured(model).modes, 1e-3, np.random.default_rng(6)
    covariance = np.array([np.diag([(sd * f)**2, 1e-6]) for f in truth.frequency])
    noisy = Modes(truth.frequency * (1 + 0.1 * sd * rng.normal(size=4)), truth.damping_ratio, truth.shape, truth.dofs,
                  covariance=covariance)
    alone = fit(Problem(model, parameters[:3], Targets(noisy)))
    both = fit(Problem(model, parameters[:3], Targets(noisy, mac=True, mac_sd=1.0)))
    assert not both.scaled and both.reduced_chi_square < 0.1
    for name in alone.free:
        assert both.standard_error[name] == pytest.approx(alone.standard_error[name], rel=0.02)
    # Where everything is assumed, the misfit is all that is known of the errors.
    assumed = Modes(noisy.frequency, noisy.damping_ratio, noisy.shape, noisy.dofs)
    assert fit(Problem(model, parameters[:2], Targets(assumed))).scaled


def test_bayesian_posterior_is_the_closed_form_of_a_linear_problem():
    """One spring, ln f = ln k / 2 + const: precision 1/s^2 + 1/(4 sd^2), mean weighted accordingly (Tarantola, ch. 3)."""
    model, parameters = chain()
    truth = measured(model).modes
    names = {f"springs.{i}.stiffness": parameters[i].value / parameters[0].value for i in range(1, 4)}
    off, prior, sd = 0.2, 0.1, 0.05
    first = Parameter(parameters[0].name, parameters[0].value * np.exp(off), prior_sd=prior,
                      links=names)
    found = fit(Problem(model, [first], Targets(truth, frequency_sd=sd)), Bayesian())
    data = 4 / (4 * sd**2)
    precision = 1 / prior**2 + data
    assert found.x[0] == pytest.approx(-off * data / precision, rel=1e-6)
    assert found.covariance[0, 0] == pytest.approx(1 / precision, rel=1e-6)
    assert found.prior_cost > 0


def test_regularisation_pulls_to_the_start_and_a_prior_is_needed():
    model, parameters = chain()
    start = moved(parameters, [1.3] * 8)
    targets = Targets(measured(model).modes, shape=True, damping=True)
    free, held = (fit(Problem(model, start, targets), m) for m in (LeastSquares(), Regularised(strength=100.0)))
    assert np.linalg.norm(held.x) < 0.9 * np.linalg.norm(free.x)
    with pytest.raises(ToolpointError, match="prior_sd"):
        fit(Problem(model, start, targets), Bayesian())


def test_no_convergence_is_said():
    model, parameters = chain()
    problem = Problem(model, moved(parameters, [1.3, 0.7, 1.3, 0.7] * 2), Targets(measured(model).modes, shape=True))
    found = fit(problem, LeastSquares(evaluations=2))
    assert not found.converged and "NOT converged" in found.status and "start from the result" in found.status


def test_a_bound_and_an_unexplained_measurement_are_said():
    model, parameters = chain()
    tight = [replace(p, value=1.5 * p.value, low=1.4 * p.value, high=2 * p.value) for p in parameters[:4]]
    found = fit_with_restarts(Problem(model, tight, Targets(measured(model).modes)), restarts=2)
    assert found.at_bounds and "at a bound" in found.status and "does not explain" in found.status


def test_a_damper_found_to_be_none_is_an_answer_and_no_bound():
    """Zero is the least that a damper can be; a limit of the search that is not nature's is said."""
    truth, _ = chain(damping=(20.0, 15.0, 10.0, 1e-9))
    model, parameters = chain()
    last = replace(parameters[7], low=0.0, high=100.0, log=False)
    targets = Targets(measured(truth).modes, damping=True)
    found = fit(Problem(model, [*parameters[4:7], last], targets), limit=None)
    assert found.values[last.name] < 1e-2 and found.at_bounds == () and found.status == "converged"
    short = replace(last, low=2.0)
    assert fit(Problem(model, [*parameters[4:7], short], targets), limit=None).at_bounds == (last.name,)


def test_modes_are_followed_through_a_crossing():
    shape = np.eye(3)[:, :2]
    measured_modes = Modes([10.0, 11.0], 0.01, shape, ("1:x", "2:x", "3:x"))
    crossed = Modes([9.0, 12.0, 30.0], 0.01, np.eye(3)[:, [1, 0, 2]], ("1:x", "2:x", "3:x"))
    assert track_modes(measured_modes, crossed).model.tolist() == [1, 0]


def test_multi_start_reports_two_optima_that_are_as_good():
    """A model that depends on the sum and the product of its parameters only: exchanging them changes nothing."""
    model, _ = chain()

    class Sum:
        def __call__(self, values, names):
            a, b = values["a"], values["b"]
            result = model({"springs.0.stiffness": a + b, "springs.3.stiffness": a * b / 1e5},
                           ["springs.0.stiffness", "springs.3.stiffness"] if names else ())
            if not names:
                return result
            turn = np.array([[1.0, b / 1e5], [1.0, a / 1e5]])[[("a", "b").index(n) for n in names]]
            return replace(result, frequency_slopes=turn @ result.frequency_slopes,
                           damping_slopes=np.zeros((len(names), 4)))

    truth = Sum()({"a": 3e5, "b": 1e5}, ()).modes
    problem = Problem(Sum(), [Parameter("a", 2.5e5), Parameter("b", 1.5e5)], Targets(truth))
    found = multi_start(problem, np.random.default_rng(1), starts=12)
    assert len(found.optima) == 2 and len(found.rivals) == 1
    assert "other optima" in found.best.status and "2 optima" in found.table()
    values = sorted(tuple(round(o.fit.values[n] / 1e5, 3) for n in "ab") for o in found.optima)
    assert values == [(1.0, 3.0), (3.0, 1.0)]


def test_bad_input_is_refused():
    model, parameters = chain()
    modes = measured(model).modes
    with pytest.raises(ToolpointError, match="neither"):
        Targets()
    with pytest.raises(ToolpointError, match="more than once"):
        Problem(model, [parameters[0], parameters[0]], Targets(modes))
    with pytest.raises(ToolpointError, match="above zero"):
        Parameter("k", 0.0)
    with pytest.raises(ToolpointError, match="within"):
        Parameter("k", 5.0, low=6.0)
    with pytest.raises(ToolpointError, match="must be of"):
        fit(Problem(model, parameters, Targets(modes)), free=("nothing",))
    with pytest.raises(ToolpointError, match="at least as many"):
        fit(Problem(replace(model, modes=2), parameters, Targets(modes)))


def test_report_has_what_lmfit_has():
    model, parameters = chain()
    text = fit(Problem(model, moved(parameters, [1.1] * 8), Targets(measured(model).modes, damping=True))).report()
    for word in ("[[Fit Statistics]]", "[[Variables]]", "chi-square", "reduced chi-square", "# data points", "# variables",
                 "±", "init =", "bounds"):
        assert word in text
