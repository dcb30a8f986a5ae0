"""A robot from its datasheet: the source's tables recomputed, its weight, the forces on its base, and wrong files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml import machine_file, robot_file
from toolpoint.machine import build
from toolpoint.machine.assembly.inverse_dynamics import base_reaction, gravity_force, inverse_dynamics
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.robot.gearing import compute_gearing, swap_reducer
from toolpoint.machine.robot.model import gravity_loads, rigid_members, robot_machine
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
    assert [row.nearest_reducer for row in compute_gearing(sheet)] == [row.reducer for row in compute_gearing(sheet)]


def test_the_robot_weighs_what_the_datasheet_says(machine):
    assert sum(body.mass[0, 0] for body in machine.bodies) == pytest.approx(32.0, rel=1e-12)


@pytest.mark.slow
def test_base_reaction_at_rest_is_the_manual_s_weight(sheet, machine):
    result = study_datasheet(sheet, machine.description, finite_elements=False)
    assert result.rest_load.vertical_force == pytest.approx(313.6, abs=1e-9)
    assert result.rest_load.horizontal_force == pytest.approx(0, abs=1e-9)
    assert any("power-off" in line for line in result.differences)


def test_base_reaction_is_the_rate_of_momentum(machine):
    # The work of base and axes: a force along an axis of the first joint is that joint's own part of the reaction.
    rng = np.random.default_rng(3)
    pose = {f"q{i + 1}": float(v) for i, v in enumerate(rng.uniform(-1, 1, 6))}
    speed, rate = rng.uniform(-2, 2, 6), rng.uniform(-5, 5, 6)
    wrench = base_reaction(machine, pose, speed, acceleration=rate, gravity=(0, 0, -9.8))[0]
    torque = inverse_dynamics(machine, pose, speed, acceleration=rate, gravity=(0, 0, -9.8))[0]
    assert wrench[5] == pytest.approx(torque[0], rel=1e-12)  # axis 1 is the machine's z through the origin


@pytest.mark.parametrize("coupled", [True, False])
def test_gravity_s_load_on_the_reducers_is_the_virtual_work_of_the_weight(sheet, coupled):
    """The torque of an axis is the sum of its joints' by their factors; alone it is the joint's."""
    if not coupled:
        sheet = replace(sheet, axes=tuple(replace(axis, coupled={}) for axis in sheet.axes))
    arm = build(robot_machine(rigid_members(sheet)))
    pose = {f"q{i + 1}": v for i, v in enumerate([0.3, 0.5, -0.4, 0.7, 0.6, -0.2])}
    loads = gravity_loads(sheet, pose)
    axes = gravity_force(arm, pose, (0, 0, -sheet.gravity))[0]
    joints = np.array(list(loads.values()))
    joints[1] += joints[2] if coupled else 0.0  # axis 2 moves joint 3 too
    np.testing.assert_allclose(np.abs(joints), np.abs(axes), atol=1e-9)
    assert np.abs(joints[1:3]).min() > 5


@pytest.mark.slow
def test_torsion_of_several_slopes_is_taken_at_the_load(sheet):
    """Of two slopes the second holds where gravity is beyond the first; what is said is what stands in the machine."""
    part = replace(sheet.catalogue["SHG-25-100"], torsion=(1e4, 4e4), torques=(10.0,))
    sheet = replace(sheet, catalogue={**sheet.catalogue, "SHG-25-100": part})
    for pose, wanted in ((None, 4e4), ({"q2": 1.0}, 4e4), ({"q2": -0.5, "q3": -1.4}, 1e4)):
        made = robot_machine(sheet, pose=pose)
        load = abs(gravity_loads(sheet, pose)["q2"])
        assert made.joints["joint_q2"].stiffness["rz"] == wanted == part.linearise(load).stiffness
        assert any(f"q2 {wanted:.4g} N m/rad at {load:.3g} N m" in line for line in made.assumptions)
    assert robot_machine(sheet, loads={}).joints["joint_q2"].stiffness["rz"] == 1e4
    study = study_datasheet(sheet, robot_machine(sheet), finite_elements=False)
    assert any("with no load" in line and "-" in line for line in study.slopes)
    with pytest.raises(ToolpointError, match="no axis 'z'"):
        robot_machine(sheet, pose={"z": 1.0})


def test_a_reducer_without_a_size_leaves_the_weight_as_it_is(sheet):
    """Its mass has no shape to be in: the members carry it, and that is said."""
    part = replace(sheet.catalogue["SHG-25-100"], diameter=None)
    made = robot_machine(replace(sheet, catalogue={**sheet.catalogue, "SHG-25-100": part}))
    assert sum(body.mass[0, 0] for body in build(made).bodies) == pytest.approx(32.0, rel=1e-12)
    assert any("reducer of q2" in line and "members carry" in line for line in made.assumptions)


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
