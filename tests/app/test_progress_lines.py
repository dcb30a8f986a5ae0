"""A command over two seconds says what it does also where stderr is no terminal; a short one and --json say nothing."""

import contextlib
import re
import threading
import time
from types import SimpleNamespace

import pytest
from numba.core.compiler_lock import global_compiler_lock

from toolpoint.app import console
from toolpoint.app.terminal import _FirstUse


@pytest.fixture
def _quick(monkeypatch):
    monkeypatch.setattr(console, "FIRST_LINE_DELAY", 0.05)
    monkeypatch.setattr(console, "LINE_INTERVAL", 0.05)
    monkeypatch.setattr(console, "interactive", lambda: False)


def work(quiet, seconds):
    with console.show_progress(quiet) as show:
        show("reading", 0, 2, step=True)
        show("identification", 1, 2, step=True)
        time.sleep(seconds)
        show("poses", 3, 40)
        time.sleep(seconds)


@pytest.mark.usefixtures("_quick")
def test_lines_of_progress_without_a_terminal(capsys):
    work(False, 0.4)
    lines = capsys.readouterr().err
    assert re.search(r"identification \(step 2 of 2\), \d+ s", lines)
    assert re.search(r"poses: 3 of 40, \d+ s", lines)  # a loaded machine may be a second late
    assert 2 <= lines.count("\n") <= 18


@pytest.mark.usefixtures("_quick")
def test_no_line_from_short_work_and_none_beside_json(capsys):
    work(False, 0.0)
    work(True, 0.2)
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("_quick")
@pytest.mark.parametrize("is_locked", [True, False])
def test_compiling_is_said_while_it_lasts(capsys, is_locked):
    with contextlib.ExitStack() as stack:
        if is_locked:
            stack.enter_context(held_elsewhere(global_compiler_lock))
        work(False, 0.2)
        assert ("(compiling, at the first use only)" in capsys.readouterr().err) == is_locked
        task = SimpleNamespace(finished=False, completed=0, id=1)
        assert bool(str(_FirstUse().render(task))) == is_locked


@contextlib.contextmanager
def held_elsewhere(lock):
    """Hold a lock in another thread, as the compiler does while progress is shown."""
    taken, ended = threading.Event(), threading.Event()

    def hold():
        with lock:
            taken.set()
            ended.wait(5)
    thread = threading.Thread(target=hold)
    thread.start()
    taken.wait(5)
    yield
    ended.set()
    thread.join()
