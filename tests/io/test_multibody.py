"""Machines written for multibody programs: MuJoCo and Exudyn agree on modes where they are installed; what cannot be
written."""

import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.multibody import exudyn_script, mjcf
from toolpoint.io.multibody.links import tree_links
from toolpoint.io.yaml import machine_file
from toolpoint.machine.frequencies import natural_frequencies

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
POSE = {"q1": 0.3, "q2": 0.4, "q3": -0.2, "q4": 0.5, "q5": 0.6, "q6": 0.1}


@pytest.mark.parametrize("name", ["elastic_robot", "milling_robot"])
def test_mujoco_agrees_on_modes(tmp_path, name):
    mujoco = pytest.importorskip("mujoco")
    machine = machine_file.read(MACHINES / f"{name}.yaml")
    mjcf.write(machine, tmp_path / "m.xml", POSE)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, mass, data.qM)
    scale = np.diag(np.reshape(model.jnt_stiffness, (model.njnt, -1))[:, 0] ** -0.5)
    found = np.sort(1 / (2 * np.pi * np.sqrt(np.linalg.eigvalsh(scale @ mass @ scale))))
    np.testing.assert_allclose(found, natural_frequencies(machine, POSE, model.nv)[0], rtol=1e-8)


@pytest.mark.parametrize("name", ["elastic_robot", "milling_robot"])
def test_exudyn_agrees_on_modes(tmp_path, name):
    pytest.importorskip("exudyn")
    machine = machine_file.read(MACHINES / f"{name}.yaml")
    exudyn_script.write(machine, tmp_path / "m.py", POSE)
    done = subprocess.run([sys.executable, tmp_path / "m.py"], capture_output=True, text=True, check=True)
    found = np.array([float(word) for word in done.stdout.split()])
    np.testing.assert_allclose(found, natural_frequencies(machine, POSE, found.size)[0], rtol=1e-5)


def test_written_bodies_hold_the_whole_mass(tmp_path):
    machine = machine_file.read(MACHINES / "milling_robot.yaml")
    mjcf.write(machine, tmp_path / "m.xml")
    masses = [float(part.get("mass")) for part in ElementTree.parse(tmp_path / "m.xml").iter("inertial")]
    assert sum(masses) == pytest.approx(32.0) and len(masses) == len(machine.bodies)
    scope = {}
    exudyn_script.write(machine, tmp_path / "m.py")
    text = (tmp_path / "m.py").read_text()
    exec(text[text.index("links = ["):text.index("kinds, parents")], scope)
    # What is fixed to the ground is no link: the base's lower half.
    still = sum(link.properties.mass for link in tree_links(machine) if link.name in ("link0",))
    assert sum(row[4] for row in scope["links"]) <= 32.0 - still + 2.0
    assert len(scope["links"]) == machine.size


def test_loops_cannot_be_written(tmp_path):
    with pytest.raises(ToolpointError, match="tree of rigid bodies"):
        mjcf.write(machine_file.read(MACHINES / "gantry.yaml"), tmp_path / "m.xml")
