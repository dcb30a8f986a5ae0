"""Loop tuning for stated margins: velocity gain with a notch where a resonance limits it, then the position gain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import FloatArray, fail, positive
from toolpoint.drives.controller.filters import Filter, notch
from toolpoint.drives.controller.loops import LoopLevel, Margins, bandwidth, compute_loops
from toolpoint.drives.controller.records import MAX_FILTERS
from toolpoint.drives.controller.servo import Servo

NOTCH_DAMPING, NOTCH_DEPTH = 0.4, 0.1  # of a notch that is added: damping ratio, gain at its frequency


@dataclass(frozen=True)
class Tuning:
    """Tuned servo and its figures: margins of velocity and position loop, peak and bandwidth of the position loop, notches."""

    servo: Servo
    velocity: Margins
    position: Margins
    peak: float
    bandwidth: float
    notches: tuple[float, ...]
    status: str


def tune(servo: Servo, axis: int = 0, *, phase_margin: float = 45.0, gain_margin_db: float = 8.0, peak_db: float = 0.5,
          notches: int = 1) -> Tuning:
    """Return the servo with the largest gains of one axis that keep the margins.

    Parameters
    ----------
    phase_margin, gain_margin_db : float
        deg and dB, of the velocity loop; the integral time follows the gain crossover (4 over its angular frequency).
    peak_db : float
        Largest magnitude of the closed position loop, dB.
    notches : int
        Notches that may be added, each at the resonance that limits the gain.

    Examples
    --------
    >>> from toolpoint.drives import (Controller, DriveAxis, PositionLoop, TorqueMotor, VelocityLoop, build_plant, rigid_axis)
    >>> plant = build_plant([DriveAxis("X", TorqueMotor(), rigid_axis(0.005, 2e-3))])
    >>> servo = Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0, 0.05), lead=2e-3),))
    >>> tuned = tune(servo, phase_margin=45.0, notches=0)
    >>> tuned.velocity.phase >= 45.0
    True
    """
    positive("phase_margin", phase_margin, 90.0)
    used: list[float] = []
    best = _tune_velocity(servo, axis, phase_margin, gain_margin_db)
    while len(used) < notches and len(best.controllers[axis].velocity.filters) < MAX_FILTERS:
        crossover = compute_loops(best).velocity.margins(axis).phase_crossover
        # At half the sample rate no notch helps.
        if not np.isfinite(crossover) or crossover > 0.45 / best.controllers[axis].sample_times.velocity:
            break
        filtered = _add_filter(best, axis, notch(crossover, NOTCH_DAMPING, NOTCH_DEPTH))
        trial = _tune_velocity(filtered, axis, phase_margin, gain_margin_db)
        # A notch costs phase below its frequency: one that gains less than a tenth is not kept.
        if trial.controllers[axis].velocity.gain < 1.1 * best.controllers[axis].velocity.gain:
            break
        best, used = trial, [*used, crossover]
    best = _tune_position(best, axis, peak_db)
    levels = compute_loops(best)
    f = _grid(levels.position)
    closed = levels.position.closed_response(f, axis)
    ok = levels.stable
    return Tuning(best, levels.velocity.margins(axis), levels.position.margins(axis), float(np.abs(closed).max()),
                  bandwidth(f, closed), tuple(used), "margins kept" if ok else "unstable: ask for larger margins")


def _tune_velocity(servo: Servo, axis: int, phase: float, gain_db: float) -> Servo:
    def fits(value: float) -> bool:
        level = compute_loops(_set_velocity_gain(servo, axis, value)).velocity
        m = level.margins(axis, 1500)
        # Position is the integral of speed: its pole lies on the unit circle, up to rounding, while the position loop is
        # open.
        return level.radius <= 1 + 1e-7 and m.phase >= phase and m.gain_db >= gain_db

    gain = _largest(fits, servo.controllers[axis].velocity.gain)
    return _set_velocity_gain(servo, axis, gain)


def _set_velocity_gain(servo: Servo, axis: int, gain: float) -> Servo:
    inertia = servo.plant.axes[axis].mechanics.motor_inertia
    # The crossover of a rigid axis is gain/inertia, rad/s.
    return _replace_gains(servo, axis, velocity=gain, integral_time=4 * inertia / gain)


def _tune_position(servo: Servo, axis: int, peak_db: float) -> Servo:
    def fits(value: float) -> bool:
        level = compute_loops(_replace_gains(servo, axis, position=value)).position
        return level.radius < 1 and np.abs(level.closed_response(_grid(level, 600), axis)).max() <= 10 ** (peak_db / 20)

    return _replace_gains(servo, axis, position=_largest(fits, servo.controllers[axis].position.gain))


def _largest(fits: Callable[[float], bool], start: float) -> float:
    """Return the largest fitting value below the first that does not fit, to one part in a thousand."""
    fitting = start
    for _ in range(60):
        if fits(fitting):
            break
        fitting /= 2
    else:
        fail("tuned", f"no gain down to {fitting:g}", "keeps the margins",
             remedy="ask for smaller margins, or lower other gains")
    failing = 2 * fitting
    while fits(failing) and failing < 1e6 * start:
        fitting, failing = failing, 2 * failing
    # A thousandth of a gain: no drive is set more exactly, and margins hardly change over it.
    while failing / fitting > 1.001:
        # Gains count by their ratio: the bracket is halved in the logarithm.
        middle = float(np.sqrt(fitting * failing))
        fitting, failing = (middle, failing) if fits(middle) else (fitting, middle)
    return fitting


def _grid(level: LoopLevel, lines: int = 2000) -> FloatArray:
    return np.geomspace(1e-4, 0.99, lines) * 0.5 / float(level.closed.sample_time or 1.0)


def _replace_gains(servo: Servo, axis: int, **gains: float) -> Servo:
    controllers = list(servo.controllers)
    controllers[axis] = controllers[axis].with_gains(**gains)
    return Servo(servo.plant, tuple(controllers))


def _add_filter(servo: Servo, axis: int, part: Filter) -> Servo:
    controllers = list(servo.controllers)
    c = controllers[axis]
    controllers[axis] = replace(c, velocity=replace(c.velocity, filters=(*c.velocity.filters, part)))
    return Servo(servo.plant, tuple(controllers))
