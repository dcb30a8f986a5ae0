"""`toolpoint robot`, `accuracy` and `screen`: pages, resuming, and wrong input."""

import json
from pathlib import Path

import pytest

from toolpoint.app.main import main

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
PLAN = """toolpoint: 1
machine: {machine}
factors:
  - {{name: torsion, paths: [joints.joint_q1.stiffness.rz], low: 0.9, high: 1.1}}
swaps:
  - {{name: reducer, options: {{as it is: {{}}, stiff: {{values: {{joints.joint_q2.stiffness.rz: 2e5}}}}}}}}
metrics: [frequency 1, frequency 2]
"""


def plan(folder, text=PLAN, **changes):
    path = folder / "plan.yaml"
    path.write_text(text.format(machine=changes.get("machine", MACHINES / "elastic_robot.yaml")))
    return str(path)


@pytest.mark.slow
def test_robot_writes_its_machine_and_page(tmp_path, capsys):
    main(["robot", str(MACHINES / "milling_robot_datasheet.yaml"), "--machine", str(tmp_path / "m.yaml"), "-o", str(tmp_path)])
    shown = capsys.readouterr().out
    assert "total ratio printed 75, follows 80" in shown
    assert (tmp_path / "m.yaml").read_text() == (MACHINES / "milling_robot.yaml").read_text()
    assert "Before you rely on this" in (tmp_path / "index.html").read_text()


def test_screen_resumes_and_says_the_same(tmp_path, capsys):
    for _ in range(2):
        main(["screen", plan(tmp_path), "--folder", str(tmp_path / "kept"), "-o", str(tmp_path / "page")])
    out = capsys.readouterr()
    assert out.out.count("reducer stiff") == 2 * 4  # in the answer, the variants and both rankings
    assert "4 of 4 variants kept" in out.err
    assert "ranking" not in (tmp_path / "page" / "index.html").read_text()[:10]


def test_screen_as_json(tmp_path, capsys):
    main(["screen", plan(tmp_path), "--json"])
    data = json.loads(capsys.readouterr().out)
    assert data["screening"]["variants"] == ["as it is", "torsion -10 %", "torsion +10 %", "reducer stiff"]
    assert data["rankings"][0]["doubt"].startswith("order: no uncertain inputs")


@pytest.mark.slow
def test_accuracy_of_a_line(tmp_path, capsys):
    main(["accuracy", str(MACHINES / "milling_robot.yaml"), "--line", "690mm,-20mm,100mm", "--line", "690mm,20mm,100mm",
          "--law",
          "jerk-limited", "--speed", "15000", "--depth", "0.5", "--window", "0.1", "-o", str(tmp_path)])
    assert "loads: the cut" in capsys.readouterr().out
    assert "Rotation error" in (tmp_path / "index.html").read_text()


@pytest.mark.parametrize(("old", "new", "words"), [
    ("joints.joint_q1.stiffness.rz", "joints.joint_q7.stiffness.rz", "joint_q7"),
    ("low: 0.9, high: 1.1", "low: 1.1, high: 0.9", "reversed"),
    ("frequency 1", "frequenz 1", "must be one of"),
    ("metrics: [frequency 1, frequency 2]", "source: x", "something to measure"),
    ("factors:", "faktors:", "did you mean 'factors'"),
])
def test_wrong_plans(tmp_path, capsys, old, new, words):
    with pytest.raises(SystemExit):
        main(["screen", plan(tmp_path, PLAN.replace(old, new)), "-o", str(tmp_path / "page")])
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(("options", "words"), [
    (["--square", "20mm", "--line", "0,0,0"], "exactly one"), (["--line", "0,0,0"], "given twice"),
    (["--square", "20mm", "--centre", "0.69,0,0.1", "--plane", "y"], "two directions"),
    (["--square", "20mm", "--centre", "2,0,0.1", "--plane", "y,z"], "out of reach"),
    (["--square", "20mm", "--centre", "0.69,0,0.1", "--plane", "y,z", "--loads", "wind"], "must be of cutting"),
])
def test_wrong_paths(tmp_path, capsys, options, words):
    with pytest.raises(SystemExit):
        main(["accuracy", str(MACHINES / "milling_robot.yaml"), "--speed", "15000", "--depth", "0.5", *options, "-o",
              str(tmp_path)])
    assert words in capsys.readouterr().err


def test_full_length_is_refused_where_there_is_one_length(capsys):
    with pytest.raises(SystemExit):
        main(["demo", "gantry", "--full"])
    assert "one length only" in capsys.readouterr().err
