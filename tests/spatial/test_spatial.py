"""Round trips and invariances of rotations, transforms, screws and registration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from toolpoint.spatial import iterative_closest_point, rigid, rotation, screw
from toolpoint.spatial import transform as tf

vectors = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)
twists = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6).map(np.array)


@given(vectors)
def test_rotation_vector_and_quaternion_round_trips(v):
    if np.linalg.norm(v) > np.pi - 1e-3:
        v = v / np.linalg.norm(v) * 3.0
    r = rotation.from_vector(v)
    np.testing.assert_allclose(r, expm(rotation.skew(v)), atol=1e-12)
    np.testing.assert_allclose(rotation.to_vector(r), v, atol=1e-9)
    w, x, y, z = rotation.to_quaternion(r)
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), r, atol=1e-12)


def test_half_turns_come_back():
    for axis in (np.eye(3)[0], np.eye(3)[1], np.array([0.6, 0, 0.8])):
        r = rotation.from_vector(np.pi * axis)
        np.testing.assert_allclose(rotation.from_vector(rotation.to_vector(r)), r, atol=1e-12)


@settings(deadline=None)
@given(twists)
def test_exponential_and_logarithm(xi):
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = rotation.skew(xi[3:]), xi[:3]
    t = tf.exponential(xi)
    np.testing.assert_allclose(t, expm(generator), atol=1e-11)
    np.testing.assert_allclose(tf.logarithm(t), xi, atol=1e-8)
    np.testing.assert_allclose(tf.inverse(t) @ t, np.eye(4), atol=1e-12)


def test_small_and_large_angles_use_the_same_function():
    # Either side of the angle at which the series takes over, against the matrix exponential.
    for angle in (1e-9, 1e-4, 0.29, 0.31):
        xi = np.array([3.0, -2.0, 1.0, 0.6 * angle, 0.0, 0.8 * angle])
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = rotation.skew(xi[3:]), xi[:3]
        np.testing.assert_allclose(tf.exponential(xi), expm(generator), rtol=0, atol=1e-13)
        np.testing.assert_allclose(tf.logarithm(tf.exponential(xi)), xi, rtol=0, atol=1e-12)


@settings(deadline=None)
@given(twists, twists, twists)
def test_adjoint_carries_twists_and_power_is_invariant(xi, eta, wrench):
    t = tf.exponential(xi)
    np.testing.assert_allclose(tf.exponential(tf.adjoint(t) @ eta), t @ tf.exponential(eta) @ tf.inverse(t), atol=1e-9)
    assert (tf.wrench_map(t) @ wrench) @ (tf.adjoint(t) @ eta) == pytest.approx(wrench @ eta, abs=1e-9)


@given(twists, twists, twists)
def test_bracket_is_antisymmetric_and_satisfies_jacobi(a, b, c):
    br = tf.twist_bracket
    np.testing.assert_allclose(br(a, b), -br(b, a), atol=1e-12)
    np.testing.assert_allclose(br(a, br(b, c)) + br(b, br(c, a)) + br(c, br(a, b)), 0, atol=1e-9)


@given(twists)
def test_screw_gives_back_its_twist(xi):
    if np.linalg.norm(xi[3:]) < 1e-3:
        xi = xi + np.array([0, 0, 0, 0.5, 0, 0])
    s = screw(xi)
    np.testing.assert_allclose(s.twist, xi, atol=1e-9)
    # Points of the axis move along the axis only.
    velocity = tf.point_velocity(s.point + 0.3 * s.direction) @ xi
    np.testing.assert_allclose(np.cross(velocity, s.direction), 0, atol=1e-9)
    assert s.distance(s.point + 2 * s.direction) == pytest.approx(0, abs=1e-9)


def test_pure_translation_has_infinite_pitch():
    s = screw([0, 3, 0, 0, 0, 0])
    assert np.isinf(s.pitch)
    np.testing.assert_allclose(s.twist, [0, 3, 0, 0, 0, 0])


@settings(deadline=None, max_examples=30)
@given(twists, st.integers(0, 1000))
def test_registration_finds_the_motion_and_weights_count(xi, seed):
    rng = np.random.default_rng(seed)
    points, t = rng.normal(size=(12, 3)), tf.exponential(xi)
    found = rigid(points, tf.move(t, points))
    np.testing.assert_allclose(found.transform, t, atol=1e-9)
    spoilt = tf.move(t, points)
    spoilt[4] += 5
    weights = np.ones(12)
    weights[4] = 0
    np.testing.assert_allclose(rigid(points, spoilt, weights).transform, t, atol=1e-9)


def test_closest_points_without_correspondence():
    rng = np.random.default_rng(0)
    points = rng.normal(size=(60, 3))
    t = tf.exponential([0.02, -0.03, 0.01, 0.03, 0.02, -0.04])
    found = iterative_closest_point(points, tf.move(t, points)[rng.permutation(60)])
    np.testing.assert_allclose(found.transform, t, atol=1e-9)
    assert found.status == "converged"


@pytest.mark.parametrize(("points", "message"), [
    (np.zeros((2, 3)), "at least 3"), (np.outer([0, 1, 2, 3.0], [1, 2, 3]), "one line")])
def test_undetermined_registration_is_refused(points, message):
    with pytest.raises(ValueError, match=message):
        rigid(points, points)


def test_left_handed_and_stretched_matrices_are_refused():
    with pytest.raises(ValueError, match="left-handed"):
        rotation.check_rotation(np.diag([1, 1, -1]))
    with pytest.raises(ValueError, match="nearest"):
        rotation.check_rotation(np.eye(3) * 1.01)
    np.testing.assert_allclose(rotation.nearest(np.eye(3) * 1.01), np.eye(3), atol=1e-12)


def test_euler_angles_turn_about_moving_axes():
    a, b, c = 0.3, -0.5, 0.9
    expected = rotation.about("z", a) @ rotation.about("y", b) @ rotation.about("x", c)
    np.testing.assert_allclose(rotation.from_euler("zyx", [a, b, c]), expected, atol=1e-12)
