"""A robot from its datasheet: the source's tables recomputed, its weight, the forces on its base, and wrong files."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml import machine_file, robot_file
from toolpoint.machine import build
from toolpoint.machine.assembly.inverse_dynamics import base_reaction, inverse_dynamics
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.robot.gearing import compute_gearing, swap_reducer
from toolpoint.studies.robots.datasheet_study import study_datasheet

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
SHEET = MACHINES / "milling_robot_datasheet.yaml"


@pytest.fixture(scope="module")
def sheet():
    return robot_file.read(SHEET)


@pytest.fixture(scope="module")
def machine():
    return build(robot_file.read_robot_machine(SHEET))


def test_ratios_and_torques_follow_from_the_motor_table(sheet):
    rows = compute_gearing(sheet)
    # By hand: 6 n/w; 6000 rev/min but 4000 of axis 4. Reducer ratios and torques as the source's table 3 rounds them.
    np.testing.assert_allclose([row.total_ratio for row in rows], [80, 94.7368, 69.2308, 43.6364, 66.0550, 36], rtol=1e-5)
    assert [round(row.reducer_ratio) for row in rows] == [73, 95, 69, 48, 51, 51]
    assert [round(row.torque) for row in rows] == [96, 114, 45, 17, 15, 8]
    assert [round(100 * row.deviation) for row in rows[3:]] == [5, -8, -12]


def test_rows_of_table_3_that_do_not_follow_are_listed(sheet):
    listed = {row.axis: row.disagreements for row in compute_gearing(sheet) if row.disagreements}
    assert listed == {"q1": ("total ratio printed 75, follows 80",), "q2": ("total ratio printed 88, follows 94.74",),
                      "q4": ("total ratio printed 65, follows 43.64",)}


def test_nearest_reducers_of_the_catalogue_are_those_of_the_source(sheet):
    assert [row.nearest for row in compute_gearing(sheet)] == [row.reducer for row in compute_gearing(sheet)]


def test_the_robot_weighs_what_the_datasheet_says(machine):
    assert sum(body.mass[0, 0] for body in machine.bodies) == pytest.approx(32.0, rel=1e-12)


def test_base_reaction_at_rest_is_the_manual_s_weight(sheet, machine):
    result = study_datasheet(sheet, machine.description, finite_elements=False)
    assert result.still.vertical_force == pytest.approx(313.6, abs=1e-9)
    assert result.still.horizontal_force == pytest.approx(0, abs=1e-9)
    assert any("power-off" in line for line in result.differences)


def test_base_reaction_is_the_rate_of_momentum(machine):
    # The work of base and axes: a force along an axis of the first joint is that joint's own part of the reaction.
    rng = np.random.default_rng(3)
    pose = {f"q{i + 1}": float(v) for i, v in enumerate(rng.uniform(-1, 1, 6))}
    speed, rate = rng.uniform(-2, 2, 6), rng.uniform(-5, 5, 6)
    wrench = base_reaction(machine, pose, speed, acceleration=rate, gravity=(0, 0, -9.8))[0]
    torque = inverse_dynamics(machine, pose, speed, acceleration=rate, gravity=(0, 0, -9.8))[0]
    assert wrench[5] == pytest.approx(torque[0], rel=1e-12)  # axis 1 is the machine's z through the origin


def test_shipped_machine_is_that_of_the_datasheet(machine):
    shipped = machine_file.read(MACHINES / "milling_robot.yaml")
    poses = {"q2": np.array([0.0, 0.5]), "q3": np.array([0.0, 0.3])}
    np.testing.assert_allclose(natural_frequencies(shipped, poses, 18), natural_frequencies(machine, poses, 18), rtol=1e-10)


def test_example_file_of_the_reference_case():
    # Reference case B2 (18 degrees of freedom at q = 0), to its printed digits.
    expected = [21.977065251, 24.551560544, 50.868133852, 70.656469104]
    found = natural_frequencies(machine_file.read(MACHINES / "elastic_robot.yaml"), {}, 4)[0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=6e-10)


def test_reducer_of_another_ratio(sheet):
    assert compute_gearing(swap_reducer(sheet, "q1", "SHG-25-100"))[0].reducer == "SHG-25-100"
    with pytest.raises(ToolpointError, match="did you mean 'SHG-25-100'"):
        swap_reducer(sheet, "q1", "SHG-25_100")


@pytest.mark.parametrize(("old", "new", "words"), [
    ("reducer: SHG-25-80,", "reducer: SHG-25-81,", "did you mean 'SHG-25-80'"),
    ("SHG-25-80: {ratio: 80, torsion: [2.5e4], ", "SHG-25-80: {ratio: 80, ", "torsion: missing"),
    ("lower: -180 deg, upper: 180 deg", "lower: 180 deg, upper: -180 deg", "reversed"),
    ("weight: 25 kg", "weight: 9 kg", "must be above that of motors"),
    ("source: chosen}\n  turret", "source: guessed}\n  turret", "published, computed or chosen"),
    ("stage: 1.1", "stge: 1.1", "did you mean 'stage'"),
    ('motor: "0.4/4000"', 'motor: "0.4/6000"', "no motor '0.4/6000'"),
])
def test_wrong_datasheets_name_the_fault(tmp_path, old, new, words):
    text = SHEET.read_text()
    assert old in text
    (tmp_path / "robot.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(ToolpointError, match=words):
        robot_file.read_robot_machine(tmp_path / "robot.yaml")
