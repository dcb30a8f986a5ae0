"""Exact derivatives against differences, for simple and repeated roots, shapes and responses."""

import numpy as np
import pytest

from random_systems import random_system
from toolpoint.vibration import SecondOrderSystem, eigen, sensitivity
from toolpoint.vibration import frequency_response as fr
from toolpoint.vibration.sensitivity import MatrixDerivatives

TERMS = ("mass", "damping", "stiffness", "structural_damping")


def directions(rng, n, structural=False):
    def one(scale):
        a = rng.normal(size=(n, n))
        return scale * (a + a.T)[None]
    return MatrixDerivatives(("p",), one(0.1), None if structural else one(1.0), one(2e4), one(1e3) if structural else None)


def at(system, derivatives, p):
    def moved(name):
        base, slope = getattr(system, name), getattr(derivatives, name)
        if slope is None:
            return base
        return (0 if base is None else base) + p * slope[0]
    return SecondOrderSystem(moved("mass"), moved("stiffness"), moved("damping"), moved("structural_damping"))


def difference(function, h):
    """Central difference of fourth order."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def modes_of(system, kind):
    return eigen.solve_undamped(system) if kind == "undamped" else eigen.solve_damped(system)


def like(shape, reference, mass):
    """Shapes with the order and sign of a reference."""
    product = np.abs(reference.conj().T @ mass @ shape)
    order = product.argmax(axis=1)
    shape = shape[:, order]
    sign = np.sign((reference.conj() * shape).sum(axis=0).real)
    return shape * sign, order


@pytest.mark.parametrize("kind", ["undamped", "viscous", "structural"])
def test_simple_roots(kind):
    rng = np.random.default_rng(1)
    system = random_system(rng, 6, damped=kind == "viscous")
    if kind == "structural":
        system = SecondOrderSystem(system.mass, system.stiffness, structural_damping=0.05 * np.diag(np.diag(system.stiffness)))
    derivatives = directions(rng, 6, kind == "structural")
    if kind == "undamped":
        derivatives = MatrixDerivatives(("p",), derivatives.mass, None, derivatives.stiffness)
    found = sensitivity.modes(system, derivatives, kind)
    base = modes_of(system, kind)
    h = 1e-3

    def frequency(p):
        return modes_of(at(system, derivatives, p), kind).frequency

    def ratio(p):
        return modes_of(at(system, derivatives, p), kind).damping_ratio

    def shape(p):
        return like(modes_of(at(system, derivatives, p), kind).shape, base.shape, system.mass)[0]
    for exact, function in ((found.frequency[0], frequency), (found.damping_ratio[0], ratio), (found.shape[0], shape)):
        expected = difference(function, h)
        np.testing.assert_allclose(exact, expected, atol=1e-6 * max(np.abs(expected).max(), 1e-30))
    if kind == "undamped":
        np.testing.assert_allclose(sensitivity.frequencies(system, derivatives)[0], found.frequency[0], rtol=1e-10)


def test_repeated_root_undamped():
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(5, 5)))[0]
    stiffness = turn @ np.diag([3.0, 3.0, 3.0, 7.0, 11.0]) @ turn.T * 1e4
    system = SecondOrderSystem(np.eye(5), (stiffness + stiffness.T) / 2)
    derivatives = MatrixDerivatives(("p",), *(np.array([a + a.T]) * s if s else None for a, s in
                                              ((rng.normal(size=(5, 5)), 0.02), (None, 0), (rng.normal(size=(5, 5)), 500.0))))
    found = sensitivity.modes(system, derivatives)
    assert not found.undetermined.any()
    h = 5e-3

    def mode(p):
        moved = at(system, derivatives, p)
        modes = eigen.solve_undamped(moved)
        shape, order = like(modes.shape, found.basis[0], moved.mass)
        return np.concatenate([modes.frequency[order][None], shape])
    expected = difference(mode, h)
    np.testing.assert_allclose(found.frequency[0], expected[0], rtol=1e-6)
    np.testing.assert_allclose(found.shape[0], expected[1:], atol=1e-6 * np.abs(expected[1:]).max())
    np.testing.assert_allclose(np.sort(sensitivity.frequencies(system, derivatives)[0][:3]), np.sort(found.frequency[0][:3]))


def test_repeated_root_viscous():
    rng = np.random.default_rng(3)
    one = random_system(rng, 3)
    zero = np.zeros((3, 3))
    double = SecondOrderSystem(*(np.block([[a, zero], [zero, a]]) for a in (one.mass, one.stiffness, one.damping)))
    a = rng.normal(size=(6, 6))
    derivatives = MatrixDerivatives(("p",), None, None, 1e4 * (a + a.T)[None])
    found = sensitivity.modes(double, derivatives, "viscous")
    h = 1e-3

    def poles(p):
        values = eigen.solve_damped(at(double, derivatives, p)).poles
        # Order by the predicted place, so that crossing roots keep their names.
        wanted = eigen.solve_damped(double).poles + p * found.eigenvalue[0]
        return values[np.abs(values[:, None] - wanted).argmin(axis=0)]
    np.testing.assert_allclose(found.eigenvalue[0], difference(poles, h), rtol=1e-6)


def test_root_that_stays_repeated_is_marked():
    system = SecondOrderSystem(np.eye(3), np.diag([4.0, 4.0, 9.0]))
    found = sensitivity.modes(system, MatrixDerivatives(("k",), None, None, np.eye(3)[None]))
    assert found.undetermined.tolist() == [[True, True, False]]
    np.testing.assert_allclose(found.shape, 0, atol=1e-12)


def test_frequency_response():
    rng = np.random.default_rng(4)
    system = random_system(rng, 5)
    derivatives = directions(rng, 5)
    frequency = np.linspace(10, 200, 7)
    expected = difference(lambda p: fr.direct(at(system, derivatives, p), frequency).values, 1e-3)
    found = sensitivity.frequency_response(system, derivatives, frequency)[0]
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


def test_global_scaling_laws():
    # lambda is homogeneous of degree one in all stiffnesses and minus one in all masses.
    system = random_system(np.random.default_rng(5), damped=False)
    all_k = MatrixDerivatives(("k", "m"), np.stack([0 * system.mass, system.mass]), None,
                              np.stack([system.stiffness, 0 * system.mass]))
    slopes = sensitivity.frequencies(system, all_k)
    base = eigen.solve_undamped(system).frequency
    np.testing.assert_allclose(slopes, [base / 2, -base / 2], rtol=1e-9)


def test_batch_of_poses_equals_single_ones():
    system = random_system(np.random.default_rng(6), 4, (3,), damped=False)
    derivatives = MatrixDerivatives(("p", "q"), None, None, np.stack([np.diag([1.0, 0, 0, 0]), np.diag([0, 0, 1.0, 0])]))
    batch = sensitivity.frequencies(system, derivatives)
    for i in range(3):
        np.testing.assert_allclose(batch[i], sensitivity.frequencies(system.at_pose(i), derivatives), rtol=1e-9)
