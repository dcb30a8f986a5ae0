"""`toolpoint doctor` and completion of commands in shells."""

import json
import os
import subprocess
import sys

import pytest

from toolpoint.app.main import HOME, main
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


def test_commands_and_options_are_completed():
    def completed(words, count):
        more = {"_TOOLPOINT_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(count)}
        done = subprocess.run([sys.executable, "-m", "toolpoint"], env={**os.environ, **more}, capture_output=True,
                              text=True)
        return [line.split(",")[-1] for line in done.stdout.splitlines()]

    assert set(completed("toolpoint ", 1)) == set(HOME)
    assert "--teeth" in completed("toolpoint lobes --tee", 2)
