"""Several measurements in one fit, and weights from correlated errors of responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from spring_chain import chain, measured

from toolpoint._check import ToolpointError
from toolpoint.updating import Parameter, Problem, Targets, fit
from toolpoint.updating.measured.frf_noise import correlations
from toolpoint.vibration import Modes

LINES = np.linspace(5.0, 120.0, 40)


def covered(modes, sd):
    return replace(modes, covariance=np.array([np.diag([(sd * f)**2, 1e-6]) for f in modes.frequency]))


def noisy(modes, sd, rng):
    return covered(Modes(modes.frequency * (1 + sd * rng.normal(size=modes.count)), modes.damping_ratio, modes.shape,
                         modes.dofs), sd)


def test_the_same_measurement_twice_gives_the_same_optimum_and_half_the_variance():
    model, parameters = chain()
    data = Targets(noisy(measured(model).modes, 1e-3, np.random.default_rng(1)))
    once, twice = (fit(Problem(model, parameters[:3], targets)) for targets in (data, [data, data]))
    assert twice.x == pytest.approx(once.x, abs=1e-7)
    assert twice.covariance == pytest.approx(once.covariance / 2, rel=1e-4)
    assert twice.chi_square == pytest.approx(2 * once.chi_square, rel=1e-6)
    assert {name for name, _ in twice.residuals.blocks} == {"set 1 frequency", "set 2 frequency"}


def test_two_states_of_a_machine_tell_more_than_one():
    """Mass loading: the same springs, another mass; two springs in series cannot be told from one state's lowest mode."""
    model, parameters = chain()
    loaded = replace(model, systems=replace(model.systems, base=replace(
        model.systems.base, mass=model.systems.base.mass + np.diag([0, 0, 0, 2.0])), _factors_by_choice={}))
    one, two = (Targets(covered(m({}, ()).modes, 1e-3).selected([0])) for m in (model, loaded))
    start = [replace(p, value=p.value * f) for p, f in zip(parameters[:2], (1.02, 0.99), strict=True)]
    single = fit(Problem(model, start, one), limit=None)
    both = fit(Problem([model, loaded], start, [one, two]), limit=None)
    assert np.linalg.matrix_rank(single.covariance, tol=1e-12) == 1
    assert [both.values[p.name] for p in start] == pytest.approx([p.value for p in parameters[:2]], rel=1e-3)


def test_one_target_for_each_model():
    model, parameters = chain()
    data = Targets(measured(model).modes)
    with pytest.raises(ToolpointError, match="one for each"):
        Problem([model], parameters, [data, data])


@pytest.mark.parametrize("kind", ["real and imaginary", "log"])
def test_derivatives_of_whitened_residuals_are_those_of_differences(kind):
    model, parameters = chain(lines=LINES)
    truth = measured(model)
    channels = np.full((4, 4), 0.4) + 0.6 * np.eye(4) + 0.1j * np.triu(np.ones((4, 4)), 1) - 0.1j * np.tril(np.ones((4, 4)), -1)
    targets = Targets(None, truth.frf, frf_kind=kind, line_correlation=toeplitz(0.5 ** np.arange(40.0)),
                      channel_correlation=channels)
    problem = Problem(model, [replace(p, value=1.1 * p.value) for p in parameters], targets)
    exact = problem.evaluated(problem.start, slopes=True).jacobian
    for j in (0, 5):
        h = np.zeros(len(parameters))
        h[j] = 1e-5
        central = (problem.evaluated(h).values - problem.evaluated(-h).values) / 2e-5
        assert np.abs(central - exact[:, j]).max() < 1e-6 * np.abs(exact).max()


def correlated(shape, lines, channels, rng):
    white = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)
    return np.einsum("fg,...goi,po->...fpi", np.linalg.cholesky(lines), white, np.linalg.cholesky(channels))


