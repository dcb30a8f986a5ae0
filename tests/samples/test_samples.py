"""Samples: every kind is written whole, its commands run as they stand, and what was put in comes out."""

import importlib
import json
import shlex
from pathlib import Path

import pytest

from toolpoint import io
from toolpoint._check import ToolpointError
from toolpoint.app.main import main
from toolpoint.samples import KINDS, write_samples

TEXT_COMMANDS = ("check", "next-test")  # they write no page
SLOW_KINDS = ("cut", "video")  # a cut is simulated, by kernels that compile; a film is drawn


def kinds(*slow):
    return [pytest.param(kind, marks=pytest.mark.slow) if kind in slow else kind for kind in KINDS]


@pytest.mark.parametrize("kind", kinds(*SLOW_KINDS))
def test_a_kind_is_written_with_its_truth_and_commands_on_its_own_files(kind, tmp_path):
    result = write_samples(kind, tmp_path / "new")
    text = (tmp_path / "new/README.txt").read_text(encoding="utf-8")
    assert all(sentence in text for sentence in (*result.truth, *result.commands))
    assert sorted(result.files) == sorted(str(p.relative_to(tmp_path / "new")) for p in (tmp_path / "new").rglob("*")
                                          if p.is_file())
    written = {Path(name).name for name in result.files}
    for command in result.commands:
        named = {Path(word).name for word in shlex.split(command)
                 if "." in word and word != "." and not word.startswith("-")}
        made = {Path(word).name for other in result.commands for option, word in zip(
            shlex.split(other), shlex.split(other)[1:], strict=False) if option in ("--save", "-m", "--machine")}
        assert not {name for name in named - written - made if "*" not in name and not name.replace(".", "").isdigit()}


def test_nothing_is_overwritten_and_kinds_are_named(tmp_path):
    (tmp_path / "mine").write_text("my notes")
    with pytest.raises(ToolpointError, match="nothing is overwritten"):
        write_samples("program", tmp_path)
    with pytest.raises(ToolpointError, match="nothing is overwritten"):
        write_samples("program", tmp_path / "mine")
    with pytest.raises(ToolpointError, match="tap, hammer-test"):
        write_samples("hammer", tmp_path / "new")
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]


def test_a_writer_that_fails_leaves_no_folder(tmp_path, monkeypatch):
    def broken(folder):
        (folder / "half").write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(importlib.import_module("toolpoint.samples.program"), "write", broken)
    with pytest.raises(OSError, match="No space"):
        write_samples("program", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(["samples", "--list"])
    shown = capsys.readouterr().out
    assert all(kind in shown for kind in KINDS)
    main(["samples", "servo"])
    shown = capsys.readouterr().out
    assert "samples-servo" in shown and "toolpoint servo-data trace.csv" in shown
    main(["samples", "program", "here", "--json"])
    assert json.loads(capsys.readouterr().out)["files"] == ["mill.yaml", "part.nc", "project.yaml", "servo.yaml",
                                                               "README.txt"]


def test_servo_and_drift_give_back_what_was_put_in(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_samples("servo", "servo")
    main(["servo-data", "servo/trace.csv", "--json"])
    axis = json.loads(capsys.readouterr().out)["axes"]["Z"]
    assert axis["velocity_gain_1_s"] == pytest.approx(25, rel=1e-3)
    write_samples("drift", "drift")
    main(["drift", "drift/june.h5", "drift/november.h5", "--baseline", "drift/january.h5", "--machine", "drift/machine.yaml",
          "--json"])
    shown = json.loads(capsys.readouterr().out)
    assert shown["parts"][0]["part"] == "joint feet" and shown["probability_unchanged"][0] > 0.01
    low, high = shown["explanations"][0]["interval"]
    assert low <= 0.8 <= high


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_commands_run_as_they_stand(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = write_samples(kind, tmp_path / "new")
    monkeypatch.chdir(tmp_path / "new")
    for command in result.commands:
        words = [name for word in shlex.split(command)[1:] for name in (
            sorted(map(str, Path().glob(word))) if "*" in word else [word])]
        page = Path(f"page-{words[0]}/index.html")
        is_text = words[0] in TEXT_COMMANDS
        main([*words, *(() if is_text else ("-o", str(page.parent)))])
        assert is_text or page.is_file(), command


@pytest.mark.slow
def test_hammer_test_leads_to_the_modes_that_were_put_in(tmp_path, monkeypatch, capsys):
    # The frequencies are those that the records were made with, as the read-me file lists them.
    write_samples("hammer-test", tmp_path / "new")
    monkeypatch.chdir(tmp_path / "new")
    main(["frf", *sorted(map(str, Path().glob("records/*.uff"))), "--save", "test.h5"])
    shown = capsys.readouterr().out
    assert "88 of 90 hits" in shown
    main(["identify", "test.h5", "--geometry", "points.csv", "-m", "modes.h5"])
    modes = io.read_modes("modes.h5")
    listed = (tmp_path / "new/README.txt").read_text().split("modes at ")[1].split(" Hz")[0]
    truth = [float(word) for word in listed.split(", ")]
    for frequency in truth:
        i = int(abs(modes.frequency - frequency).argmin())
        assert modes.frequency[i] == pytest.approx(frequency, abs=max(2 * modes.frequency_interval[i], 0.006))


@pytest.mark.slow
def test_sound_and_blows_are_judged_right(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_samples("cut", "cut")
    main(["listen", "cut/cut.wav", "--teeth", "4", "--speed", "7300", "--json"])
    assert json.loads(capsys.readouterr().out)["verdict"] == "chatter"
    write_samples("work", "work")
    main(["operational", "work/work.csv", "--json"])
    assert len(json.loads(capsys.readouterr().out)["scaled_frequency_hz"]) == 3


@pytest.mark.slow
def test_the_film_gives_back_its_modes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command = write_samples("video", "film").commands[0]
    monkeypatch.chdir(tmp_path / "film")
    main([*shlex.split(command)[1:], "--json"])
    modes = json.loads(capsys.readouterr().out)["videos"][0]
    assert modes["frequency_hz"] == pytest.approx([38, 71], rel=2e-3)
    assert modes["damping_ratio"] == pytest.approx([0.012, 0.018], rel=0.05)
