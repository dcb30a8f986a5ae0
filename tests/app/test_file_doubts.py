"""What a study doubts of a machine goes with its file: it is read back and stands first in every result of that file."""

import json
import warnings
from dataclasses import replace

import pytest
from click.testing import CliRunner

from toolpoint import io
from toolpoint._check import FileDoubt
from toolpoint._doubt import Doubt
from toolpoint.app.main import cli
from toolpoint.machine import assemble
from toolpoint.machine.description import ReferenceDescription
from toolpoint.vibration import eigen

DOUBT = Doubt("fit of the machine", "it leaves 373 times the noise unexplained", "check masses: all of them", figure=373.0)
COMMANDS = (["check"], ["modes"], ["frf", "--lines", "10:100:20"], ["map", "--axis", "X=-0.1:0.1:2"], ["sensitivity"])


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    path = tmp_path_factory.mktemp("machine") / "mill.yaml"
    io.write_template(path, "machine", "three-axis-vertical")
    return io.read_machine(path).description


def written(description, folder):
    path = folder / "doubted.yaml"
    io.write_machine(description, path)
    return path


def test_a_doubt_is_read_back_as_it_was_written(sound, tmp_path):
    path = written(replace(sound, doubts=(DOUBT,)), tmp_path)
    with pytest.warns(FileDoubt, match="373 times"):
        read = io.read_machine(path).description
    assert read.doubts == (DOUBT,)
    assert (read.doubts[0].what, read.doubts[0].why, read.doubts[0].remedy) == (DOUBT.what, DOUBT.why, DOUBT.remedy)


@pytest.mark.parametrize("arguments", COMMANDS, ids=lambda a: a[0])
def test_every_command_repeats_the_doubts_of_its_file_first(sound, tmp_path, arguments):
    path = written(replace(sound, doubts=(DOUBT,)), tmp_path)
    page = [] if arguments[0] in ("check", "modes") else ["-o", str(tmp_path / "page")]
    shown = CliRunner().invoke(cli, [arguments[0], str(path), *arguments[1:], *page])
    assert shown.exit_code == 0, shown.output
    assert shown.stdout.replace("\n", " ").startswith("doubt: fit of the machine: it leaves 373 times")
    if page:
        text = (tmp_path / "page" / "index.html").read_text()
        assert "it leaves 373 times" in text
    data = json.loads(CliRunner().invoke(cli, [arguments[0], str(path), *arguments[1:], "--json"]).stdout)
    assert next(iter(data)) == "doubts" or arguments[0] == "check"
    assert data["doubts"][0] == DOUBT


def test_a_sound_file_states_none(sound, tmp_path):
    shown = CliRunner().invoke(cli, ["modes", str(written(sound, tmp_path))])
    assert "doubt:" not in shown.output


def test_a_measured_reference_is_compared_with_the_modes(sound, tmp_path):
    machine = io.read_machine(written(sound, tmp_path))
    true = tuple(float(f) for f in eigen.solve_undamped(assemble(machine, outputs=["nose:+x"])).frequency[:4])
    same = ReferenceDescription("tap test", true, source="measured")
    assert not warned(replace(sound, reference=(same,)), tmp_path)
    off = ReferenceDescription("tap test", (*true[:3], 1.05 * true[3]), source="measured")
    doubts = warned(replace(sound, reference=(off,)), tmp_path)
    assert len(doubts) == 1
    assert "differ" in doubts[0]
    assert f"{1.05 * true[3]:.4g} Hz" in doubts[0]
    assert not warned(replace(sound, reference=(replace(off, source="published"),)), tmp_path)
    lossy = ReferenceDescription("tap test", true, tuple(0.2 for _ in true), source="measured")
    assert "damping differs" in warned(replace(sound, reference=(lossy,)), tmp_path)[0]


def warned(description, folder):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        io.read_machine(written(description, folder))
    return [str(w.message) for w in caught if issubclass(w.category, FileDoubt)]


def test_which_of_several_described_poses_a_file_of_responses_holds_is_said(sound, tmp_path):
    path = tmp_path / "mill.yaml"
    io.write_machine(sound, path)
    result = CliRunner().invoke(cli, ["frf", str(path), "--lines", "20:60:20", "--save", str(tmp_path / "tip.h5"),
                                      "-o", str(tmp_path / "page")])
    assert "tip.h5 holds the first of 3 described poses alone, X 0 mm, Y 0 mm, Z 0 mm" in result.output
