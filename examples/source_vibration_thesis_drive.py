"""A digital drive as the thesis has one: field-oriented current loop, inverter, velocity and position loop, PRBS and a step."""

from typing import Any

import numpy as np

from toolpoint.drives import (
    Controller,
    CurrentLoop,
    DriveAxis,
    Inverter,
    PositionLoop,
    Servo,
    SynchronousMotor,
    VelocityLoop,
    build_plant,
    measure_loop,
    simulate,
    step_figures,
    two_mass_axis,
)
from toolpoint.drives.program.command import step

LEAD, MOTOR = 0.01 / (2 * np.pi), SynchronousMotor(4, 0.5, 5e-3, 5e-3, 0.15)  # m/rad; chosen: the thesis' are not at hand


def axis(inverter: Inverter) -> Servo:
    """Return an axis with a synchronous motor in field-oriented control."""
    mechanics = two_mass_axis(0.008, 300.0, LEAD, stiffness=1.2e8, damping=2e4, motor_damping=0.01)
    control = Controller(PositionLoop(20.0, 1e-3), VelocityLoop(2.0, 0.02, 250e-6), LEAD,
                         CurrentLoop.from_bandwidth(MOTOR, 500.0, sample_time=125e-6, delay=1, limit=60.0), inverter=inverter)
    return Servo(build_plant([DriveAxis("X", MOTOR, mechanics)]), (control,))


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    numbers: dict[str, Any] = {}
    for name, inverter in (("", Inverter(320.0)), ("six_", Inverter(320.0, kind="six-pulse"))):
        servo = axis(inverter)
        for level, amplitude in (("current", 1.0), ("velocity", 0.5)):
            loop = measure_loop(servo, level, amplitude, offset_velocity=0.03)
            numbers |= {f"{name}{level}_margin": loop.margins.phase, f"{name}{level}_bandwidth": loop.bandwidth}
        run = simulate(servo, step(5e-4, 1e-3, 0.5))
        figures = step_figures(run.time, run.output("scale", "X"), 5e-4)
        numbers |= {f"{name}rise_ms": 1e3 * figures.rise_time, f"{name}overshoot": 100 * figures.overshoot}
    return numbers


if __name__ == "__main__":
    print(main())
