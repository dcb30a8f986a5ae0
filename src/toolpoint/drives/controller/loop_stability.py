"""Verdict on the stability of a servo before it is simulated: the innermost unstable loop, and how far its gain must fall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpoint._check import fail
from toolpoint.drives.controller.loops import ServoLoops, compute_loops
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import Controller

# Largest multiplier above one by loop (current, velocity, position). Below the velocity loop place and speed of an axis without
# damping integrate: their double pole at one splits by the root of rounding. Below the position loop its place integrates.
_RIGID_MARGINS = (1e-5, 1e-7, 0.0)


def check_stable(servo: Servo) -> ServoLoops:
    """Return the loops of a servo that is stable; else say which loop is not, by how much its gain must fall.

    Raises
    ------
    ToolpointError
        Names the innermost unstable loop, its largest multiplier and the gain margin found by bisection.
    """
    levels = compute_loops(servo)
    for number, level in enumerate(levels.levels):
        if level.radius > 1.0 + _RIGID_MARGINS[number]:
            factor = _critical(servo, number)
            note = f"gain margin {20 * np.log10(factor):.1f} dB" if factor > 0 else "unstable at any gain"
            fail(f"{level.name} loop", f"unstable: largest multiplier {level.radius:.4f} per sample, {note}",
                 "must be stable before a simulation", remedy=f"multiply its gain by less than {factor:.3g}" if factor > 0 else
                 "check signs, lead and the inner loops")
    return levels


def _critical(servo: Servo, number: int) -> float:
    stable, unstable = 0.0, 1.0
    largest = 1.0 + max(_RIGID_MARGINS[number], 1e-7)
    if not _radius(servo, number, 1e-4) <= largest:  # unstable with hardly any gain, or not a number
        return 0.0
    for _ in range(24):  # to 1e-7 of the gain, far below what is printed
        middle = 0.5 * (stable + unstable)
        stable, unstable = (middle, unstable) if _radius(servo, number, middle) <= largest else (stable, middle)
    return unstable


def _radius(servo: Servo, number: int, factor: float) -> float:
    scaled = Servo(servo.plant, tuple(_scaled(c, number, factor) for c in servo.controllers))
    return compute_loops(scaled).levels[number].radius


def _scaled(c: Controller, number: int, factor: float) -> Controller:
    if number == 0 and c.current is not None:
        return replace(c, current=replace(c.current, gain=factor * c.current.gain, integral=factor * c.current.integral))
    if number == 1:
        return c.with_gains(velocity=factor * c.velocity.gain)
    return c.with_gains(position=factor * c.position.gain)

