"""Slips of servo, component, cut and datasheet files that are valid numbers: each is doubted under its name, true ones not."""

import json
from pathlib import Path

import pytest
import yaml

from toolpoint import ToolpointError
from toolpoint.app.main import main
from toolpoint.io import kind_of, read_kind
from toolpoint.io.template_files import read_template
from toolpoint.studies import question_part

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
SHEET = MACHINES / "milling_robot_datasheet.yaml"


def doubts(path):
    return question_part(read_kind(path, kind_of(path))[1])


def changed(text, old, new, path):
    assert text.count(old) >= 1
    path.write_text(text.replace(old, new, 1))
    return doubts(path)


@pytest.mark.parametrize("path", [SHEET, MACHINES / "three_axis_vertical_servo.yaml",
                                  MACHINES / "three_axis_vertical_servo_on_structure.yaml"])
def test_shipped_files_have_no_doubts(path):
    assert doubts(path) == ()


@pytest.mark.parametrize("kind", ["servo", "components", "cut"])
def test_templates_have_no_doubts(kind, tmp_path):
    (tmp_path / "file.yaml").write_text(read_template(kind, ""))
    assert doubts(tmp_path / "file.yaml") == ()


@pytest.mark.parametrize(("kind", "old", "new", "name"), [
    ("servo", "gain: 60 1/s", "gain: 60000 1/s", "axes.X.position.gain"),
    ("servo", "gain: 60 1/s", "gain: 1 1/s", "axes.X.position.gain"),
    ("servo", "lead: 10 mm", "lead: 10", "axes.X.mechanics.lead"),
    ("servo", "inertia: 0.0108 kg*m^2", "inertia: 10.8 kg*m^2", "axes.X.mechanics.inertia"),
    ("servo", "gain: 1.2 N*m*s/rad", "gain: 0.0012 N*m*s/rad", "axes.X.velocity.gain"),
    ("servo", "integral_time: 20 ms", "integral_time: 20", "axes.X.velocity.integral_time"),
    ("servo", "coulomb: 2.1 N*m\n      static: 2.8 N*m", "coulomb: 2.8 N*m\n      static: 2.1 N*m", "static"),
    ("servo", "viscous: 0.02 N*m*s/rad", "viscous: 20 N*m*s/rad", "axes.X.friction.viscous"),
    ("servo", "speed: 30 m/min", "speed: 30", "limits.speed"), ("servo", "jerk: 50 m/s^3", "jerk: 0.05", "limits.jerk"),
    ("components", "mass: 2200 kg", "mass: 2.2 kg", "components.bed.body.mass"),
    ("components", "size: [1.2, 1.8, 0.7]", "size: [1200, 1800, 700] mm", "components.bed.body"),
    ("components", "centre: [0, 0.5, 1.45]", "centre: [0, 50, 145]", "components.column.body.centre"),
    ("components", "along: x", "along: y", "axes.X"),
    ("components", 'limits: "-300, 300 mm"', 'limits: "-0.3, 0.3 mm"', "axes.X.limits"),
    ("components", "uncertainty: {mass: 5 %", "uncertainty: {mass: 90 %", "components.bed.uncertainty.mass"),
    ("components", "coordinate_deviation: 2 mm", "coordinate_deviation: 2", "coordinate_deviation"),
    ("cut", "diameter: 16 mm", "diameter: 16", "cutting.diameter"),
    ("cut", "helix: 30 deg", "helix: 0.5236 deg", "cutting.helix"),
    ("cut", "material: al7075", "tangential: 800\n  normal: 250e6", "cutting.tangential"),
    ("cut", "material: al7075", "tangential: 800 MPa\n  normal: 800 GPa", "cutting.normal"),
    ("cut", '"4000, 18000 rpm"', '"4000000, 18000000 rpm"', "cutting.speeds"),
])
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_a_slip_is_doubted_under_its_name(kind, old, new, name, tmp_path):
    path = tmp_path / "file.yaml"
    try:
        lines = [line.what for line in changed(read_template(kind, ""), old, new, path)]
    except ToolpointError as error:  # refused by the reader, which names it too
        lines = [name] if name.split(".")[-1] in str(error) else [str(error)]
    assert any(name in line for line in lines), lines


@pytest.mark.parametrize(("old", "new", "name"), [
    ("bending: 39.2e4", "bending: 392", "catalogue.SHG-25-80.bending"),
    ("torsion: [2.5e4]", "torsion: [25]", "catalogue.SHG-25-80.torsion"),
    ("damping: 14,", "damping: 14000,", "catalogue.SHG-25-80.damping"),
    ("damping: 14,", "damping: 0.014,", "catalogue.SHG-25-80.damping"),
    ("a: 150 mm", "a: 150", "a")])
def test_a_slip_of_a_datasheet_is_doubted_under_its_name(old, new, name, tmp_path):
    lines = [line.what for line in changed(SHEET.read_text(encoding="utf-8"), old, new, tmp_path / "file.yaml")]
    assert any(name in line for line in lines), lines


def test_a_table_of_angles_in_the_other_unit_is_one_doubt(tmp_path):
    text = SHEET.read_text(encoding="utf-8")
    for degrees, radians in (("-90", "-1.5707963"), ("180", "3.14159265"), ("90", "1.5707963")):
        text = text.replace(f"alpha: {degrees} deg", f"alpha: {radians} deg")
    (tmp_path / "file.yaml").write_text(text)
    (line,) = doubts(tmp_path / "file.yaml")
    assert line.what == "axes" and "6 of 7 angles" in line


def test_two_reducers_alone_are_compared_too(tmp_path):
    data = yaml.safe_load(read_template("servo", ""))
    data["axes"]["Y"]["friction"]["coulomb"] = "2400 N*m"
    data["axes"]["Y"]["friction"]["static"] = "3100 N*m"
    (tmp_path / "servo.yaml").write_text(yaml.safe_dump(data))
    assert any(line.what == "axes.Y.friction.coulomb" for line in doubts(tmp_path / "servo.yaml"))


def test_check_says_the_doubts_first_in_text_and_json(tmp_path, capsys):
    path = tmp_path / "cut.yaml"
    path.write_text(read_template("cut", "").replace("helix: 30 deg", "helix: 0.5236 deg"))
    main(["check", str(path)])
    assert capsys.readouterr().out.startswith("doubt: cutting.helix: ")
    main(["check", str(path), "--json"])
    assert json.loads(capsys.readouterr().out)["doubts"][0].startswith("cutting.helix: ")
