"""Samples of a posterior: the closed form of a linear-Gaussian problem, bounds, going on after an interruption."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.updating import Bayesian, Parameter, Prediction, Problem, Targets, fit
from toolpoint.updating.fits.sampler import sample
from toolpoint.vibration import Dof, Frf

LINES = np.arange(1.0, 7.0)
DOF = (Dof("a", "+x"),)
ROWS = np.random.default_rng(1).normal(size=(6, 3)) + 1j * np.random.default_rng(2).normal(size=(6, 3))


class Linear:
    """Receptances that are linear in three numbers."""

    def __call__(self, values, names):
        p = np.array([values[n] for n in ("joints.a.k", "joints.b.k", "joints.c.k")])
        at = [("joints.a.k", "joints.b.k", "joints.c.k").index(n) for n in names]
        frf = Frf(LINES, (ROWS @ p)[:, None, None], DOF, DOF)
        return Prediction(frf=frf, frf_slopes=ROWS.T[at][:, :, None, None] if names else None)


def linear_problem(low=-50.0, sd=0.3, prior=0.5):
    data = ROWS @ [1.2, 0.7, 1.9]
    targets = Targets(None, Frf(LINES, data[:, None, None], DOF, DOF, variance=np.full((6, 1, 1), 2 * sd**2)))
    parameters = [Parameter(n, v, low, 50.0, prior_sd=prior, log=False) for n, v in
                  (("joints.a.k", 1.0), ("joints.b.k", 1.0), ("joints.c.k", 2.0))]
    return Problem(Linear(), parameters, targets), data, sd, prior


@pytest.mark.slow
def test_samples_have_the_closed_form_mean_and_covariance_of_a_linear_gaussian_problem():
    """Tarantola, Inverse Problem Theory, 2005, eqs. 3.37, 3.38: C = (A^T A / s^2 + 1/p^2)^-1, m = C (A^T d / s^2 + m_0/p^2)."""
    pytest.importorskip("emcee")
    problem, data, sd, prior = linear_problem()
    start = fit(problem, Bayesian(), limit=None)
    found = sample(problem, start, np.random.default_rng(3), steps=2500, walkers=24)
    rows, d = np.concatenate([ROWS.real, ROWS.imag]), np.concatenate([data.real, data.imag])
    covariance = np.linalg.inv(rows.T @ rows / sd**2 + np.eye(3) / prior**2)
    mean = covariance @ (rows.T @ d / sd**2 + np.array([1, 1, 2]) / prior**2)
    assert start.covariance * prior**2 == pytest.approx(covariance, rel=1e-6)
    error = np.sqrt(np.diag(covariance) / found.effective)
    assert (np.abs(found.values.mean(axis=0) - mean) < 4 * error).all()
    # The relative standard error of a variance of n independent samples is sqrt(2/n).
    ratio = np.linalg.solve(covariance, np.cov(found.values, rowvar=False))
    assert ratio == pytest.approx(np.eye(3), abs=5 * np.sqrt(2 / found.effective.min()))
    assert "; converged" in found.status and found.r_hat.max() < 1.02
    low, high = found.interval("joints.a.k")
    assert (high - low) / 2 == pytest.approx(1.96 * np.sqrt(covariance[0, 0]), rel=0.1)
    assert "R-hat" in found.table()


def test_no_sample_leaves_the_bounds_and_a_short_chain_is_called_so():
    pytest.importorskip("emcee")
    problem, *_ = linear_problem(low=0.9)
    start = fit(problem, Bayesian(), limit=None)
    found = sample(problem, start, np.random.default_rng(4), steps=60)
    assert found.values.min() >= 0.9
    assert "NOT converged" in found.status


@pytest.mark.slow
def test_sampling_goes_on_where_it_was_interrupted(tmp_path):
    pytest.importorskip("emcee")
    problem, *_ = linear_problem()
    start = fit(problem, Bayesian(), limit=None)
    whole = sample(problem, start, np.random.default_rng(5), steps=200)
    seen = []

    def stopping(done, total):
        seen.append(done)
        if done >= 200:
            raise KeyboardInterrupt

    part = sample(problem, start, np.random.default_rng(5), steps=200, folder=tmp_path, progress=stopping)
    assert "interrupted" in part.status and part.steps < 200 and seen == sorted(seen)
    rest = sample(problem, start, np.random.default_rng(5), steps=200, folder=tmp_path)
    assert rest.x == pytest.approx(whole.x)
    other, *_ = linear_problem(sd=0.1)
    with pytest.raises(ToolpointError, match="another problem"):
        sample(other, fit(other, Bayesian(), limit=None), np.random.default_rng(5), steps=200, folder=tmp_path)


def test_missing_library_and_improper_posteriors_are_said(monkeypatch):
    problem, *_ = linear_problem(prior=0.5)
    start = fit(problem, Bayesian(), limit=None)
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(ToolpointError, match=r"pip install 'toolpoint\[bayes\]'"):
        sample(problem, start, np.random.default_rng(1), steps=10)
    flat = Problem(problem.model, [Parameter(p.name, p.value, log=False) for p in problem.parameters], problem.targets)
    with pytest.raises(ToolpointError, match="improper"):
        sample(flat, fit(flat, limit=None), np.random.default_rng(1), steps=10)
    with pytest.raises(ToolpointError, match="even"):
        sample(problem, start, np.random.default_rng(1), walkers=7)
