"""Machine files: what is read, what is written back, and every fault at once with line, column and remedy."""

import json
from dataclasses import replace

import numpy as np
import pytest
from broken_machines import CHANGED, GOOD, SEVERAL, WHOLE
from hypothesis import given
from hypothesis import strategies as st

from toolpoint._check import ToolpointError
from toolpoint._doubt import Doubt
from toolpoint.app.main import main
from toolpoint.io.faults import FileFaults
from toolpoint.io.quantities import units
from toolpoint.io.yaml import machine_file
from toolpoint.io.yaml.machine_schema import json_schema


def read(tmp_path, text):
    path = tmp_path / "machine.yaml"
    path.write_text(text, encoding="utf-8")
    return machine_file.read(path)


def test_good_file_is_read_in_si(tmp_path):
    machine = read(tmp_path, GOOD)
    assert machine.value("joints.foot.stiffness.z") == pytest.approx(2e8)
    assert machine.value("joints.foot.loss_factor") == pytest.approx(0.04)
    assert machine.description.bodies["head"].centre == pytest.approx((0.3, 0, 1.5))
    assert machine.description.axes["Z"].limits == pytest.approx((-0.3, 0.3))
    assert machine.size == 4


def test_written_file_reads_back_equal(tmp_path, vertical, vertical_drives):
    for machine in (vertical, vertical_drives, read(tmp_path, GOOD)):
        machine_file.write(machine.description, tmp_path / "copy.yaml")
        assert machine_file.read(tmp_path / "copy.yaml").description == machine.description


@pytest.mark.parametrize("name", list(CHANGED))
def test_changed_file_gives_its_faults(tmp_path, name):
    old, new, expected = CHANGED[name]
    assert GOOD.count(old) >= 1
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, GOOD.replace(old, new, 1))
    _expect(caught.value, expected)


@pytest.mark.parametrize("name", list(WHOLE))
def test_file_that_is_no_machine_file(tmp_path, name):
    text, expected = WHOLE[name]
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, text)
    _expect(caught.value, expected)


def _expect(error, expected):
    for line, text in expected:
        found = [fault for fault in error.faults if fault.line == line and text in fault.message]
        assert found, f"line {line}, {text!r} is not in\n{error}"
    shown = str(error)
    assert all(f":{fault.line}:{fault.column}:" in shown for fault in error.faults)


def test_all_faults_come_at_once(tmp_path):
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, SEVERAL)
    _expect(caught.value, [(4, "greater than 0"), (4, "triangle"), (4, "unknown key 'colour'"), (5, "decimal comma"),
                           (5, "not a finite"), (7, "did you mean 'column'"), (7, "2 values"), (7, "write the rad"),
                           (8, "already given"), (9, "no acceleration")])


@pytest.mark.parametrize("name", [*CHANGED, *WHOLE])
def test_command_line_ends_with_code_two_and_no_traceback(tmp_path, capsys, name):
    path = tmp_path / "machine.yaml"
    path.write_text(GOOD.replace(*CHANGED[name][:2], 1) if name in CHANGED else WHOLE[name][0], encoding="utf-8")
    with pytest.raises(SystemExit) as stopped:
        main(["check", str(path)])
    assert stopped.value.code == 2
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err + shown.out
    assert "machine.yaml" in shown.err


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(ValueError, match="No such file"):
        machine_file.read(tmp_path / "none.yaml")
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ValueError, match="UTF-8"):
        machine_file.read(tmp_path / "binary.yaml")


@pytest.mark.parametrize("name", ["test.h5", "test.uff", "hits.WAV"])
def test_a_measured_file_in_place_of_a_machine_is_told_what_it_is(tmp_path, name):
    (tmp_path / name).write_bytes(b"\x89HDF\r\n" if name.endswith("h5") else b"    -1\n   151\n")
    with pytest.raises(ToolpointError, match=r"files hold measurements.*expected here is YAML.*--frf"):
        machine_file.read(tmp_path / name)


def test_byte_order_mark_and_windows_line_ends_are_fine(tmp_path):
    path = tmp_path / "machine.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert machine_file.read(path).size == 4


def test_numbers_of_yaml_1_2(tmp_path):
    machine = read(tmp_path, GOOD.replace("{z: 1e8}", "{z: 2e8}").replace("name: test stand", "name: no"))
    assert machine.value("joints.guide.stiffness.z") == 2e8
    assert machine.name == "no"


