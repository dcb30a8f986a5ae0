"""Set points: seven-phase profile, quintic, straight moves within limits, look-ahead over lines and arcs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.drives import Command, JerkLimits, Quintic, check_limits, plan_motion, seven_phase, smooth_command, straight_move
from toolpoint.drives.program.clothoid import Blend, half_lengths
from toolpoint.drives.program.path import ARC_KIND, CLOTHOID_KIND, Path, blend_corners, polyline, soften_corners

LIMITS = JerkLimits(0.5, 4.0, 80.0)


def test_duration_when_all_limits_are_reached():
    """L/v + v/a + a/j."""
    assert seven_phase(1.0, LIMITS).duration == pytest.approx(1 / 0.5 + 0.5 / 4 + 4 / 80, rel=1e-14)


@settings(max_examples=200, deadline=None)
@given(st.floats(1e-6, 2.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_profile_ends_where_it_must(extra, start, end):
    v0, v1 = 0.5 * start, 0.5 * end
    from toolpoint.drives.program.jerk_profile import speed_change

    length = speed_change(v0, v1, LIMITS)[2] + extra
    profile = seven_phase(length, LIMITS, v0, end_speed=v1)
    last = profile.sample(np.array([profile.duration]))[0]
    np.testing.assert_allclose(last[:2], [length, v1], atol=1e-9)
    t = np.linspace(0, profile.duration, 2001)
    s = profile.sample(t)
    assert s[:, 1].max() <= 0.5 * (1 + 1e-9)
    assert np.abs(s[:, 2]).max() <= 4 * (1 + 1e-9)
    assert s[:, 1].min() >= -1e-9


@pytest.mark.slow
def test_ten_thousand_random_moves_keep_limits():
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(10_000):
        limits = [JerkLimits(*(10 ** rng.uniform([-1.5, 0, 1], [0, 1, 2.5]))) for _ in range(2)]
        start, end = rng.uniform(-0.2, 0.2, (2, 2))
        report = check_limits(straight_move(start, end, limits, sample_time=2e-3), limits)
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
    s = move.sample(np.linspace(0, move.duration, 5001))
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
    plan = plan_motion(path, LIMITS)
    command = plan.command(1e-3, 2)
    assert check_limits(command, LIMITS).kept
    np.testing.assert_allclose(command.position[-1], path.end[-1, :2], atol=1e-12)


def test_corner_tolerance_is_kept_and_time_saved():
    rng = np.random.default_rng(4)
    points = np.cumsum(rng.uniform(-0.02, 0.02, (60, 2)), axis=0)
    path = polyline(points, 0.2)
    plan = plan_motion(path, LIMITS, corner_tolerance=2e-5)
    assert plan.duration < plan_motion(path, LIMITS).duration
    command = plan.command(1e-3, 2)
    gaps = [np.linalg.norm(command.position - corner, axis=1).min() for corner in points[1:-1]]
    route = blend_corners(path, 2e-5)
    for k in np.flatnonzero(route.kind == ARC_KIND):
        middle = route.points(np.array([k]), np.array([0.5]))[0]
        assert np.linalg.norm(points - middle[:2], axis=1).min() <= 2e-5 * (1 + 1e-6)
    assert max(gaps) < 5e-4
    acceleration = np.hypot(*np.diff(command.position, 2, axis=0).T) / 1e-6
    assert acceleration.max() <= np.hypot(4.0, 4.0) * (1 + 1e-6)


def test_smoothing_bounds_the_jerk_of_arcs():
    quarter = np.pi / 2
    path = Path([0, 1, 0], [[0, 0, 0], [0.05, 0, 0], [0.06, 0.01, 0]], [[0.05, 0, 0], [0.06, 0.01, 0], [0.06, 0.05, 0]],
                [[0, 0, 0], [0.05, 0.01, 0], [0, 0, 0]], [0, quarter, 0], [[0, 1]] * 3, [0.15] * 3, [False] * 3)
    command = plan_motion(path, LIMITS).command(1e-3, 2)
    raw = check_limits(command, JerkLimits(0.5, 6.0, 200.0))
    soft = check_limits(smooth_command(command, 0.03), JerkLimits(0.5, 6.0, (0.15**2 / 0.01) / 0.03 * 1.05 + 80))
    assert not raw.kept
    assert soft.kept
    np.testing.assert_allclose(np.gradient(command.position, 1e-3, axis=0)[5:-5], command.velocity[5:-5], atol=2e-3)


@settings(max_examples=60, deadline=None)
@given(st.floats(1e-3, 3.0), st.floats(1e-6, 1e-3), st.integers(0, 10_000))
def test_clothoid_blend_in_any_plane(turn, tolerance, seed):
    """Ends on the lines, tangents and curvature continuous, unit speed, the middle at the tolerance from the corner."""
    rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3))).Q
    one, t = np.array([turn]), np.array([turn])
    half, trim = half_lengths(t, tolerance, np.array([10.0]))
    before, after = rotation[:, 0], np.cos(turn) * rotation[:, 0] + np.sin(turn) * rotation[:, 1]
    n = 4001
    spread = lambda v: np.tile(v, (n, 1))
    blend = Blend(spread(-trim * before), spread(trim * after), np.zeros((n, 3)), np.full(n, turn))
    u = np.linspace(0, 1, n)
    p, tangent, curvature = blend.points(u), blend.tangents(u), blend.curvatures(u)
    length = 2 * blend.half_length[0]
    assert length == pytest.approx(2 * half[0], rel=1e-9)
    np.testing.assert_allclose(p[[0, -1]], [-trim * before, trim * after], atol=1e-9 * trim[0])
    np.testing.assert_allclose(tangent[[0, -1]], [before, after], atol=1e-9)
    step = length / (n - 1)
    np.testing.assert_allclose((p[2:] - p[:-2]) / (2 * step), tangent[1:-1], atol=2e-5 * (1 + one[0]))
    np.testing.assert_allclose((tangent[2:] - tangent[:-2]) / (2 * step), curvature[1:-1], atol=2e-3 * turn / half[0])
    np.testing.assert_allclose(np.linalg.norm(curvature, axis=1), turn / half[0] * (1 - np.abs(2 * u - 1)), atol=1e-9 / half[0])
    assert np.linalg.norm(p[n // 2]) == pytest.approx(tolerance, rel=1e-6)
    assert np.linalg.norm(p, axis=1).min() == pytest.approx(tolerance, rel=1e-6)


@pytest.mark.parametrize("axes", [2, 3])
def test_clothoid_corners_keep_the_jerk_of_every_axis(axes):
    """The independent checker sees speed, acceleration and jerk kept without smoothing; arcs of the same tolerance break it."""
    rng = np.random.default_rng(8)
    direction = np.cumsum(rng.uniform(-0.25, 0.25, (80, axes)), axis=0) + np.eye(axes)[0]
    points = np.cumsum(0.02 * direction / np.linalg.norm(direction, axis=1, keepdims=True), axis=0)
    path = polyline(points, 0.2)
    plan = plan_motion(path, LIMITS, corner_tolerance=5e-5, straight=1e-7, corner="clothoid")
    command = plan.command(5e-4, axes)
    report = check_limits(command, LIMITS)
    assert report.kept, report
    assert report.share[:, 2].max() > 0.9
    assert plan.duration < 0.9 * plan_motion(path, LIMITS).duration
    arcs = plan_motion(path, LIMITS, corner_tolerance=5e-5, straight=1e-7).command(5e-4, axes)
    if axes == 2:
        assert check_limits(arcs, LIMITS).share[:, 2].max() > 5.0
    soft = soften_corners(path, 5e-5)
    assert (soft.kind == CLOTHOID_KIND).sum() == (path.turns() > 1e-4).sum()
    assert (plan.path.kind == CLOTHOID_KIND).sum() > 60
    for corner in np.pad(points, ((0, 0), (0, 3 - axes)))[1:-1]:
        gap = np.linalg.norm(np.pad(command.position, ((0, 0), (0, 3 - axes))) - corner, axis=1).min()
        assert gap < 5e-5 + 0.2 * 5e-4
    np.testing.assert_allclose(np.gradient(command.position, 5e-4, axis=0)[5:-5], command.velocity[5:-5], atol=1e-4)
    np.testing.assert_allclose(np.gradient(command.velocity, 5e-4, axis=0)[5:-5], command.acceleration[5:-5], atol=0.05)


def test_sharp_corners_stop_where_creeping_takes_longer():
    """A random zigzag: never slower than stopping at every corner."""
    rng = np.random.default_rng(8)
    path = polyline(np.cumsum(rng.uniform(-0.02, 0.02, (80, 2)), axis=0), 0.2)
    for tolerance in (5e-6, 5e-5, 5e-4):
        plan = plan_motion(path, LIMITS, corner_tolerance=tolerance, straight=1e-7, corner="clothoid")
        assert plan.duration < plan_motion(path, LIMITS).duration
        assert check_limits(plan.command(5e-4, 2), LIMITS).kept


def test_path_lengths_and_points():
    helix = Path([1], [[0.01, 0, 0]], [[0.01, 0, 0.005]], [[0, 0, 0]], [4 * np.pi], [[0, 1]], [0.1], [False])
    assert helix.lengths[0] == pytest.approx(np.hypot(0.01 * 4 * np.pi, 0.005))
    p = helix.at(np.linspace(0, helix.lengths[0], 50))
    np.testing.assert_allclose(np.hypot(p[:, 0], p[:, 1]), 0.01, rtol=1e-12)
    assert (np.diff(p[:, 2]) > 0).all()


def test_bad_set_points():
    with pytest.raises(ToolpointError, match="at least"):
        seven_phase(1e-6, LIMITS, 0.5, end_speed=0.0)
    with pytest.raises(ToolpointError, match="gap"):
        Path([0, 0], [[0, 0, 0], [1, 0, 0]], [[0.5, 0, 0], [2, 0, 0]], np.zeros((2, 3)), [0, 0], [[0, 1]] * 2, [1, 1],
             [False] * 2)
    with pytest.raises(ToolpointError, match="arc"):
        plan_motion(polyline(np.array([[0, 0], [1, 0.0]]), 0.1), LIMITS, corner="spline")
    with pytest.raises(ToolpointError, match="feed"):
        plan_motion(polyline(np.array([[0, 0], [1, 0.0]]), 0.0), LIMITS)
