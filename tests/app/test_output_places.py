"""Outputs are tested before anything is computed, in every command; and what cannot be written costs nothing else."""

import json
from dataclasses import dataclass
from typing import Annotated

import click
import pytest
from click.testing import CliRunner

from conftest import MACHINES
from toolpoint import ToolpointError, io
from toolpoint.app.declare import Help, command
from toolpoint.app.frame import Frame
from toolpoint.app.main import MODULE_OF_COMMAND, cli, main
from toolpoint.app.values import NewFile
from toolpoint.io.output_places import check_file_place, check_folder_place, check_page_place


def all_commands():
    context = click.Context(cli)
    return {name: cli.get_command(context, name) for name in MODULE_OF_COMMAND}


PAGED = [name for name, each in all_commands().items() if any(p.name == "output" for p in each.params)]
# A folder that is an argument is what the command is about, not where it keeps parts.
KEEPING = [name for name, each in all_commands().items() if any("--folder" in p.opts for p in each.params)]

RANGES = {"--axis": "X=0:1:2", "--along": "x=0mm:100mm:2"}


def test_places_that_take_no_file_are_refused(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("")
    for check, path, words in ((check_file_place, tmp_path, "is a folder"),
                               (check_file_place, tmp_path / "no" / "x", "does not"),
                               (check_file_place, file / "x", "does not exist"), (check_page_place, file, "is a file"),
                               (check_page_place, file / "page", "is a file"), (check_folder_place, file, "must be a folder"),
                               (check_file_place, tmp_path / ("n" * 300), "nothing can be written"),
                               (check_page_place, tmp_path / "x.html" / "..", "")):
        if words:
            with pytest.raises(ToolpointError, match=words):
                check(path)
    check_page_place(tmp_path / "deep" / "er" / "page.html")
    check_page_place(tmp_path / "deep")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt"]


@pytest.mark.parametrize("name", PAGED)
def test_every_page_is_refused_before_its_command_reads_anything(tmp_path, name, capsys):
    """Arguments of every command are any file that is there: it is the place of the page that is told, not their content."""
    (tmp_path / "file").write_text("")
    each = all_commands()[name]
    arguments = [str(tmp_path / "file") for p in each.params if isinstance(p, click.Argument) for _ in range(max(p.nargs, 1))]
    required = [word for p in each.params if isinstance(p, click.Option) and p.required
                for word in (p.opts[-1], "1" if p.type.name in ("integer", "integer range", "float", "float range")
                             else RANGES.get(p.opts[-1], str(tmp_path / "file")))]
    with pytest.raises(SystemExit) as ended:
        main([name, *arguments, *required, "-o", str(tmp_path / "file" / "page")])
    shown = " ".join(capsys.readouterr().err.split())
    assert ended.value.code == 2
    assert "is a file; must be a folder" in shown, shown


@pytest.mark.parametrize("name", KEEPING)
def test_every_folder_of_parts_is_refused_at_once(tmp_path, name, capsys):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit):
        main([name, "--folder", str(tmp_path / "file" / "parts"), str(tmp_path / "file")])
    assert "is a file; must be a folder" in " ".join(capsys.readouterr().err.split())


@dataclass(frozen=True)
class Answer:
    """A result."""

    def table(self):
        return "the answer is 42"

    def to_dict(self):
        return {"answer": 42}


def fail_to_write(what, path):
    raise ToolpointError("principal moments 1, 2, 9; the largest must not exceed the sum of the two others")


@command(replace=True)
def answer(run: Frame, *, save: Annotated[NewFile, Help("Where.")]) -> None:
    """Answer and save."""
    run.write("Machine file", save, fail_to_write, 1)
    run.show(Answer())


@pytest.mark.parametrize("as_json", [True, False])
def test_a_file_that_cannot_be_written_costs_no_answer(tmp_path, as_json):
    done = CliRunner().invoke(answer, ["--save", str(tmp_path / "m.yaml"), "-o", str(tmp_path / "page"),
                                       *(["--json"] if as_json else [])])
    assert isinstance(done.exception, ToolpointError) and "Machine file not written" in str(done.exception)
    assert "principal moments" in str(done.exception)
    assert json.loads(done.stdout) == {"answer": 42} if as_json else "the answer is 42" in done.stdout


def test_the_machine_of_a_test_that_cannot_be_written_leaves_table_and_page(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(io, "write_frf", fail_to_write)
    with pytest.raises(SystemExit) as ended:
        main(["frf", str(MACHINES / "three_axis_vertical.yaml"), "--at", "tool-table:+x", "--lines", "10:60:20", "--save",
              str(tmp_path / "x.csv"), "-o", str(tmp_path / "page")])
    shown = capsys.readouterr()
    assert ended.value.code == 2 and "Responses not written" in " ".join(shown.err.split())
    assert "tool-table:+x" in shown.out and (tmp_path / "page" / "index.html").exists()
