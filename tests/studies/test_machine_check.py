"""What `check` says of a machine: the drawing in words, and doubts that a slip of a unit gives away."""

import re
from importlib import resources

import pytest

from toolpoint._check import ToolpointError
from toolpoint.io import read_datasheet, read_machine, write_machine
from toolpoint.io.template_files import read_template
from toolpoint.studies.machines.check.datasheet_doubts import question_datasheet
from toolpoint.studies.machines.check.machine_check import check_machine

TEXT = read_template("machine", "three-axis-vertical")


def checked(tmp_path, *changes):
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "m.yaml").write_text(text)
    return check_machine(read_machine(tmp_path / "m.yaml"))


def test_the_chain_is_drawn_from_the_ground_to_the_tool(tmp_path):
    result = checked(tmp_path)
    assert result.chain[0] == "My vertical machining centre: 6 bodies of 4415 kg in all, 36 coordinates"
    depth = {line.split("(")[0].strip(): len(line) - len(line.lstrip()) for line in result.chain[2:]}
    assert depth["feet"] < depth["guide_y"] < depth["guide_x"] and depth["guide_y"] == depth["column_foot"]
    spindle = next(line for line in result.chain if "bearings" in line)
    assert "45 kg, 0.15 x 0.15 x 0.5 m" in spindle and "tip (tool)" in spindle
    # The drive of the table runs against X, as ISO 841 counts.
    assert "axis X moves table along -x of guide_x; travel -0.3 m .. 0.3 m" in result.travel


def test_sound_drives_are_not_doubted_for_the_slip_of_another(tmp_path):
    result = checked(tmp_path, ("x: 9e8, y: 1.5e8, z: 1.2e9", "x: 9e8, y: 7e5, z: 1.2e9"))
    assert {doubt.split(".stiffness")[0] for doubt in result.doubts if doubt.startswith("joints.")} == {"joints.guide_y"}


@pytest.mark.parametrize(("change", "part", "words"), [
    (("mass: 2200 kg", "mass: 2200000 kg"), "bodies.bed", "more than any metal"),
    (("mass: 1200 kg", "mass: 1.2 kg"), "bodies.column", "less than a hollow box"),
    (("size: [0.8, 0.6, 0.15]", "size: [80, 60, 15]"), "bodies.saddle", "check the units"),
    (("x: 2.5e8, y: 2.5e8", "x: 250, y: 2.5e8"), "joints.bearings.stiffness.x", "softer than"),
    (("rx: 2.5e8, ry: 2.5e8, rz: 2e8", "rx: 2.5e13, ry: 2.5e8, rz: 2e8"), "joints.column_foot.stiffness.rx", "is a lever of"),
    (('"-300, 300 mm"', '"-100, 100 m"'), "axes.X", "check the unit of its limits"),
    (("at: [0, -0.25, 1.4]", "at: [0, -25, 1.4]"), "joints.bearings", "away from both"),
])
def test_a_slip_of_a_unit_is_doubted(change, part, words, tmp_path):
    doubts = checked(tmp_path, change).doubts
    assert any(line.startswith(part) and words in line for line in doubts), doubts


@pytest.mark.parametrize(("change", "part", "words"), [
    (("rx: 6e7, ry: 8e7, rz: 6e7", "rx: 6e8, ry: 8e7, rz: 6e7"), "joints.guide_y.stiffness.rx", "times above the turning"),
    (("rx: 2.5e8, ry: 2.5e8, rz: 2e8", "rx: 2.5e8, ry: 2.5e7, rz: 2e8"), "joints.column_foot.stiffness.ry", "times below the"),
    (("x: 9e8, y: 1.5e8, z: 1.2e9", "x: 7e9, y: 1.5e8, z: 1.2e9"), "joints.guide_y.stiffness.x", "times above z"),
    (("x: 9e8, y: 1.5e8, z: 1.2e9", "x: 9e8, y: 3e7, z: 1.2e9"), "joints.guide_y.stiffness.y", "the other drives have"),
    (("at: [0, -0.25, 1.1]", "at: [0, -0.25, 1.85]"), "points.tip", "lies inside head"),
    (("at: [0, -0.25, 1.1]", "at: [0, -1.25, 1.1]"), "points.tip", "off its body"),
    (("at: [0, -0.25, 0.97]", "at: [0, -0.25, 0.02]"), "points.tip", "no travel brings"),
    (('"-200, 200 mm"', '"-2000, 2000 mm"'), "axes.Y", "would be off the other"),
    (("mass: 45 kg", "mass: 99.2 kg"), "bodies.spindle", "more than solid steel"),
    (("centre: [0, -0.25, 1.45]", "centre: [0, -0.25, 2.3]"), "bodies.spindle", "from the nearest joint that holds it"),
])
def test_a_slip_that_only_neighbours_contradict_is_doubted(change, part, words, tmp_path):
    doubts = checked(tmp_path, change).doubts
    assert any(line.startswith(part) and words in line for line in doubts), doubts


