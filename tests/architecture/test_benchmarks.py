"""Every benchmark still imports what it measures, and says what it takes."""

import importlib
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOR_ANOTHER_INTERPRETER = "benchmarks.vision.clip_peers"  # run by `clips.py` with bare paths


def names():
    return [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in sorted((ROOT / "benchmarks").rglob("*.py"))
            if path.parent.name != "tasks" and path.stem != "__init__"]


@pytest.fixture
def _as_it_was(monkeypatch):
    """Scripts put folders on the path and set the threads of BLAS."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "argv", list(sys.argv))
    monkeypatch.setattr(os, "environ", os.environ.copy())


@pytest.mark.usefixtures("_as_it_was")
def test_every_benchmark_imports_and_prints_its_help(capsys):
    """In this process: a process each would cost a second and more each, as each imports the package."""
    for name in names():
        module = importlib.import_module(name)
        if hasattr(module, "main") and name != FOR_ANOTHER_INTERPRETER:
            sys.argv[:] = [name, "--help"]
            with pytest.raises(SystemExit) as end:
                module.main()
            assert not end.value.code and module.__doc__.splitlines()[0] in capsys.readouterr().out, name


def test_benchmarks_stand_in_rooms():
    assert {path.name for path in (ROOT / "benchmarks").glob("*.py")} == {"__init__.py", "bars.py", "frame.py"}
