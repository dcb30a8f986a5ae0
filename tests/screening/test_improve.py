"""What to change: slopes against differences, goals met by the full model, the cheapest corner of a closed form, wrong
input."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.quantities.written import read_goal
from toolpoint.io.yaml import machine_file
from toolpoint.machine import build
from toolpoint.machine import description as d
from toolpoint.machine.description.variation import Factor
from toolpoint.studies.screening.answers import DepthLimit, PeriodicError, ResponsePeak
from toolpoint.studies.screening.improve import _AffineModel, improve

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
CUT = CuttingDescription.of(diameter=0.006, teeth=2, tangential=1780e6, normal=593e6, edge_tangential=9e3, edge_normal=7e3,
                            direction="down", immersion=0.5, feed_per_tooth=1e-5)
FACTORS = [Factor(f"torsion {i}", (f"joints.joint_q{i}.stiffness.rz",), 1.0, 2.0, cost=float(i)) for i in (1, 2, 3, 5)]


@pytest.fixture(scope="module")
def robot():
    return machine_file.read(MACHINES / "elastic_robot.yaml")


@pytest.mark.parametrize("answer", [ResponsePeak(static=True), ResponsePeak(), DepthLimit(CUT), PeriodicError(CUT, 15000,
                                                                                                              5e-4)])
@pytest.mark.default_cases(2)
def test_slopes_are_exact(robot, answer):
    factors = [*FACTORS, Factor("mass", ("bodies.link6.mass",), 0.5, 1.0)]
    model = _AffineModel.of(robot, factors, [{"q2": 0.2}])
    at = model.resting + np.array([0.3, 0.3, 0.3, 0.3, -0.3])

    def value(shares):
        values = answer.evaluate(model.at(shares)[0], None)[0]
        return values.min() if answer.rises else values.max()

    values, slopes = answer.evaluate(model.at(at)[0], model.slopes[0])
    row = slopes[values.argmin() if answer.rises else values.argmax()]
    differences = [(value(at + h) - value(at - h)) / 2e-4 for h in 1e-4 * np.eye(5)]
    np.testing.assert_allclose(row, differences, atol=1e-4 * np.abs(row).max())


def two_springs():
    """A mass on two springs in a row: compliance 1/k1 + 1/k2."""
    mass = d.BodyDescription(mass=1, inertia=d.InertiaDescription(1, 1, 1))
    joints = {"first": d.JointDescription("ground", "a", stiffness={"x": 1e6}),
              "second": d.JointDescription("a", "b", stiffness={"x": 2e6})}
    return build(d.MachineDescription("springs", {"a": mass, "b": mass}, joints,
                                      points={"tip": d.PointDescription("b")},
                                      tool="tip",
                                      damping_ratio=0.02))


def test_the_cheapest_change_is_that_of_the_closed_form():
    factors = [Factor("first", ("joints.first.stiffness.x",), 1.0, 3.0), Factor("second", ("joints.second.stiffness.x",), 1.0,
                                                                                3.0)]
    goal = 1.2e-6
    result = improve(two_springs(), factors, ResponsePeak(static=True), goal=goal)
    # Compliance 1/(k1 (1 + 2 x)) + 1/(k2 (1 + 2 y)), least x + y: both slopes are equal where both move.
    grid = np.linspace(0, 1, 2001)
    rest = 1 / (goal - 1e-6 / (1 + 2 * grid)) / 2e6  # what 1 + 2 y must be
    cost = np.where((rest >= 1) & (rest <= 3), grid + (rest - 1) / 2, np.inf)
    cost = np.minimum(cost, np.where((rest > 0) & (rest < 1), grid, np.inf))
    assert result.cost == pytest.approx(cost.min(), rel=5e-3)
    assert result.value <= goal and result.error < 1e-9


@pytest.mark.parametrize(("answer", "share"), [
    (ResponsePeak(static=True), 0.8), pytest.param(DepthLimit(CUT), 1.3, marks=pytest.mark.slow)])
def test_goals_are_met_by_the_full_model_and_no_single_change_does_better(robot, answer, share):
    before = improve(robot, FACTORS, answer, goal=1e-9 if answer.rises else 1.0).start_value
    result = improve(robot, FACTORS, answer, goal=share * before, doubts=[Factor("tool", ("bodies.link6.mass",), 0.9, 1.1)],
                     draws=4, rng=np.random.default_rng(1))
    sense = 1 if answer.rises else -1
    assert sense * (result.value - result.goal) >= 0
    assert sense * (result.value - result.best_single[1]) >= -3e-4 * abs(result.value)
    assert result.interval[0] <= result.interval[1] and "met" in result.status


def test_a_goal_out_of_reach_says_so(robot):
    result = improve(robot, FACTORS, ResponsePeak(static=True), goal=1e-9)
    assert result.status.startswith("the goal cannot be met") and result.value < result.start_value


def test_command(tmp_path, capsys):
    plan = tmp_path / "plan.yaml"
    plan.write_text(f"toolpoint: 1\nmachine: {MACHINES / 'elastic_robot.yaml'}\nmetrics: [frequency 1]\nfactors:\n"
                    "  - {name: torsion 2, paths: [joints.joint_q2.stiffness.rz], low: 1.0, high: 2.0}\n"
                    "  - {name: torsion 3, paths: [joints.joint_q3.stiffness.rz], low: 1.0, high: 2.0}\n")
    main(["improve", str(plan), "--answer", "static compliance", "--goal", "6.5um/N"])
    by_compliance = capsys.readouterr().out
    assert "the goal is met by the full model" in by_compliance and "to 6.5 µm/N" in by_compliance
    main(["improve", str(plan), "--answer", "static compliance", "--goal", f"{1 / 6.5:.12g}N/um"])
    assert capsys.readouterr().out == by_compliance


@pytest.mark.parametrize(("text", "answer", "words"), [
    ("6.5e-6", "static compliance", "of which unit"), ("8 N", "response peak", "stiffness"),
    ("0N/um", "response peak", "above"), ("2.5 kg", "depth limit", "length"), ("-3", "position error", "above zero")])
def test_a_goal_says_its_unit(text, answer, words):
    with pytest.raises(ToolpointError, match=words):
        read_goal(text, answer)


def test_what_is_not_affine_is_refused(robot):
    with pytest.raises(ToolpointError, match="affine"):
        improve(robot, [Factor("centre", ("bodies.link6.centre.0",), 0.001, 0.4, "set")], ResponsePeak(), goal=1.2e-4)
