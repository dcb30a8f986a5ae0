"""`toolpoint joints`: measured responses in, the published machine's joints and a machine file that runs out."""

import json
import time

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError
from toolpoint._check import FileDoubt
from toolpoint.app.main import main
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.measured import geometry_files
from toolpoint.io.yaml import machine_file
from toolpoint.machine.assembly.shapes import body_shapes
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies.machines.virtual_test import MeasuringPoints, surface_points, true_modes
from toolpoint.vibration import Dof, Frf, Modes, frequency_response
from toolpoint.vibration.correlation import mac

RIDES_ON = {"base": "base", "saddle": "base", "table": "base", "column": "column", "head": "column", "magazine": "magazine"}
# The chosen masses of the machine file, whole components.
BODIES = {"base": (6354, (0, 1.282, -0.679), (1.161, 1.821, 0.81)), "column": (2805, (0, 1.869, 0.355), (0.94, 0.99, 2.469)),
          "magazine": (300, (-0.553, 1.89, 1.265), (0.831, 0.92, 0.932))}


@pytest.fixture(scope="module")
def measured_machine(vertical, tmp_path_factory):
    """Accelerances at 60 points with 1 % noise as a universal file, and a component file."""
    folder, rng = tmp_path_factory.mktemp("joints"), np.random.default_rng(3)
    points = surface_points(vertical, 60, rng)
    modes = true_modes(vertical, points, 0.03)
    share = np.abs(modes.shape) / np.abs(modes.shape).max(axis=0)
    struck = modes.dofs[int(np.argmax(share.min(axis=1)))]
    exact = frequency_response.modal(modes, np.linspace(5, 100, 761), None, inputs=[struck], quantity="accelerance")
    noise = 0.01 * np.sqrt((np.abs(exact.values) ** 2).mean(axis=0) / 2)
    values = exact.values + noise * (rng.normal(size=exact.values.shape) + 1j * rng.normal(size=exact.values.shape))
    geometry = uff.MeasuredGeometry(tuple(points.places), np.array([at for _, at in points.places.values()]))
    uff.write(folder / "test.uff", geometry, Frf(exact.frequency, values, exact.outputs, exact.inputs, "accelerance"))
    parts = {name: [p for p, (body, _) in points.places.items() if RIDES_ON[body] == name] for name in BODIES}
    lines = ["toolpoint: 1", "name: from its test", "chain: [ground, base, column, magazine]", "components:"]
    for name, (mass, centre, size) in BODIES.items():
        lines += [f"  {name}:", f"    points: {parts[name]}",
                  f"    body: {{mass: {mass} kg, centre: {list(centre)}, shape: {{kind: box, size: {list(size)}}}}}"]
    (folder / "components.yaml").write_text("\n".join(lines) + "\n")
    return folder


def arguments(folder, *more):
    return ["joints", str(folder / "test.uff"), "--geometry", str(folder / "test.uff"), "--components",
            str(folder / "components.yaml"), *more]


def test_geometry_is_read_from_a_machine_file_too():
    found = geometry_files.read(MACHINES / "three_axis_vertical.yaml")
    machine = machine_file.read(MACHINES / "three_axis_vertical.yaml")
    assert set(found.points) == set(machine.description.points)
    place = place_machine(machine)
    for name, at in found.points.items():
        np.testing.assert_allclose(at, place.position(machine.description.points[name])[0])


@pytest.mark.parametrize(("name", "content", "words"), [
    ("g.csv", b"1,2,3\n", "g.csv:1: '1,2,3'; read as CSV"), ("g.txt", b"point x y z\n1 0 0 0\n", "or a machine file (.yaml)"),
    ("g.h5", b"\x89HDF\x00\xff", "kept beside modes, but"),
    ("g.yaml", b"components: {a: {points: [1]}}\n", "points of a machine"), ("g.json", b"", "no points")])
def test_geometry_of_another_format_is_told_which_are_read(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ToolpointError, match="point,x,y,z in m") as raised:
        geometry_files.read(tmp_path / name)
    assert words in str(raised.value)


