"""Points whose coordinates are stated with a deviation: several motions tell where they are, and what stays unknown is said."""

import numpy as np
import pytest

from toolpoint.joint_identification.motion.measured import Component
from toolpoint.joint_identification.motion.motion_errors import with_placed_errors
from toolpoint.joint_identification.motion.point_places import place_points
from toolpoint.spatial import transform as tf


def drawn(rng, *, points=8, modes=6, off=0.01, noise=1e-4, is_known=True):
    """Return a component with wrongly stated coordinates, its true twists and true places."""
    at = rng.uniform(-0.5, 0.5, (points, 3)) + rng.uniform(-1, 1, 3)
    owner, ways = np.repeat(np.arange(points), 3), np.tile(np.eye(3), (points, 1))
    twist = rng.normal(size=(6, modes))
    exact = np.einsum("ni,nij->nj", ways, tf.point_velocity(at[owner])) @ twist
    deviation = noise * np.sqrt((exact**2).mean(axis=0)) * np.ones_like(exact)
    stated = at + off * rng.normal(size=at.shape)
    rows = np.einsum("ni,nij->nj", ways, tf.point_velocity(stated[owner]))
    values = exact + deviation * rng.normal(size=exact.shape)
    part = Component("slide", tuple(range(points)), stated, rows, stated[owner], ways, owner, values,
                     deviation**2 if is_known else None)
    return part, twist, at


@pytest.mark.parametrize(("is_known", "least", "most"), [(True, 0.75, 1.1), (False, 0.6, 1.9)])
def test_the_covariance_of_all_twists_is_that_of_their_errors(is_known, least, most):
    rng, scores = np.random.default_rng(3), []
    for _ in range(12):
        part, twist, _ = drawn(rng, is_known=is_known)
        placed = place_points(part, 0.01)
        motion = with_placed_errors(placed, placed.motion, np.eye(6))
        error = (motion.twist - twist).T.ravel()
        scores.append(error @ np.linalg.solve(motion.full_covariance.reshape(36, 36), error) / 36)
    assert least < np.mean(scores) < most


def test_motions_tell_all_of_the_places_but_a_common_offset_and_scale():
    part, _, at = drawn(np.random.default_rng(4), points=20, modes=8, noise=1e-5)
    before, after = part.at - at, place_points(part, 0.01).part.at - at
    about = at - at.mean(axis=0)

    def told(error):
        error = error - error.mean(axis=0)
        return np.sqrt(((error - about * (error * about).sum() / (about**2).sum()) ** 2).mean())

    assert told(after) < 0.01 * told(before)
    assert np.linalg.norm(after.mean(axis=0) - before.mean(axis=0)) < 1e-3 * 0.01


def test_coordinates_worse_than_stated_are_taken_as_they_are():
    rng = np.random.default_rng(5)
    assert place_points(drawn(rng, off=0.03)[0], 0.005).deviation == pytest.approx(0.03, rel=0.4)
    assert place_points(drawn(rng, off=0.005)[0], 0.005).deviation == 0.005
