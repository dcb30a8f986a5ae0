"""Command: positions, velocities and accelerations of the axes at one sample time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from toolpoint._check import FloatArray, count, fail, floats, frozen, positive
from toolpoint._notebook import NotebookText


@dataclass(frozen=True, eq=False)
class Command(NotebookText):
    """Set points of several axes.

    Parameters
    ----------
    position : (n, n_axes) floats
        m.
    sample_time : float
        s.
    velocity, acceleration : (n, n_axes) floats, optional
        m/s, m/s^2; central differences of the position where left out.

    Examples
    --------
    >>> import numpy as np
    >>> Command(np.linspace(0, 0.1, 11)[:, None], sample_time=1e-3)
    Command(1 axes, 0.01 s, every 1 ms)
    """

    position: FloatArray
    sample_time: float
    velocity: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    acceleration: FloatArray = field(default_factory=lambda: np.empty((0, 0)))

    def __post_init__(self) -> None:
        put = object.__setattr__
        position = floats("Command.position", self.position, (None, None))
        if position.ndim != 2 or position.shape[0] < 1:
            fail("Command.position", f"shape {position.shape}", "must be (n, n_axes)")
        put(self, "position", position)
        put(self, "sample_time", positive("Command.sample_time", self.sample_time))
        previous = position
        for name in ("velocity", "acceleration"):
            value = getattr(self, name)
            if not np.size(value):
                value = np.gradient(previous, self.sample_time, axis=0) if len(previous) > 1 else np.zeros_like(previous)
            previous = floats(f"Command.{name}", value, position.shape)
            put(self, name, previous)

    @property
    def time(self) -> FloatArray:
        """Time of every sample, s."""
        return np.arange(self.position.shape[0]) * self.sample_time

    @property
    def duration(self) -> float:
        """Time of the last sample, s."""
        return (self.position.shape[0] - 1) * self.sample_time

    def held_at(self, time: FloatArray) -> FloatArray:
        """Return the position in force at times, the sample before each, (n_times, n_axes)."""
        # A sample counts from its own time on, also where rounding puts it a little before.
        index = np.floor(np.asarray(time) / self.sample_time + 1e-9).astype(int)
        return self.position[np.clip(index, 0, self.position.shape[0] - 1)]

    def resampled(self, sample_time: float) -> Command:
        """Return the command at another sample time: cubic through positions and velocities."""
        from scipy.interpolate import CubicHermiteSpline

        time = np.arange(0.0, self.duration + 1e-12, positive("sample_time", sample_time))
        spline = CubicHermiteSpline(self.time, self.position, self.velocity)
        return Command(spline(time), sample_time, spline(time, 1), spline(time, 2))

    def extended(self, duration: float) -> Command:
        """Return the command with the last position held for `duration` s more."""
        n = round(duration / self.sample_time)
        zeros = np.zeros((n, self.position.shape[1]))
        return Command(np.vstack([self.position, zeros + self.position[-1]]), self.sample_time,
                       np.vstack([self.velocity, zeros]), np.vstack([self.acceleration, zeros]))

    def __repr__(self) -> str:
        return f"Command({self.position.shape[1]} axes, {self.duration:.4g} s, every {1e3 * self.sample_time:g} ms)"


def circle(radius: float, feed: float, sample_time: float, *, duration: float, center: tuple[float, float] = (0.0, 0.0),
           start_angle: float = 0.0, direction: int = 1) -> Command:
    """Return a circle in two axes at constant feed (m/s) for `duration` s, exact velocities and accelerations.

    Starts at the angle (rad) from the first axis; direction 1 is counterclockwise. The start is not smoothed.
    """
    w = direction * positive("feed", feed) / positive("radius", radius)
    t = np.arange(round(positive("duration", duration) / sample_time) + 1) * sample_time
    c, s = np.cos(start_angle + w * t), np.sin(start_angle + w * t)
    unit = np.stack([c, s], axis=1)
    return Command(np.asarray(center) + radius * unit, sample_time, radius * w * np.stack([-s, c], axis=1),
                   -radius * w * w * unit)


def step(height: float | FloatArray, sample_time: float, duration: float, *, start: float = 0.0) -> Command:
    """Return a position step of every axis (m) at time `start` (s); velocity and acceleration commands are zero."""
    heights = np.atleast_1d(np.asarray(height, float))
    n = count("samples", round(duration / sample_time) + 1, 2)
    position = np.where((np.arange(n) * sample_time >= start - 1e-12)[:, None], heights, 0.0)
    zero = np.zeros_like(position)
    return Command(position, sample_time, zero, zero)


def rest(axes: int, sample_time: float, duration: float) -> Command:
    """Return the command to stay at zero."""
    return step(np.zeros(axes), sample_time, duration)


def constant_velocity(velocity: float | FloatArray, sample_time: float, duration: float) -> Command:
    """Return a ramp of every axis, m/s, from zero without smoothing."""
    v = np.atleast_1d(np.asarray(velocity, float))
    t = np.arange(round(duration / sample_time) + 1)[:, None] * sample_time
    return Command(frozen(t * v), sample_time, np.ones_like(t) * v, np.zeros_like(t * v))
