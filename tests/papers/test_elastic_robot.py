"""B2: a six-axis robot with elastic joints, Denavit-Hartenberg lengths of a published milling robot."""

import numpy as np
import pytest

import elastic_robot
from toolpoint.machine import assemble
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.vibration import eigen


@pytest.fixture(scope="module")
def robot():
    return elastic_robot.robot()


def test_published_frequencies_at_zero(robot):
    found = eigen.solve_undamped(assemble(robot)).frequency[:4]
    np.testing.assert_allclose(found, elastic_robot.REFERENCE, rtol=1e-10)


@pytest.mark.parametrize("path", ["numpy", "compiled"])
def test_frequency_paths_agree_with_the_assembled_system(robot, path):
    rng = np.random.default_rng(0)
    poses = {f"q{i + 1}": rng.uniform(-2, 2, 70) for i in range(6)}
    found = natural_frequencies(robot, poses, 6, path=path)
    expected = eigen.solve_undamped(assemble(robot, poses), 6).frequency
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_turning_the_first_axis_changes_nothing_but_the_view(robot):
    # The ground has no preferred direction about z, and joint 1's two bending springs are equal.
    first = natural_frequencies(robot, {"q1": np.array([0.0]), "q2": np.array([0.4]), "q5": np.array([0.7])}, 18)
    second = natural_frequencies(robot, {"q1": np.array([1.1]), "q2": np.array([0.4]), "q5": np.array([0.7])}, 18)
    np.testing.assert_allclose(first, second, rtol=1e-9)
