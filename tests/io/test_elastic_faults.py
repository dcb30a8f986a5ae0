"""Faults and doubts of elastic bodies in a machine file, as a user meets them: the place in the file, the value, the remedy."""

import pytest

from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.studies import solve_modes
from toolpoint.studies.machines.check.machine_check import check_machine

TEXT = """toolpoint: 1
name: slide
bodies:
  bed:
    elastic:
      band: 600 Hz
      mesh_size: 250 mm
      materials: {body: {modulus: 110 GPa, density: 7200 kg/m^3, poisson: 0.26}}
      boxes:
        - {low: [0, 0, -100 mm], high: [1000 mm, 120 mm, 0]}
      interfaces:
        foot: {centre: [500 mm, 60 mm, -100 mm], along: [1, 0, 0], across: [0, -1, 0], length: 400 mm, width: 100 mm}
        way: {centre: [500 mm, 60 mm, 0], along: [1, 0, 0], across: [0, 1, 0], length: 120 mm, width: 60 mm, slide: [-0.3, 0.3]}
  carriage: {mass: 40 kg, centre: [0.5, 0.06, 0.1], shape: {kind: box, size: [0.2, 0.2, 0.2]}}
joints:
  feet: {parent: ground, child: bed, at: [0.5, 0.06, -0.1], child_interface: foot,
         stiffness: {x: 3e8, y: 3e8, z: 5e8, rx: 5e6, ry: 8e6, rz: 5e6}}
  guide: {parent: bed, child: carriage, at: [0.5, 0.06, 0], parent_interface: way,
          stiffness: {x: 5e7, y: 3e8, z: 3e8, rx: 1e6, ry: 1e6, rz: 1e6}}
axes:
  X: {joint: guide, direction: x, limits: [-300 mm, 300 mm]}
points:
  tool: {body: carriage, at: [0.5, 0.06, 0.3]}
tool: tool
"""


@pytest.fixture(autouse=True)
def _cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("TOOLPOINT_CACHE", str(tmp_path_factory.getbasetemp() / "bodies"))


def changed(tmp_path, old, new):
    assert old in TEXT
    path = tmp_path / "m.yaml"
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(("old", "new", "words"), [
    ("slide: [-0.3, 0.3]", "slide: [-0.48, 0.48]", r"m.yaml:13:.*bodies.bed.elastic.interfaces.way.Patch: .*leaves its rail"),
    ("slide: [-0.3, 0.3]", "slide: [0.3, -0.3]", r"m.yaml:13:\d+: bodies.bed.elastic.interfaces.way.slide: 0.3 .. -0.3 m"),
    ("slide: [-0.3, 0.3]", "slide: [0.3]", r"m.yaml:13:\d+: bodies.bed.elastic.interfaces.way.slide: 1 positions"),
    ("-100 mm], along", "-90 mm], along", r"m.yaml:12:\d+: bodies.bed.elastic.interfaces.foot.Patch: 0 % of"),
    ("band: 600 Hz", "band: 600 Hz\n      size: 1", r"m.yaml:7:\d+: bodies.bed.elastic.size: 1; must be"),
    ("mesh_size: 250 mm", "mesh_size: 0.5 mm", r"m.yaml:7:\d+: bodies.bed.elastic.mesh_size: 0.5 mm, .*its unit right"),
    ("mesh_size: 250 mm", "mesh_size: 2.5 mm", r"m.yaml:7:\d+: bodies.bed.elastic.mesh_size: 2.5 mm, .*must give 4e\+05"),
    ("poisson: 0.26", "poisson: 0.5", r"m.yaml:8:\d+: bodies.bed.elastic.materials.body.poisson: 0.5: .*0.49"),
    ("child_interface: foot", "child_interface: feet",
     r"m.yaml:16:\d+: joints.feet.child_interface: 'feet'; .*did you mean 'foot'"),
    (" parent_interface: way,", "", r"m.yaml:18:\d+: joints.guide.parent_interface: none; must be of .*bed: foot, way"),
    ("{body: carriage, at: [0.5, 0.06, 0.3]}", "{body: bed, at: [0.5, 0.06, 0]}",
     r"m.yaml:23:\d+: points.tool.interface: none; must be of .*bed: foot"),
    ("{body: carriage, at: [0.5, 0.06, 0.3]}", "{body: bed, interface: way}",
     r"m.yaml:23:\d+: points.tool.interface: 'way'; slides, and can be held by a joint only"),
    ("high: [1000 mm, 120 mm, 0]}", "high: [1000 mm, 120 mm, 0]}\n        - {low: [1.1, 0, 0], high: [1.2, 0.1, 0.1]}",
     r"m.yaml:5:\d+: bodies.bed.elastic.Casting.cuboids: 2 pieces")])
