"""`toolpoint new`: templates that pass `check`, run `report` and `map`; nothing is overwritten."""

import json
import os
import resource

import pytest

from toolpoint.app.main import main
from toolpoint.io import read_machine
from toolpoint.io.template_files import FOLDER, list_templates, read_template, write_template
from toolpoint.studies.machines.check.machine_check import check_machine

MACHINES = sorted(list_templates())
LONGEST = 60.0  # CPU s for all templates together


def test_the_templates_are_those_that_were_promised():
    assert MACHINES == ["boring-mill", "gantry", "grinder", "lathe", "parallel-head", "robot", "three-axis-horizontal",
                        "three-axis-vertical", "trunnion"]


@pytest.mark.parametrize("name", MACHINES)
def test_a_template_is_commented_and_leaves_no_doubt(name, tmp_path):
    text = read_template("machine", name)
    assert text.startswith("# ") and text.count("#") >= 5 and max(map(len, text.splitlines())) <= 210
    machine = read_machine(write_template(tmp_path / "m.yaml", "machine", name))
    checked = check_machine(machine)
    assert checked.doubts == ()
    assert {"tip", "work"} <= set(machine.description.points) or machine.description.table is not None
    # Every body, joint and axis of the file is in its drawing.
    drawn = "\n".join([*checked.chain, *checked.travel])
    assert all(part in drawn for part in (*machine.description.bodies, *machine.description.joints, *machine.description.axes))


@pytest.mark.parametrize("kind", ["servo", "components", "test", "shaft", "plan"])
def test_other_templates_pass_the_check(kind, tmp_path, capsys):
    path = write_template(tmp_path / "x.yaml", kind)
    main(["check", str(path)])
    assert "no faults" in capsys.readouterr().out


def test_the_cut_is_read_in_a_machine(tmp_path):
    machine = read_template("machine", "lathe") + "\n" + read_template("cut")
    (tmp_path / "m.yaml").write_text(machine)
    cut = read_machine(tmp_path / "m.yaml").description.cutting
    assert cut is not None and cut.tool.teeth == 4


def test_a_file_that_is_there_stays_as_it_is(tmp_path, capsys):
    path = tmp_path / "mine.yaml"
    path.write_text("mine")
    with pytest.raises(SystemExit) as stopped:
        main(["new", "machine", str(path), "--template", "lathe"])
    assert stopped.value.code == 2 and "nothing is overwritten" in capsys.readouterr().err
    assert path.read_text() == "mine"


@pytest.mark.parametrize(("arguments", "words"), [
    (["machine", "--template", "gantri"], "did you mean 'gantry'?"), (["machine"], "three-axis-vertical"),
    (["servo", "none/servo.yaml"], "does not exist"), (["cart"], "'cart'")])
def test_wrong_input_names_what_there_is(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["new", *arguments])
    assert stopped.value.code == 2 and words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_what_was_written_is_said_and_what_comes_next(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(["new", "machine", "--template", "lathe"])
    shown = capsys.readouterr().out
    assert (tmp_path / "machine.yaml").is_file() and "toolpoint check machine.yaml" in shown


def test_templates_are_in_the_package():
    assert FOLDER.is_dir() and len(list(FOLDER.rglob("*.yaml"))) >= len(MACHINES) + 3


@pytest.mark.slow
def test_every_template_is_checked_reported_and_mapped_in_a_minute(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    start = os.times()
    for name in MACHINES:
        file = f"{name}.yaml"
        main(["new", "machine", file, "--template", name])
        main(["check", file, "--json"])
        assert json.loads(capsys.readouterr().out.split("\n", 2)[2])["ok"]
        main(["report", file, "-o", f"{name}-report"])
        axis = next(iter(read_machine(file).chain.axes))
        low, high = (f"{0.5 * end:.4g}" for end in (axis.lower, axis.upper))
        low, high = ("0.8", "1.0") if axis.name == "L1" else (low, high)
        main(["map", file, "--axis", f"{axis.name}={low}:{high}:5", "-o", f"{name}-map"])
        capsys.readouterr()
        assert (tmp_path / f"{name}-report/index.html").stat().st_size > 1e5 and (tmp_path / f"{name}-map/index.html").is_file()
    spent = os.times()
    print(f"CPU {spent.user - start.user:.1f} s, {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.1f} GB")
    assert spent.user - start.user < LONGEST
