"""Set points: seven-phase profile, quintic, straight moves within limits, look-ahead over lines and arcs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.drives import Command, JerkLimits, Quintic, check_limits, planned, seven_phase, smoothed, straight_move
from toolpoint.drives.path import ARC, Path, blended, polyline

LIMITS = JerkLimits(0.5, 4.0, 80.0)


def test_duration_when_all_limits_are_reached():
    """L/v + v/a + a/j."""
    assert seven_phase(1.0, LIMITS).duration == pytest.approx(1 / 0.5 + 0.5 / 4 + 4 / 80, rel=1e-14)


@settings(max_examples=200, deadline=None)
@given(st.floats(1e-6, 2.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_profile_ends_where_it_must(extra, start, end):
    v0, v1 = 0.5 * start, 0.5 * end
    from toolpoint.drives.jerk_profile import speed_change

    length = speed_change(v0, v1, LIMITS)[2] + extra
    profile = seven_phase(length, LIMITS, v0, v1)
    last = profile.sampled(np.array([profile.duration]))[0]
    np.testing.assert_allclose(last[:2], [length, v1], atol=1e-9)
    t = np.linspace(0, profile.duration, 2001)
    s = profile.sampled(t)
    assert s[:, 1].max() <= 0.5 * (1 + 1e-9)
    assert np.abs(s[:, 2]).max() <= 4 * (1 + 1e-9)
    assert s[:, 1].min() >= -1e-9


def test_ten_thousand_random_moves_keep_limits():
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(10_000):
        limits = [JerkLimits(*(10 ** rng.uniform([-1.5, 0, 1], [0, 1, 2.5]))) for _ in range(2)]
        start, end = rng.uniform(-0.2, 0.2, (2, 2))
        report = check_limits(straight_move(start, end, limits, 2e-3), limits)
        worst = max(worst, report.share.max())
        assert report.kept, report
    assert worst > 0.99


def test_durations_equal_ruckig():
    ruckig = pytest.importorskip("ruckig", reason="ruckig is not installed")
    rng = np.random.default_rng(2)
    for _ in range(2000):
        limits = JerkLimits(*(10 ** rng.uniform([-2, -1, 0], [1, 2, 3])))
        length = 10 ** rng.uniform(-5, 1)
        given_ = ruckig.InputParameter(1)
        given_.target_position, given_.max_velocity = [length], [limits.speed]
        given_.max_acceleration, given_.max_jerk = [limits.acceleration], [limits.jerk]
        trajectory = ruckig.Trajectory(1)
        ruckig.Ruckig(1).calculate(given_, trajectory)
        assert seven_phase(length, limits).duration == pytest.approx(trajectory.duration, abs=1e-9, rel=1e-9)


def test_quintic_keeps_limits():
    move = Quintic.fastest(0.3, LIMITS)
    s = move.sampled(np.linspace(0, move.duration, 5001))
    shares = np.abs(s[:, 1:]).max(axis=0) / [0.5, 4.0, 80.0]
    assert shares.max() == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose(s[-1, :3], [0.3, 0, 0], atol=1e-12)


def test_checker_sees_a_broken_limit():
    t = np.arange(0, 1, 1e-3)
    stream = Command(np.stack([0.01 * np.sin(30 * t), 0 * t], axis=1), 1e-3)
    report = check_limits(stream, JerkLimits(0.2, 10.0, 1e4))
    assert not report.kept
    assert "speed" in repr(report)
    assert report.share[0, 0] == pytest.approx(0.3 / 0.2, rel=1e-3)


def test_polyline_with_stops_keeps_all_limits():
    rng = np.random.default_rng(3)
    path = polyline(np.cumsum(rng.uniform(-0.02, 0.02, (60, 2)), axis=0), 0.2)
    plan = planned(path, LIMITS)
    command = plan.command(1e-3, 2)
    assert check_limits(command, LIMITS).kept
    np.testing.assert_allclose(command.position[-1], path.end[-1, :2], atol=1e-12)


def test_corner_tolerance_is_kept_and_time_saved():
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.uniform(-0.02, 0.02, (60, 2)), axis=0)
    path = polyline(points, 0.2)
    plan = planned(path, LIMITS, corner_tolerance=2e-5)
    assert plan.duration < planned(path, LIMITS).duration
    command = plan.command(1e-3, 2)
    gaps = [np.linalg.norm(command.position - corner, axis=1).min() for corner in points[1:-1]]
    route = blended(path, 2e-5)
    for k in np.flatnonzero(route.kind == ARC):
        middle = route.points(np.array([k]), np.array([0.5]))[0]
        assert np.linalg.norm(points - middle[:2], axis=1).min() <= 2e-5 * (1 + 1e-6)
    assert max(gaps) < 5e-4
    acceleration = np.hypot(*np.diff(command.position, 2, axis=0).T) / 1e-6
    assert acceleration.max() <= np.hypot(4.0, 4.0) * (1 + 1e-6)


def test_smoothing_bounds_the_jerk_of_arcs():
    quarter = np.pi / 2
    path = Path([0, 1, 0], [[0, 0, 0], [0.05, 0, 0], [0.06, 0.01, 0]], [[0.05, 0, 0], [0.06, 0.01, 0], [0.06, 0.05, 0]],
                [[0, 0, 0], [0.05, 0.01, 0], [0, 0, 0]], [0, quarter, 0], [[0, 1]] * 3, [0.15] * 3, [False] * 3)
    command = planned(path, LIMITS).command(1e-3, 2)
    raw = check_limits(command, JerkLimits(0.5, 6.0, 200.0))
    soft = check_limits(smoothed(command, 0.03), JerkLimits(0.5, 6.0, (0.15**2 / 0.01) / 0.03 * 1.05 + 80))
    assert not raw.kept
    assert soft.kept
    np.testing.assert_allclose(np.gradient(command.position, 1e-3, axis=0)[5:-5], command.velocity[5:-5], atol=2e-3)


def test_path_lengths_and_points():
    helix = Path([1], [[0.01, 0, 0]], [[0.01, 0, 0.005]], [[0, 0, 0]], [4 * np.pi], [[0, 1]], [0.1], [False])
    assert helix.lengths[0] == pytest.approx(np.hypot(0.01 * 4 * np.pi, 0.005))
    p = helix.at(np.linspace(0, helix.lengths[0], 50))
    np.testing.assert_allclose(np.hypot(p[:, 0], p[:, 1]), 0.01, rtol=1e-12)
    assert (np.diff(p[:, 2]) > 0).all()


def test_bad_set_points():
    with pytest.raises(ToolpointError, match="at least"):
        seven_phase(1e-6, LIMITS, 0.5, 0.0)
    with pytest.raises(ToolpointError, match="gap"):
        Path([0, 0], [[0, 0, 0], [1, 0, 0]], [[0.5, 0, 0], [2, 0, 0]], np.zeros((2, 3)), [0, 0], [[0, 1]] * 2, [1, 1],
             [False] * 2)
    with pytest.raises(ToolpointError, match="feed"):
        planned(polyline(np.array([[0, 0], [1, 0.0]]), 0.0), LIMITS)