def test_faults_stand_at_their_place_in_the_file(tmp_path, old, new, words):
    with pytest.raises(ToolpointError, match=words):
        read_machine(changed(tmp_path, old, new))


def test_what_is_meant_is_not_doubted(tmp_path):
    whole = check_machine(read_machine(changed(tmp_path, "name: slide", "name: slide")))
    assert whole.doubts == () and whole.reduction[0].startswith("X ")


@pytest.mark.parametrize(("old", "new", "words"), [
    ("limits: [-300 mm, 300 mm]", "limits: [-300 mm, 350 mm]", "axes.X: at X 350 mm, an end of its travel: body bed, interfac"),
    ("direction: x", "direction: y", "axes.X: at X 300 mm joint guide is 300 mm beside slide way of bed"),
    ("density: 7200 kg/m^3", "density: 7.2", "materials.body.density: 7.2 kg/m^3, lighter than foam"),
    pytest.param("modulus: 110 GPa", "modulus: 110000", "materials.body.modulus: 110000 Pa, softer than plastic",
                 marks=pytest.mark.slow),
    pytest.param("band: 600 Hz", "band: 20 kHz", "bodies.bed.elastic.mesh_size: 250 mm is less than 2 elements a shear wave",
                 marks=pytest.mark.slow),
    ("{x: 5e7, y: 3e8, z: 3e8, rx: 1e6, ry: 1e6, rz: 1e6}", "{y: 3e8, z: 3e8, rx: 1e6, ry: 1e6, rz: 1e6}, free: [x]",
     "joints.guide: nothing holds x: a mode at 0 Hz")])
def test_what_is_hardly_meant_is_doubted(tmp_path, old, new, words):
    checked = check_machine(read_machine(changed(tmp_path, old, new)))
    assert any(words in doubt for doubt in checked.doubts)


@pytest.mark.slow
def test_a_carriage_beyond_its_rail_and_a_narrow_band_are_told_by_modes(tmp_path):
    machine = read_machine(changed(tmp_path, "limits: [-300 mm, 300 mm]", "limits: [-300 mm, 350 mm]"))
    with pytest.raises(ToolpointError, match=r"interface way: .*position 0.35 m; must be within its way, -0.3 .. 0.3 m"):
        solve_modes(machine, {"X": 0.35})
    narrow = solve_modes(read_machine(changed(tmp_path, "band: 600 Hz", "band: 200 Hz")))
    assert None in narrow.to_dict()["reduction_error"] and "`" not in "".join(narrow.notes)


def test_a_band_that_no_mesh_carries_is_refused_once_its_modes_are_counted(tmp_path):
    """Hundreds of the elements' own modes were looked for, for minutes, and then a negative stiffness was named."""
    path = changed(tmp_path, "mesh_size: 250 mm", "mesh_size: 100 mm")
    path.write_text(path.read_text().replace("band: 600 Hz", "band: 60 kHz"))
    with pytest.raises(ToolpointError, match=r"m.yaml:6:.*bodies.bed.elastic.band: \d+ of \d+ modes lie below 9e\+04 Hz"):
        solve_modes(read_machine(path), count=3)
