"""Times of paths within the limits of every axis: closed forms of one axis, and that no random path breaks a limit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from toolpoint.drives.program.axis_limits import AxisTimes, plan_within_axes


def ends(way: np.ndarray) -> np.ndarray:
    return np.stack([way[:-1], way[1:]], axis=1)


def plan(way: np.ndarray, nominal: np.ndarray, *, speed: tuple[float, ...], acceleration: tuple[float, ...],
         stops: np.ndarray | None = None, tolerance: float = 0.0) -> AxisTimes:
    stops = np.array([2, *[0] * (len(way) - 2), 2]) if stops is None else stops
    return plan_within_axes(ends(way), nominal, speed=np.array(speed), acceleration=np.array(acceleration), stops=stops,
                            corner_tolerance=np.full(way.shape[1], tolerance))


@pytest.mark.parametrize("count", [1, 2, 7, 400])
def test_one_axis_takes_the_time_of_its_trapezoid_or_triangle(count: int) -> None:
    way = np.linspace(0, 0.2, count + 1)[:, None]
    for speed, acceleration in ((0.05, 2.0), (10.0, 2.0)):
        result = plan(way, np.full(count, 1.0 / count), speed=(speed,), acceleration=(acceleration,))
        top = min(speed, 0.2, np.sqrt(0.2 * acceleration))  # 0.2 m/s is the programmed feed
        expected = 0.2 / top + top / acceleration
        assert result.times.sum() == pytest.approx(expected, rel=1e-9)
        assert 0.2 * result.peaks.max() == pytest.approx(top, rel=1e-9)


def test_the_slower_axis_rules() -> None:
    """A turn of 1 rad beside 0.1 m: at 0.5 rad/s it takes 2 s and v/a more, however fast the linear axis may go."""
    way = np.linspace(0, 1, 51)[:, None] * np.array([0.1, 1.0])
    result = plan(way, np.full(50, 0.01), speed=(1.0, 0.5), acceleration=(5.0, 4.0))
    assert result.times.sum() == pytest.approx(2 + 0.5 / 4, rel=1e-9)


def test_a_circle_is_passed_at_the_root_of_acceleration_and_radius() -> None:
    """Two axes round 10 mm: v^2/R = 0.9 a where one axis alone bears it, as nine tenths go to the curve."""
    angle = np.linspace(0, 6 * np.pi, 3000)
    way = 0.01 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    result = plan(way, np.full(2999, 0.01 * 6 * np.pi / 2999 / 0.5), speed=(9.0, 9.0), acceleration=(2.0, 2.0))
    middle = result.ratio[1000:2000]
    assert 0.5 * middle.min() == pytest.approx(np.sqrt(0.9 * 2.0 * 0.01), rel=0.02)


def test_a_corner_between_blocks_is_passed_within_its_tolerance() -> None:
    """A right angle: each axis jumps by v, and v = sqrt(8 a e); with no tolerance next to nothing is left."""
    way = np.concatenate([np.stack([np.linspace(0, 0.1, 51), np.zeros(51)], axis=1),
                          np.stack([np.full(50, 0.1), np.linspace(0, 0.1, 51)[1:]], axis=1)])
    stops = np.array([2, *[0] * 49, 1, *[0] * 49, 2])
    for tolerance in (1e-5, 4e-5):
        result = plan(way, np.full(100, 0.002 / 0.2), speed=(9.0, 9.0), acceleration=(2.0, 2.0), stops=stops,
                      tolerance=tolerance)
        assert 0.2 * result.ratio[50] == pytest.approx(np.sqrt(8 * 2.0 * tolerance), rel=1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 4))
def test_no_random_path_breaks_a_limit(seed: int, axes: int) -> None:
    """Speeds of every step and accelerations between the middles of neighbours: within their limits by a few percent."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, 400)
    way = sum(rng.normal(size=axes) * np.sin(share[:, None] * rng.uniform(1, 9) + rng.uniform(0, 6)) for _ in range(4))
    speed, acceleration = rng.uniform(0.3, 3, axes), rng.uniform(0.5, 9, axes)
    result = plan(way, rng.uniform(0.5, 2) * np.full(399, 1 / 399), speed=tuple(speed), acceleration=tuple(acceleration))
    velocity = np.diff(way, axis=0) / result.times[:, None]
    assert (np.abs(velocity) <= speed * (1 + 1e-9)).all()
    between = (result.times[1:] + result.times[:-1]) / 2
    assert (np.abs(np.diff(velocity, axis=0) / between[:, None])[2:-2] <= acceleration * 1.1).all()
    assert result.ratio.max() <= 1 + 1e-12 and result.ratio[0] == result.ratio[-1] == 0
