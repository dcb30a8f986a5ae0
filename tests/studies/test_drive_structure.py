"""Law: the structure of a servo has the damping that the machine's file states, coupled between modes."""

import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from toolpoint import ToolpointWarning
from toolpoint.drives.build import build_servo
from toolpoint.io import read_drives, read_machine, write_unit
from toolpoint.io.template_files import FOLDER
from toolpoint.machine import assemble, build
from toolpoint.studies.servos.drive_structure import free_machine, question_structure, structure_of
from toolpoint.studies.servos.servo_map import map_servo
from toolpoint.vibration import frequency_response

HERE = FOLDER.parents[1] / "app" / "machines"
LINES = np.linspace(5.0, 400.0, 300)


def random_mill(seed, kind):
    """Return the vertical mill with unequal losses of its joints in place of one ratio."""
    rng, mill = np.random.default_rng(seed), read_machine(HERE / "three_axis_vertical_drives.yaml").description
    joints = {}
    for name, joint in mill.joints.items():
        loss = float(rng.uniform(0.01, 0.15))
        dampers = {way: loss * k / (2 * np.pi * 60) for way, k in joint.stiffness.items() if k > 0}
        joints[name] = replace(joint, loss_factor=loss if kind == "loss" else 0.0, damping=dampers if kind == "dampers" else {})
    return build(replace(mill, joints=joints, damping_ratio=None))


def responses(drives, machine):
    """Return the structure's response and the direct one of the freed machine, at the same labels."""
    structure = structure_of(drives, machine)
    free, ends, tools = free_machine(drives, machine)
    labels = list(dict.fromkeys([*ends.values(), *tools.values()]))
    system = assemble(free, None, labels, inputs=list(dict.fromkeys(ends.values())))
    a, b, c = structure.system.a, structure.system.b, structure.system.c[:len(labels)]
    s = 2j * np.pi * LINES[:, None, None]
    taken = c @ np.linalg.solve(s * np.eye(len(a)) - a, np.broadcast_to(b, (LINES.size, *b.shape)))
    return taken, frequency_response.direct(system, LINES).values


@pytest.fixture(scope="module")
def drives():
    return read_drives(HERE / "three_axis_vertical_servo_on_structure.yaml")


@pytest.mark.parametrize("seed", range(3))
def test_dampers_of_joints_are_exact(drives, seed):
    machine = random_mill(seed, "dampers")
    taken, exact = responses(drives, machine)
    assert np.abs(taken - exact).max() < 1e-8 * np.abs(exact).max()
    assert question_structure(drives, machine) == []


@pytest.mark.parametrize("seed", range(3))
def test_loss_factors_err_by_no_more_than_is_said(drives, seed):
    machine = random_mill(seed, "loss")
    taken, exact = responses(drives, machine)
    error = np.linalg.norm(taken - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    doubts = question_structure(drives, machine)
    assert len(doubts) == 1 and doubts[0].what == "structure"
    assert error.max() <= 1.05 * doubts[0].figure < 0.5


@pytest.mark.slow
def test_map_and_unit_show_the_same_doubt(drives, tmp_path):
    """The map (table and JSON) and the description of an exported unit hold what `drive` says of loss factors in time."""
    machine = random_mill(0, "loss")
    doubt = question_structure(drives, machine)[0]
    with pytest.warns(ToolpointWarning, match="stick-slip"):
        result = map_servo(drives, machine=machine, grid={"X": np.array([-0.1, 0.1])})
    assert result.structure_doubts and result.structure_doubts[0].what == "structure"
    assert result.table().startswith("doubt: structure: its loss factors") and result.to_dict()["doubts"][0].what == "structure"
    corners = [question_structure(drives, machine, {"X": x})[0].figure for x in (-0.1, 0.1)]
    assert result.structure_doubts[0].figure == max(corners)
    servo = build_servo(drives, structure_of(drives, machine), warn=False)
    write_unit(servo, tmp_path / "servo.fmu", "servo", binary=False, notes=[doubt])
    with zipfile.ZipFile(tmp_path / "servo.fmu") as unit:
        described = ElementTree.fromstring(unit.read("modelDescription.xml"))
    assert described.get("description") == f"doubt: {doubt}"
    with pytest.warns(ToolpointWarning, match="stick-slip"):
        exact = map_servo(drives, machine=random_mill(0, "dampers"), grid={"X": np.array([-0.1, 0.1])})
    assert exact.structure_doubts == ()


def test_one_ratio_for_all_modes_needs_no_word(drives):
    machine = read_machine(HERE / "three_axis_vertical_drives.yaml")
    taken, exact = responses(drives, machine)
    assert np.abs(taken - exact).max() < 1e-8 * np.abs(exact).max()
    assert question_structure(drives, machine) == []
