"""Speeds of a chart on several threads: the same points to the last bit as on one, and errors that come through."""

import threading
from dataclasses import fields

import numpy as np
import pytest

from cutting.cutting_cases import altintas
from toolpoint import _threads
from toolpoint.cutting import PanelArnoldi, Tool, stability
from toolpoint.cutting.stability.panels import speeds as panel_speeds

SPEEDS = np.linspace(4000.0, 12000.0, 10)
TOOLS = {"helix": Tool(0.0254, 4, helix=np.radians(30)), "pitch": Tool(0.0254, 2, pitch=np.radians([170.0, 190.0]))}


@pytest.mark.parametrize("name", TOOLS)
def test_points_do_not_depend_on_the_number_of_threads(name, monkeypatch):
    problem, charts = altintas().changed(tool=TOOLS[name]), []
    for threads in (1, 3):
        monkeypatch.setattr(panel_speeds, "available_threads", lambda threads=threads: threads)
        charts.append(stability.chart(problem, SPEEDS, PanelArnoldi(levels=6, tolerance=1e-3), depth_max=3e-3))
    one, several = charts
    assert np.isfinite(one.limit).any()
    for field in fields(one):
        first, second = getattr(one, field.name), getattr(several, field.name)
        assert np.array_equal(first, second, equal_nan=True) if isinstance(first, np.ndarray) else first == second, field.name


def test_results_keep_their_order_and_an_error_ends_the_rest():
    begun = []

    def part(number):
        begun.append(number)
        if number == 3:
            raise ValueError("three")
        return number**2

    assert _threads.run_side_by_side(lambda number: number**2, range(20), 3) == [n**2 for n in range(20)]
    with pytest.raises(ValueError, match="three"):
        _threads.run_side_by_side(part, range(10_000), 2)
    assert len(begun) < 10_000


def test_parts_see_the_settings_of_numpy_of_their_caller():
    def divide(number):
        return np.float64(number) / np.zeros(1)[0]

    with np.errstate(divide="raise", invalid="raise"), pytest.raises(FloatingPointError):
        _threads.run_side_by_side(divide, [1.0], 2)


def test_a_thread_that_is_not_the_main_one_starts_no_others():
    counts = []
    helper = threading.Thread(target=lambda: counts.append(_threads.available_threads()))
    helper.start()
    helper.join()
    assert counts == [1]
    assert 1 <= _threads.available_threads() <= _threads.MAX_KERNEL_THREADS
