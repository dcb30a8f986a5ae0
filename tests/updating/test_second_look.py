"""Minima that are as good as the one that a fit came to, and what parameters left alone do to those that were fitted."""

from dataclasses import replace

import numpy as np
import pytest
from spring_chain import chain, measured

from toolpoint.updating import AffineSystem, Parameter, Problem, SystemModel, Targets, fit
from toolpoint.updating.fits.left_alone import name_effects
from toolpoint.updating.fits.second_look import look_again
from toolpoint.vibration import SecondOrderSystem
from toolpoint.vibration.sensitivity import MatrixDerivatives


def two_masses(first, second):
    """Two equal masses, the first on a spring to the ground, the second on a spring to the first.

    The frequencies tell k1 + 2 k2 and k1 k2, so (k1, k2) and (2 k2, k1 / 2) have the same ones.
    """
    patterns = np.array([[[1.0, 0.0], [0.0, 0.0]], [[1.0, -1.0], [-1.0, 1.0]]])
    names = ("springs.0.stiffness", "springs.1.stiffness")
    system = SecondOrderSystem(np.eye(2), np.tensordot((first, second), patterns, 1), np.zeros((2, 2)))
    slopes = MatrixDerivatives(names, stiffness=patterns)
    model = SystemModel(AffineSystem(system, slopes, (first, second)), 2)
    return model, [Parameter(name, value, value / 100, value * 100) for name, value in zip(names, (first, second), strict=True)]


def spoilt(modes, seed=1):
    rng = np.random.default_rng(seed)
    return replace(modes, frequency=modes.frequency * (1 + 0.005 * rng.normal(size=modes.frequency.size)))


def test_a_second_minimum_that_is_as_good_is_said_and_held():
    truth, _ = two_masses(1e5, 1.3e5)
    model, parameters = two_masses(1.05e5, 1.25e5)
    problem = Problem(model, parameters, Targets(spoilt(measured(truth).modes)))
    first = fit(problem, limit=None)
    again = look_again(problem, first)
    assert first.status == "converged" and "another minimum explains the data as well" in again.status
    # Whichever of the two it stands in: the interval reaches the other.
    for name, values in (("springs.0.stiffness", (1e5, 2.6e5)), ("springs.1.stiffness", (1.3e5, 0.5e5))):
        low, high = again.interval(name)
        assert low < min(values) * 1.02 and high > max(values) * 0.98
        narrow = first.interval(name)
        assert narrow[1] / narrow[0] < 1.3
    assert again.evaluations > first.evaluations


def test_a_single_minimum_stays_as_it_is():
    model, parameters = chain()
    known = spoilt(measured(model).modes)
    problem = Problem(model, [replace(p, value=1.1 * p.value) for p in parameters[:4]], Targets(known, shape=True))
    first = fit(problem, limit=None)
    again = look_again(problem, first)
    assert again.status == first.status
    assert again.x == pytest.approx(first.x, abs=1e-4) and again.covariance == pytest.approx(first.covariance, rel=1e-3)


def test_effects_of_what_is_left_alone_are_those_of_another_fit_with_it_changed():
    model, parameters = chain()
    known = measured(model).modes  # exact: residuals would add their curvature
    names = [p.name for p in parameters[:4]]

    def fitted(factor):
        given = [replace(p, value=p.value * (factor if p.name == names[3] else 1.0)) for p in parameters[:4]]
        problem = Problem(model, given, Targets(known))
        return problem, fit(problem, free=tuple(names[:3]))

    problem, base = fitted(1.0)
    # So well known that a change small enough to be linear counts.
    base = replace(base, left_alone={names[3]: "not asked for"}, covariance=1e-11 * np.eye(3))
    line, = name_effects(problem, base, share=1e-4)
    _, changed = fitted(1.0001)
    shift = {n: abs(np.log(changed.values[n] / base.values[n])) for n in names[:3]}
    known_by = dict(zip(base.free, np.sqrt(np.diag(base.covariance)), strict=True))
    for name in names[:3]:
        if name in line:
            stated = float(line.split(f"{name} moves by ")[1].split(" ")[0])
            assert stated == pytest.approx(shift[name] / known_by[name], rel=0.05)
    assert names[3] in line and sum(name in line for name in names[:3]) >= 1
    assert name_effects(problem, replace(base, left_alone={})) == ()
