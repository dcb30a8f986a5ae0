"""Linear algebra of small matrices is held to one thread, and what was set before comes back."""

import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from toolpoint import ToolpointError
from toolpoint._threads import VARIABLES, on_one_thread
from toolpoint.cutting import stability


def threads() -> list[int]:
    """Threads of every loaded BLAS library."""
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


@on_one_thread
def count_threads(fails: bool) -> list[int]:
    scipy.linalg.eigvals(np.eye(3))
    if fails:
        raise ToolpointError("named")
    return threads()


def test_one_thread_inside_and_as_before_outside():
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        assert set(count_threads(False)) == {1}
        with pytest.raises(ToolpointError, match="named"):
            count_threads(True)
        assert threads() == before


def test_a_chart_is_computed_on_one_thread():
    """The verb that computes charts is held, whatever the method."""
    seen = []

    class Looking:
        name, needs_modes, uses_warm = "looking", False, False

        def refuses(self, problem):
            return None

        def solve(self, problem, speeds, depth_max, *, warm=None):
            seen.extend(threads())
            raise ToolpointError("seen")

    from cutting.cutting_cases import altintas

    with threadpool_limits(2, user_api="blas"), pytest.raises(ToolpointError, match="seen"):
        stability.chart(altintas(), [5000.0], Looking())
    assert set(seen) == {1}


@pytest.mark.parametrize(("variables", "expected"), [({}, {1}), ({"OPENBLAS_NUM_THREADS": "2"}, {min(2, os.cpu_count() or 1)})])
def test_a_command_holds_its_process_unless_told_otherwise(variables, expected):
    """Libraries that are loaded and those that come later; a variable of the user's is kept."""
    code = ("import numpy; from toolpoint._threads import hold_process; hold_process(); import scipy.linalg;"
            "from threadpoolctl import threadpool_info;"
            "print({library['num_threads'] for library in threadpool_info() if library['user_api'] == 'blas'})")
    clean = {name: value for name, value in os.environ.items() if name not in VARIABLES}
    out = subprocess.run([sys.executable, "-c", code], env=clean | variables, capture_output=True, text=True, check=True)
    assert out.stdout.strip() == str(expected)
