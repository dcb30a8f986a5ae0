"""Rotary axes behind a reducer: two inertias on a spring, loops of a drive file, joints of a robot; and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.drives import build_servo, compute_loops
from toolpoint.drives.build import build_mechanics
from toolpoint.io.yaml import drive_file, machine_file
from toolpoint.studies.accuracy.joint_servos import servos_of
from toolpoint.studies.accuracy.moving_structure import ToolStance, structure_along
from toolpoint.studies.accuracy.tool_paths import line

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
TEXT = """toolpoint: 1
name: shoulder
axes:
  q2:
    mechanics: {kind: reducer, inertia: 3.0e-5, gear_ratio: 100, load_inertia: 3.2, torsion: 3.1e4, torsion_damping: 14}
    position: {gain: 20}
    velocity: {gain: 0.02, integral_time: 20 ms}
"""


def file_of(tmp_path, text=TEXT):
    path = tmp_path / "drives.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_motor_and_load_are_two_inertias_on_a_spring(tmp_path):
    mechanics = build_mechanics(drive_file.read(file_of(tmp_path)).axes["q2"])
    assert mechanics.lead == pytest.approx(0.01)
    rotor = 3e-5 * 100**2
    assert mechanics.natural_frequencies[-1] == pytest.approx(np.sqrt(3.1e4 * (1 / 3.2 + 1 / rotor)) / (2 * np.pi))
    assert mechanics.motor_inertia == pytest.approx(3e-5 + 3.2 / 100**2)


def test_loops_of_rotary_axes_are_told_without_a_path(tmp_path, capsys):
    path = file_of(tmp_path)
    loops = compute_loops(build_servo(drive_file.read(path)))
    # Slow against the reducer: the velocity loop crosses near K_v / J, the position loop near its gain.
    assert loops.stable and loops.figures[-1][4] == pytest.approx(20 / (2 * np.pi), rel=2)
    main(["drive", str(path)])
    shown = capsys.readouterr().out
    assert "position" in shown and "q2" in shown
    with pytest.raises(SystemExit):
        main(["drive", str(path), "--circle", "50,4000"])
    assert "q2 behind a reducer; must be linear axes" in " ".join(capsys.readouterr().err.split())


def test_servo_of_a_robot_s_joint_from_its_drive_file(tmp_path):
    robot = machine_file.read(MACHINES / "milling_robot.yaml")
    servos = servos_of(drive_file.read(file_of(tmp_path)), robot)
    assert servos["q2"].travel == 0.01 and servos["q2"].mass == pytest.approx(0.3)
    side = line([0.69, -0.01, 0.1], [0.69, 0.01, 0.1])[0]
    bare = structure_along(robot, side, ToolStance(), spacing=5e-3).system
    system = structure_along(robot, side, ToolStance(), spacing=5e-3, servos=servos).system
    delays = sum(delay > 0 for delay in servos["q2"].delays)
    assert system.size == bare.size + 2 + delays and delays == 2  # a rotor, its integral, a coordinate of second order a delay
    held, free = (s.output_map[0] @ np.linalg.solve(s.stiffness[0], s.input_map[0][:, :3]) for s in (system, bare))
    assert np.allclose(held, free, rtol=1e-6, atol=1e-9 * np.abs(free).max())  # the integral holds a steady load


@pytest.mark.parametrize(("old", "new", "words"), [
    ("torsion: 3.1e4, ", "", "mechanics.*'torsion' is missing|torsion.*missing"),
    ("kind: reducer,", "kind: reducer, lead: 10 mm,", "a rotary axis has no lead"),
    ("kind: reducer,", "kind: rigid, lead: 10 mm,", "a rigid axis has none; a rotary one is kind reducer")])
def test_faults_of_rotary_mechanics(tmp_path, old, new, words):
    with pytest.raises(ToolpointError, match=words):
        drive_file.read(file_of(tmp_path, TEXT.replace(old, new)))


def test_a_reducer_drives_no_linear_axis(tmp_path):
    mill = machine_file.read(MACHINES / "three_axis_vertical.yaml")
    with pytest.raises(ToolpointError, match=r"axes.X.mechanics.kind: reducer; must be of a rotary axis"):
        servos_of(drive_file.read(file_of(tmp_path, TEXT.replace("q2:", "X:"))), mill)
