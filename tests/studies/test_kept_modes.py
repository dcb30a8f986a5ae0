"""Machines with many, partly overdamped modes: which may go, and the exact first limits over poses of a robot."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cutting.cutting_cases import random_problem
from toolpoint.cutting import PanelArnoldi, ZeroOrder, stability
from toolpoint.cutting.cut.kept_modes import MAX_LEFT_OUT_GAIN, find_least_frequency, steepest_force
from toolpoint.io.yaml import machine_file
from toolpoint.studies.cuts.chatter_map import chatter_map
from toolpoint.studies.machines.reach import reach_places
from toolpoint.studies.machines.tool_point import first_loss_depth, lobes, milling_problem, pose_problem, tool_point

ROBOT = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot.yaml"
PLACES = np.array([[0.6, 0, 0.1], [0.35, 0, 0.3]])


@pytest.fixture(scope="module")
def robot():
    machine = machine_file.read(ROBOT)
    return machine, [dict(pose) for pose in reach_places(machine, PLACES).poses]


def test_modes_that_may_go_are_stable_by_themselves():
    """Small gain: a cut on the modes left out alone has no limit down to the depth asked for."""
    for seed in range(6):
        problem = random_problem(np.random.default_rng(seed), modes=20)
        plane = problem.plane
        frequency, gain = find_least_frequency(problem, 2e-3)
        rest = np.abs(plane.poles) > 2 * np.pi * frequency
        if not rest.any():
            continue
        assert 0 < gain < MAX_LEFT_OUT_GAIN
        alone = problem.changed(dynamics=replace(plane, poles=plane.poles[rest], residues=plane.residues[rest]))
        assert np.isinf(stability.chart(alone, np.linspace(4000, 15000, 5), PanelArnoldi(), depth_max=2e-3).limit).all()


def test_the_gain_is_that_of_the_modes_left_out():
    """One light mode above twelve others: 2 w K (largest response less the static one), in closed form at its resonance."""
    problem = random_problem(np.random.default_rng(3), modes=12)
    plane, pole = problem.plane, 2 * np.pi * 9000 * complex(-0.01, 1)
    stiff = 1e9
    residue = np.diag([1.0, 0.0]) * abs(pole) ** 2 / stiff / (2j * pole.imag)
    more = problem.changed(dynamics=replace(plane, poles=np.append(plane.poles, pole),
                                            residues=np.concatenate([plane.residues, residue[None]])))
    depth = 1e-4
    frequency, gain = find_least_frequency(more, depth)
    assert np.abs(plane.poles).max() < 2 * np.pi * frequency < abs(pole)
    # |1/(2 i zeta) - 1| / k, zeta 0.01
    assert gain == pytest.approx(2 * depth * steepest_force(problem) * abs(1 / 0.02j - 1) / stiff, rel=1e-3)
    assert find_least_frequency(problem, depth) == (np.inf, 0.0)


@pytest.mark.slow
def test_limits_of_a_robot_with_the_modes_that_count_are_those_with_all(robot):
    machine, poses = robot
    speeds = np.array([2500.0, 6000, 12000, 21000])
    for pose in poses:
        study = tool_point(machine, [pose])
        problem = pose_problem(study, machine.description.cutting, 0)
        every = milling_problem(machine.description.cutting, study.modes.at_pose(0), "tip:+x", y="tip:+y")
        assert every.plane.poles.size > problem.plane.poles.size + 20
        method, depth = PanelArnoldi(first_only=True, tolerance=1e-4), first_loss_depth(problem)
        kept, whole = (stability.chart(p, speeds, method, depth_max=depth).limit for p in (problem, every))
        np.testing.assert_allclose(kept, whole, rtol=5e-3)


@pytest.mark.slow
def test_robots_are_charted_by_the_exact_engine(robot):
    """Real poles of its reducers included; the single-frequency solution is off by some per cent."""
    machine, poses = robot
    speeds = np.array([3000.0, 8000])
    chart = lobes(tool_point(machine, poses[:1]), speeds=speeds)[0]
    assert chart.method == "PanelArnoldi" and chart.limit_error.max() < 1e-3 * chart.limit.max()
    assert any("cannot chatter by themselves" in note for note in chart.notes)
    result = chatter_map(machine, poses, speeds=speeds)
    assert result.limit[0, 0] == pytest.approx(chart.limit, rel=2e-3)
    single = chatter_map(machine, poses, speeds=speeds, method=ZeroOrder())
    finite = np.isfinite(single.limit)
    assert 0.01 < np.abs(single.limit[finite] / result.limit[finite] - 1).max() < 0.15


def test_a_root_beside_a_level_is_found_with_more_nodes(robot):
    """Few nodes call the level unstable, more do not: its bracket holds no root, and the stated error was as wide as it."""
    machine, _ = robot
    speed = np.linspace(2000, 24000, 200)[107:108]
    pose = reach_places(machine, [[-0.15, 0.0, 0.25]], point="wrist").poses[0]
    problem = pose_problem(tool_point(machine, [pose]), machine.description.cutting, 0)
    first, whole = (stability.chart(problem, speed, method, depth_max=first_loss_depth(problem)) for method in (
        PanelArnoldi(first_only=True, tolerance=1e-3), PanelArnoldi(levels=60)))
    assert first.limit_error[0] < 5e-3 * first.limit[0]
    assert abs(first.limit[0] - whole.limit[0]) <= first.limit_error[0] + whole.limit_error[0]