def test_a_long_narrow_slide_may_turn_stiffer_one_way(tmp_path):
    """Carriages 1.8 m apart along y and 0.1 m across: rx is 300 times ry by geometry, so nothing contradicts it."""
    change = ("size: [1.0, 0.5, 0.12]", "size: [0.1, 1.8, 0.12]")
    stiffness = ("rx: 5e7, ry: 8e7, rz: 6e7", "rx: 6e8, ry: 2e6, rz: 5e8")
    doubts = checked(tmp_path, change, stiffness).doubts
    assert not any("joints.guide_x.stiffness.r" in line and "turning stiffness" in line for line in doubts), doubts


@pytest.mark.parametrize(("damping", "is_doubted"), [(1e-12, False), (40.0, True)])
def test_a_damper_that_a_fit_left_at_nothing_is_no_slip(damping, is_doubted, tmp_path):
    """A fit of viscous joints ends with 1e-22 s where there is none: "8e17 times below" told nobody anything."""
    spring = "rx: 6e7, ry: 8e7, rz: 6e7}"
    change = [(f"z: 1.2e9, {spring}", f"z: 1.2e9, {spring}\n    damping: {{x: 9e4, y: {damping}}}"),
              ("z: 9e8, rx: 3e8, ry: 2e8, rz: 2e8}", "z: 9e8, rx: 3e8, ry: 2e8, rz: 2e8}\n    damping: {x: 4e4, y: 5e4}")]
    assert any("damping over stiffness" in doubt for doubt in checked(tmp_path, *change).doubts) == is_doubted


def test_a_machine_as_slow_as_a_tower(tmp_path):
    changes = [(f"{way}: {value}", f"{way}: {float(value) / 1e5:g}") for way, value in
               (("x", "4e8"), ("y", "4e8"), ("z", "9e8"), ("rx", "3e8"), ("ry", "2e8"))]
    assert any("that of a tower" in line for line in checked(tmp_path, *changes).doubts)


def test_what_is_assumed_is_said(tmp_path):
    lines = "\n".join(checked(tmp_path, ("damping_ratio: 3 %", "# damping_ratio: 3 %"), ("table: work  #", "# table: work  #")
                              ).assumed)
    assert "no damping at all" in lines and "the work stands still" in lines and "no gravity" in lines


@pytest.mark.parametrize(("place", "is_doubted"), [("at: [0, 0, 0]", False), ("", True)])
def test_a_place_left_out_is_doubted_and_one_at_zero_is_not(place, is_doubted, tmp_path):
    doubts = checked(tmp_path, ("at: [0, 0.1, 0]", place)).doubts
    assert any(line.startswith("joints.feet: no place is given") for line in doubts) == is_doubted


def test_a_place_survives_writing(tmp_path):
    checked(tmp_path, ("at: [0, 0.1, 0]", ""))
    machine = read_machine(tmp_path / "m.yaml")
    assert not machine.description.joints["feet"].placed
    write_machine(machine.description, tmp_path / "again.yaml")
    assert read_machine(tmp_path / "again.yaml").description.joints["feet"].placed


@pytest.mark.parametrize(("change", "part", "words"), [
    (("{x: 9e8, y: 1.5e8, z: 1.2e9,", "{x: 700000, y: 1.5e8, z: 1.2e9,"), "joints.guide_y.stiffness.x",
     "times below the least"),
    (("{x: 4e8, y: 4e8, z: 9e8,", "{x: 3e5, y: 3e5, z: 3e5,"), "joints.feet.stiffness.x", "times below the least"),
    (("rx: 5e7, ry: 8e7", "rx: 5e4, ry: 8e7"), "joints.guide_x.stiffness.rx", "along ry of the same joint"),
    (("mass: 2200 kg", "density: 7.2"), "bodies.bed.density", "lighter than foam"),
    (("tip: {body: spindle, at: [0, -0.25, 1.1]}", "tip: {body: spindle, at: [0, -0.25, 11]}"), "points.tip", "off its body"),
    (("direction: -x", "direction: x"), "axes.X", "+X moves the tool along -x relative to the work"),
    (("direction: -x", "direction: -y"), "axes.X", "not its own direction"),
    (("tool: tip", "# tool: tip"), "cutting", "no point is the tool"),
    (("damping_ratio: 3 %", "damping_ratio: 0.9"), "damping_ratio", "90 %"),
    (("at: [0, -0.25, 0.85],", "at: [0, -0.25, 0.85], rotation: [0, 0, 0.0274156],"), "joints.guide_x.rotation",
     "read as degrees"),
])
def test_a_valid_number_that_is_hardly_meant_is_doubted(change, part, words, tmp_path):
    doubts = checked(tmp_path, change).doubts
    assert any(line.startswith(part) and words in line for line in doubts), doubts


SCREW = ("stiffness: {x: 1.5e8, y: 9e8, z: 1.2e9, rx: 5e7, ry: 8e7, rz: 6e7}",
         "law: {guideway: {at: [[0.2, 0.2, 0], [0.2, -0.2, 0], [-0.2, 0.2, 0], [-0.2, -0.2, 0]], radial: 500 N/um, "
         "lateral: 500 N/um},"
         " ball_screw: {nut: 600 N/um, bearing: 800 N/um, diameter: 35 mm, length: 900 mm, nut_at: 450 mm, follows: away}}")


