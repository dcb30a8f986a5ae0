"""Drift: an unchanged machine is left in peace at the stated rate, a changed joint, mass or scale is named with its factor."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.io import read_machine
from toolpoint.machine import assemble
from toolpoint.machine.assembly.joint_terms import stiffness_of_joint
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies import Repeatability, study_drift
from toolpoint.studies.drift.mode_changes import compare_modes, pool_baselines
from toolpoint.vibration import Modes, eigen

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
POINTS = ("tip", "work", "nose")


@pytest.fixture(scope="module")
def mill(tmp_path_factory):
    file = tmp_path_factory.mktemp("drift") / "mill.yaml"
    main(["new", "machine", str(file), "--template", "three-axis-vertical"])
    return read_machine(file)


def measured(machine, count=20, noise=1e-4):
    """Return the lowest modes of a machine at three points, with the intervals of a good test."""
    dofs = [f"{point}:+{way}" for point in POINTS for way in "xyz"]
    modes = eigen.solve_undamped(replace(assemble(machine, outputs=dofs), damping=None)).selected(range(count))
    covariance = np.array([np.diag([(noise * f) ** 2, 1e-6]) for f in modes.frequency])
    return Modes(modes.frequency, np.full(count, 0.03), modes.shape, modes.dofs, covariance=covariance)


@cache
def study_of(machine, joint):
    """Drift of a joint that lost a fifth of its stiffness; asked by several tests."""
    return study_drift(measured(machine), [measured(softer(machine, joint, 0.8))], machine)


def softer(machine, joint, factor, ways=None):
    stiffness = machine.description.joints[joint].stiffness
    return machine.with_values({f"joints.{joint}.stiffness.{way}": factor * stiffness[way] for way in ways or stiffness})


def test_joints_add_up_to_the_stiffness(mill):
    place = place_machine(mill, {"X": 0.2, "Z": -0.1})
    total = sum(stiffness_of_joint(place, name) for name in mill.joint_names)
    stiffness = assemble(mill, {"X": 0.2, "Z": -0.1}).stiffness
    assert np.abs(total - stiffness).max() <= 1e-12 * np.abs(stiffness).max()


@pytest.mark.parametrize("name", ["hexapod_6_ups.yaml", "three_rps_head.yaml"])
def test_directions_of_a_joint_in_a_loop_add_up_to_it(name):
    place = place_machine(read_machine(MACHINES / name))
    names = (*place.machine.joint_names, *(loop.name for loop in place.machine.loops))
    for joint in names:
        parts = sum(stiffness_of_joint(place, joint, way) for way in range(6))
        assert np.allclose(parts, stiffness_of_joint(place, joint), atol=1e-9)


@pytest.mark.parametrize("joint", ["feet", *(pytest.param(name, marks=pytest.mark.slow) for name in (
    "bearings", "guide_y", "guide_x", "column_foot", "guide_z"))])
def test_a_softer_joint_is_named_with_its_factor(mill, joint):
    study = study_of(mill, joint)
    assert study.has_changed and study.parts[0][0] == f"joint {joint}"
    assert study.explanations[0].interval[0] <= 0.8 <= study.explanations[0].interval[1]
    # A tenth of the change is left open for the machine's own errors, which all modes share.
    lower, upper = study.explanations[0].interval
    assert np.log(upper / lower) / 2 > 1.9 * 0.1 * abs(np.log(0.8))
    assert study.explanations[0].fits and not any("no single change" in doubt for doubt in study.doubts)


def test_one_direction_is_named(mill):
    study = study_drift(measured(mill), [measured(softer(mill, "guide_y", 0.75, ["y"]))], mill)
    best = study.explanations[0]
    assert (best.part, best.direction) == ("joint guide_y", "y") and best.interval[0] <= 0.75 <= best.interval[1]
    # A sum over directions is said to be one, beside what the table gives for the likeliest of them.
    rows = (replace(best, probability=0.93), replace(best, direction="rx", probability=0.03), *study.explanations[1:])
    rows = tuple(replace(row, probability=0.0) if k > 1 else row for k, row in enumerate(rows))
    said = replace(study, explanations=rows).status
    assert "joint guide_y, with a probability of 96 % for all its directions together; 93 % belong to joint guide_y in" in said
    alone = replace(study, explanations=(replace(best, probability=0.96),)).status
    assert "with a probability of 96 %." in alone and "together" not in alone


def test_a_spring_that_no_measured_point_sees_keeps_its_stiffness(mill):
    study = study_of(mill, "feet")
    unseen = next(each for each in study.explanations if (each.part, each.direction) == ("joint bearings", "rz"))
    assert unseen.factor == pytest.approx(1.0, abs=0.1) and unseen.interval[0] < 0.7


@pytest.mark.slow
def test_a_workpiece_is_no_joint(mill):
    heavier = mill.with_values({"bodies.table.mass": 350.0 * 1.25})
    study = study_drift(measured(mill), [measured(heavier)], mill)
    assert study.parts[0][0] == "mass of table"


@pytest.mark.slow
def test_all_frequencies_alike_are_no_joint(mill):
    later = measured(mill)
    study = study_drift(measured(mill), [replace(later, frequency=0.988 * later.frequency)], mill)
    assert study.parts[0][0] == "all frequencies"
    assert study.explanations[0].factor == pytest.approx(0.988, abs=2e-3)


@pytest.mark.slow
def test_two_changes_are_named_together(mill):
    changed = softer(softer(mill, "feet", 0.7), "guide_z", 0.8)
    study = study_drift(measured(mill), [measured(changed)], mill)
    best = study.explanations[0]
    factors = dict(zip(best.part.split(" and "), (best.factor, best.second[0]), strict=True))
    assert factors == pytest.approx({"joint feet": 0.7, "joint guide_z": 0.8}, abs=0.02)
    assert study.parts[0] == (best.part, pytest.approx(0.95, abs=0.05)) and " and " in best.change_text


@pytest.mark.slow
def test_three_changes_are_explained_by_no_pair(mill):
    changed = softer(softer(softer(mill, "feet", 0.7), "guide_z", 0.6), "bearings", 0.6)
    study = study_drift(measured(mill), [measured(changed)], mill)
    assert any("no single change and no pair" in doubt for doubt in study.doubts)
    assert "no pair of parts explains it" in study.status and "Likeliest" not in study.status


def test_unchanged_machines_are_called_changed_as_often_as_stated():
    rng, count, alarms = np.random.default_rng(5), 400, 0
    shape = rng.normal(size=(6, 5))
    dofs = [f"{i}:+x" for i in range(6)]
    frequency, noise = np.linspace(20.0, 90.0, 5), 5e-4
    covariance = np.array([np.diag([(noise * f) ** 2, 1e-6]) for f in frequency])

    def test(scatter):
        return Modes(frequency * np.exp(scatter * rng.normal(size=5)), np.full(5, 0.02), shape, dofs, covariance=covariance)

    for _ in range(count):
        # Each test has its own noise; the repeatability is of the difference of two.
        first, second = (test(np.hypot(noise, 1e-3 / np.sqrt(2))) for _ in range(2))
        alarms += study_drift(first, [second], repeatability=Repeatability(1e-3), false_alarms=0.05).has_changed
    assert binom.ppf(0.0005, count, 0.05) <= alarms <= binom.ppf(0.9995, count, 0.05)


def test_a_change_that_is_called_detectable_is_seen_in_19_of_20_tests():
    rng, count, seen = np.random.default_rng(9), 400, 0
    first = Modes(np.linspace(20.0, 90.0, 7), 0.01, np.eye(7), [f"{i}:+x" for i in range(7)])
    size = compare_modes(first, first, Repeatability(1e-3)).detectable_change(0.01)
    for _ in range(count):
        moved = 1e-3 * rng.normal(size=7) + size * (np.arange(7) == 3)
        second = replace(first, frequency=first.frequency * np.exp(moved))
        seen += compare_modes(first, second, Repeatability(1e-3)).probability < 0.01
    assert binom.ppf(0.0005, count, 0.95) <= seen <= binom.ppf(0.9995, count, 0.95)


def test_named_modes_follow_holm():
    # 2.42 deviations have the probability 0.0155: within 0.05 / 3, which is what the second of four has, and beyond 0.05 / 4;
    # 2.1 deviations (0.036) are beyond 0.05 / 2 of the third.
    first = Modes([20.0, 40.0, 60.0, 80.0], 0.01, np.eye(4), [f"{i}:+x" for i in range(4)])
    moved = np.array([0.0, 2.42, 2.1, 5.0]) * 1e-3
    second = replace(first, frequency=first.frequency * np.exp(moved))
    changes = compare_modes(first, second, Repeatability(1e-3))
    assert changes.significant(0.05).tolist() == [1, 3]
    assert changes.scores == pytest.approx([0.0, 2.42, 2.1, 5.0])


def test_baselines_that_scatter_raise_the_repeatability_and_none_lowers_it():
    rng = np.random.default_rng(1)
    first = Modes(np.linspace(20.0, 90.0, 8), 0.01, np.eye(8), [f"{i}:+x" for i in range(8)])

    def repeated(scatter):
        return [replace(first, frequency=first.frequency * np.exp(scatter * rng.normal(size=8))) for _ in range(4)]

    pooled, repeat, raised = pool_baselines(repeated(5e-3), Repeatability(1e-3))
    # The difference of two tests that scatter by 0.5 % each has 0.71 %.
    assert raised and repeat.frequency == pytest.approx(7.1e-3, rel=0.35)
    assert np.abs(pooled.frequency / first.frequency - 1).max() < 0.01
    assert pool_baselines(repeated(1e-4), Repeatability(1e-3))[1:] == (Repeatability(1e-3), False)


@pytest.mark.slow
def test_a_calibration_that_is_far_off_is_doubted(mill):
    model = softer(mill, "column_foot", 0.3)
    study = study_drift(measured(mill), [measured(softer(mill, "feet", 0.8))], model)
    assert any("off the baseline" in doubt for doubt in study.doubts)


def test_what_cannot_be_compared_is_refused(mill):
    first = measured(mill)
    other = replace(first, dofs=[f"{i}:+x" for i in range(9)])
    with pytest.raises(ToolpointError, match="share points and directions"):
        study_drift(first, [other])
    with pytest.raises(ToolpointError, match="at least one"):
        study_drift(first, [])
    renamed = replace(measured(softer(mill, "feet", 0.5)), dofs=other.dofs)
    with pytest.raises(ToolpointError, match="no point of it is measured"):
        study_drift(other, [renamed], mill)


def test_lost_modes_and_tests_without_intervals_are_doubted(mill):
    first = replace(measured(mill), covariance=None)
    study = study_drift(first, [first.selected([0, 1, 3, 4])])
    text = "\n".join(study.doubts)
    assert "state no intervals" in text and "does not show" in text and not study.has_changed


@pytest.mark.slow
def test_command(mill, tmp_path, capsys):
    io.write_machine(mill.description, tmp_path / "mill.yaml")
    for name, machine in (("jan", mill), ("feb", mill), ("mar", softer(mill, "feet", 0.8))):
        io.write_nouns(measured(machine), tmp_path / f"{name}.h5")
    folder = str(tmp_path)
    main(["drift", f"{folder}/feb.h5", f"{folder}/mar.h5", "--baseline", f"{folder}/jan.h5", "--machine", f"{folder}/mill.yaml",
          "-o", f"{folder}/page"])
    shown = capsys.readouterr().out
    assert "The machine has changed" in shown and "joint feet" in shown
    page = (tmp_path / "page/index.html").read_text(encoding="utf-8")
    assert "joint feet" in page and "History" in page
