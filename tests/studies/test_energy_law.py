"""A machine whose modes are damped by energy: studies that couple them say by how much responses differ."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from toolpoint._check import FileDoubt
from toolpoint.io import read_machine
from toolpoint.io.template_files import FOLDER
from toolpoint.machine import build
from toolpoint.studies.machines.energy_law import question_energy_law
from toolpoint.studies.machines.sensitivity_study import study_sensitivity

HERE = FOLDER.parents[1] / "app" / "machines"


def mill(law, seed=0, equal=False):
    rng, description = np.random.default_rng(seed), read_machine(HERE / "three_axis_vertical.yaml").description
    joints = {name: replace(joint, loss_factor=0.05 if equal else float(rng.uniform(0.01, 0.15)), damping={})
              for name, joint in description.joints.items()}
    return build(replace(description, joints=joints, damping_ratio=None, modal_damping=law))


@pytest.mark.parametrize("seed", range(3))
def test_the_difference_of_both_laws_is_told(seed):
    doubts = question_energy_law(mill("energy", seed))
    assert len(doubts) == 1 and 0.01 < doubts[0].figure < 2 and "modal_damping: energy" in doubts[0]


def test_nothing_is_said_where_the_file_couples_its_modes():
    assert question_energy_law(mill("")) == []


def test_every_result_of_the_study_repeats_it():
    with pytest.warns(FileDoubt, match="modal_damping: energy"):
        study_sensitivity(mill("energy"), ["joints.foundation.stiffness.rx"], 3)
    with warnings.catch_warnings():
        warnings.simplefilter("error", FileDoubt)
        study_sensitivity(mill(""), ["joints.foundation.stiffness.rx"], 3)


def test_a_stiffness_fitted_to_poles_errs_by_what_the_doubt_says():
    """A mode of loss factor eta: its pole is (1 + eta^2)^(1/4) times the natural frequency; k goes with its square."""
    machine, eta = mill("energy", equal=True), 0.05
    poles = np.sqrt(np.linspace(1, 9, 3) ** 2 * (1 + 1j * eta))
    share = np.abs(poles / np.linspace(1, 9, 3)).max() - 1
    assert f"up to {200 * share:.2g} % too small" in question_energy_law(machine)[0]
