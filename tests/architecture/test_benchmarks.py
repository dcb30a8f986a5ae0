"""Every benchmark still imports what it measures, and says what it takes."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# One process for all: each import of the package would cost more than a second.
ASK_ALL = """
import contextlib, importlib, io, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
for name in sys.argv[2:]:
    printed = io.StringIO()
    try:
        module = importlib.import_module(name)
        if hasattr(module, "main") and name != "benchmarks.vision.clip_peers":  # run by another interpreter, with bare paths
            sys.argv = [name, "--help"]
            with contextlib.redirect_stdout(printed):
                module.main()
            print(f"{name}: --help did not end it")
    except SystemExit as end:
        if end.code or module.__doc__.splitlines()[0] not in printed.getvalue():
            print(f"{name}: --help ended with {end.code} and printed {printed.getvalue()[:80]!r}")
    except Exception as error:
        print(f"{name}: {type(error).__name__}: {error}")
"""


def names():
    return [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in sorted((ROOT / "benchmarks").rglob("*.py"))
            if path.parent.name != "tasks" and path.stem != "__init__"]


def test_every_benchmark_imports_and_prints_its_help(tmp_path):
    done = subprocess.run([sys.executable, "-c", ASK_ALL, str(ROOT), *names()], cwd=tmp_path, capture_output=True, text=True)
    assert (done.stdout, done.returncode) == ("", 0), done.stdout + done.stderr


def test_benchmarks_stand_in_rooms():
    assert {path.name for path in (ROOT / "benchmarks").glob("*.py")} == {"__init__.py", "bars.py", "frame.py"}
