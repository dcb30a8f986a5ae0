"""The command line as a person meets it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from toolpoint.app import maps
from toolpoint.app.main import main
from toolpoint.studies.pose_map import PoseMap

ROOT = Path(__file__).resolve().parents[2]
MACHINE = str(ROOT / "src/toolpoint/app/machines/three_axis_vertical.yaml")


def run(arguments):
    try:
        main(arguments)
    except SystemExit as stopped:
        return stopped.code
    return 0


def holder_frf(path):
    """A measured-looking text FRF of two modes with known frequency and damping."""
    f = np.arange(0.0, 3001.0)
    s = 2j * np.pi * f
    h = sum(1 / m / (s**2 + 2 * z * w * s + w**2) for m, z, w in
            ((2.0, 0.03, 2 * np.pi * 900), (1.5, 0.02, 2 * np.pi * 1700)))
    np.savetxt(path, np.column_stack([f, h.real, h.imag]), delimiter="\t")


def test_demo_compares_with_the_paper_and_writes_the_page(tmp_path, capsys):
    assert run(["demo", "-o", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    for value in ("21.50", "32.79", "58.00", "published", "chosen", "18 degrees of freedom",
                  "Stable at every charted speed"):
        assert value in shown
    page = (tmp_path / "index.html").read_text()
    for words in ("tool-table", "What was assumed", "Masses are not published", "Stability of the cut", "published"):
        assert words in page


def test_report_of_a_machine_at_a_pose(tmp_path, capsys):
    assert run(["report", MACHINE, "--pose", "X=0.1,Y=0.2", "-o", str(tmp_path / "page.html")]) == 0
    assert "X 0.1, Y 0.2" in (tmp_path / "page.html").read_text()


def test_report_of_measured_files(tmp_path, capsys):
    holder_frf(tmp_path / "tip.txt")
    assert run(["report", "--frf", str(tmp_path / "tip.txt"), "--band", "100:3000", "-o", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    found = [float(line.split("│")[2]) for line in shown.splitlines() if line.count("│") == 4 and "Hz" not in line]
    np.testing.assert_allclose(found, [900, 1700], rtol=2e-3)
    assert "straight" in (tmp_path / "out/index.html").read_text().lower()


def test_report_of_measured_tool_holder(tmp_path, capsys, measured):
    files = [str(measured / "tool_holder_frf" / f"Point_{i}_Channel_1_CH1.txt") for i in range(1, 6)]
    arguments = ["report", MACHINE, "-o", str(tmp_path)]
    for file in files:
        arguments += ["--frf", file]
    assert run(arguments) == 0
    shown = capsys.readouterr().out
    # The author of the measurement picked 1074 Hz by hand (second and third mode are hard cases, see the data's notes).
    found = [float(line.split("│")[2]) for line in shown.splitlines() if line.count("│") == 4 and "Hz" not in line]
    assert min(abs(f / 1074 - 1) for f in found) < 0.02


def test_modes_and_check_speak_json(capsys):
    assert run(["modes", MACHINE, "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["frequency_hz"]) == 6
    assert run(["check", MACHINE, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] and found["coordinates"] == 6 and found["cutting"].startswith("80 mm, 5 teeth")
    assert run(["schema"]) == 0
    assert "properties" in json.loads(capsys.readouterr().out)


def test_map_writes_a_page_and_resumes(tmp_path, capsys):
    arguments = ["map", MACHINE, "--axis", "X=-0.3:0.3:5", "--axis", "Z=-0.2:0.4:4", "--folder", str(tmp_path / "study"),
                 "-o", str(tmp_path / "page")]
    assert run(arguments) == 0
    assert (tmp_path / "page/index.html").is_file()
    capsys.readouterr()
    assert run([*arguments, "--json"]) == 0
    assert np.shape(json.loads(capsys.readouterr().out)["frequency_hz"]) == (5, 4, 6)


@pytest.mark.parametrize(("arguments", "words"), [
    (["report", "none.yaml"], "cannot be read"), (["report"], "neither a machine file nor --frf"),
    (["report", MACHINE, "--pose", "X=0,1"], "decimal point"), (["report", MACHINE, "--pose", "Q=1"], "no axis"),
    (["report", MACHINE, "--pose", "X=5"], "within -0.3 .. 0.3"), (["report", "--frf", "none.txt"], "cannot be read"),
    (["report", "--frf", MACHINE, "--band", "9:3"], "below the upper"), (["demmo"], "did you mean 'demo'"),
    (["map", MACHINE, "--axis", "X=1"], "FIRST:LAST:NUMBER"),
    (["map", MACHINE, "--axis", "X=-0.1:0.1:0"], "FIRST:LAST:NUMBER"), (["map", MACHINE, "--axis", "X=-0.1:5:3"], "0.3"),
 (["modes", MACHINE, "--count", "x"], "not a valid integer")])
def test_wrong_input_gives_a_message_and_code_two(arguments, words, capsys):
    assert run(arguments) == 2
    shown = capsys.readouterr()
    assert words in shown.err
    assert "Traceback" not in shown.err


def test_the_installed_program_runs_without_a_display():
    environment = {**os.environ, "DISPLAY": ""}
    command = [sys.executable, "-m", "toolpoint", "modes", MACHINE]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0
    assert "58." in done.stdout or "57.9" in done.stdout


def test_poses_that_fail_in_a_map_are_told_with_their_reason():
    found = PoseMap({"X": np.array([0.0, 0.1])}, np.array([[20.0, 30.0], [np.nan, np.nan]]), {(1,): "no equilibrium"})
    assert maps.failures(found) == ["X 0.1: no equilibrium"]
    assert json.loads(json.dumps(maps.plain(found), allow_nan=False))["frequency_hz"][1] == [None, None]
