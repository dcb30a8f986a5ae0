"""Law: a nut with backlash or a preload on a machine's structure gives way under a force on the table as its contact says."""

import re

import numpy as np
import pytest

from toolpoint.drives import Command, simulate
from toolpoint.drives.build import build_servo
from toolpoint.drives.friction.contact import Contact, ProgressiveSpring
from toolpoint.io import read_drives, read_machine
from toolpoint.io.template_files import FOLDER
from toolpoint.studies.servos.drive_structure import structure_of
from toolpoint.studies.servos.driven_responses import study_driven_responses

HERE = FOLDER.parents[1] / "app" / "machines"
FORCE, STIFFNESS, BACKLASH, PRELOAD = 1200.0, 3e8, 20e-6, 500.0


def drives(folder, extra):
    text = (HERE / "three_axis_vertical_servo_on_structure.yaml").read_text()
    text = text.replace("nut_stiffness: 300 N/um", f"nut_stiffness: 300 N/um{extra}", 1).replace(
        "position: {gain: 60 1/s, sample_time: 1 ms}", "position: {gain: 60 1/s, sample_time: 1 ms, feedback: motor}", 1)
    # Its friction law sticks and slips, which is another matter.
    text = re.sub(r"friction: \{law: lugre.*?\}", "friction: {law: none}", text, flags=re.DOTALL)
    path = folder / "servo.yaml"
    path.write_text(text)
    return read_drives(path)


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    """Displacement of the table along x under a force of either sign at rest, by what the nut is."""
    machine, result = read_machine(HERE / "three_axis_vertical_drives.yaml"), {}
    for name, extra in (("linear", ""), ("backlash", ", backlash: 20 um"), ("preload", ", preload: 500 N")):
        part = drives(tmp_path_factory.mktemp(name), extra)
        servo = build_servo(part, structure_of(part, machine))
        for sign in (1, -1):
            run = simulate(servo, Command(np.zeros((500, 2)), 1e-3), load=np.array([[sign * FORCE, 0.0]]), substeps=2)
            result[name, sign] = run.output("table", "X")[-1]
    return result


def test_both_sides_of_the_gap_are_taken(moved):
    linear = moved["linear", 1] - moved["linear", -1]
    assert moved["backlash", 1] - moved["backlash", -1] - linear == pytest.approx(BACKLASH, rel=0.02)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_preload_that_is_lost_leaves_half_the_stiffness(moved, sign):
    # 500 N over half the stiffness are 3.3 um, at which 1000 N act; the remaining 200 N meet one side alone.
    further = (FORCE - 2 * PRELOAD) / (STIFFNESS / 2) - (FORCE - 2 * PRELOAD) / STIFFNESS
    assert moved["preload", sign] - moved["linear", sign] == pytest.approx(sign * further, rel=0.02)


def test_a_progressive_coupling_twists_as_its_cubic_law(tmp_path):
    """Under a torque T the twist solves k x (1 + (x / x_2)^2) = T: the table yields less, lead / 2 pi a radian."""
    machine, lead_ratio, stiffness, doubling = read_machine(HERE / "three_axis_vertical_drives.yaml"), 0.0, 1e3, 2e-3
    displacement = {}
    for name, extra in (("linear", ""), ("progressive", ", coupling_doubling_twist: 2 mrad")):
        (tmp_path / name).mkdir()
        part = drives(tmp_path / name, "")
        path = tmp_path / name / "servo.yaml"
        path.write_text(path.read_text().replace(
            "coupling_stiffness: 2e4 N*m/rad", f"coupling_stiffness: {stiffness} N*m/rad{extra}", 1))
        part = read_drives(path)
        lead_ratio = part.axes["X"].mechanics.lead / (2 * np.pi)
        servo = build_servo(part, structure_of(part, machine))
        run = simulate(servo, Command(np.zeros((800, 2)), 1e-3), load=np.array([[FORCE, 0.0]]), substeps=2)
        displacement[name] = run.output("table", "X")[-1]
    torque = FORCE * lead_ratio
    roots = np.roots([stiffness / doubling**2, 0, stiffness, -torque])
    twist = float(roots[np.abs(roots.imag) < 1e-12].real[0])
    assert torque / stiffness > 0.5 * doubling  # the law is not linear there
    change = displacement["progressive"] - displacement["linear"]
    assert change == pytest.approx(-lead_ratio * (torque / stiffness - twist), rel=0.02)
    assert ProgressiveSpring(stiffness, doubling).force(twist) == pytest.approx(torque, rel=1e-9)


def test_the_law_is_that_of_the_file_and_linear_responses_say_what_they_leave_out(tmp_path):
    machine, part = read_machine(HERE / "three_axis_vertical_drives.yaml"), drives(tmp_path, ", backlash: 20 um")
    play = build_servo(part, structure_of(part, machine)).plant.axes[0].mechanics.contacts
    assert play[0].law.force(15e-6) == pytest.approx(float(Contact.with_backlash(STIFFNESS, BACKLASH).force(15e-6)), rel=1e-9)
    result = study_driven_responses(machine, part, frequency=[20.0, 40.0])
    assert any("nut of X" in str(doubt) for doubt in result.doubts)
