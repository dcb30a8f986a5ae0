"""B2: a six-axis robot with elastic joints, Denavit-Hartenberg lengths of a published milling robot."""

import numpy as np
import pytest

from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.vibration import eigen

DEG = np.pi / 180
LINKS = [(0, 0, 0.15, -90), (-90, 0, 0.25, 180), (0, 0, 0.075, -90), (0, -0.29, 0, 90), (0, 0, 0, -90), (0, -0.08, 0, 180)]
MASSES = [12, 9, 7, 4, 2, 3]
CENTRES = [(-.06, .05, 0), (-.12, 0, -.05), (-.02, 0, -.02), (0, .12, 0), (0, 0, .01), (0, 0, .02)]
INERTIAS = [(.12, .11, .10), (.03, .09, .085), (.03, .035, .03), (.03, .01, .03), (.004,) * 3, (.006, .006, .004)]
SPRINGS = [(4e5, 1.2e5), (3e5, 1e5), (2e5, 6e4), (8e4, 2e4), (5e4, 1.2e4), (3e4, 8e3)]


def link(theta, d, a, alpha):
    return (tf.transform(rotation.about("z", theta * DEG), [0, 0, d])
            @ tf.transform(rotation.about("x", alpha * DEG), [a, 0, 0]))


def angles(r):
    """zyx Euler angles; at the singularity the last one is set to zero."""
    b = -np.arcsin(np.clip(r[2, 0], -1, 1))
    if abs(abs(r[2, 0]) - 1) < 1e-9:
        return np.arctan2(-r[0, 1], r[1, 1]), b, 0.0
    return np.arctan2(r[1, 0], r[0, 0]), b, np.arctan2(r[2, 1], r[2, 2])


def described(transform):
    return FrameDescription(tuple(transform[:3, 3]), tuple(map(float, angles(transform[:3, :3]))))


@pytest.fixture(scope="module")
def robot():
    bodies, joints, axes, place = {}, {}, {}, np.eye(4)
    for i in range(6):
        before, place = place, place @ link(*LINKS[i])
        bodies[f"link{i + 1}"] = BodyDescription(mass=MASSES[i], centre=CENTRES[i], inertia=InertiaDescription(*INERTIAS[i]),
                                                 frame=described(place))
        joints[f"joint{i + 1}"] = JointDescription(
            "ground" if i == 0 else f"link{i}", f"link{i + 1}", described(before),
            {"rx": SPRINGS[i][0], "ry": SPRINGS[i][0], "rz": SPRINGS[i][1]})
        axes[f"q{i + 1}"] = AxisDescription(f"joint{i + 1}", "rz")
    return build(MachineDescription("robot", bodies, joints, axes, {"flange": PointDescription("link6")}))


def test_published_frequencies_at_zero(robot):
    found = eigen.undamped(assemble(robot)).frequency[:4]
    np.testing.assert_allclose(found, [21.977065251, 24.551560544, 50.868133852, 70.656469104], rtol=1e-10)


@pytest.mark.parametrize("path", ["numpy", "compiled"])
def test_frequency_paths_agree_with_the_assembled_system(robot, path):
    rng = np.random.default_rng(0)
    poses = {f"q{i + 1}": rng.uniform(-2, 2, 70) for i in range(6)}
    found = natural_frequencies(robot, poses, 6, path)
    expected = eigen.undamped(assemble(robot, poses), 6).frequency
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_turning_the_first_axis_changes_nothing_but_the_view(robot):
    # The ground has no preferred direction about z, and joint 1's two bending springs are equal.
    first = natural_frequencies(robot, {"q1": np.array([0.0]), "q2": np.array([0.4]), "q5": np.array([0.7])}, 18)
    second = natural_frequencies(robot, {"q1": np.array([1.1]), "q2": np.array([0.4]), "q5": np.array([0.7])}, 18)
    np.testing.assert_allclose(first, second, rtol=1e-9)
