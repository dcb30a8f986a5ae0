"""A file that a person has is never written over without --replace, in any command that writes one."""

from typing import Annotated

import pytest
from click.testing import CliRunner

from toolpoint.app.declare import Help, command
from toolpoint.app.main import MODULE_OF_COMMAND, main
from toolpoint.app.values import NewFile


@command(replace=True)
def save_something(*, save: Annotated[NewFile, Help("Where.")]) -> None:
    """Save something."""
    save.write_text("new")


@pytest.mark.parametrize("order", [["--replace", "--save"], ["--save", "--replace"]])
def test_replace_allows_it_in_any_order(tmp_path, order):
    file = tmp_path / "kept.h5"
    file.write_text("old")
    words = [word for option in order for word in ([option, str(file)] if option == "--save" else [option])]
    assert CliRunner().invoke(save_something, words).exit_code == 0 and file.read_text() == "new"


def test_an_existing_file_is_refused_with_the_remedy(tmp_path):
    file = tmp_path / "kept.h5"
    file.write_text("old")
    done = CliRunner().invoke(save_something, ["--save", str(file)])
    assert done.exit_code != 0 and "add --replace" in str(done.exception) and file.read_text() == "old"
    assert CliRunner().invoke(save_something, ["--save", str(tmp_path / "other.h5")]).exit_code == 0


WRITING = {"identify": ["-m"], "frf": ["--save"], "joints": ["--machine"], "update": ["--machine"], "rcsa": ["--save"],
           "robot": ["--machine"], "drive": ["--fmu"], "calibrate": ["--yaml"], "video": ["-m", "--update", "--magnify"],
           "plan": ["--test", "--geometry"]}


@pytest.mark.parametrize(("command", "option"), [(name, option) for name, options in WRITING.items() for option in options])
def test_no_command_writes_over_a_file(tmp_path, capsys, command, option):
    assert command in MODULE_OF_COMMAND
    file = tmp_path / "kept.yaml"
    file.write_text("old")
    with pytest.raises(SystemExit) as ended:
        main([command, option, str(file)])
    assert ended.value.code == 2 and file.read_text() == "old"
    assert "kept.yaml: exists already; nothing was written" in capsys.readouterr().err
