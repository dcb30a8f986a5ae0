"""`check` says what is possible but hardly meant: joints without a place, masses, a speed range that runs backwards."""

import json

from click.testing import CliRunner

from toolpoint.app.main import cli

FILE = """toolpoint: 1
name: small
bodies:
  bed: {{mass: {mass}, inertia: {{xx: 1, yy: 1, zz: 1}}}}
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
