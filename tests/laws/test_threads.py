"""Linear algebra of small matrices is held to one thread, and what was set before comes back."""

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from toolpoint import ToolpointError
from toolpoint._threads import on_one_thread
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