def test_correlated_errors_weighted_as_such_give_an_honest_covariance():
    """Monte Carlo: with the right correlations the squared normalised errors average 1 and, by Gauss and Markov, the errors are
    the smallest; with independent lines the covariance says something else than the errors."""
    model, parameters = chain(lines=LINES)
    model = replace(model, modes=0)
    truth = measured(model).frf
    lines = toeplitz(np.clip(1 - np.arange(40) / 6, 0, None))
    channels = 0.7 * np.ones((4, 4)) + 0.3 * np.eye(4)
    rng, sd = np.random.default_rng(3), 0.01 * np.abs(truth.values).mean()
    scores, errors, chi = {True: [], False: []}, {True: [], False: []}, []
    for _ in range(40):
        data = replace(truth, values=truth.values + sd * correlated(truth.values.shape, lines, channels, rng),
                       variance=np.full(truth.values.shape, sd**2))
        for known in scores:
            given = {"line_correlation": lines, "channel_correlation": channels} if known else {}
            found = fit(Problem(model, parameters[:4], Targets(None, data, **given)), limit=None)
            scores[known].append((found.x**2 / np.diag(found.covariance)).mean())
            errors[known].append(found.x**2)
            if known:
                chi.append(found.reduced_chi_square)
    assert np.mean(chi) == pytest.approx(1.0, abs=0.05)
    assert 0.8 < np.mean(scores[True]) < 1.25
    assert not 0.8 < np.mean(scores[False]) < 1.25
    assert (np.mean(errors[True], axis=0) < 0.8 * np.mean(errors[False], axis=0)).all()


def test_correlations_are_found_in_repeated_measurements():
    rng = np.random.default_rng(4)
    lines = toeplitz(np.where(np.arange(200) < 3, np.array([1.0, 0.6, 0.2] + [0] * 197), 0.0))
    channels = np.array([[1.0, 0.5j], [-0.5j, 1.0]])
    repeats = 3.0 + correlated((12, 200, 2, 1), lines, channels, rng)
    along, between = correlations(repeats)
    assert between[0, 1] == pytest.approx(0.5j, abs=0.05)
    assert along[0, 1] == pytest.approx(0.6 * 8 / 9, abs=0.05)
    assert np.abs(along[0, 4:]).max() < 0.05
    assert np.linalg.eigvalsh(along)[0] > 0 and np.linalg.eigvalsh(between)[0] > 0


def test_what_the_weights_come_from_is_said():
    model, parameters = chain(lines=LINES)
    truth = measured(model)
    found = fit(Problem(model, parameters[:2], Targets(covered(truth.modes, 1e-3), truth.frf, damping=True)))
    assert any("2x2 covariance" in words for words in found.weights)
    assert "assumed standard deviation of each line, lines independent" in found.report()


def test_bad_correlations_are_refused():
    model, _ = chain(lines=LINES)
    frf = measured(model).frf
    with pytest.raises(ToolpointError, match="must be \\(40, 40\\)"):
        Targets(None, frf, line_correlation=np.eye(3))
    with pytest.raises(ToolpointError, match="positive definite"):
        Targets(None, frf, channel_correlation=np.ones((4, 4)))
    with pytest.raises(ToolpointError, match="belongs to measured responses"):
        Targets(measured(model).modes, line_correlation=np.eye(40))
    with pytest.raises(ToolpointError, match="at least two repeats"):
        correlations(np.zeros((1, 4, 1, 1)))


def test_linked_numbers_move_with_their_parameter():
    """The chain rule over links: one parameter for all springs has the sum of their derivatives."""
    model, parameters = chain()
    ratio = {p.name: p.value / parameters[0].value for p in parameters[1:4]}
    data = Targets(measured(model).modes, shape=True)
    one = Problem(model, [Parameter(parameters[0].name, parameters[0].value, links=ratio)], data)
    each = Problem(model, parameters[:4], data)
    together = one.evaluated(one.start, True).jacobian[:, 0]
    assert together == pytest.approx(each.evaluated(each.start, True).jacobian.sum(axis=1), abs=1e-9)
