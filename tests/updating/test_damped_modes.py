"""Predicted modes of coupled damping: poles of the state matrix, derivatives by differences, size of the subspace."""

from __future__ import annotations

import numpy as np
import pytest
from spring_chain import MASSES, chain

from toolpoint.updating import AffineSystem, Parameter, Problem, SystemModel, Targets, fit
from toolpoint.updating.models import damped_modes
from toolpoint.vibration import Modes, SecondOrderSystem, eigen
from toolpoint.vibration.damped_modes import solve_as_damped, upper_poles
from toolpoint.vibration.sensitivity import MatrixDerivatives

LOSSES = np.array([0.02, 0.3, 0.05, 0.1])


def lossy_chain(dampers=(0.0, 30.0, 0.0, 0.0)):
    """Return the chain with a loss factor of each spring and some dampers, all of them parameters."""
    model, _ = chain(damping=dampers)
    base, slopes = model.systems.base, model.systems.slopes
    pattern = slopes.stiffness[:4]
    stiffness = np.array(model.systems.values[:4])
    lossy = SecondOrderSystem(base.mass, base.stiffness, base.damping, np.tensordot(LOSSES * stiffness, pattern, 1))
    names = (*slopes.names, *(f"springs.{i}.loss_factor" for i in range(4)))
    zero = np.zeros_like(pattern)
    # With its loss factor a spring's stiffness moves both parts of K + i D; the base is where the products are linear.
    changes = MatrixDerivatives(
        names, stiffness=np.concatenate([pattern, zero, zero]), damping=np.concatenate([zero, pattern, zero]),
        structural_damping=np.concatenate([LOSSES[:, None, None] * pattern, zero, stiffness[:, None, None] * pattern]))
    values = (*stiffness.tolist(), *dampers, *LOSSES.tolist())
    return SystemModel(AffineSystem(lossy, changes, values), 4), dict(zip(names, values, strict=True))


def turned_alike(modes: Modes, like: Modes) -> np.ndarray:
    return modes.shape * np.sign(np.real((modes.shape.conj() * like.shape).sum(axis=0)))


@pytest.mark.parametrize("dampers", [(0.0, 0.0, 0.0, 0.0), (0.0, 30.0, 0.0, 0.0), (5.0, 150.0, 1.0, 40.0)])
def test_derivatives_of_poles_and_shapes_are_those_of_central_differences(dampers):
    model, values = lossy_chain(dampers)
    names = tuple(values)
    here = model(values, names)
    for k, name in enumerate(names):
        step = 1e-5 * max(values[name], 0.1)
        ahead, behind = (model({**values, name: values[name] + sign * step}) for sign in (1, -1))
        before, after = behind.modes, ahead.modes
        shape_change = turned_alike(after, here.modes) - turned_alike(before, here.modes)
        for slopes, change, quantity in (
                (here.frequency_slopes[k], after.frequency - before.frequency, here.modes.frequency),
                (here.damping_slopes[k], after.damping_ratio - before.damping_ratio, here.modes.damping_ratio),
                (here.shape_slopes.array[k], shape_change, here.modes.shape)):
            size = max(np.abs(change).max(), 1e-11 * np.abs(quantity).max()) / (2 * step)
            assert np.abs(change / (2 * step) - slopes).max() < 1e-4 * size + 1e-11 * np.abs(quantity).max() / step, name


def test_modes_are_the_poles_that_responses_of_the_system_have():
    for dampers in ((0.0, 0.0, 0.0, 0.0), (0.0, 30.0, 0.0, 0.0)):
        model, values = lossy_chain(dampers)
        system = model.systems.system(values)
        poles = upper_poles(solve_as_damped(system))
        predicted = model(values)
        assert predicted.modes.frequency == pytest.approx(np.abs(poles) / (2 * np.pi), rel=1e-10)
        assert predicted.modes.damping_ratio == pytest.approx(-poles.real / np.abs(poles), rel=1e-8)


def test_measured_modes_of_structural_damping_count_by_their_poles():
    model, values = lossy_chain((0.0, 0.0, 0.0, 0.0))
    system = model.systems.system(values)
    measured = solve_as_damped(system)
    assert measured.damping == "structural"
    free = Parameter("springs.0.stiffness", values["springs.0.stiffness"])
    problem = Problem(model, [free], Targets(measured, damping=True, shape=True))
    assert np.abs(problem.evaluated(problem.start).values).max() < 1e-6


def test_one_strong_damper_is_found_from_complex_modes_and_not_from_real_ones():
    """A damper that couples the modes moves frequencies and makes shapes complex: both are data of the fit."""
    model, parameters = chain(damping=(0.0, 0.0, 120.0, 0.0))
    measured = model({}).modes
    named = [p for p in parameters if p.name in ("springs.2.stiffness", "springs.2.damping")]
    problem = Problem(model, [Parameter(p.name, p.value * 1.3, p.value / 50, p.value * 50) for p in named],
                      Targets(measured, damping=True, shape=True))
    result = fit(problem)
    for p in named:
        assert result.values[p.name] == pytest.approx(p.value, rel=1e-5)
    real = eigen.solve_undamped(model.systems.system({}))
    assert np.abs(measured.frequency / real.frequency - 1).max() > 1e-3
    assert np.abs(measured.damping_ratio / real.damping_ratio - 1).max() > 0.02


def test_overdamped_pairs_follow_the_modes_that_oscillate():
    model, _ = chain(damping=(0.0, 0.0, 0.0, 8000.0))
    modes = model({}).modes
    assert modes.count == len(MASSES)
    assert (np.diff(modes.damping_ratio >= 1 - 1e-12) >= 0).all() and modes.damping_ratio[-1] == pytest.approx(1.0)


def test_poles_of_a_subspace_are_those_of_all_modes(monkeypatch):
    """Modes beyond the subspace move as dampers push them at standstill: what is lost is the square of a frequency ratio."""
    rng = np.random.default_rng(3)
    n = 60
    springs = np.diag(np.full(n, 2.0)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    stiffness, damping = 1e6 * springs, np.zeros((n, n))
    for place in (0, 7, 20):
        damping[place, place] = rng.uniform(50, 200)
    system = SecondOrderSystem(np.eye(n), stiffness, damping)
    name, change = "damper", np.zeros((1, n, n))
    change[0, 7, 7] = 1.0
    model = SystemModel(AffineSystem(system, MatrixDerivatives((name,), damping=change), (damping[7, 7],)), 3)
    whole = model({}, (name,))
    monkeypatch.setattr(damped_modes, "MAX_STATE_MODES", 40)
    part = model({}, (name,))
    assert part.modes.frequency == pytest.approx(whole.modes.frequency, rel=1e-6)
    assert part.modes.damping_ratio == pytest.approx(whole.modes.damping_ratio, rel=1e-3)
    assert part.damping_slopes == pytest.approx(whole.damping_slopes, rel=1e-2)
