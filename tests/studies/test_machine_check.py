"""What `check` says of a machine: the drawing in words, and doubts that a slip of a unit gives away."""

import pytest

from toolpoint.io import read_machine, write_machine
from toolpoint.io.template_files import read_template
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