@pytest.mark.slow
def test_measured_responses_become_a_machine_that_runs(measured_machine, tmp_path, capsys, vertical):
    main(arguments(measured_machine, "--machine", str(tmp_path / "found.yaml"), "-o", str(tmp_path / "page")))
    shown = capsys.readouterr().out
    assert "3 joints established" in shown
    found = machine_file.read(tmp_path / "found.yaml")
    kinds = {name: tuple(joint.stiffness) for name, joint in found.description.joints.items()}
    # Tables 3 and 4 of the paper: six freedoms and no others.
    assert kinds == {"ground_base": ("rx", "ry", "rz"), "base_column": ("rx",), "column_magazine": ("ry", "rz")}
    assert found.value("joints.base_column.stiffness.rx") == pytest.approx(184.64e6, rel=0.02)
    at = found.description.joints["ground_base"].frame.at
    np.testing.assert_allclose(at, (0, 1.063, -1.5), atol=0.015)
    np.testing.assert_allclose(body_shapes(found).frequency, body_shapes(vertical).frequency, rtol=5e-3)
    points = surface_points(vertical, 60, np.random.default_rng(3))
    carried = MeasuringPoints({p: (RIDES_ON[body], at) for p, (body, at) in points.places.items()})
    agreement = mac(true_modes(found, carried, 0.03).shape, true_modes(vertical, points, 0.03).shape)
    assert np.diag(agreement).min() > 0.99
    assert "Joints of from its test" in (tmp_path / "page/index.html").read_text()


def test_a_geometry_in_another_unit_is_refused_before_the_fit(measured_machine, tmp_path, capsys):
    points = geometry_files.read(measured_machine / "test.uff").points
    given = arguments(measured_machine, "-o", str(tmp_path / "page"))
    at = given.index("--geometry") + 1
    given[at] = str(tmp_path / "g.csv")
    (tmp_path / "g.csv").write_text("\n".join(f"{name},{','.join(repr(float(v / 0.0254)) for v in place)}"
                                              for name, place in points.items()))
    started = time.process_time()
    with pytest.raises(SystemExit):
        main(given)
    shown = " ".join(capsys.readouterr().err.split())
    assert "write the unit in the first line" in shown and time.process_time() - started < 3


