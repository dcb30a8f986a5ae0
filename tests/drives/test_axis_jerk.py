"""Motion within speed, acceleration and jerk of every axis: closed forms, and that no random path breaks a limit."""

import numpy as np
import pytest

from toolpoint._check import ToolpointError
from toolpoint.drives.program.axis_jerk import AxisMotion, MotionBounds, move_within_axes
from toolpoint.drives.program.axis_limits import plan_within_axes, sight_ceiling
from toolpoint.drives.program.command import Command
from toolpoint.drives.program.jerk_profile import JerkLimits, seven_phase
from toolpoint.drives.program.limits import check_limits
from toolpoint.drives.program.path import polyline
from toolpoint.drives.program.planner import plan_motion, sight_of
from toolpoint.drives.program.rounded_path import RoundedPath


def ends(way: np.ndarray) -> np.ndarray:
    return np.stack([way[:-1], way[1:]], axis=1)


def limits_of(*each: tuple[float, float, float]) -> MotionBounds:
    return MotionBounds(*(np.array(column) for column in zip(*each, strict=True)))


def move(way: np.ndarray, nominal: np.ndarray, limits: MotionBounds, *, stops: np.ndarray | None = None,
         tolerance: float = 1e-5) -> AxisMotion:
    stops = np.array([2, *[0] * (len(way) - 2), 2]) if stops is None else stops
    return move_within_axes(ends(way), nominal, limits, stops=stops, corner_tolerance=np.full(way.shape[1], tolerance))


@pytest.mark.parametrize("count", [1, 7, 200])
@pytest.mark.parametrize("length", [1e-4, 1e-2, 0.3, 1.0])
def test_one_axis_takes_the_time_of_its_seven_phases(count: int, length: float) -> None:
    way = np.linspace(0, length, count + 1)[:, None]
    motion = move(way, np.full(count, length / count / 0.5), limits_of((0.5, 5.0, 100.0)))
    expected = seven_phase(length, JerkLimits(0.5, 5.0, 100.0)).duration
    assert expected * (1 - 1e-9) <= motion.duration <= expected * 1.012
    assert motion.times.sum() == pytest.approx(motion.duration)


def test_a_stop_in_the_middle_is_two_motions() -> None:
    way, limits = np.linspace(0, 0.2, 41)[:, None], limits_of((0.5, 5.0, 100.0))
    stops = np.array([2, *[0] * 19, 2, *[0] * 19, 2])
    motion, half = (move(each, np.full(len(each) - 1, 0.01), limits, stops=at)
                    for each, at in ((way, stops), (way[:21], stops[:21])))
    assert motion.duration == pytest.approx(2 * half.duration, rel=1e-6)
    assert motion.ratio[20] == pytest.approx(0, abs=1e-6)
    assert motion.sample(np.array([half.duration]))[0][0, 0] == pytest.approx(0.1, abs=1e-9)


def test_a_corner_is_rounded_within_its_tolerance_and_passed_within_the_jerk() -> None:
    """A right angle within e: each axis' rate goes from v to 0 over the rounding, whose jerk J v^2/w^2 bounds v."""
    way = np.concatenate([np.stack([np.linspace(0, 0.05, 26), np.zeros(26)], axis=1),
                          np.stack([np.full(25, 0.05), np.linspace(0, 0.05, 26)[1:]], axis=1)])
    stops, limits = np.array([2, *[0] * 24, 1, *[0] * 24, 2]), limits_of((1.0, 5.0, 100.0), (1.0, 5.0, 100.0))
    for tolerance in (1e-5, 1e-4):
        motion = move(way, np.full(50, 0.01), limits, stops=stops, tolerance=tolerance)
        places = motion.sample(np.linspace(0, motion.duration, 20_000))[0]
        inside = (0.05 - places[:, 0] > 0) & (places[:, 1] > 0)
        assert np.minimum(0.05 - places[:, 0], places[:, 1])[inside].max() <= tolerance
        speed = 0.2 * motion.ratio[25]
        assert 0.3 * (36 * 100 * tolerance**2) ** (1 / 3) < speed <= (36 * 100 * tolerance**2) ** (1 / 3)


@pytest.mark.parametrize("seed", range(6))
def test_no_sample_of_a_random_path_breaks_a_limit(seed: int) -> None:
    """By differences of the positions alone, which are means of speed, acceleration and jerk."""
    rng = np.random.default_rng(seed)
    axes, share = int(rng.integers(2, 6)), np.linspace(0, 1, 121)[:, None]
    way = sum(rng.normal(size=axes) * np.sin(share * rng.uniform(1, 9) + rng.uniform(0, 6)) for _ in range(4))
    acceleration = rng.uniform(0.5, 9, axes)
    limits = MotionBounds(rng.uniform(0.3, 3, axes), acceleration, acceleration / rng.uniform(0.05, 0.2, axes))
    motion = move(np.asarray(way), np.full(120, 1 / 120), limits, tolerance=1e-3)
    time = np.arange(0, motion.duration + 4e-3, 1e-3)
    report = check_limits(Command(motion.sample(time)[0], 1e-3),
                          [JerkLimits(*each) for each in zip(limits.speed, limits.acceleration, limits.jerk, strict=True)])
    assert report.share.max() <= 1.01
    assert motion.ratio.max() <= 1 + 1e-9 and (motion.times > 0).all()


