"""Conclusions over drawn assumptions, and the springs of a tree: counts by a law, compliance against the assembled system."""

from importlib import resources

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.studies import Factor, draw_conclusions, solve_modes, spring_ways
from toolpoint.studies.machines.tool_point import tool_point


@pytest.fixture(scope="module")
def vertical():
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_axis_vertical.yaml") as path:
        return read_machine(path)


@pytest.fixture(scope="module")
def robot():
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "milling_robot.yaml") as path:
        return read_machine(path)


def test_a_conclusion_holds_as_often_as_its_law_says(vertical):
    """All frequencies go with the root of all stiffnesses: drawn evenly in their logarithm from 1/2 to 2, half lie above."""
    now = solve_modes(vertical, None, 1).frequency[0]

    def judge(machine):
        first = solve_modes(machine, None, 1).frequency[0]
        return {"higher": first > now, "moves": first > 0, "falls": first < 0}

    drawn = draw_conclusions(vertical, [Factor("springs", ("joints.*.stiffness.*",), 0.5, 2.0)], judge, draws=60,
                             rng=np.random.default_rng(2))
    assert np.array_equal(drawn.held[:, 0], drawn.levels[:, 0] > 1)
    assert 15 < drawn.count("higher") < 45 and drawn.decisive("higher")[1] > 0.8
    assert drawn.words("moves") == "holds for every value drawn (60 of 60)"
    assert drawn.words("falls") == "holds for no value drawn (0 of 60)" and drawn.decisive("falls") == ("", 0.0)
    assert drawn.summary()["by_higher"].startswith("goes most with springs, correlation +0.8")
    assert "some values" in drawn.table() and drawn.to_dict()["draws"] == 60


def test_a_draw_that_cannot_be_judged_is_kept_with_its_reason(vertical):
    def judge(machine):
        if machine.value("bodies.base.mass") > 5504:
            raise ToolpointError("base: too heavy")
        return {"light": True}

    factors = [Factor("base", ("bodies.base.mass",), 0.5, 2.0)]
    drawn = draw_conclusions(vertical, factors, judge, draws=20, rng=np.random.default_rng(1))
    assert 0 < len(drawn.failures) < 20 and drawn.count("light") + len(drawn.failures) == 20
    assert "could not be judged, the first: base: too heavy" in drawn.table()
    with pytest.raises(ToolpointError, match="none of 5 could be judged"):
        draw_conclusions(vertical, [Factor("base", ("bodies.base.mass",), 1.5, 2.0)], judge, draws=5,
                         rng=np.random.default_rng(1))


def test_springs_of_a_tree_give_its_static_compliance(robot):
    """Against the response at 0 Hz (a sum over damped modes: to 1e-5), and of another stiffness against another machine."""
    pose = {"q2": 0.3, "q3": -0.5, "q5": 0.6}
    springs = spring_ways(robot, [pose], "tip")
    force = np.array([[3.0, -2.0, 5.0]])

    def static(machine):
        study = tool_point(machine, [pose], np.array([0.0, 1.0]))
        return study.axes[0] @ study.frf.values[0, 0].real @ study.axes[0].T @ force[0]

    np.testing.assert_allclose(springs.moved(force)[0, :3], static(robot), rtol=1e-5)
    changed = robot.with_values({"joints.joint_q3.stiffness.rz": 2.6e4})
    new = springs.stiffness * springs.factors({"joint_q3.rz": 2.0})
    np.testing.assert_allclose(springs.moved(force, new)[0, :3], static(changed), rtol=1e-5)


def test_a_point_moved_along_its_body_moves_by_its_turn(robot):
    springs = spring_ways(robot, [{}], "tip")
    flange = spring_ways(robot, [{}], "flange")
    np.testing.assert_allclose(springs.shifted((-0.2, 0, 0)).way, flange.way, atol=1e-12)


def test_springs_that_are_not_there_and_springs_that_are_coupled_are_refused(robot):
    springs = spring_ways(robot, [{}], "tip")
    with pytest.raises(ToolpointError, match="by_start: 'joint_q9'"):
        springs.factors({"joint_q9": 2.0})
    with resources.as_file(resources.files("toolpoint.app") / "machines" / "three_rps_head.yaml") as path:
        head = read_machine(path)
    with pytest.raises(ToolpointError, match="must be a tree of springs"):
        spring_ways(head, [{}], "tip")