@pytest.mark.slow
def test_a_turned_test_is_turned_back_with_a_doubt_and_in_silence_where_its_frame_is_told(measured_machine, tmp_path, capsys):
    """The test's x is the machine's -y, in the labels of its responses and in its points."""
    points = geometry_files.read(measured_machine / "test.uff").points
    given = arguments(measured_machine, "-o", str(tmp_path / "page"))
    given[given.index("--geometry") + 1] = str(tmp_path / "g.csv")
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (tmp_path / "g.csv").write_text("\n".join(f"{name},{','.join(repr(float(v)) for v in turn @ place)}"
                                              for name, place in points.items()))
    frf = uff.read_frf(measured_machine / "test.uff")
    to_test = {"+x": "-y", "+y": "+x", "+z": "+z"}
    labels = [Dof(dof.point, to_test[dof.direction]) for dof in frf.outputs]
    struck = [Dof(dof.point, to_test[dof.direction]) for dof in frf.inputs]
    uff.write(tmp_path / "turned.uff", Frf(frf.frequency, frf.values, labels, struck, "accelerance"))
    given[1] = str(tmp_path / "turned.uff")
    main([*given, "--machine", str(tmp_path / "found.yaml"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert any("rotation: [90 deg, 0 deg, 0 deg]" in doubt for doubt in told["doubts"])
    assert {joint["child"]: joint["parent"] for joint in told["joints"]} == {
        "base": "ground", "column": "base", "magazine": "column"}
    parts = (measured_machine / "components.yaml").read_text() + "frame: {rotation: [90 deg, 0, 0]}\n"
    (tmp_path / "components.yaml").write_text(parts)
    given[given.index("--components") + 1] = str(tmp_path / "components.yaml")
    main([*given, "--json"])
    told = json.loads(capsys.readouterr().out)
    assert not any("frame" in doubt for doubt in told["doubts"]) and told["status"].startswith("3 joints established")


@pytest.mark.parametrize(("old", "new", "words"), [
    ("chain: [ground, base, column, magazine]", "chain: [ground, base, colum, magazine]", "no component 'colum'"),
    ("mass: 300 kg", "mass: -300 kg", "greater than 0"), ("components:", "componets:", "did you mean 'components'"),
    ("    body: {mass: 300 kg", "    boddy: {mass: 300 kg", "did you mean 'body'")])
def test_faults_of_a_component_file(measured_machine, tmp_path, capsys, old, new, words):
    text = (measured_machine / "components.yaml").read_text()
    assert old in text
    (tmp_path / "components.yaml").write_text(text.replace(old, new))
    wrong = arguments(measured_machine)
    wrong[wrong.index("--components") + 1] = str(tmp_path / "components.yaml")
    with pytest.raises(SystemExit) as stopped:
        main(wrong)
    assert stopped.value.code == 2
    shown = capsys.readouterr().err
    assert words in shown and "Traceback" not in shown


@pytest.mark.slow
def test_the_machine_is_correlated_updated_and_studied_without_further_options(measured_machine, tmp_path, capsys):
    """Responses -> joints -> the machine beside its own test, updated to it: the measured points ride on its bodies."""
    found, page = str(tmp_path / "found.yaml"), ["-o", str(tmp_path / "page")]
    test, modes = str(measured_machine / "test.uff"), str(tmp_path / "modes.h5")
    main(["identify", test, "--modes", modes, *page])
    main(arguments(measured_machine, "--machine", found, *page))
    points = machine_file.read(found).description.points
    assert len(points) == 60 and {point.body for point in points.values()} == set(BODIES)
    capsys.readouterr()
    main(["correlate", found, test, *page, "--json"])
    agreed = json.loads(capsys.readouterr().out)
    assert len(agreed["points_paired"]) == 60 and len(agreed["modes"]) == 6
    assert min(mode["mac"] for mode in agreed["modes"]) > 0.99 and agreed["total"] > 0.98
    # A wrong foot is mended again by the modes of the same test.
    machine = machine_file.read(found)
    path = "joints.ground_base.stiffness.rx"
    machine_file.write(machine.with_values({path: 0.7 * machine.value(path)}).description, tmp_path / "wrong.yaml")
    main(["update", str(tmp_path / "wrong.yaml"), "--modes", modes, *page, "--json"])
    updated = json.loads(capsys.readouterr().out)
    assert updated["values"][path] == pytest.approx(902.78e6, rel=0.02) and updated["status"].startswith("converged")
    main(["sensitivity", found, *page, "--json"])
    assert len(json.loads(capsys.readouterr().out)["frequency_hz"]) == 6


@pytest.mark.slow
def test_a_mode_that_the_machine_does_not_have_has_no_partner_and_stops_nothing(measured_machine, tmp_path, capsys, vertical):
    points = surface_points(vertical, 60, np.random.default_rng(3))
    truth = true_modes(vertical, points, 0.03)
    odd = np.random.default_rng(4).normal(size=(len(truth.dofs), 1)) * 1e-3
    order = np.argsort(frequency := np.append(truth.frequency, 44.7))
    hdf5.write(Modes(frequency[order], 0.03, np.hstack([truth.shape, odd])[:, order], truth.dofs), tmp_path / "modes.h5")
    found, page = str(tmp_path / "found.yaml"), ["-o", str(tmp_path / "page")]
    given = arguments(measured_machine, "--machine", found, *page)
    main([given[0], str(tmp_path / "modes.h5"), *given[2:]])
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in capsys.readouterr().out.splitlines() if "│" in line]
    assert [row[0] for row in rows] == ["1", "2", "3", "4", "5", "6", "no partner"]
    assert rows[-1][2] == "44.700" and max(abs(float(row[3])) for row in rows[:6]) < 0.5
    with pytest.warns(FileDoubt, match="44.7 Hz"):
        written = machine_file.read(tmp_path / "found.yaml").description
    assert written.reference[0].frequencies == pytest.approx(truth.frequency, rel=1e-6)
    assert any("without a partner" in text and "left out: 44.7 Hz" in text for text in written.assumptions)
    main(["update", found, "--modes", str(tmp_path / "modes.h5"), *page])
    shown = capsys.readouterr()
    assert "the measured modes at 44.7 Hz look least like" in shown.err and "57.98" in shown.out
    # A measured point, a number, is where the tool cuts.
    text = (tmp_path / "found.yaml").read_text()
    (tmp_path / "cuts.yaml").write_text(text.replace("name: from its test", 'name: from its test\ntool: "7"'))
    main(["lobes", str(tmp_path / "cuts.yaml"), "--teeth", "4", "--kt", "770", "--kn", "170", "--speeds", "3000:6000:3",
          "--json", *page])
    assert len(json.loads(capsys.readouterr().out)["stable_intervals_m"]) == 3