def test_stl_body_equals_its_shape(tmp_path):
    corners = np.array([[x, y, z] for x in (-200, 200) for y in (-150, 150) for z in (-300, 300)], float)
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
             (1, 5, 7), (1, 7, 3)]
    text = "solid box\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corners[list(face)])
        + "endloop\nendfacet\n" for face in faces) + "endsolid box\n"
    (tmp_path / "box.stl").write_text(text)
    record = np.zeros(12, [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")])
    record["c"] = corners[np.array(faces)]
    (tmp_path / "binary.stl").write_bytes(b"binary".ljust(80) + (12).to_bytes(4, "little") + record.tobytes())
    shape = 'shape: {kind: box, size: "0.4, 0.3, 0.6 m"}'
    expected = read(tmp_path, GOOD).bodies[1].mass
    for name in ("box.stl", "binary.stl"):
        found = read(tmp_path, GOOD.replace(shape, f"mesh: {{file: {name}, unit: 1 mm}}")).bodies[1].mass
        np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-6)
    (tmp_path / "cut.stl").write_text(text[: len(text) // 2])
    with pytest.raises(FileFaults, match="cut off"):
        read(tmp_path, GOOD.replace(shape, "mesh: {file: cut.stl}"))


def test_schema_knows_every_section_and_is_json():
    schema = json.loads(json.dumps(json_schema()))
    assert {"bodies", "joints", "axes", "points", "cutting"} <= set(schema["properties"])
    assert schema["additionalProperties"] is False


@pytest.mark.parametrize(("text", "kind", "value"), [
    ("902.78 GN*mm/rad", units.TURNING_STIFFNESS, 902.78e6), ("10 Nm", units.MOMENT, 10), ("200 N/um", units.STIFFNESS, 2e8),
    ("200 N/µm", units.STIFFNESS, 2e8), ("7.2 g/cm^3", units.DENSITY, 7200), ("30 deg", units.ANGLE, np.pi / 6),
    ("12000 rpm", units.SPEED, 12000), ("3 %", units.RATIO, 0.03), ("1.2 kHz", units.FREQUENCY, 1200),
    ("2 N·s/mm", units.DAMPING, 2000), ("5 kg·m²", units.AREA_MOMENT, 5), (".5e3mm", units.LENGTH, 0.5),
    ("3 N m s/rad", units.TURNING_DAMPING, 1.0 * 3)])
def test_units_of_the_field(text, kind, value):
    if text == "3 N m s/rad":
        text = "3 N*m*s/rad"
    assert units.quantity(text, kind) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(("text", "kind"), [("1 Hz", units.SPEED), ("60 rpm", units.FREQUENCY), ("1 rad/s", units.FREQUENCY),
                                            ("10 Nm", units.STIFFNESS), ("1,5 m", units.LENGTH), (True, units.LENGTH)])
def test_what_must_not_be_mixed_up_is_refused(text, kind):
    with pytest.raises(units.UnitError):
        units.quantity(text, kind)


@given(st.floats(-100, 100), st.sampled_from(["m", "mm", "um", "cm"]))
def test_length_round_trip(number, unit):
    factor = {"m": 1, "mm": 1e-3, "um": 1e-6, "cm": 1e-2}[unit]
    assert units.quantity(f"{number!r} {unit}", units.LENGTH) == pytest.approx(number * factor, rel=1e-12, abs=0)


@given(st.text(max_size=200))
def test_any_text_gives_faults_and_nothing_else(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("fuzz") / "m.yaml"
    path.write_text(text, encoding="utf-8", errors="replace")
    with pytest.raises(ValueError):
        machine_file.read(path)


CUTTING = """tool: tool
cutting:
  diameter: 16 mm
  teeth: 4
  entry: 20 deg
  exit: 100 deg
  helix: "30, 32, 30, 32 deg"
  pitch: [80 deg, 100 deg, 80 deg, 100 deg]
  runout: 8 um
  runout_angle: 40 deg
  tilt: 0.1 mrad
  corner_radius: 2 mm
  material: Al 7075:3
  axial: 300 MPa
  edge_tangential: 12 N/mm
  process_damping: 250 N/m
  damping_friction: 0.2
  speed_variation: {amplitude: 10 %, revolutions: 4, phase: 30 deg}
  feed_per_tooth: 0.1 mm
"""


def with_cutting(text):
    return GOOD.replace("tool: tool\n", text, 1)


def test_cutting_section_is_read_in_si_and_written_back(tmp_path, capsys):
    machine = read(tmp_path, with_cutting(CUTTING))
    cut = machine.description.cutting
    assert cut.tool.helix == pytest.approx(np.radians([30, 32, 30, 32]))
    assert cut.tool.pitch == pytest.approx(np.radians([80, 100, 80, 100]))
    k = cut.coefficients
    assert (cut.tool.runout, cut.tool.tilt, k.axial, k.edge_tangential) == pytest.approx((8e-6, 1e-4, 3e8, 12e3))
    assert (cut.variation.amplitude, cut.variation.phase) == pytest.approx((0.1, np.pi / 6))
    assert cut.damping.coefficient == 250 and cut.feed_per_tooth == pytest.approx(1e-4) and k.tangential is None
    machine_file.write(machine.description, tmp_path / "copy.yaml")
    assert machine_file.read(tmp_path / "copy.yaml").description == machine.description
    machine_file.write_cutting(cut, tmp_path / "cut.yaml")
    (tmp_path / "joined.yaml").write_text(GOOD + (tmp_path / "cut.yaml").read_text())
    assert machine_file.read(tmp_path / "joined.yaml").description.cutting == cut
    main(["check", str(tmp_path / "copy.yaml")])
    shown = capsys.readouterr().out
    assert "helix 30/32 deg" in shown and "Al 7075, set 3 of 4" in shown and "corner radius 2 mm" in shown


@pytest.mark.parametrize(("old", "new", "line", "text"), [
    ("100 deg]", "90 deg]", 34, "add up to 360"), ("[80 deg, 100 deg,", "[", 34, "one for each of the 4 teeth"),
    ("Al 7075:3", "Al 7065", 39, "did you mean 'Al 7075'"), ("Al 7075:3", "Al 7075:5", 39, "4 sets"),
    ("corner_radius: 2 mm", "corner_radius: 9 mm", 38, "ball end mill"), ("exit: 100 deg", "exit: 10 deg", 31, "entry < exit"),
    ("  exit: 100 deg\n", "", 28, "belong together"), ("entry: 20 deg", "immersion: 0.5", 28, "belong together"),
    ("10 %", "95 %", 44, "less than 0.9"), ("12 N/mm", "12 N", 41, "not one of edge coefficient"),
    ("runout: 8 um", "runout: 8 mm", 35, "less than or equal to 0.001"),
    ("process_damping: 250 N/m", "process_damping: -1", 42, "equal to 0"),
    ("material: Al 7075:3", "source: chosen", 28, "unless a material is named"),
    ("helix:", "helx:", 33, "did you mean 'helix'"),
    ("30, 32, 30, 32 deg", "30, 32, 30, 3x deg", 33, "deg")])
def test_faults_of_the_cutting_section(tmp_path, old, new, line, text):
    changed = with_cutting(CUTTING)
    assert changed.count(old) == 1
    with pytest.raises(FileFaults) as caught:
        read(tmp_path, changed.replace(old, new, 1))
    _expect(caught.value, [(line, text)])


def test_a_doubt_among_the_assumptions_is_written_as_its_sentence(tmp_path, vertical):
    doubt = Doubt("measured modes at 44.7 Hz", "look like none of the machine's", "check the chain")
    machine_file.write(replace(vertical.description, assumptions=(doubt,)), tmp_path / "copy.yaml")
    assert machine_file.read(tmp_path / "copy.yaml").description.assumptions == (str(doubt),)


def test_an_unknown_key_of_a_part_beside_it_is_sent_there(tmp_path):
    """A mesh file under `elastic` is meant for `solid`; a key of many parts is sent nowhere."""
    path = tmp_path / "machine.yaml"
    path.write_text("toolpoint: 1\nname: x\nbodies: {ram: {elastic: {file: ram.inp, held: FOOT, mass: 3 kg}}}\njoints: {}\n")
    with pytest.raises(ToolpointError) as caught:
        machine_file.read(path)
    words = str(caught.value)
    assert "(held is a key of solid)" in words
    assert "(file is a key of mesh and of matrices and of solid)" in words
