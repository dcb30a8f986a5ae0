"""A command over two seconds says what it does also where stderr is no terminal; a short one and --json say nothing."""

import time

import pytest

from toolpoint.app import console


@pytest.fixture
def _quick(monkeypatch):
    monkeypatch.setattr(console, "FIRST_LINE", 0.05)
    monkeypatch.setattr(console, "NEXT_LINE", 0.05)
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
    assert "identification (step 2 of 2), 0 s" in lines
    assert "poses: 3 of 40, 0 s" in lines
    assert 2 <= lines.count("\n") <= 18


@pytest.mark.usefixtures("_quick")
def test_no_line_from_short_work_and_none_beside_json(capsys):
    work(False, 0.0)
    work(True, 0.2)
    assert capsys.readouterr().err == ""
