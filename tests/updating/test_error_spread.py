"""Intervals where deviations are assumed: they hold the truth, whatever the assumption, also where few lines decide."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.updating import AffineSystem, Parameter, Problem, SystemModel, Targets, fit
from toolpoint.updating.fits.error_spread import spread_of_gradient
from toolpoint.updating.fits.misfit import question_misfit
from toolpoint.vibration import Dof, SecondOrderSystem, frequency_response
from toolpoint.vibration.sensitivity import MatrixDerivatives

LINES = np.arange(2.0, 90.0, 0.25)
DOFS = (Dof(1, "+x"), Dof(2, "+x"), Dof(3, "+x"))
STIFFNESS = {"k1": 4e5, "k2": 6e5, "k3": 2e5}
SPRING = (np.diag([1.0, 0, 0]), np.array([[1.0, -1, 0], [-1, 1, 0], [0, 0, 0]]),
          np.array([[0.0, 0, 0], [0, 1, -1], [0, -1, 1]]))


def chain(values):
    """Three masses in a chain from the ground, loss factor 2 %."""
    stiffness = sum(values[name] * part for name, part in zip(STIFFNESS, SPRING, strict=True))
    return SecondOrderSystem(np.diag([10.0, 6.0, 3.0]), stiffness, outputs=DOFS, inputs=DOFS,
                             structural_damping=0.02 * stiffness)


def measured(rng, noise, quantity):
    """Responses with white noise in the quantity that was measured, a share of the rms of all."""
    exact = frequency_response.direct(chain(STIFFNESS), LINES, quantity).selected(DOFS, DOFS[:1])
    size = noise * np.sqrt((np.abs(exact.values) ** 2).mean() / 2)
    return replace(exact, values=exact.values + size * (rng.normal(size=exact.values.shape)
                                                        + 1j * rng.normal(size=exact.values.shape)))


def fitted(frf, start=1.01):
    """The three stiffnesses fitted to responses from a start within the width of a resonance (further away modes lead)."""
    values = {name: start * value for name, value in STIFFNESS.items()}
    slopes = MatrixDerivatives(tuple(STIFFNESS), mass=np.zeros((3, 3, 3)), stiffness=np.array(SPRING),
                               structural_damping=0.02 * np.array(SPRING))
    model = SystemModel(AffineSystem(chain(values), slopes, tuple(values.values())), 0, frf.frequency, DOFS, DOFS[:1])
    parameters = [Parameter(name, value, log=True) for name, value in values.items()]
    return fit(Problem(model, parameters, Targets(frf=frf)), limit=None)


@pytest.mark.parametrize(("quantity", "noise"), [("receptance", 0.02), ("accelerance", 0.2),
                                                 pytest.param("accelerance", 0.02, marks=pytest.mark.slow)])
@pytest.mark.default_cases(1)
def test_intervals_hold_and_noise_alone_is_explained(quantity, noise):
    scores = []
    for seed in range(40):
        result = fitted(measured(np.random.default_rng(seed), noise, quantity))
        assert result.converged and "does not explain" not in result.status
        errors = np.array([np.log(result.values[name] / STIFFNESS[name]) for name in result.free])
        scores += list(errors / np.sqrt(np.diag(result.covariance)))
    assert 0.91 <= np.mean(np.abs(scores) < 1.96) <= 1.0
    assert np.std(scores) > 0.6  # an interval that holds everything says nothing


def test_noise_of_accelerometers_grows_in_the_receptance():
    frf = measured(np.random.default_rng(0), 0.1, "accelerance")
    exact = frequency_response.direct(chain(STIFFNESS), LINES, "accelerance").selected(DOFS, DOFS[:1])
    noise = Targets(frf=frf).noise_of_lines()
    size = 0.1 * np.sqrt((np.abs(exact.values) ** 2).mean())
    np.testing.assert_allclose(noise * (2 * np.pi * LINES[:, None, None]) ** 2, np.full(noise.shape, size), rtol=0.2)
    assert Targets(frf=frf).frf_quantity == "accelerance"


def test_measured_deviations_are_taken_as_they_are():
    frf = measured(np.random.default_rng(0), 0.05, "receptance")
    stated = replace(frf, variance=np.full(frf.values.shape, 1e-14))
    result = fitted(stated)
    residuals = result.residuals
    assert not result.scaled
    jacobian = np.random.default_rng(1).normal(size=(residuals.values.size, 3))
    matrix = spread_of_gradient((Targets(frf=stated),), replace(residuals, jacobian=jacobian))
    np.testing.assert_allclose(matrix, jacobian.T @ jacobian)


def test_a_band_that_decides_alone_leaves_no_residual_and_counts_by_its_noise():
    rng = np.random.default_rng(2)
    frf = measured(rng, 0.05, "receptance")
    targets = Targets(frf=frf)
    lines, responses = LINES.size, frf.values[0].size
    jacobian = np.zeros((2, lines, responses, 2))
    jacobian[:, 7, :, 0] = 1.0  # one line alone tells the first parameter
    jacobian[:, :, :, 1] = rng.normal(size=(2, lines, responses))
    rows, errors = jacobian.reshape(-1, 2), rng.normal(size=2 * lines * responses)
    errors = errors - rows @ np.linalg.lstsq(rows, errors, rcond=None)[0]
    residuals = replace(fitted(frf).residuals, values=errors, jacobian=rows, blocks=(("frf", errors.size),))
    matrix = spread_of_gradient((targets,), residuals)
    share = (targets.noise_of_lines() / np.sqrt(2) / targets.frf_deviation())[7]
    assert matrix[0, 0] >= 0.99 * 2 * float((share**2).sum())


def test_two_bands_that_contradict_each_other_stand_as_far_apart_as_they_are():
    """What a model lacks is no noise: estimates d apart from two bands have the variance d^2/2 of the jackknife."""
    frf = measured(np.random.default_rng(3), 1e-9, "receptance")
    lines, responses, apart = LINES.size, frf.values[0].size, 0.3
    jacobian, errors = np.zeros((2, lines, responses, 1)), np.zeros((2, lines, responses))
    jacobian[:, [7, 300]] = 1.0
    errors[:, 7], errors[:, 300] = apart / 2, -apart / 2
    rows = jacobian.reshape(-1, 1)
    residuals = replace(fitted(frf, 1.0).residuals, values=errors.ravel(), jacobian=rows, blocks=(("frf", errors.size),))
    matrix = spread_of_gradient((Targets(frf=frf),), residuals)
    information = float((rows**2).sum())
    assert matrix[0, 0] / information**2 == pytest.approx(apart**2 / 2, rel=0.02)


def test_what_a_model_misses_beyond_noise_is_named_with_its_share():
    targets = Targets(frf=measured(np.random.default_rng(4), 0.02, "accelerance"))
    exact = frequency_response.direct(chain(STIFFNESS), LINES, "receptance").selected(DOFS, DOFS[:1])
    assert question_misfit(targets, exact) == ()
    (doubt,) = question_misfit(targets, replace(exact, values=1.05 * exact.values))
    assert doubt.figure == pytest.approx(0.05, rel=0.1) and "of the responses" in doubt
