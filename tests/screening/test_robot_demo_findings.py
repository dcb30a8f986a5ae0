"""What the robot demo says of its source: numbers beside numbers, the largest effect first, no verdict by a threshold."""

from types import SimpleNamespace

import numpy as np
import pytest

from toolpoint.studies.screening.robot_demo import RobotDemo

LABELS = ("as it is", "stiffness of base +20 %", "stiffness of turret +20 %", "density of base -20 %",
          "reducer of axis 1 1:100", "reducer of axis 3 1:100", "reducer of axis 4 1:80", "reducer of axis 5 1:100",
          "reducer of axis 6 1:100", "support bearings axes 2 and 3")
CHANGES = np.array([0, -0.06, -0.04, 0, -3.5, -4.98, 0.2, -6.34, 0, -1.18])


@pytest.fixture
def demo():
    names = ("position error", "rotation error", "position error side 1", "position error side 2")

    def metric(name):
        return (1 + CHANGES / 100 * (1 if name == "position error" else 0.5))[None] * 7.9e-5

    screening = SimpleNamespace(design=SimpleNamespace(labels=LABELS), metrics=names, metric=metric, loads="errors: the cut")
    planned = SimpleNamespace(screening=screening, plan=SimpleNamespace(square=SimpleNamespace(sides=(1, 2))))
    return RobotDemo(*[None] * 7, planned, None)


def test_the_largest_effect_is_named_first_and_beside_the_sources(demo):
    first = demo.findings()[0]
    assert first.startswith("largest effect here: reducer of axis 5 1:100, -6.34 % of position and -3.17 % of rotation")
    assert "-13 %" in first and "axis 1 (-7.5 %)" in first


def test_a_disagreement_is_said_with_its_size(demo):
    lines = demo.findings()
    five = next(line for line in lines if "reducer of axis 5: rotation only" in line)
    assert "6.34 points outside the source's" in five and "contradicts the source" in five
    three = next(line for line in lines if "reducer of axis 3" in line and "finds" in line)
    assert "here -4.98 % (-2.49, -2.49 % by side), 0.72 points outside the source's: the next ratio's torsion" in three


def test_nothing_agrees_or_differs_by_a_threshold(demo):
    lines = demo.findings()
    assert not any(line.startswith(("agree", "differ")) for line in lines)
    assert all("%" in line for line in lines[:-1])
    inside = next(line for line in lines if "members 20 % stiffer" in line)
    assert "here -0.06 to -0.04 %, not outside the source's" in inside and inside.endswith("source's")
