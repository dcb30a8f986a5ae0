"""Branches of arms: their names change at singular poses only, what may be asked of them, and segments that stay on one."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.io.yaml import machine_file, robot_file
from toolpoint.kinematics.arms.branch_choice import BRANCHES, BranchChoice
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow, arm_chain
from toolpoint.kinematics.arms.spherical_wrist import SphericalWrist
from toolpoint.machine import build
from toolpoint.machine.pose.tool_pose import tool_place
from toolpoint.machine.robot.model import rigid_members, robot_machine
from toolpoint.studies.machines.branch_words import name_branches
from toolpoint.studies.machines.pose_map import pose_map
from toolpoint.studies.machines.reach import MAX_AXIS_STEP, branch_names, reach_places
from toolpoint.studies.robots.reach_study import study_reach
from toolpoint.studies.robots.regions import search_regions
from toolpoint.studies.robots.segment_poses import FOLLOWING_STEP

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"


def random_arm(rng):
    """An arm of six joints with a spherical wrist: random lengths, offsets and angles at rest."""
    def about():
        return float(rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(-3, 3)]))

    quarter = np.pi / 2
    return SphericalWrist.of(arm_chain([
        ArmRow("q1", about(), rng.uniform(0, 0.5), rng.uniform(0, 0.3), rng.choice([-1, 1]) * quarter),
        ArmRow("q2", about(), rng.choice([0.0, 0.1]), rng.uniform(0.2, 0.8), rng.choice([0.0, np.pi])),
        ArmRow("q3", about(), 0.0, rng.uniform(0, 0.2), rng.choice([-1, 1]) * quarter),
        ArmRow("q4", about(), rng.uniform(0.2, 0.8), 0.0, quarter), ArmRow("q5", about(), 0.0, 0.0, -quarter),
        ArmRow("q6", about(), 0.1, 0.0, 0.0)]))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_names_are_those_of_the_inverse_and_change_at_singular_poses_only(seed):
    """Two branches of one name, or a name that changes along a path away from singular poses, would be a jump."""
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    q = rng.uniform(-2.5, 2.5, 6)
    branches = arm.inverse(arm.forward(q))
    assert len({each.name for each in branches}) == len(branches)
    assert all(arm.branch_name(each.positions) == each.name for each in branches)
    way = rng.normal(size=6)
    path = q + np.linspace(0, 1, 400)[:, None] * way
    moved = arm.forward(path)
    names = [arm.branch_name(row) for row in path]
    for i in np.flatnonzero([a != b for a, b in pairwise(names)]):
        # At a change two solutions meet: near it there is another branch hardly any joint away.
        near = arm.inverse(moved[i])
        apart = sorted(float(np.abs(np.angle(np.exp(1j * (each.positions - path[i])))).max()) for each in near)
        other = [float(np.abs(np.angle(np.exp(1j * (each.positions[:3] - path[i, :3])))).max()) for each in near
                 if each.name != names[i]]
        straight = any("singular" in each.note for each in near) or abs(np.sin(path[i, 4])) < 0.05 or min(
            abs(np.sin(each.positions[4])) for each in near) < 0.05
        assert apart[0] < 1e-6 and (min(other, default=0.0) < 0.35 or straight)


def test_the_elbow_keeps_its_name_where_the_wrist_passes_over_the_shoulder():
    """Above the line from shoulder to wrist turns into below there, though no axis turns round and no pose is singular."""
    quarter = np.pi / 2
    arm = SphericalWrist.of(arm_chain([
        ArmRow("q1", 0, 0.3, 0.2, -quarter), ArmRow("q2", -quarter, 0, 0.5), ArmRow("q3", 0, 0, 0.05, -quarter),
        ArmRow("q4", 0, 0.5, 0, quarter), ArmRow("q5", 0, 0, 0, -quarter), ArmRow("q6", 0, 0.1)]))
    names = [arm.branch_name(np.array([0.2, second, -2.0, 0.3, 0.8, 0.1])) for second in np.linspace(-0.6, 1.0, 200)]
    fronts = {name for name in names if name.startswith("front")}
    assert len(fronts) == 1 and len(set(names)) <= 2


@pytest.mark.parametrize(("text", "allowed"), [
    ("", 8), ("front", 4), ("elbow up", 4), ("front, elbow up", 2), ("Front up no flip", 1), ("back down flip", 1),
    ("front, elbow up, wrist turned least", 2), ("no flip", 4), ("flip", 4)])
def test_some_words_choose_some_branches(text, allowed):
    choice = BranchChoice.parsed(text)
    assert sum(choice.allows(name) for name in BRANCHES) == allowed and choice.is_least == ("least" in text)


@pytest.mark.parametrize("text", ["nonsense", "front back", "up down", "flip no flip", "elbow", "front sideways", "no"])
def test_other_words_are_refused_with_the_branches_there_are(text):
    with pytest.raises(ToolpointError, match="must be of front up no flip, front up flip, front down") as error:
        BranchChoice.parsed(text)
    assert "wrist turned least" in str(error.value)


@pytest.fixture(scope="module")
def sheet():
    return rigid_members(robot_file.read(MACHINES / "milling_robot_datasheet.yaml"))


@pytest.fixture(scope="module")
def robot(sheet):
    return build(robot_machine(sheet))


@pytest.mark.parametrize("command", ["reach --tip 690mm,20mm,100mm", "region --along y=-50mm:50mm:2 --origin 690mm,0,100mm",
                                     "accuracy --line 690mm,0,100mm --line 690mm,9mm,100mm --speed 15000 --depth 0.1"])
def test_a_branch_of_other_words_ends_every_command(command, capsys):
    name, *options = command.split()
    with pytest.raises(SystemExit) as end:
        main([name, str(MACHINES / "milling_robot.yaml"), *options, "--branch", "nonsense"])
    error = capsys.readouterr().err
    assert end.value.code == 2 and "--branch: 'nonsense'" in error and "back down flip" in error


def test_a_machine_without_branches_refuses_one(capsys):
    for options in (["reach", "--tip", "0,0,0"], ["region", "--along", "x=0:0.1:2"]):
        with pytest.raises(SystemExit):
            main([options[0], str(MACHINES / "gantry.yaml"), *options[1:], "--branch", "front up no flip"])
        assert "six turning joints" in capsys.readouterr().err


def test_the_wrist_turned_least_is_the_least_of_the_branches(robot):
    for place in ([0.6, -0.1, 0.2],):
        names = [name for name in branch_names(robot, place, [-1, 0.3, 0.5], turn=2.0) if name.startswith("front up")]
        turns = {name: np.linalg.norm([reach_places(robot, [place], [-1, 0.3, 0.5], turn=2.0, branch=name).poses[0][axis]
                                       for axis in ("q4", "q5", "q6")]) for name in names}
        least = reach_places(robot, [place], [-1, 0.3, 0.5], turn=2.0, branch="front, elbow up, wrist turned least")
        assert len(names) == 2 and least.branches[0] == min(turns, key=turns.get)
        (only,) = study_reach(robot, place, [-1, 0.3, 0.5], turn=2.0, branch="front up, wrist turned least").poses
        assert only.branch == least.branches[0]


def test_poses_have_the_name_under_which_they_were_reached(robot):
    places = np.array([[0.69, 0.02, 0.1], [0.6, -0.1, 0.2], [0.5, 0.1, 0.0]])
    for branch in ("front up no flip", "front down flip", "front"):
        reach = reach_places(robot, places, branch=branch)
        assert name_branches(robot, reach.batch()) == tuple(filter(None, reach.branches))
    mapped = pose_map(robot, {"q5": [-0.5, 0.5]}, 2)
    assert len(set(mapped.branches)) == 2 and "branches of the arm: " in mapped.table()


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10**6))
def test_a_segment_stays_on_one_branch_and_no_axis_jumps(sheet, seed):
    """Along every segment of random arms: one name, each sample reached, and joints bounded between its followed places."""
    rng = np.random.default_rng(seed)
    axes = tuple(replace(axis, d=axis.d * rng.uniform(0.6, 1.5), a=axis.a * rng.uniform(0.6, 1.5)) for axis in sheet.axes)
    machine = build(robot_machine(replace(sheet, axes=axes, reach=None)))
    middle = np.array([rng.uniform(0.3, 0.8), rng.uniform(-0.2, 0.2), rng.uniform(-0.1, 0.4)])
    starts = middle + rng.uniform(-0.1, 0.1, (3, 3))
    direction, turn = rng.normal(size=3), rng.uniform(-3, 3)
    branch = str(rng.choice(["", "front", "elbow up, wrist turned least"]))
    try:
        search = search_regions(machine, starts, rng.normal(size=(2, 3)), length=0.15, samples=4, direction=direction,
                                turn=turn, branch=branch)
    except ToolpointError:
        assume(False)
    for each in search.regions:
        batch = {name: np.array([pose[name] for pose in each.poses]) for name in each.poses[0]}
        assert set(name_branches(machine, batch)) == {each.branch} and BranchChoice.parsed(branch).allows(each.branch)
        tips = tool_place(machine, batch)[0]
        np.testing.assert_allclose(tips, np.linspace(each.start, each.end, 4), atol=1e-9)
        parts = np.ceil(0.05 / FOLLOWING_STEP)
        assert max(np.abs(np.diff(v)).max() for v in batch.values()) <= MAX_AXIS_STEP * parts + 1e-9


def test_the_shipped_robot_has_no_even_segment_across_branches():
    machine = machine_file.read(MACHINES / "milling_robot.yaml")
    starts = [[0.45, y, z] for y in (-0.1, 0.0) for z in (0.0, 0.2)]
    search = search_regions(machine, starts, [[0, 1, 0], [1, 0, 0]], length=0.2)
    assert all(each.branch in BRANCHES for each in search.regions) and "branch" in search.table()
    assert search.to_dict()["regions"][0]["branch"] == search.best.branch
