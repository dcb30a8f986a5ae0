"""Servo: a plant with a controller for each of its axes."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import fail
from toolpoint._notebook import NotebookText
from toolpoint.drives.axis.plant import Plant
from toolpoint.drives.controller.records import SampleCounts
from toolpoint.drives.controller.settings import Controller


@dataclass(frozen=True)
class Servo(NotebookText):
    """A plant and a controller for each of its axes; all axes share the three sample times.

    Examples
    --------
    >>> from toolpoint.drives import (DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, compute_loops,
    ...                               rigid_axis)
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0, 0.05), lead=2e-3),))
    >>> compute_loops(servo).stable
    True
    """

    plant: Plant
    controllers: tuple[Controller, ...]

    def __post_init__(self) -> None:
        controllers = tuple(self.controllers)
        object.__setattr__(self, "controllers", controllers)
        if len(controllers) != len(self.plant.axes):
            fail("Servo.controllers", f"{len(controllers)}", f"must be one for each of {len(self.plant.axes)} axes")
        times = controllers[0].sample_times
        for axis, c in zip(self.plant.axes, controllers, strict=True):
            c.parameters(axis.motor)
            if c.sample_times != times:
                fail("Servo.controllers", f"sample times {c.sample_times} s of axis {axis.name!r}",
                     f"must be those of the first axis, {times} s")
        for name, inner_time, outer_time in (("velocity", times.current, times.velocity),
                                             ("position", times.velocity, times.position)):
            ratio = outer_time / inner_time
            if abs(ratio - round(ratio)) > 1e-6 or ratio < 0.999:
                fail(f"{name} sample time", f"{outer_time:g} s over {inner_time:g} s",
                     "must be a whole multiple of the inner loop's",
                     remedy=f"for example {max(1, round(ratio)) * inner_time:g} s")

    @property
    def counts(self) -> SampleCounts:
        """Current samples for each current, velocity and position sample."""
        times = self.controllers[0].sample_times
        return SampleCounts(1, round(times.velocity / times.current), round(times.position / times.current))

    def __repr__(self) -> str:
        times = ", ".join(f"{1e6 * t:g}" for t in self.controllers[0].sample_times)
        return f"Servo({', '.join(a.name for a in self.plant.axes)}; loops at {times} us; {self.plant.a.shape[0]} states)"
