"""Exact step: the block coordinates against the states themselves, defective plants, the semigroup."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drives import servo_cases as cases
from toolpoint.drives import (
    BallScrew,
    Coupling,
    DriveAxis,
    TorqueMotor,
    ball_screw_axis,
    build_plant,
    linear_motor_axis,
    rigid_axis,
)
from toolpoint.drives.simulation.exact_step import coordinates, step_matrices
from toolpoint.drives.simulation.kernel import advance
from toolpoint.vibration.state_space import hold_matrices


def screw_axis(nut=0.3):
    return ball_screw_axis(0.01, Coupling(5e3), BallScrew(0.04, 0.02, 0.8), table_mass=300.0, nut_position=nut,
                           front_bearing=5e8, end_bearing=None, nut=4e8)


PLANTS = {
    "benchmark": lambda: cases.benchmark_plant(cases.lugre()),
    "two equal axes": lambda: build_plant([DriveAxis(n, TorqueMotor(), rigid_axis(0.01, 1e-3, 0.1)) for n in "xy"]),
    "double integrators": lambda: build_plant([DriveAxis(n, TorqueMotor(), linear_motor_axis(20.0)) for n in "xyz"]),
    "undamped and damped": lambda: build_plant([DriveAxis("x", cases.MOTOR, screw_axis()),
                                          DriveAxis("y", TorqueMotor(), rigid_axis(1.0, 1.0))]),
}


def stepped(m, x):
    """phi x by the kernel's blocks."""
    z = m.inward(x)
    new = np.zeros_like(z)
    advance(m.core, m.pairs, z, new)
    return m.outward(new)


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize("step", [1e-6, 6.25e-5, 1e-3])
def test_blocks_equal_the_matrix_exponential(name, step):
    p = PLANTS[name]()
    phi = hold_matrices(p.a, np.zeros((len(p.a), 0)), step)[0]
    m, rng = step_matrices(p, step), np.random.default_rng(0)
    # States in the units of their own motion: what one rad/s or N s brings about.
    for x in (rng.standard_normal((5, len(phi))) * (1.0 + np.abs(p.a).max(axis=1)) ** -0.5):
        np.testing.assert_allclose(stepped(m, x), phi @ x, rtol=1e-9, atol=1e-10 * np.abs(phi @ x).max())
        np.testing.assert_allclose(m.outward(m.inward(x)), x, rtol=1e-9, atol=1e-11 * np.abs(x).max())


@pytest.mark.parametrize("name", PLANTS)
def test_dense_and_block_columns_are_the_same_step(name):
    p = PLANTS[name]()
    one, two = step_matrices(p, 1e-4), step_matrices(p, 1e-4, dense=True)
    count = p.b_input.shape[1] + p.b_force.shape[1] + p.b_scalar.shape[1]
    for a, b in ((one.inputs[:count], two.inputs[:count]), (one.shift, two.shift), (one.jump, two.jump)):
        x, y = one.outward(a.T), two.outward(b.T)
        np.testing.assert_allclose(x, y, rtol=1e-7, atol=1e-9 * max(np.abs(y).max(initial=0.0), 1e-300))
    np.testing.assert_allclose(one.gain, two.gain, rtol=1e-9)
    np.testing.assert_allclose(one.direct, two.direct, rtol=1e-7, atol=1e-9 * max(np.abs(two.direct).max(initial=0.0), 1e-300))


def test_rigid_motion_without_damping_stays_in_the_core():
    """A double integrator has one eigenvector for two poles; the elastic poles stand in blocks."""
    assert coordinates(PLANTS["double integrators"]().a)[2] == 6
    assert coordinates(build_plant([DriveAxis("x", TorqueMotor(), screw_axis())]).a)[2] == 2
    assert coordinates(PLANTS["benchmark"]().a)[2] == 0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_random_stable_systems(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    a = rng.standard_normal((n, n)) - 2 * np.eye(n)
    basis, inverse, core = coordinates(a)
    turned = inverse @ a @ basis
    half = (n - core) // 2
    outside = turned.copy()
    outside[:core, :core] = 0.0
    for i in range(half):
        at = [core + i, core + half + i]
        outside[np.ix_(at, at)] = 0.0
    assert np.abs(outside).max(initial=0.0) < 1e-7 * np.abs(a).max()
