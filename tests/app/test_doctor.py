"""`toolpoint doctor` and completion of commands in shells."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from ruamel.yaml import YAML

import toolpoint
from toolpoint import ToolpointError
from toolpoint.app.main import MODULE_OF_COMMAND, main
from toolpoint.app.questions import GROUPS
from toolpoint.studies.environment import examine_environment


def test_this_environment_is_whole():
    result = examine_environment()
    assert result.is_whole and "numba" in result.table()


def test_more_threads_than_cores_are_doubted(monkeypatch, capsys):
    monkeypatch.setenv("OMP_NUM_THREADS", "4096")
    with pytest.raises(SystemExit) as stopped:
        main(["doctor", "--json"])
    found = {part["part"]: part for part in json.loads(capsys.readouterr().out)["findings"]}
    assert stopped.value.code == 1 and "OMP_NUM_THREADS" in found["threads"]["remedy"]


def test_a_cache_that_cannot_be_written_is_doubted(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    states = {part.part: part for part in examine_environment().findings}
    assert "XDG_CACHE_HOME" in states["cache of elastic bodies"].remedy


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_are_told_how_to_complete(shell, capsys):
    main(["completion", shell])
    assert "_TOOLPOINT_COMPLETE" in capsys.readouterr().out


@pytest.mark.slow
def test_commands_and_options_are_completed():
    def completed(words, count):
        more = {"_TOOLPOINT_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(count)}
        done = subprocess.run([sys.executable, "-m", "toolpoint"], env={**os.environ, **more}, capture_output=True,
                              text=True)
        return [line.split(",")[-1] for line in done.stdout.splitlines()]

    assert set(completed("toolpoint ", 1)) == {*MODULE_OF_COMMAND, *GROUPS}
    assert "--teeth" in completed("toolpoint lobes --tee", 2)


def test_a_part_that_fails_is_a_result(monkeypatch):
    from toolpoint import kernel_compilation

    ended = []

    def fail_here():
        raise ToolpointError("no case for this engine")

    monkeypatch.setattr(kernel_compilation, "PARTS", {"first": lambda: ended.append("first"), "second": fail_here})
    result = kernel_compilation.compile_kernels()
    assert ended == ["first"] and [part.failure for part in result.parts] == ["", "no case for this engine"]
    assert not result.is_whole and "no case for this engine" in result.table()


@pytest.mark.slow
def test_parts_compile_in_processes_of_their_own(monkeypatch):
    from toolpoint import kernel_compilation

    parts = dict(list(kernel_compilation.PARTS.items())[-2:])
    monkeypatch.setattr(kernel_compilation, "PARTS", parts)
    steps = []
    result = kernel_compilation.compile_kernels(2, progress=lambda *step: steps.append(step))
    assert result.is_whole and {part.name for part in result.parts} == set(parts)
    assert steps[-1] == ("kernels", 2, 2) and set(result.to_dict()) == {"whole", "seconds", "parts"}


@pytest.mark.slow
def test_a_part_that_fails_in_its_process_says_why(monkeypatch):
    from toolpoint import kernel_compilation

    monkeypatch.setattr(kernel_compilation, "PARTS", {"castings": None, "no such part": None})
    result = kernel_compilation.compile_kernels(2)
    assert {part.name: bool(part.failure) for part in result.parts} == {"castings": False, "no such part": True}


def test_the_citation_is_that_of_the_file_beside_the_package(capsys):
    main(["doctor", "--cite", "--json"])
    shown = json.loads(capsys.readouterr().out)
    file = YAML(typ="safe").load((Path(__file__).resolve().parents[2] / "CITATION.cff").read_text(encoding="utf-8"))
    assert (shown["title"], shown["license"], shown["authors"]) == (file["title"], file["license"], file["authors"][0]["name"])
    assert shown["version"] == toolpoint.__version__ == file["version"] and shown["bibtex"].startswith("@software{toolpoint,")
