"""A machine with its drives on, off and braked: what drives do not carry stays, stiff loops are brakes, slips are told."""

import json
from dataclasses import replace

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError, studies
from toolpoint.app.main import main
from toolpoint.io import read_drives, read_machine
from toolpoint.machine import assemble, build
from toolpoint.studies.servos.drive_structure import free_machine
from toolpoint.studies.servos.driven_responses import SPRINGS, build_structure
from toolpoint.vibration import frequency_response

MACHINE = MACHINES / "three_axis_vertical_drives.yaml"
DRIVES = MACHINES / "three_axis_vertical_servo_on_structure.yaml"
LINES = np.linspace(2.0, 400.0, 200)


@pytest.fixture(scope="module")
def result():
    return studies.study_driven_responses(read_machine(MACHINE), read_drives(DRIVES), frequency=LINES)


def test_the_structure_keeps_its_loss_factors_exactly():
    """The freed machine in modal coordinates with its structural damping, by the direct solution of its own matrices."""
    plain, drives = read_machine(MACHINE).description, read_drives(DRIVES)
    joints = {name: replace(joint, loss_factor=0.05) if joint.stiffness else joint for name, joint in plain.joints.items()}
    machine = build(replace(plain, joints=joints, damping_ratio=None))
    labels = ["tool:+x", "tool:+z"]
    structure, losses = build_structure(machine, drives, None, labels=labels)
    assert np.abs(losses).max() > 0
    system, names = structure.system, [structure.system.inputs.index(label) for label in labels]
    rows = [structure.system.outputs.index(label) for label in labels]
    states = [np.linalg.solve(2j * np.pi * f * np.eye(system.size) - system.a - losses, system.b[:, names]) for f in LINES]
    free, _, _ = free_machine(drives, machine)
    direct = frequency_response.direct(assemble(free, None, labels, inputs=labels), LINES).values
    assert system.c[rows] @ np.array(states) == pytest.approx(direct, rel=1e-6, abs=1e-9 * np.abs(direct).max())


def test_an_axis_that_is_off_is_free_and_one_that_is_braked_is_held_by_its_springs(result):
    lowest = {name: np.abs(frf.values[0, 0, 0]) for name, frf in result.frfs.items()}
    assert lowest["off"] > 20 * lowest["braked"]
    assert lowest["braked"] == pytest.approx(lowest[SPRINGS], rel=0.3)
    # A free mass: the response falls as the square of the frequency.
    off = np.abs(result.frfs["off"].values[:3, 0, 0]) * LINES[:3] ** 2
    assert off == pytest.approx(off[0], rel=0.2)


def test_responses_are_those_of_forces_and_motions_at_the_same_places(result):
    assert "shorted" not in result.frfs or len(result.frfs) == 5
    assert [str(dof) for dof in result.frfs["on"].outputs] == [f"tool-table:+{way}" for way in "xyz"]
    assert result.frfs["braked"].values[:, 0, 1] == pytest.approx(result.frfs["braked"].values[:, 1, 0], rel=1e-6, abs=1e-12)


def test_faults_are_told():
    machine, drives = read_machine(MACHINE), read_drives(DRIVES)
    with pytest.raises(ToolpointError, match="frequency: 0 Hz; must be above 0"):
        studies.study_driven_responses(machine, drives, frequency=[0.0, 10.0])
    with pytest.raises(ToolpointError, match="no axis of the drive file is a ball screw with 'ends'"):
        studies.study_driven_responses(machine, read_drives(MACHINES / "three_axis_vertical_servo.yaml"), frequency=LINES)


def test_the_command_tells_the_same(tmp_path, capsys, result):
    main(["frf", str(MACHINE), "--drives", str(DRIVES), "--lines", "2:400:200", "-o", str(tmp_path / "page"), "--json",
          "--save", str(tmp_path / "on.h5")])
    data = json.loads(capsys.readouterr().out)
    assert data["status"] == result.status and set(data["states"]) == set(result.frfs)
    assert (tmp_path / "page" / "index.html").exists() and (tmp_path / "on.h5").exists()
