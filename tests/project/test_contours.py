"""Circles of a project: plane and structure that the goal names, what would meet it, the command that shows the same."""

import json
import re
import shlex
from importlib.resources import files
from pathlib import Path

import pytest

from toolpoint.app.main import main
from toolpoint.project import Project

MACHINES = files("toolpoint.app") / "machines"
SERVO = """toolpoint: 1
name: Slides
axes:
  X: &axis
    mechanics: {kind: two-mass, lead: 10 mm, inertia: 0.006 kg*m^2, table_mass: 300 kg, stiffness: 100 N/um,
                damping: 5 kN*s/m}
    position: {gain: 40 1/s, sample_time: 1 ms}
    velocity: {gain: 1.2 N*m*s/rad, integral_time: 20 ms, sample_time: 0.25 ms}
  Z:
    mechanics: {kind: two-mass, lead: 10 mm, inertia: 0.008 kg*m^2, table_mass: 300 kg, stiffness: 100 N/um,
                damping: 5 kN*s/m}
    position: {gain: 30 1/s, sample_time: 1 ms}
    velocity: {gain: 1.2 N*m*s/rad, integral_time: 20 ms, sample_time: 0.25 ms}
limits: {speed: 30 m/min, acceleration: 2 m/s^2, jerk: 50 m/s^3}
""".replace("&axis", "")
GOALS = """toolpoint: 1
name: Slides
servo: servo.yaml
contours:
  circle: {radius: 10 mm, feed: 1200 mm/min, deviation: 20 um, axes: [X, Z]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a project of a servo of X and Z and a circle that it misses."""
    (tmp_path / "servo.yaml").write_text(SERVO, encoding="utf-8")
    (tmp_path / "project.yaml").write_text(GOALS, encoding="utf-8")
    return tmp_path


def test_a_missed_circle_tells_its_cause_and_what_meets_it(folder: Path, monkeypatch: pytest.MonkeyPatch,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    """The command of the step, as a shell takes it, gives the same numbers."""
    project = Project.open(folder)
    results = project.run()
    data = results.data["contours"]["circle"]
    assert results.answers[0].startswith("circle: not met; radial deviation") and data["axes"] == ["X", "Z"]
    # Axes that lag by 1/K_v leave a circle by v |1/K_1 - 1/K_2|/2 along its diagonals.
    cause = re.search(r"its largest part, (\S+) µm, makes the circle oval: X and Z lag by different amounts", results.table())
    assert cause and float(cause[1]) == pytest.approx(1e6 * 0.02 * (1 / 30 - 1 / 40) / 2, rel=0.05)
    assert data["remedies"][0]["met"] and f"for circle change the {data['remedies'][0]['kind']} as said" in results.table()
    assert not any("structure" in str(doubt) for doubt in results.doubts)
    step = next(step for step in project.chain.steps if step.name == "contour/circle")
    monkeypatch.chdir(folder)
    capsys.readouterr()
    main([*shlex.split(step.command)[1:], "--json"])
    shown = json.loads(capsys.readouterr().out)
    assert shown["deviation_m"] == pytest.approx(data["deviation_m"], rel=1e-8)
    assert [remedy["words"] for remedy in shown["remedies"]] == [remedy["words"] for remedy in data["remedies"]]


@pytest.mark.slow
def test_drives_that_end_on_the_machine_have_its_structure_in_the_circle(tmp_path: Path) -> None:
    """Before, such a servo file failed: its ends were looked for without the machine."""
    for name, target in (("three_axis_vertical_servo_on_structure.yaml", "servo.yaml"),
                         ("three_axis_vertical_drives.yaml", "machine.yaml")):
        (tmp_path / target).write_text((MACHINES / name).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "project.yaml").write_text(
        "toolpoint: 1\nname: Mill\nmachine: machine.yaml\nservo: servo.yaml\ncontours:\n"
        "  circle: {radius: 20 mm, feed: 1 m/min, deviation: 1 mm, pose: {X: 100 mm}}\n", encoding="utf-8")
    project = Project.open(tmp_path)
    results = project.run()
    step = next(step for step in project.chain.steps if step.name == "contour/circle")
    assert results.answers[0].startswith("circle: met") and step.input_paths == ("servo.yaml", "machine.yaml")
    assert "--machine machine.yaml --pose X=0.1" in step.command
    assert not any("no axis of the servo file ends" in str(doubt) for doubt in results.doubts)


@pytest.mark.slow
def test_a_machine_on_which_no_drive_ends_is_doubted(folder: Path) -> None:
    text = (MACHINES / "three_axis_vertical.yaml").read_text(encoding="utf-8")
    (folder / "machine.yaml").write_text(text, encoding="utf-8")
    with (folder / "project.yaml").open("a", encoding="utf-8") as file:
        file.write("machine: machine.yaml\n")
    assert any("no axis of the servo file ends" in str(doubt) for doubt in Project.open(folder).run().doubts)
