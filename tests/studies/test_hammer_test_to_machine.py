"""From responses of a test, by command, to a machine that predicts at poses nobody tested: trees, any joint, damping,
doubts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from toolpoint.app.main import main
from toolpoint.io import uff
from toolpoint.io.yaml import component_file, machine_file
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
)
from toolpoint.studies.machines.virtual_test import surface_points
from toolpoint.studies.measured.model_correlation import with_measured_points
from toolpoint.vibration import Dof, eigen, frequency_response

BOXES = {"bed": (3000.0, (0.0, 0.0, 0.4), (2.2, 1.0, 0.8)), "column": (900.0, (-0.6, 0.0, 1.5), (0.6, 0.7, 1.4)),
         "table": (400.0, (0.6, 0.1, 1.0), (0.8, 0.6, 0.3))}


def machine():
    """A tree: column (an oblique hinge) and table (turns and slides, moved by X) on a bed on three springs."""
    bodies = {n: BodyDescription(m, c, shape=ShapeDescription("box", s)) for n, (m, c, s) in BOXES.items()}
    joints = {
        "ground_bed": JointDescription("ground", "bed", FrameDescription((0.05, 0.02, 0.0)),
                                       {"z": 6e8, "rx": 8e7, "ry": 2.5e8}, loss_factor=0.08),
        "bed_column": JointDescription("bed", "column", FrameDescription((-0.6, 0.0, 0.8), (0.3, -0.2, 0.1)), {"rx": 1.5e8},
                                       loss_factor=0.03),
        "bed_table": JointDescription("bed", "table", FrameDescription((0.62, 0.05, 0.85)), {"x": 9e7, "rz": 2.5e7},
                                      loss_factor=0.05)}
    return build(MachineDescription("tree", bodies, joints, {"X": AxisDescription("bed_table", "y", (-0.2, 0.2))},
                                    {"tool": PointDescription("column", (-0.2, 0.0, 1.3)),
                                     "plate": PointDescription("table", (0.6, 0.1, 1.15))}, tool="tool", table="plate"))


UNTESTED = "nothing in this test loads the joint along"


@pytest.fixture(scope="module")
def tested(tmp_path_factory):
    """Accelerances at 40 points from one driving point with 2 % noise, and what the tester knows."""
    folder, true, rng = tmp_path_factory.mktemp("tree"), machine(), np.random.default_rng(2)
    points = surface_points(true, 40, rng)
    seen = with_measured_points(true, points.coordinates, points.components)
    labels = [Dof(p, way) for p in points.places for way in ("+x", "+y", "+z")]
    shape = np.abs(eigen.solve_undamped(assemble(seen, outputs=labels)).shape)
    struck = labels[int(np.argmax((shape / shape.max(axis=0)).min(axis=1)))]
    frf = frequency_response.direct(assemble(seen, outputs=labels, inputs=[struck]), np.arange(5.0, 160.0, 0.25), "accelerance")
    size = 0.02 * np.sqrt((np.abs(frf.values) ** 2).mean(axis=0) / 2)
    noise = rng.normal(size=frf.values.shape) + 1j * rng.normal(size=frf.values.shape)
    uff.write(folder / "test.uff", uff.MeasuredGeometry(tuple(points.places), np.array(list(points.coordinates.values()))),
              replace(frf, values=frf.values + size * noise))
    lines = ["toolpoint: 1", "name: tree", "parents: {bed: ground, column: bed, table: bed}", "components:"]
    for name, (mass, centre, box) in BOXES.items():
        lines += [f"  {name}:", f"    points: {points.components[name]}",
                  f"    body: {{mass: {mass} kg, centre: {list(centre)}, shape: {{kind: box, size: {list(box)}}}}}"]
    lines += ["axes:", "  X: {moves: table, along: y, at_test: 50 mm, limits: [-0.2, 0.25]}", "points:",
              "  tool: {body: column, at: [-0.2, 0, 1.3]}", "  plate: {body: table, at: [0.6, 0.1, 1.15]}", "tool: tool",
              "table: plate", "tool_axis: [0, 0, 1]"]
    (folder / "components.yaml").write_text("\n".join(lines) + "\n")
    return folder, true


def run(folder, *more):
    test = str(folder / "test.uff")
    main(["joints", test, "--geometry", test, "--components", str(folder / "components.yaml"), "-o", str(folder / "page"),
          *more])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*nothing in this test loads")
def test_a_tree_with_a_turn_and_slide_becomes_a_machine_that_is_right_at_an_untested_pose(tested, capsys):
    folder, true = tested
    run(folder, "--machine", str(folder / "m.yaml"), "--json")
    shown = json.loads(capsys.readouterr().out)
    assert {j["child"]: j["kind"] for j in shown["joints"]} == {
        "bed": "free in x ry rz", "column": "hinge", "table": "turn and slide"}
    # One struck point neither pushes nor loads the joints about the column's length; nothing else is in doubt.
    assert all(UNTESTED in doubt for doubt in shown["doubts"]) and "gives back" in shown["modes"]["status"]
    for joint in shown["joints"]:
        loss = true.description.joints[f"{joint['parent']}_{joint['child']}"].loss_factor
        assert joint["loss_factor"] == pytest.approx(loss, rel=0.05)
        assert abs(joint["loss_factor"] - loss) < 2 * joint["loss_factor_interval"]
    table = next(j for j in shown["joints"] if j["child"] == "table")
    assert table["stiffness"] == pytest.approx({"x": 9e7, "rz": 2.5e7}, rel=5e-3)
    assert table["at"][:2] == pytest.approx([0.62, 0.05], abs=2e-3)  # the elastic centre along y, which only the springs tell
    built = machine_file.read(folder / "m.yaml")
    for x in (-0.15, 0.2):  # the axis showed 50 mm in the test
        placed = ((built, x), (true, x - 0.05))
        mine, real = (eigen.solve_undamped(assemble(m, {"X": at}, ["tool-plate:+y"])) for m, at in placed)
        np.testing.assert_allclose(mine.frequency, real.frequency, rtol=2e-3)
        np.testing.assert_allclose(mine.damping_ratio, real.damping_ratio, rtol=0.05)
    main(["frf", str(folder / "m.yaml"), "--pose", "X=0.15", "--lines", "10:150:60", "-o", str(folder / "frf"), "--json"])
    response = json.loads(capsys.readouterr().out)["responses"][0]
    exact = frequency_response.direct(assemble(true, {"X": 0.1}, ["tool-plate:+x"]), np.array(response["frequency_hz"]))
    got = np.array(response["real_m_per_n"])[:, 0, 0] + 1j * np.array(response["imaginary_m_per_n"])[:, 0, 0]
    np.testing.assert_allclose(got, exact.values[:, 0, 0], rtol=0.02)


@pytest.mark.slow
def test_a_wrong_tree_is_mended_and_said(tested, tmp_path, capsys):
    folder, _ = tested
    text = (folder / "components.yaml").read_text()
    wrong = text.replace("parents: {bed: ground, column: bed, table: bed}", "chain: [ground, column, bed, table]")
    (tmp_path / "components.yaml").write_text(wrong)
    (tmp_path / "test.uff").write_bytes((folder / "test.uff").read_bytes())
    run(tmp_path, "--json")
    shown = json.loads(capsys.readouterr().out)
    assert {j["child"]: j["parent"] for j in shown["joints"]} == {"bed": "ground", "column": "bed", "table": "bed"}
    assert any("chain: as told it needs" in doubt for doubt in shown["doubts"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*nothing in this test loads")
def test_masses_known_badly_widen_the_intervals_to_what_is_true(tested, tmp_path, capsys):
    folder, true = tested
    text = (folder / "components.yaml").read_text().replace("mass: 400.0 kg", "mass: 460 kg").replace("mass: 900.0 kg",
                                                                                                      "mass: 840 kg")
    text = text.replace("    body:", "    uncertainty: {mass: 10 %}\n    body:")
    (tmp_path / "components.yaml").write_text(text)
    (tmp_path / "test.uff").write_bytes((folder / "test.uff").read_bytes())
    run(tmp_path, "--machine", str(tmp_path / "m.yaml"), "--json")
    for joint in json.loads(capsys.readouterr().out)["joints"]:
        real = list(true.description.joints[f"{joint['parent']}_{joint['child']}"].stiffness.values())
        halves = joint["stiffness_interval"]
        assert all(min(abs(k - r) for r in real) < 1.5 * halves[way] for way, k in joint["stiffness"].items())
    assert any(path.startswith("bodies.") for path in machine_file.read(tmp_path / "m.yaml").description.identified.parameters)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("parents: {", "chain: [ground, bed]\nparents: {", "one of them must be there"),
    ("moves: table", "moves: tabel", "no 'tabel'"),
    ("along: y", "along: y, about: z", "must have one of"), ("along: y", "about: z", "at: missing"),
    ("along: y", "along: [0, 0, 0]", "not zero"), ("limits: [-0.2, 0.25]", "limits: [0.2, -0.2]", "below the upper"),
    ("tool: tool", "tool: tol", "no 'tol'"), ("{body: column", "{body: colum", "no 'colum'")])
def test_faults_of_what_a_tester_knows(tested, tmp_path, old, new, words):
    text = (tested[0] / "components.yaml").read_text()
    assert old in text
    (tmp_path / "c.yaml").write_text(text.replace(old, new, 1))
    with pytest.raises(Exception, match=words):
        component_file.read(tmp_path / "c.yaml")


@pytest.mark.slow
def test_the_turn_and_slide_of_the_reference_case(measured, tmp_path, capsys):
    """Virtual test of a lathe: the carriage turns about z (3e7 N m/rad, through (0.3, 0.1, 0.8) m) and slides along x (6e7
    N/m)."""
    folder = measured / "joint_turn_and_slide"
    test = str(folder / "test.uff")
    main(["joints", test, "--geometry", test, "--components", str(folder / "components.yaml"), "-o", str(tmp_path), "--json"])
    joint = json.loads(capsys.readouterr().out)["joints"][1]
    assert joint["kind"] == "turn and slide" and joint["freedoms"] == ["x", "rz"]
    assert joint["stiffness"] == pytest.approx({"x": 6e7, "rz": 3e7}, rel=2e-3)
    assert joint["at"][:2] == pytest.approx([0.3, 0.1], abs=1e-3)
