"""Ctrl-C and poor terminals: what a process of its own does."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

MACHINE = Path(__file__).resolve().parents[2] / "src" / "toolpoint" / "app" / "machines" / "three_axis_vertical.yaml"
RUN = [sys.executable, "-m", "toolpoint"]


def begun(arguments, folder, **environment):
    return subprocess.Popen([*RUN, *arguments], cwd=folder, env=os.environ | environment, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE)


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
@pytest.mark.parametrize("moment", [0.6, pytest.param(1.5, marks=pytest.mark.slow)])
def test_ctrl_c_ends_a_command_with_130_and_no_traceback(moment, tmp_path):
    process = begun(["map-chatter", str(MACHINE), "--axis", "X=-300mm:300mm:40", "--axis", "Y=-200mm:200mm:40"], tmp_path)
    time.sleep(moment)
    process.send_signal(signal.SIGINT)
    error = process.communicate(timeout=20)[1].decode()
    assert process.returncode == 130 and "interrupted" in error and "Traceback" not in error


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
def test_a_kernel_that_runs_does_not_hold_ctrl_c_up(tmp_path):
    """The kernel releases the interpreter's lock; Python alone would wait for its end."""
    code = ("import sys; from toolpoint.app.interrupt import end_on_interrupt; end_on_interrupt(); import time; "
            "import numpy as np; a = np.random.default_rng(0).standard_normal((3000, 3000)); print('begun', flush=True); "
            "[np.linalg.svd(a) for _ in range(50)]")
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    sent = time.monotonic()
    process.communicate(timeout=60)
    assert process.returncode == 130 and time.monotonic() - sent < 10


def test_every_kernel_releases_the_lock():
    source = Path(__file__).resolve().parents[2] / "src"
    held = [f"{path.name}: {line.strip()}" for path in source.rglob("*.py") for line in path.read_text().splitlines()
            if "njit(" in line and line.lstrip().startswith("@") and "nogil" not in line]
    assert held == []


def test_an_ascii_terminal_gets_plain_signs():
    code = "from toolpoint.app.plain_output import spell_plainly; spell_plainly(); print('5 µm ± 2°, 中')"
    plain = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "PYTHONUTF8": "0"}
    ascii_code = code.encode("ascii", "backslashreplace").decode()
    done = subprocess.run([sys.executable, "-X", "utf8=0", "-c", ascii_code], env=plain, capture_output=True, check=True)
    assert done.stdout.decode("ascii").strip() == "5 um +- 2 deg, ?"


def test_an_lvm_with_more_names_than_columns_is_refused(measured, capsys, tmp_path, monkeypatch):
    from toolpoint.app.main import main

    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["frf", str(measured / "broken" / "bad_9771_a.lvm")])
    assert ended.value.code == 2 and "names" in capsys.readouterr().err
