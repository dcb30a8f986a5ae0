"""The status of a chart follows from its stated errors."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from toolpoint.cutting.stability.result import StabilityChart, assemble_chart


def chart(error, search="complete"):
    speeds = np.array([3000.0, 4000, 5000])
    columns = (np.arange(3), [1e-3, 2e-3, 4e-3], np.ones(3), np.full(3, 500.0), np.full(3, 2), error)
    return assemble_chart(speeds, 10e-3, columns, search=search)


def test_a_chart_of_small_errors_is_complete():
    assert chart([1e-6, 1e-6, 1e-6]).status == "complete" and chart([9e-5, 1.9e-4, 3.9e-4]).doubts == ()


def test_a_chart_of_large_errors_is_not_called_complete():
    rough = chart([0.37e-3, 0.5e-3, 1e-6])
    assert rough.status.startswith("doubtful: limits: the stated error is 37 % of the limit at 3000 rev/min")
    assert "at 2 of 3 speeds from 3000 to 4000 rev/min" in rough.status and rough.doubts[0].figure == 0.37
    assert "doubtful" in repr(rough)


def test_errors_that_grow_later_change_the_status():
    assert "50 %" in replace(chart([1e-6, 1e-6, 1e-6]), error=np.array([1e-6, 1e-3, 1e-6])).status


def test_what_a_search_could_not_do_stays_first():
    assert chart([1e-6] * 3, "bracketed only").status == "bracketed only"
    assert chart([0.37e-3, 0, 0], "bracketed only").status.startswith("bracketed only; limits: ")


def test_no_limit_and_no_depth_give_no_doubt():
    empty = assemble_chart(np.array([3000.0]), 1e-3, [np.zeros(0)] * 6)
    unstable = assemble_chart(np.array([3000.0]), 1e-3, [np.zeros(0)] * 6, unstable_at_zero=np.array([2]))
    assert empty.status == unstable.status == "complete"


def test_a_limit_is_shown_to_the_digit_that_its_error_leaves():
    from toolpoint.studies.cuts.lobes_study import _limit_rows

    shown = {row[0]: row[2] for row in _limit_rows(chart([0.37e-3, 1e-9, 1e-9]))}
    assert shown == {"lowest charted limit": "1.0", "highest charted limit": "4.0000"}


def test_what_is_sure_is_the_limit_less_its_error():
    rough = chart([0.37e-3, 3e-3, 0.0])
    np.testing.assert_allclose(rough.limit_error, [0.37e-3, 3e-3, 0.0])
    np.testing.assert_allclose(rough.sure_limit, [0.63e-3, 0.0, 4e-3])


@given(data=st.data())
def test_the_limit_of_a_chart_is_the_end_of_its_first_stable_interval(data):
    """By the definition, walked point by point; and the point of a limit is the nearest of its speed."""
    n = data.draw(st.integers(1, 4))
    points = sorted(data.draw(st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, 12)), max_size=10)))
    index, depth = np.array([speed for speed, _ in points], int), np.array([1e-3 * level for _, level in points])
    change = np.array([data.draw(st.sampled_from([-2, -1, 1, 2])) for _ in points], int)
    at_zero = np.array([data.draw(st.integers(0, 2)) for _ in range(n)])
    charted = StabilityChart(np.arange(1.0, n + 1), 0.01, index, depth, 0 * depth, 0 * depth, change, depth / 8, at_zero)
    for speed, (limit, point) in enumerate(zip(charted.limit, charted.limit_points(), strict=True)):
        spans = charted.intervals(speed)
        first = 0.0 if spans.size == 0 or spans[0, 0] > 0 else spans[0, 1]
        assert limit == (np.inf if first >= charted.depth_max else first)
        near = [place for place in range(depth.size) if index[place] == speed] if np.isfinite(limit) else []
        assert point == (min(near, key=lambda place: abs(depth[place] - limit)) if near else -1)
        assert charted.limit_error[speed] == (depth[point] / 8 if near else 0.0)
