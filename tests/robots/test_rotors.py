"""Rotors of a robot's motors: their momenta, what they do to modes, and that they take and give no energy."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml import robot_file
from toolpoint.machine import assemble, build
from toolpoint.machine.assembly.gyroscopics import gyroscopic_matrix, spins
from toolpoint.machine.pose.placement import place_machine
from toolpoint.machine.robot.model import rigid_members, robot_machine
from toolpoint.machine.robot.rotors import rotor_momenta, with_rotors
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_side
from toolpoint.studies.accuracy.tool_paths import line
from toolpoint.studies.robots.datasheet_study import study_datasheet

SHEET = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/milling_robot_datasheet.yaml"


@pytest.fixture(scope="module")
def sheet():
    return robot_file.read(SHEET)


@pytest.fixture(scope="module")
def machine(sheet):
    return robot_machine(rigid_members(sheet), cutting=robot_file.read_robot_machine(SHEET).cutting)


def test_momentum_is_inertia_times_ratio_times_speed(sheet, machine):
    momenta = rotor_momenta(sheet, {"q1": 2.0, "q4": 0.5})
    assert momenta["q1"] == pytest.approx(3e-5 * 80 * 1.1 * 2.0) and momenta["q4"] == pytest.approx(1.4e-5 * 50 * 0.9 * 0.5)
    built = build(with_rotors(machine, sheet, {"q1": 2.0, "q4": 0.5}))
    carried = {built.body_names[link]: np.linalg.norm(h) for link, h in spins(built).items()}
    assert carried == pytest.approx({"motor_q1": momenta["q1"], "motor_q4": momenta["q4"]})
    with pytest.raises(ToolpointError, match="speeds: 'q9'; must be of q1, q2"):
        rotor_momenta(sheet, {"q9": 1.0})


def test_poles_stay_on_the_imaginary_axis_and_pairs_part_with_the_speed(sheet, machine):
    """Without dampers the poles of a gyroscopic system come in pairs +-i w; coupled modes part with the square of the speed."""
    still = assemble(build(machine), {}, modal_damping=False)
    full = {axis.name: axis.largest_speed for axis in sheet.axes}
    n, parted = len(still.mass), []
    for factor in (0.0, 500.0, 1000.0):
        turning = build(with_rotors(machine, sheet, {name: factor * speed for name, speed in full.items()}))
        gyroscopic = gyroscopic_matrix(place_machine(turning))
        turn = np.zeros((n, n)) if gyroscopic is None else gyroscopic[0]
        assert np.abs(turn + turn.T).max() <= 1e-12 * max(np.abs(turn).max(), 1e-300)
        first = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(still.mass, still.stiffness),
                                                        -np.linalg.solve(still.mass, turn)]])
        poles = np.linalg.eigvals(first)
        assert np.abs(poles.real).max() < 1e-7 * np.abs(poles).max()
        parted.append(np.sort(poles.imag)[n:])
    change = [np.abs(w[:6] - parted[0][:6]) for w in parted[1:]]
    most = int(change[0].argmax())
    assert change[1][most] / change[0][most] == pytest.approx(4.0, rel=0.2)


def test_fast_rotors_keep_the_balance_of_an_accuracy_run(sheet, machine):
    side = line([0.69, -0.01, 0.1], [0.69, 0.01, 0.1])[0]
    setup = MillingSetup(15000, 0.5e-3, window=0.05, halved=False, with_energy=True)
    fast = {axis.name: 1000 * axis.largest_speed for axis in sheet.axes}
    plain, spun = (mill_side(build(part), side, setup) for part in (machine, with_rotors(machine, sheet, fast)))
    assert spun.energy.gap < 2e-6 and plain.energy.gap < 2e-6
    assert 1e-5 < abs(spun.position_error / plain.position_error - 1) < 0.1


@pytest.mark.slow
def test_the_study_says_that_they_do_not_matter(sheet, machine):
    words = study_datasheet(sheet, machine, finite_elements=False).rotors
    assert "momenta reach 0.021 N m s" in words and words.endswith("left out below")
