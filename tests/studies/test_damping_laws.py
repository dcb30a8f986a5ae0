"""`joints` tells laws of damping apart by evidence: real shapes, viscous joints, loss factors; damping is never clipped."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint import io, studies
from toolpoint.cutting.description import CuttingDescription
from toolpoint.studies.machines.tool_point import lobes, tool_point

DATA = Path(__file__).parents[2] / ".." / "shared" / "data" / "joint_damping"
LOSS = {"bed": 0.0247, "column": 0.0222, "head": 0.0541}
SPEEDS = np.array([272.0, 378.5, 485.0])
LIMITS = {0.0: (10.661e-3, 17.953e-3, 18.107e-3), -0.167: (9.763e-3, 16.313e-3, 16.164e-3)}


@pytest.fixture(scope="module")
def real_study():
    if not DATA.exists():
        pytest.skip("../shared/data/joint_damping is not here: a measured case that is not part of the project")
    test = DATA / "real_shapes.uff"
    saved, responses = io.read_test_nouns([test])
    modes, doubts = studies.modes_of_test(saved, responses)
    return studies.study_joints(modes, io.read_geometry(test), io.read_components(DATA / "real_shapes_parts.yaml"),
                                channel_doubts=doubts)


@pytest.mark.slow
def test_real_shapes_give_the_loss_factors_by_energy_and_no_doubt(real_study):
    law = real_study.joints.machine.law
    assert law.law == "energy"
    assert not real_study.doubts
    assert real_study.machine.modal_damping == "energy"
    assert law.note in real_study.table()
    assert real_study.to_dict()["damping"]["law"] == "energy"
    for joint in real_study.joints.joints:
        true = LOSS[joint.child]
        assert abs(joint.loss_factor - true) < max(3 * joint.loss_factor_deviation, 1e-3 * true)
        assert joint.loss_factor_deviation < 0.01 * true


@pytest.mark.slow
def test_limits_of_the_written_machine_are_those_of_the_true_one(real_study, tmp_path):
    io.write_machine(real_study.machine, tmp_path / "found.yaml")
    machine = io.read_machine(tmp_path / "found.yaml")
    cut = CuttingDescription.of(diameter=0.05, teeth=4, immersion=0.5, tangential=2e9, normal=8e8, speeds=(250.0, 500.0))
    for place, limits in LIMITS.items():
        chart = lobes(tool_point(machine, [{"X": place}]), cut, speeds=SPEEDS)[0]
        np.testing.assert_allclose(chart.limit, limits, rtol=2e-3)


@pytest.mark.slow
def test_ratios_that_no_joint_explains_are_kept_mode_by_mode(real_study):
    """Ratios of three joints cannot be any five numbers: with others the modes keep their own."""
    modes = real_study.modes
    wrong = modes.damping_ratio * np.array([1.3, 0.8, 1.2, 0.7, 1.4])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = studies.study_joints(replace(modes, damping_ratio=wrong), real_study.geometry, real_study.components)
    assert other.joints.machine.law.law == "measured"
    np.testing.assert_allclose(other.machine.modal_damping, wrong, rtol=1e-6)
    assert all(joint.loss_factor is None for joint in other.joints.joints)
    np.testing.assert_allclose(other.checked.ratio, wrong, rtol=1e-3)
