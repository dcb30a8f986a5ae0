"""Loops measured as on a controller: pseudo-random binary excitation -> open and closed loop response with coherence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, ToolpointError, count, fail, floats, one_of, positive
from toolpoint._notebook import NotebookText
from toolpoint.drives.controller.loops import LEVELS, Margins, bandwidth, margins
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.program.command import Command, constant_velocity
from toolpoint.drives.simulation.simulate import Excitation, simulate

_TAPS = {4: (4, 3), 5: (5, 3), 6: (6, 5), 7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7), 11: (11, 9),
         12: (12, 11, 10, 4), 13: (13, 12, 11, 8), 14: (14, 13, 12, 2), 15: (15, 14)}


def prbs(order: int, amplitude: float = 1.0) -> FloatArray:
    """Return one period of a maximum-length sequence of +-amplitude, 2^order - 1 samples; flat spectrum but for the mean.

    Source: Golomb, Shift Register Sequences; taps of primitive polynomials.
    """
    if order not in _TAPS:
        fail("order", f"{order}", f"must be one of {min(_TAPS)} to {max(_TAPS)}")
    register, out = [1] * order, np.empty(2**order - 1)
    for k in range(out.size):
        out[k] = register[-1]
        bit = 0
        for tap in _TAPS[order]:
            bit ^= register[tap - 1]
        register = [bit, *register[:-1]]
    return positive("amplitude", amplitude) * (2 * out - 1)


@dataclass(frozen=True, eq=False)
class LoopResponse(NotebookText):
    """Measured loop: frequency (Hz), closed T = y/r and open L = y/e responses, coherence of y and r, sample time (s)."""

    frequency: FloatArray
    closed: ComplexArray
    open: ComplexArray
    coherence: FloatArray
    sample_time: float

    @property
    def margins(self) -> Margins:
        """Margins of the open loop; crossings among incoherent lines (noise) do not count."""
        return margins(self.frequency, self.open, self.coherence)

    @property
    def bandwidth(self) -> float:
        """First frequency at which the closed loop is 3 dB below its start, Hz."""
        return bandwidth(self.frequency, self.closed)

    def between(self, frequency_min: float, frequency_max: float) -> LoopResponse:
        """Return the lines from `frequency_min` to `frequency_max` Hz."""
        keep = (self.frequency >= frequency_min) & (self.frequency <= frequency_max)
        if not keep.any():
            raise ToolpointError(f"between: no line from {frequency_min:g} to {frequency_max:g} Hz; the measured ones are "
                                 f"{self.frequency[0]:g} to {self.frequency[-1]:g} Hz")
        return LoopResponse(self.frequency[keep], self.closed[keep], self.open[keep], self.coherence[keep],
                            self.sample_time)

    def __repr__(self) -> str:
        return (f"LoopResponse({self.frequency.size} lines to {self.frequency[-1]:g} Hz, coherence at least "
                f"{self.coherence.min():.3f})")


def average_response(reference: FloatArray, feedback: FloatArray, sample_time: float) -> LoopResponse:
    """Return T and L from whole periods: H1 over periods, (n_periods, n) each; no window, since the signal is periodic."""
    r, y = floats("reference", reference, (None, None)), floats("feedback", feedback, np.shape(reference))
    # The mean says where the axis stands, not how the loop answers.
    lines = np.fft.rfft(np.stack([r, y]), axis=-1)[:, :, 1:]
    f = np.fft.rfftfreq(r.shape[1], positive("sample_time", sample_time))[1:]
    rr, yy = ((np.abs(x) ** 2).sum(axis=0) for x in lines)
    yr = (lines[1] * lines[0].conj()).sum(axis=0)
    e = lines[0] - lines[1]
    # From T as T/(1 - T), noise of T would grow without bound where T is near one; the error is measured.
    open_loop = (lines[1] * e.conj()).sum(axis=0) / (np.abs(e) ** 2).sum(axis=0)
    return LoopResponse(f, yr / rr, open_loop, np.abs(yr) ** 2 / (rr * yy), sample_time)


def measure_loop(servo: Servo, level: str, amplitude: float, *, axis: int = 0, order: int = 11, periods: int = 2,
                  settle: int = 2, offset_velocity: float = 0.0, substeps: int = 1) -> LoopResponse:
    """Return the response of the ``current``, ``velocity`` or ``position`` loop of one axis to a PRBS on its set point.

    Parameters
    ----------
    amplitude : float
        A, rad/s or m.
    order, periods, settle : int
        2^order - 1 samples of the loop in each period; periods averaged, periods left out before.
    offset_velocity : float
        m/s of the axis meanwhile, so that it slides all the time.

    Outer loops stay closed: y/r and y/e of the loop itself do not depend on them. The sequence of the position loop is
    added to the position alone, so that no feed-forward sees it.

    Examples
    --------
    >>> from toolpoint.drives import (Controller, DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, rigid_axis)
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0), lead=2e-3),))
    >>> response = measure_loop(servo, "velocity", amplitude=0.1, order=7)
    >>> bool(response.coherence.min() > 0.999)  # a linear loop in its steady state
    True
    """
    one_of("level", level, LEVELS)
    number = LEVELS.index(level)
    c, axes = servo.controllers[axis], len(servo.plant.axes)
    if level == "current" and c.current is None:
        fail("level", "current", f"axis {servo.plant.axes[axis].name!r} has no current loop",
             remedy="measure the velocity loop")
    period = prbs(order, amplitude)
    total = count("periods", periods) + count("settle", settle, 0)
    values = np.zeros((total * period.size, axes))
    values[:, axis] = np.tile(period, total)
    speed = np.zeros(axes)
    speed[axis] = offset_velocity
    reference, feedback = _histories(servo, number, axis, values, speed, substeps)
    shape = (total, period.size)
    return average_response(reference.reshape(shape)[settle:], feedback.reshape(shape)[settle:], c.sample_times[number])


def _histories(servo: Servo, number: int, axis: int, values: FloatArray, speed: FloatArray, substeps: int
               ) -> tuple[FloatArray, FloatArray]:
    """Return set point and feedback of one loop at its samples; of the position loop without the common ramp."""
    c, lines = servo.controllers[axis], values.shape[0]
    # An outer loop may be slower by any whole factor: its ramp must last as long as the sequence.
    duration = lines * c.sample_times[number]
    ramp: Command = constant_velocity(speed, c.position.sample_time, duration)
    options: dict[str, Any] = {"substeps": substeps, "record_interval": servo.counts[number] * substeps, "duration": duration}
    if number < 2:
        excitation = Excitation(("current", "speed")[number], values)
        result = simulate(servo, ramp, excitation=excitation, **options)
        base = result.signal(("current_set", "speed_set")[number], axis)[:lines]
        return base + values[:, axis], result.output(("i_q", "speed")[number], axis)[:lines]
    command = Command(ramp.position[:lines] + values, ramp.sample_time, ramp.velocity[:lines], ramp.acceleration[:lines])
    result = simulate(servo, command, **options)
    along = speed[axis] * result.time[:lines]
    actual = result.output("scale", axis) if c.position.feedback == "scale" else result.output("angle", axis) * (c.lead or 0.0)
    return values[:, axis], actual[:lines] - along
