"""Speeds to use of a tapped tool: chosen on a rough chart, given only where the exact limit stands by them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from toolpoint import Modes
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool, ZeroOrder, stability
from toolpoint.studies.testing import tap_limits

SPEEDS = np.linspace(3000.0, 20000.0, 300)


@pytest.fixture(scope="module")
def problem():
    """One mode of 800 Hz, 2 %, 20 N/um in x and in y; four teeth."""
    shape = 2 * np.pi * 800 / np.sqrt(20e6) * np.eye(2)
    modes = Modes(np.full(2, 800.0), np.full(2, 0.02), shape, ("tool:+x", "tool:+y"))
    return MillingProblem(Tool(0.016, 4), Engagement.down(0.5), CuttingCoefficients(8e8, 3e8), modes)


def speeds_to_use(problem, low=0.8):
    chart = stability.chart(problem, SPEEDS, ZeroOrder(), depth_max=0.05)
    return tap_limits._speeds_to_use(problem, chart, np.full(SPEEDS.size, low), 0.05)


def test_speeds_to_use_are_stable_beside_themselves_with_depth_in_hand(problem):
    picked, left_out = speeds_to_use(problem)
    assert len(picked) == 3 and left_out == 0 and picked[0].worth == 1
    for speed in picked:
        beside = speed.speed * np.linspace(1 - tap_limits.SPEED_MARGIN, 1 + tap_limits.SPEED_MARGIN, 3)
        assert speed.depth / 0.8 / (1 - tap_limits.DEPTH_MARGIN) <= stability.chart(problem, beside, depth_max=0.05).limit.min()
    for a, b in itertools.pairwise(picked):
        assert abs(a.speed / b.speed - 1) > 0.07 and a.worth >= b.worth


def test_a_speed_whose_exact_limit_is_not_known_is_left_out_and_counted(problem, monkeypatch):
    """The most promising speed on the rough chart: its exact limit less the stated error is zero."""
    known, _ = speeds_to_use(problem)
    exact, first = tap_limits._check_speed, []

    def checked(cut, speed, low, depth):
        first.append(speed)
        result = exact(cut, speed, low, depth)
        return replace(result, depth=0.0) if speed == first[0] else result

    monkeypatch.setattr(tap_limits, "_check_speed", checked)
    picked, left_out = speeds_to_use(problem)
    assert left_out == 1 and len(picked) == 3 and first[0] in [speed.speed for speed in known]
    assert first[0] not in [speed.speed for speed in picked] and min(speed.depth for speed in picked) > 0


def test_where_no_exact_limit_stands_no_speed_is_given(problem, monkeypatch):
    monkeypatch.setattr(tap_limits, "_check_speed", lambda cut, speed, low, depth: tap_limits.SpeedToUse(speed, 0.0, 0.0, 1.0))
    picked, left_out = speeds_to_use(problem)
    assert picked == () and left_out == tap_limits.MAX_TRIED_SPEEDS
