"""P1: Machines 2022, 10(11), 1102: the six-freedom and eighteen-freedom vertical machining centre."""

import numpy as np
import pytest

from toolpoint.machine import assemble
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.vibration import eigen, sensitivity

MODEL_ROW = [21.5, 26.4, 32.8, 39.8, 44.4, 58.0]  # table 5 of the paper, simplified model, Hz
STIFFNESS = {  # table 4 of the paper, GN mm/rad = 1e6 N m/rad
    "joints.foundation.stiffness.ry": 653.58, "joints.foundation.stiffness.rz": 147.12,
    "joints.foundation.stiffness.rx": 902.78, "joints.column_foot.stiffness.rx": 184.64,
    "joints.magazine_arm.stiffness.ry": 2.68, "joints.magazine_arm.stiffness.rz": 5.56}


def test_the_file_holds_the_published_joints(vertical):
    for path, value in STIFFNESS.items():
        assert vertical.value(path) == pytest.approx(value * 1e6, rel=1e-12)
    for joint, place in {"foundation": (0, 1.063, -1.5), "column_foot": (0, 1.3, 0.1),  # table 3, mm
                         "magazine_arm": (-0.28, 1.5, 1.35)}.items():
        assert vertical.description.joints[joint].frame.at == pytest.approx(place)


def test_six_freedoms_give_the_model_row(vertical):
    system = assemble(vertical)
    assert system.size == 6
    np.testing.assert_allclose(eigen.solve_undamped(system).frequency, MODEL_ROW, rtol=5e-3)


def test_with_feed_drives_it_has_eighteen_freedoms(vertical_drives):
    assert assemble(vertical_drives).size == 18
    names = [name.split(".")[1] for name in vertical_drives.coordinates]
    assert sum(name.startswith("r") for name in names) == 15  # table 2: 3 translations, 15 rotations


def test_masses_of_the_parts_add_up_to_the_stated_ones(vertical):
    bodies = vertical.description.bodies
    assert sum(bodies[n].mass for n in ("base", "saddle", "table")) == pytest.approx(6354)
    assert sum(bodies[n].mass for n in ("column", "head")) == pytest.approx(2805)


def test_moving_an_axis_changes_the_modes_and_comes_back(vertical):
    home = eigen.solve_undamped(assemble(vertical, {"X": 0.0})).frequency
    away = eigen.solve_undamped(assemble(vertical, {"X": 0.3, "Y": -0.25, "Z": 0.4})).frequency
    assert np.abs(away / home - 1).max() > 1e-3
    batch = eigen.solve_undamped(assemble(vertical, {"X": np.array([0.0, 0.3]), "Y": np.array([0.0, -0.25]),
                                               "Z": np.array([0.0, 0.4])})).frequency
    np.testing.assert_allclose(batch, [home, away], rtol=1e-10)


def test_stiffness_sensitivities_sum_to_the_scaling_law(vertical):
    paths = list(STIFFNESS)
    slopes = sensitivity.frequencies(assemble(vertical), matrix_derivatives(vertical, paths))
    weights = np.array([vertical.value(path) for path in paths])
    np.testing.assert_allclose(weights @ slopes, eigen.solve_undamped(assemble(vertical)).frequency / 2, rtol=1e-9)
