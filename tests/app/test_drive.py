"""`toolpoint drive`: a drive file with a circle or a program, its page, and wrong inputs."""

import json
from pathlib import Path

import pytest

from toolpoint.app.main import main

SERVO = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines/three_axis_vertical_servo.yaml"
PROGRAM = "G90 G17 G64\nG1 X20 Y0 F4000\nG3 X20 Y30 I0 J15\nG1 X0 Y30\nM30\n"

pytestmark = pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")


@pytest.mark.slow
def test_circle_shows_the_quadrant_glitches_of_the_published_servo(tmp_path, capsys):
    main(["drive", str(SERVO), "--circle", "50,4000", "-o", str(tmp_path), "--json"])
    found = json.loads(capsys.readouterr().out)
    # Reference: 70 um for F_c = F_s/1.5, J 0.01 kg m2, R 50 mm, 4000 mm/min; within 10 %.
    assert 1e6 * found["circular_deviation_m"] == pytest.approx(70.0, rel=0.1)
    page = (tmp_path / "index.html").read_text()
    for words in ("Ballbar", "Torque", "velocity loop", "critical feed", "inertia"):
        assert words in page


@pytest.mark.slow
def test_line_and_arc_program(tmp_path, capsys):
    (tmp_path / "path.nc").write_text(PROGRAM)
    main(["drive", str(SERVO), "--program", str(tmp_path / "path.nc"), "-o", str(tmp_path / "page")])
    shown = capsys.readouterr()
    assert "contour error, tool" in shown.out
    assert "phase margin" in shown.out
    assert "critical feed" in shown.err


@pytest.mark.parametrize(("old", "new", "words"), [
    ("inertia: 0.01 kg*m^2", "inertia: 0 kg*m^2", "greater than 0"),
    ("lead: 9.9966 mm", "leed: 9.9966 mm",
                                                                      "did you mean 'lead'"),
    ("gain: 60 1/s", "gain: 60000 1/s", "unstable"),
    ("sample_time: 0.1 ms", "sample_time: 0.07 ms", "must be those of the first axis"),
    ("viscous: 0.1 N*m*s/rad", "viscous: 0.1 N*m", "rotational damping"), ("static: 4.7318 N*m, ", "", "'static' is missing"),
    ("toolpoint: 1", "toolpoint: 4", "version")])
def test_faults_of_a_drive_file(tmp_path, capsys, old, new, words):
    text = SERVO.read_text()
    assert old in text
    (tmp_path / "servo.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(SystemExit) as stopped:
        main(["drive", str(tmp_path / "servo.yaml"), "--circle", "50,4000", "-o", str(tmp_path)])
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.parametrize(("arguments", "words"), [
    ([], "either --program"), (["--circle", "50"], "RADIUS,FEED"), (["--circle", "0.001,4000"], "larger radius"),
    (["--circle", "50000,4000"], "at most 1800 s"), (["--fmu", "none/unit.fmu"], "does not exist"),
    (["--program", "none.nc"], "none.nc")])
def test_wrong_commands(capsys, arguments, words):
    with pytest.raises(SystemExit) as stopped:
        main(["drive", str(SERVO), *arguments])
    assert stopped.value.code == 2
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_a_feed_that_the_axes_cannot_keep_is_said(tmp_path, capsys):
    """20 mm at 30 m/min asks for 12.5 m/s^2 of axes that allow 2: sqrt(2 * 0.02) m/s = 12 m/min."""
    main(["drive", str(SERVO), "--circle", "20,30000", "-o", str(tmp_path)])
    shown = " ".join(capsys.readouterr().err.split())
    assert "not the 30000 mm/min asked for" in shown
    assert 11000 < float(shown.split("allow ")[1].split()[0]) < 12100


def test_program_faults_come_with_their_lines(tmp_path, capsys):
    (tmp_path / "bad.nc").write_text("G90\nG1 X20 Y0 F4000\nG3 X20 Y30 I0 J19\nG1 X0 Q30\n")
    with pytest.raises(SystemExit):
        main(["drive", str(SERVO), "--program", str(tmp_path / "bad.nc")])
    shown = capsys.readouterr().err
    assert "bad.nc:3:" in shown and "bad.nc:4:" in shown


@pytest.mark.slow
def test_servo_on_the_structure_of_a_machine(tmp_path, capsys):
    folder = SERVO.parent
    (tmp_path / "path.nc").write_text(PROGRAM)
    arguments = ["drive", str(folder / "three_axis_vertical_servo_on_structure.yaml"), "--program", str(tmp_path / "path.nc")]
    main([*arguments, "--machine", str(folder / "three_axis_vertical_drives.yaml"), "-o", str(tmp_path / "page"), "--json"])
    found = json.loads(capsys.readouterr().out)["contour_error_m"]
    # Scale, table and tool see different things once the machine's frame moves.
    assert len({round(1e9 * value) for value in found.values()}) == 3
    assert all(1e-6 < value < 5e-4 for value in found.values())
    assert "F_c = F_s/1.5" in (tmp_path / "page/index.html").read_text()
    with pytest.raises(SystemExit):
        main(arguments)
    assert "ends at points of a machine" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["drive", str(SERVO), "--circle", "50,4000", "--machine", str(folder / "three_axis_vertical_drives.yaml")])
    assert "no axis of the drive file is a ball screw" in capsys.readouterr().err


@pytest.mark.slow
def test_map_over_the_workspace(tmp_path, capsys):
    folder = SERVO.parent
    arguments = ["drive", str(folder / "three_axis_vertical_servo_on_structure.yaml"), "--map", "X=-0.3:0.3:3", "--map",
                 "Y=-0.2:0.2:2", "-o", str(tmp_path / "page")]
    machine = ["--machine", str(folder / "three_axis_vertical_drives.yaml")]
    main([*arguments, *machine, "--circle", "20,3000", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert len(found["poses"]) == 6 and found["poses"][1] == {"X": -0.3, "Y": 0.2} and all(found["stable"])
    margins = [row[0] for row in found["velocity_phase_margin_deg"]]
    assert len({round(m, 6) for m in margins}) > 3
    assert all(1e-6 < value < 5e-4 for value in found["circular_deviation_m"])
    page = (tmp_path / "page/index.html").read_text()
    for words in ("Phase margin of the velocity loop", "Bandwidth of the position", "Circular deviation at the tool point"):
        assert words in page
    main([*arguments[:4], *machine, "-o", str(tmp_path / "line")])
    assert "Page written" in capsys.readouterr().out
    for wrong, words in ((["--map", "X=0:1"], "AXIS=FIRST:LAST:NUMBER"), (["--map", "X=0.1:0.1:1"], "two positions or more")):
        with pytest.raises(SystemExit):
            main([*arguments[:2], *wrong, *machine])
        assert words in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(arguments)
    assert "--machine" in capsys.readouterr().err


def test_unit_and_schema_from_the_command_line(tmp_path, capsys):
    main(["drive", str(SERVO), "--fmu", str(tmp_path / "servo.fmu"), "--fmu-sources"])
    assert "Unit written" in capsys.readouterr().out
    assert (tmp_path / "servo.fmu").stat().st_size > 1000
    main(["schema", "servo"])
    assert json.loads(capsys.readouterr().out)["title"] == "toolpoint drive file"
    with pytest.raises(SystemExit):
        main(["drive"])
    assert "DRIVES" in capsys.readouterr().err
