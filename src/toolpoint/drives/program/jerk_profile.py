"""Seven-phase jerk-limited motion along one coordinate, and quintic moves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from toolpoint._check import FloatArray, fail, positive, scalar


@dataclass(frozen=True)
class JerkLimits:
    """Limits of speed (m/s), acceleration (m/s^2) and jerk (m/s^3).

    Examples
    --------
    >>> JerkLimits(speed=0.5, acceleration=3.0, jerk=100.0).jerk
    100.0
    """

    speed: float
    acceleration: float
    jerk: float

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "jerk"):
            positive(f"JerkLimits.{name}", getattr(self, name))


@dataclass(frozen=True)
class SevenPhase:
    """Piecewise constant jerk: (duration s, jerk m/s^3) of each phase, from `start_speed` at rest of acceleration."""

    phases: tuple[tuple[float, float], ...]
    start_speed: float = 0.0

    @property
    def duration(self) -> float:
        """Whole time, s."""
        return math.fsum(t for t, _ in self.phases)

    def sample(self, time: FloatArray) -> FloatArray:
        """Return position, speed, acceleration, jerk at times, shape (n, 4); held before the start and after the end."""
        time = np.asarray(time, float)
        knots = np.concatenate([[0.0], np.cumsum([t for t, _ in self.phases])])
        state, states = (0.0, self.start_speed, 0.0), []
        for t, j in self.phases:
            states.append((*state, j))
            s, v, a = state
            state = (s + v * t + a * t * t / 2 + j * t**3 / 6, v + a * t + j * t * t / 2, a + j * t)
        # Behind the last phase the place stays, without the rest of acceleration that rounding of the phases leaves.
        states.append((*state[:2], 0.0, 0.0))
        phase = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(states) - 1)
        s, v, a, j = np.array(states)[phase].T
        d = np.maximum(time - knots[phase], 0.0)
        return np.stack([s + v * d + a * d * d / 2 + j * d**3 / 6, v + a * d + j * d * d / 2, a + j * d, j], axis=-1)


def speed_change(start: float, end: float, limits: JerkLimits) -> tuple[float, float, float]:
    """Return (jerk time, constant time, distance) of the fastest change of speed, acceleration zero at both ends."""
    change = abs(end - start)
    if change >= limits.acceleration**2 / limits.jerk:
        t1 = limits.acceleration / limits.jerk
        t2 = change / limits.acceleration - t1
    else:
        t1, t2 = math.sqrt(change / limits.jerk), 0.0
    return t1, t2, 0.5 * (start + end) * (2 * t1 + t2)


def seven_phase(length: float, limits: JerkLimits, start_speed: float = 0.0, *, end_speed: float = 0.0) -> SevenPhase:
    """Return the fastest motion over `length` (m) with zero acceleration at both ends.

    At rest at both ends and with every limit reached its duration is L/v + v/a + a/j.

    Raises
    ------
    ToolpointError
        Where an end speed exceeds the limit, or the length is too short to change from one to the other.

    Examples
    --------
    >>> profile = seven_phase(1.0, JerkLimits(speed=0.5, acceleration=2.5, jerk=50.0))
    >>> round(profile.duration, 9)  # L/v + v/a + a/j
    2.25
    """
    for name, v in (("start_speed", start_speed), ("end_speed", end_speed)):
        if scalar(name, v) < 0 or v > limits.speed * (1 + 1e-12):
            fail(name, f"{v:g} m/s", f"must be within 0 and the limit {limits.speed:g}")
    if scalar("length", length) < 0:
        fail("length", f"{length:g} m", "must not be negative")
    shortest = speed_change(start_speed, end_speed, limits)[2]
    if length < shortest * (1 - 1e-12):
        fail("length", f"{length:g} m", f"must be at least {shortest:g} m to change from {start_speed:g} to "
             f"{end_speed:g} m/s")
    peak = limits.speed if _distance(limits.speed, start_speed, end_speed, limits) <= length else _peak(
        length, start_speed, end_speed, limits)
    (a1, a2, up), (d1, d2, down) = speed_change(start_speed, peak, limits), speed_change(peak, end_speed, limits)
    # Negative by rounding where the peak was bisected to just this length.
    cruise = max((length - up - down) / peak, 0.0) if peak > 0 else 0.0
    j = limits.jerk
    return SevenPhase(((a1, j), (a2, 0.0), (a1, -j), (cruise, 0.0), (d1, -j), (d2, 0.0), (d1, j)), start_speed)


def _distance(peak: float, start: float, end: float, limits: JerkLimits) -> float:
    return speed_change(start, peak, limits)[2] + speed_change(peak, end, limits)[2]


def _peak(length: float, start: float, end: float, limits: JerkLimits) -> float:
    """Return the peak speed whose two changes take just `length`: rest to rest closed, else by bisection."""
    if start == end == 0.0:
        a, j = limits.acceleration, limits.jerk
        # Without a phase of constant acceleration: L = 2 v sqrt(v/j). With one: L = v (v/a + a/j).
        short = (length * math.sqrt(j) / 2) ** (2 / 3)
        return short if short <= a * a / j else a * (math.sqrt(a * a / (j * j) + 4 * length / a) - a / j) / 2
    lower, upper = max(start, end), limits.speed
    # Bisection: the distance has a square root at each end, where Newton's method starts with an infinite slope.
    while upper - lower > 1e-16 * upper:
        middle = 0.5 * (lower + upper)
        # Two neighbouring floats have no number between them: the interval cannot shrink further.
        if middle in (lower, upper):
            break
        lower, upper = (middle, upper) if _distance(middle, start, end, limits) <= length else (lower, middle)
    return lower


@dataclass(frozen=True)
class Quintic:
    """Rest-to-rest move s = L (10 u^3 - 15 u^4 + 6 u^5), u = t/T: speed, acceleration continuous and zero at the ends.

    Examples
    --------
    >>> move = Quintic(length=0.1, duration=0.5)
    >>> [round(v, 9) for v in move.sample(0.25).tolist()]  # middle: half the way, 15/8 L/T, no acceleration
    [0.05, 0.375, 0.0, -24.0]
    """

    length: float
    duration: float

    def __post_init__(self) -> None:
        positive("Quintic.duration", self.duration)

    @classmethod
    def fastest(cls, length: float, limits: JerkLimits) -> Quintic:
        """Return the shortest one: peaks 15/8 L/T, 10/sqrt(3) L/T^2, 60 L/T^3 within the limits."""
        size = abs(scalar("length", length))
        return cls(length, max(15 / 8 * size / limits.speed, math.sqrt(10 / math.sqrt(3) * size / limits.acceleration),
                               (60 * size / limits.jerk) ** (1 / 3), 1e-9))

    def sample(self, time: FloatArray) -> FloatArray:
        """Return position, speed, acceleration, jerk at times, shape (n, 4); held before the start and after the end."""
        u = np.clip(np.asarray(time, float) / self.duration, 0.0, 1.0)
        t, inside = self.duration, (u > 0) & (u < 1)
        return self.length * np.stack([u**3 * (10 + u * (6 * u - 15)), 30 * u**2 * (1 - u) ** 2 / t,
                                       60 * u * (1 - u) * (1 - 2 * u) / t**2, inside * 60 * (1 - 6 * u + 6 * u**2) / t**3],
                                      axis=-1)
