"""`check` says what is possible but hardly meant: joints without a place, masses, a speed range that runs backwards."""

import json

from click.testing import CliRunner

from toolpoint.app.main import cli

FILE = """toolpoint: 1
name: small
bodies:
  bed: {{mass: {mass}, inertia: {{xx: 30, yy: 30, zz: 30}}}}
joints:
  feet:
    parent: ground
    child: bed
    {at}
    stiffness: {{x: 1e8, y: 1e8, z: 1e8, rx: 1e7, ry: 1e7, rz: 1e7}}
points:
  tool: {{body: bed, at: [0, 0, 1]}}
tool: tool
cutting: {{diameter: 20 mm, teeth: 2, tangential: 2000 MPa, normal: 800 MPa, immersion: 0.5, speeds: {speeds}}}
"""


def doubts(tmp_path, **values):
    path = tmp_path / "machine.yaml"
    path.write_text(FILE.format(**{"mass": 500, "at": "at: [0, 0, 0.1]", "speeds": "[1000, 9000]", **values}))
    result = CliRunner().invoke(cli, ["check", str(path), "--json"])
    assert result.exit_code == 0, result.output
    lines = json.loads(result.output)["doubts"]
    plain = CliRunner().invoke(cli, ["check", str(path)]).output
    assert plain.startswith("doubt: ") == bool(lines)
    return lines


def test_doubts_of_a_machine_file(tmp_path):
    assert doubts(tmp_path) == []
    assert "joints.feet" in doubts(tmp_path, at="loss_factor: 0.02")[0]
    assert "bodies.bed" in doubts(tmp_path, mass=4e6)[0]
    assert "backwards" in doubts(tmp_path, speeds="[9000, 1000]")[0]


def test_axes_that_tear_a_loop_and_joints_far_away_are_doubted(tmp_path):
    from toolpoint.io import read_machine
    from toolpoint.studies.machines.check.machine_doubts import question_machine

    text = """toolpoint: 1
name: two sides
bodies:
  left: {mass: 300 kg, centre: [-1, 0, 1], shape: {kind: box, size: [0.2, 0.5, 1]}}
  right: {mass: 300 kg, centre: [1, 0, 1], shape: {kind: box, size: [0.2, 0.5, 1]}}
  bridge: {mass: 700 kg, centre: [0, 0, 1.6], shape: {kind: box, size: [2.2, 0.4, 0.4]}}
joints:
  guide_l: {parent: ground, child: left, at: [-1, 0, 0.5], stiffness: {y: 1e8}}
  guide_r: {parent: ground, child: right, at: [1, 0, 0.5], stiffness: {y: 1e8}}
  left_bridge: {parent: left, child: bridge, at: [-1, 0, 1.5], stiffness: {x: 9e8, y: 9e8, z: 9e8, rx: 8e7, ry: 8e7, rz: 8e7}}
  right_bridge: {parent: right, child: bridge, closes_loop: true, at: [1, 0, 1.5]}
axes:
  Y1: {joint: guide_l, direction: y}
  Y2: {joint: guide_r, direction: y}
"""
    path = tmp_path / "sides.yaml"
    path.write_text(text)
    doubts = question_machine(read_machine(path))
    assert [line.split(":")[0] for line in doubts] == ["axes.Y1", "axes.Y2"]
    assert "right_bridge" in doubts[0]
    both = "  Y: {drives: [{joint: guide_l, direction: y}, {joint: guide_r, direction: y}]}"
    path.write_text(text.split("  Y1:")[0] + both)
    assert question_machine(read_machine(path)) == ()
    path.write_text((text.split("  Y1:")[0] + both).replace("at: [-1, 0, 1.5]", "at: [-100, 0, 150]"))
    assert question_machine(read_machine(path))[0].startswith("joints.left_bridge: at -100, 0, 150 m")