def test_the_derivatives_along_a_rounded_path_are_those_of_its_places() -> None:
    way = np.random.default_rng(5).normal(size=(12, 2))
    path = RoundedPath.of(ends(way), np.random.default_rng(6).uniform(0.5, 2, 11), stops=np.array([2, *[0] * 10, 2]),
                          tolerance=np.full(2, 0.2))
    sigma, h = np.random.default_rng(7).uniform(0.1, path.sigma[-1] - 0.1, 50), 1e-5
    at = [path.derivatives(s, np.searchsorted(path.sigma, s, side="right") - 1) for s in (sigma - h, sigma, sigma + h)]
    for order in range(3):
        expected = at[1][order + 1]
        assert (at[2][order] - at[0][order]) / (2 * h) == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    assert (path.deviation <= 0.2 + 1e-12).all()


def test_a_jerk_without_an_acceleration_is_refused() -> None:
    with pytest.raises(ToolpointError, match="acceleration"):
        move(np.linspace(0, 1, 5)[:, None], np.full(4, 0.1), limits_of((1.0, np.inf, 5.0)))


def test_a_control_that_sees_few_blocks_is_slower_and_can_always_stop() -> None:
    """Blocks of 1 mm on a line: seeing n of them the speed keeps v t(v)/2 <= n mm at every joint; none is a stop at each."""
    limits, path = JerkLimits(0.5, 3.0, 100.0), polyline([[1e-3 * k, 0] for k in range(101)], feed=0.2)
    path = path.__class__(**{**{name: getattr(path, name) for name in path.__dataclass_fields__}, "line": np.arange(100)})
    free = plan_motion(path, limits)
    durations = []
    for blocks in (0, 1, 5, 20, 99):
        plan = plan_motion(path, limits, look_ahead=blocks)
        durations.append(plan.duration)
        for speed in np.asarray(plan.junction)[1:-1]:
            stop = seven_phase_distance(float(speed), limits)
            assert stop <= 1e-3 * blocks * (1 + 1e-9) + 1e-15
    assert durations == sorted(durations, reverse=True)
    assert durations[0] == pytest.approx(100 * seven_phase(1e-3, limits).duration, rel=1e-6)
    assert durations[-1] == pytest.approx(free.duration, rel=1e-9)


def seven_phase_distance(speed: float, limits: JerkLimits) -> float:
    a, j = limits.acceleration, limits.jerk
    time = speed / a + a / j if speed >= a * a / j else 2 * np.sqrt(speed / j)
    return 0.5 * speed * time


def test_sight_counts_whole_blocks() -> None:
    line, length = np.array([1, 2, 2, 3, 4]), np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert sight_of(line, length, 1).tolist() == [1.0, 5.0, 7.0, 4.0, 5.0, 0.0]
    assert sight_of(line, length, 0).tolist() == [0.0, 0.0, 3.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("blocks", [0, 1, 4])
def test_axes_of_a_control_that_sees_few_blocks_can_stop_in_them(blocks: int) -> None:
    """A straight line in blocks of two steps: r^2/2 <= a sight/v^2 of the axis, and by W/2 of time less with an average."""
    n, length = 60, 0.12
    way, nominal, line = np.linspace(0, length, n + 1)[:, None], np.full(n, length / n / 0.3), np.arange(n) // 2
    options = {"speed": np.array([1.0]), "acceleration": np.array([5.0]), "stops": np.array([2, *[0] * (n - 1), 2]),
               "corner_tolerance": np.array([1e-5])}
    ceiling = sight_ceiling(ends(way), nominal, line=line, blocks=blocks, **options)
    plan = plan_within_axes(ends(way), nominal, ceiling=ceiling, **options)
    sight = sight_of(line, np.full(n, length / n), blocks)
    speed = 0.3 * plan.ratio
    assert (speed[1:-1] ** 2 / 2 / 5.0 <= sight[1:-1] * (1 + 1e-9) + 1e-12).all()
    if blocks:
        free = plan_within_axes(ends(way), nominal, **options)
        assert (plan.times.sum() > free.times.sum()) == (blocks == 1)  # four blocks are enough for the feed
        assert plan.ratio[n // 2] > 0.9 * min(np.sqrt(2 * 5.0 * 0.004 * blocks) / 0.3, 1.0)
    averaged = sight_ceiling(ends(way), nominal, line=line, blocks=blocks, window=0.05, **options)
    middle = averaged[n // 2] * 0.3
    assert middle**2 / 10 + middle * 0.025 <= sight[n // 2] + 1e-12
    if blocks == 1:  # not the feed, but the sight bounds it
        assert middle**2 / 10 + middle * 0.025 == pytest.approx(sight[n // 2], rel=0.02)
