"""Stamps of compiled kernels: a change of a callee or a constant elsewhere changes the file of its caller, and so the cache."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "docs"))

from generate import kernel_stamps  # noqa: E402


def test_stamps_are_those_of_the_code():
    stale = [str(path.relative_to(ROOT)) for path in kernel_stamps.kernel_files()
             if kernel_stamps.stamped_text(path) != path.read_text(encoding="utf-8")]
    assert not stale, f"run python docs/generate/kernel_stamps.py --write: {stale}"


CALLEE = '''"""Kernels."""
from numba import njit

@njit
def half(x):
    """Return a half."""
    return x / 2
'''
CALLER = '''"""Kernels that call another file's."""
from numba import njit
from toolpoint.callee import half
from toolpoint.limits import MAX_ROUNDS

@njit
def quarter(x):
    return half(half(x)) + MAX_ROUNDS
'''


@pytest.fixture
def stamp(tmp_path, monkeypatch):
    """Return a function that writes three files and gives the stamp of the caller."""
    monkeypatch.setattr(kernel_stamps, "SOURCE", tmp_path)

    def stamp(callee=CALLEE, limits="MAX_ROUNDS = 3\nOTHER = 1\n"):
        (tmp_path / "toolpoint").mkdir(exist_ok=True)
        for name, text in (("callee", callee), ("limits", limits), ("caller", CALLER)):
            (tmp_path / "toolpoint" / f"{name}.py").write_text(text, encoding="utf-8")
        for function in (kernel_stamps.tree_of, kernel_stamps.has_kernels, kernel_stamps.taken_from):
            function.cache_clear()
        return kernel_stamps.stamp_of(tmp_path / "toolpoint" / "caller.py")

    yield stamp
    for function in (kernel_stamps.tree_of, kernel_stamps.has_kernels, kernel_stamps.taken_from):
        function.cache_clear()


def test_a_stamp_changes_with_code_and_constants_that_a_kernel_takes_and_with_nothing_else(stamp):
    first = stamp()
    assert len(first) == 12
    assert stamp(callee=CALLEE.replace("x / 2", "x / 3")) != first
    assert stamp(limits="MAX_ROUNDS = 4\nOTHER = 1\n") != first
    assert stamp(callee=CALLEE.replace("Return a half.", "Return half of it.")) == first
    assert stamp(limits="MAX_ROUNDS = 3  # times\nOTHER = 2\n") == first


def test_a_stamp_is_written_once(stamp, tmp_path):
    stamp()
    path = tmp_path / "toolpoint" / "caller.py"
    text = kernel_stamps.stamped_text(path)
    assert text.startswith(CALLER) and text.count("# Code of other modules") == 1
    path.write_text(text, encoding="utf-8")
    assert kernel_stamps.stamped_text(path) == text
