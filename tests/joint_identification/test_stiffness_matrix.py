"""Stiffness matrices of general joints: found from modes and masses, or said not to be decided."""

import warnings

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.joint_identification import ComponentMass, identify_joints
from toolpoint.machine import build
from toolpoint.machine.components import Components
from toolpoint.machine.description import BodyDescription, InertiaDescription
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.studies.measured.joint_machine import machine_of
from toolpoint.vibration import Dof, Modes

WAYS = ("+x", "+y", "+z")
BODIES = {"first": (40.0, (0.1, 0.2, 0.5), (3.0, 4.0, 5.0)), "second": (25.0, (0.3, -0.1, 1.5), (1.0, 2.0, 1.5))}


def case(rng, f, share=0.002, modes=None, repeated=None):
    """Two bodies on a joint of f free twists with a full matrix and a hinge; (result arguments, free twists, matrix)."""
    masses = {name: ComponentMass(m, at, np.diag(i)) for name, (m, at, i) in BODIES.items()}
    first = np.linalg.qr(rng.normal(size=(6, 6)))[0][:, :f]
    second = np.array([0.0, 1.2, 0.0, 1.0, 0.0, 0.0])[:, None]
    jacobian = {"first": np.hstack([first, np.zeros((6, 1))]), "second": np.hstack([first, second])}
    mass = sum(j.T @ masses[name].matrix @ j for name, j in jacobian.items())
    root = rng.normal(size=(f, f))
    stiff = np.zeros((f + 1, f + 1))
    stiff[:f, :f], stiff[f, f] = 1e6 * (root @ root.T + 4 * np.eye(f)), 4e5
    lower = np.linalg.cholesky(mass)
    squares, vectors = np.linalg.eigh(np.linalg.solve(lower, np.linalg.solve(lower, stiff).T))
    q = np.linalg.solve(lower.T, vectors)
    at = {i: rng.uniform(-1, 1, 3) + np.array([0, 0, 0.5 if i < 20 else 1.5]) for i in range(40)}
    shape = np.concatenate([tf.point_velocity(at[i]) @ jacobian["first" if i < 20 else "second"] @ q for i in at])
    spread = share * np.sqrt((shape**2).mean(axis=0)) * np.ones_like(shape)
    measured = Modes(np.sqrt(squares) / (2 * np.pi), 0.01, shape + spread * rng.normal(size=shape.shape),
                     [Dof(i, way) for i in at for way in WAYS], shape_variance=spread**2)
    measured = measured if modes is None else measured.selected(range(modes))
    parts = {"first": list(range(20)), "second": list(range(20, 40))}
    return (measured, at, parts, ("ground", "first", "second")), masses, first, stiff[:f, :f]


def found(arguments, masses):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        measured, points, components, chain = arguments
        return identify_joints(measured, points, components, chain=chain, masses=masses)


def in_basis(joint, free, matrix):
    """The true matrix over the free twists that were found, which span the true ones but for noise."""
    turn = np.linalg.lstsq(free, joint.screws, rcond=None)[0]
    return turn.T @ matrix @ turn


@pytest.mark.slow
@pytest.mark.parametrize(("f", "share"), [(4, 0.002), (6, 0.002), (6, 0.02)])
def test_the_matrix_is_found_and_its_intervals_hold(f, share):
    z = []
    for seed in range(3):
        arguments, masses, free, matrix = case(np.random.default_rng(100 + seed), f, share)
        joint = found(arguments, masses).joint("first")
        assert joint.kind == ("mount" if f == 6 else "general")
        np.testing.assert_array_equal(joint.stiffness_matrix, joint.stiffness_matrix.T)
        error = joint.stiffness_matrix - in_basis(joint, free, matrix)
        z += list((error / joint.stiffness_matrix_deviation)[np.triu_indices(f)])
    z = np.array(z)
    assert (np.abs(z) < 1.96).mean() >= 0.85 and 0.4 < (z**2).mean() < 2.2


@pytest.mark.slow
def test_six_freedoms_become_a_machine_with_the_frequencies_of_the_test():
    arguments, masses, _, _ = case(np.random.default_rng(3), 6)
    result = found(arguments, masses)
    bodies = {name: BodyDescription(m, at, InertiaDescription(*i)) for name, (m, at, i) in BODIES.items()}
    components = Components("two", arguments[3], arguments[2], bodies)
    machine = machine_of(result, components, modes=arguments[0], points=arguments[1])
    np.testing.assert_allclose(solve_modes(build(machine)).frequency, arguments[0].frequency, rtol=5e-3)


@pytest.mark.slow
def test_too_few_modes_do_not_decide():
    arguments, masses, _, _ = case(np.random.default_rng(4), 6, modes=4)
    joint = found(arguments, masses).joint("first")
    assert not joint.certain and any("more freedoms cannot be excluded" in d for d in joint.doubts)


def test_a_machine_needs_masses():
    arguments, _, _, _ = case(np.random.default_rng(4), 6)
    with pytest.raises(ToolpointError, match="masses of all components"):
        machine_of(found(arguments, None), Components("two", arguments[3], arguments[2]), modes=arguments[0])


@pytest.mark.slow
def test_wrong_masses_do_not_go_unseen():
    arguments, masses, _, _ = case(np.random.default_rng(5), 6)
    wrong = {**masses, "first": ComponentMass(40.0, (0.1, -0.8, 0.5), np.diag([3.0, 1.0, 3.5]))}
    assert any("unexplained" in d for d in found(arguments, wrong).doubts)