@pytest.mark.parametrize(("change", "part", "words"), [
    (("35 mm", "35 mm"), "", ""),
    (("diameter: 35 mm", "diameter: 28"), "joints.guide_x.law.ball_screw", "no ball screw of a machine tool"),
    (("nut_at: 450 mm", "nut_at: 700 mm"), "axes.X", "an end of its travel"),
    (("radial: 500 N/um", "radial: 700000"), "joints.guide_x.law.guideway.radial", "softer than any"),
    (("[[0.2, 0.2, 0], [0.2, -0.2, 0], [-0.2, 0.2, 0], [-0.2, -0.2, 0]]", "[[0.2, -0.05, 0.85], [0.2, -0.45, 0.85], "
      "[-0.2, -0.05, 0.85], [-0.2, -0.45, 0.85]]"), "joints.guide_x.law.guideway.at", "not from the machine's origin"),
])
def test_slips_of_parts_of_a_catalogue(change, part, words, tmp_path):
    doubts = checked(tmp_path, SCREW, change).doubts
    assert not doubts if not part else any(line.startswith(part) and words in line for line in doubts), doubts


def test_parent_and_child_exchanged_are_named(tmp_path):
    with pytest.raises(ToolpointError, match=r"guide_z: parent and child are the wrong way round") as caught:
        checked(tmp_path, ("guide_z: {parent: column, child: head", "guide_z: {parent: head, child: column"))
    assert "closes_loop" not in str(caught.value) and "hangs on no joint" not in str(caught.value)


def test_which_way_plus_moves_the_tool(tmp_path):
    assert "+X moves the tool along +x relative to the work" in checked(tmp_path).motion


SHEET = (resources.files("toolpoint") / "app/machines/milling_robot_datasheet.yaml").read_text()


@pytest.mark.parametrize(("changes", "part"), [
    ([], ""),
    ([("bending: 39.2e4", "bending: 392")], "catalogue.SHG-25-80.bending"),
    ([("torsion: [2.5e4]", "torsion: [25]")], "catalogue.SHG-25-80.torsion"),
    ([("bending: 39.2e4", "bending: 39.2e7")], "catalogue.SHG-25-80.bending"),
    ([("damping: 14", "damping: 14000")], "catalogue.SHG-25-80.damping"),
    ([("alpha: -90 deg", "alpha: -1.5708 deg")], "axes.q1.alpha"),
    ([("alpha: 180 deg", "alpha: 3.14159 deg")], "axes.q2.alpha"),
    ([("weight: 25 kg", "weight: 25 g")], "weight"),
    ([("weight: 25 kg", "weight: 25 t")], "weight"),
    ([("mass: 7 kg, diameter", "mass: 7 g, diameter")], "payload.mass"),
    ([("reach: 717 mm", "reach: 7170 mm")], "reach"),
])
def test_slips_of_a_datasheet(changes, part, tmp_path):
    text = SHEET
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "robot.yaml").write_text(text)
    doubts = question_datasheet(read_datasheet(tmp_path / "robot.yaml"))
    assert [doubt.what for doubt in doubts] == ([part] if part else []), doubts


@pytest.mark.parametrize(("key", "factor", "part"), [
    ("torsion", 1e-3, "catalogue"), ("torsion", 0.1, "first frequency"), ("damping", 1e-3, "damping of the first mode"),
    ("damping", 12.0, "damping of the first mode")])
def test_a_unit_of_the_whole_catalogue_is_told_by_the_first_mode(key, factor, part, tmp_path):
    """No reducer stands out, so only frequency and damping of the robot as a whole contradict it."""
    pattern = rf"(\b{key}: \[?)([\d.e]+)"
    head, tail = SHEET.split("catalogue:", 1)
    catalogue, rest = tail.split("members:", 1)
    changed = re.sub(pattern, lambda found: f"{found.group(1)}{float(found.group(2)) * factor:g}", catalogue)
    (tmp_path / "robot.yaml").write_text(f"{head}catalogue:{changed}members:{rest}")
    doubts = question_datasheet(read_datasheet(tmp_path / "robot.yaml"))
    assert doubts and doubts[0].what.startswith(part), doubts


def test_an_arm_of_a_machine_file_is_asked_as_a_whole(tmp_path):
    text = read_template("machine", "robot")
    rows = re.sub(r"((?:rx|ry|rz): )([\d.]+e\d)", lambda found: f"{found.group(1)}{float(found.group(2)) * 30:g}", text)
    (tmp_path / "arm.yaml").write_text(text)
    assert not check_machine(read_machine(tmp_path / "arm.yaml")).doubts
    (tmp_path / "arm.yaml").write_text(rows)
    doubts = check_machine(read_machine(tmp_path / "arm.yaml")).doubts
    assert [doubt.what for doubt in doubts] == ["first frequency"], doubts
