"""`modal_damping` of a machine file: modes damped one by one at every pose, with real shapes."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.machine import assemble, build
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.vibration import eigen

LOSS = (0.02, 0.05, 0.08, 0.11)


@pytest.fixture(scope="module")
def described(tmp_path_factory):
    path = tmp_path_factory.mktemp("machine") / "mill.yaml"
    io.write_template(path, "machine", "three-axis-vertical")
    machine = io.read_machine(path).description
    joints = {name: replace(joint, loss_factor=loss, damping={})
              for (name, joint), loss in zip(machine.joints.items(), LOSS * 3, strict=False)}
    return replace(machine, joints=joints, damping_ratio=None, identified=None, reference=())


def poles(machine, pose):
    modes = eigen.solve_damped(assemble(machine, pose, ["nose:+x", "nose:+y", "nose:+z"]))
    return modes


def test_energy_gives_each_mode_its_joints_share(described):
    machine, coupled = build(replace(described, modal_damping="energy")), build(described)
    for pose in ({}, {"X": 0.1}):
        system = assemble(coupled, pose, ["nose:+x"])
        undamped = eigen.solve_undamped(system)  # ratios by energy
        modes = poles(machine, pose)
        moving = undamped.frequency > 1.0
        np.testing.assert_allclose(modes.frequency[moving], undamped.frequency[moving], rtol=1e-9)
        np.testing.assert_allclose(modes.damping_ratio[moving], undamped.damping_ratio[moving], rtol=1e-6)
        turned = modes.shape * np.exp(-0.5j * np.angle((modes.shape**2).sum(axis=0)))
        assert np.abs(turned.imag).max() < 1e-6 * np.abs(turned).max()


def test_stated_ratios_are_those_of_the_modes_at_the_reference_pose(described):
    count = build(described).size
    ratios = tuple(np.linspace(0.01, 0.05, count).tolist())
    machine = build(replace(described, modal_damping=ratios))
    modes = poles(machine, None)
    moving = modes.frequency > 1.0
    np.testing.assert_allclose(modes.damping_ratio[moving], np.array(ratios)[moving], rtol=1e-6)
    np.testing.assert_allclose(solve_modes(machine, None, count).damping_ratio[moving], np.array(ratios)[moving], rtol=1e-6)


def test_equal_ratios_are_one_damping_ratio_at_every_pose(described):
    count = build(described).size
    lossless = replace(described, joints={name: replace(joint, loss_factor=0.0) for name, joint in described.joints.items()})
    many, one = build(replace(lossless, modal_damping=(0.03,) * count)), build(replace(lossless, damping_ratio=0.03))
    for pose in ({}, {"X": 0.1}):
        np.testing.assert_allclose(poles(many, pose).damping_ratio, poles(one, pose).damping_ratio, rtol=1e-6, atol=1e-9)


def test_the_key_is_read_written_and_refused_beside_one_ratio(described, tmp_path):
    path = tmp_path / "machine.yaml"
    for law in ("energy", (0.01, 0.02)):
        io.write_machine(replace(described, modal_damping=law), path)
        assert io.read_machine(path).description.modal_damping == law
    io.write_machine(replace(described, modal_damping="energy", damping_ratio=0.02), path)
    with pytest.raises(ToolpointError, match="modal_damping"):
        io.read_machine(path)


def test_more_ratios_than_modes_are_refused(described):
    with pytest.raises(ToolpointError, match="no more"):
        assemble(build(replace(described, modal_damping=(0.01,) * 99)), None, ["nose:+x"])
