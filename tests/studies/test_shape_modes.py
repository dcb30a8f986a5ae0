"""Errors of shapes at places of bodies: common to a body, so more places of it tell no more."""

import numpy as np
import pytest

from toolpoint.studies.video.shape_modes import body_covariance, body_modes
from toolpoint.vibration import Modes
from toolpoint.vision.clip import Region
from toolpoint.vision.modes.bodies import BodyMotion
from toolpoint.vision.view import View

VIEW = View("+x", "-z", 1e-3, (50.0, 50.0))
POLES = Modes([30.0], [0.01], [[1.0]], ["1:+x"], "unscaled")


def body(covariance):
    """A body that moves to the right alone."""
    coefficients = np.zeros((1, 12), complex)
    coefficients[0, 0] = 0.4
    region = Region(10, 10, 80, 60)
    return BodyMotion("slide", region, ("rigid",), coefficients, covariance, np.eye(2)[None] / 2, np.ones(1), 20)


def places(count):
    rng = np.random.default_rng(count)
    return {f"p{k}": ("slide", np.array([x, 0.0, z])) for k, (x, z) in enumerate(rng.uniform(-0.03, 0.03, (count, 2)))}


def variance_of_translation(matrix):
    rows = np.tile([1.0, 0.0], len(matrix) // 2)
    return 1 / (rows @ np.linalg.solve(matrix, rows))


@pytest.mark.parametrize("spread", [0.0, 1e-4])
def test_more_places_of_a_rigid_body_tell_no_more_of_its_motion(spread):
    coefficients = np.zeros((1, 12, 12))
    coefficients[0, [0, 6], [0, 6]] = spread
    motion = body(coefficients)
    few, many = (variance_of_translation(body_covariance(POLES, [motion], VIEW, places=places(count), floor=0.005)[0])
                 for count in (4, 40))
    assert many / few == pytest.approx(1, rel=0.02)


def test_the_diagonal_is_the_variance_of_each_entry():
    rng = np.random.default_rng(2)
    root = rng.standard_normal((12, 12))
    motion = body((root @ root.T)[None] * 1e-6)
    joint = body_covariance(POLES, [motion], VIEW, places=places(5), floor=1e-12)[0]
    modes = body_modes(POLES, [motion], VIEW, places=places(5))
    assert np.diagonal(joint) / modes.shape_variance[:, 0] == pytest.approx(np.ones(10), rel=1e-6)
    assert np.linalg.matrix_rank(joint, tol=1e-12 * joint.max()) <= 10
