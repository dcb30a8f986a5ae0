"""From torques at constant speed to a tuned axis: friction fitted, loops tuned, measured by an excitation, a step judged."""

import numpy as np

from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    constant_velocity_points,
    friction_variants,
    identify_friction,
    measure_loop,
    simulate,
    step_figures,
    tune,
    two_mass_axis,
)
from toolpoint.drives.program.command import step


def main() -> float:
    """Return the phase margin of the tuned velocity loop, as an excitation measures it, degrees."""
    rng, lead = np.random.default_rng(1), 0.01 / (2 * np.pi)
    speeds = np.geomspace(0.2, 60.0, 24)
    torques = 0.6 + 0.3 * np.exp(-((speeds / 4.0) ** 2)) + 0.02 * speeds
    records = [(np.full(500, v), t + 0.01 * rng.standard_normal(500))
               for v, t in zip(speeds, torques, strict=True)]
    law = identify_friction(*constant_velocity_points(records)).law
    print(law, "; or read as", ", ".join(friction_variants(law)))
    mechanics = two_mass_axis(0.008, 300.0, lead, stiffness=1.2e8, damping=2e4, motor_damping=0.01, shaft_friction=law)
    control = Controller(PositionLoop(10.0, 1e-3), VelocityLoop(0.2, 0.05, 250e-6, delay=1), lead)
    tuning = tune(Servo(build_plant([DriveAxis("X", TorqueMotor(), mechanics)]), (control,)), phase_margin=50.0)
    loop = measure_loop(tuning.servo, "velocity", 0.5, offset_velocity=0.03).between(5.0, 1500.0)
    response = simulate(tuning.servo, step(1e-3, 1e-3, 0.6))
    print(step_figures(response.time, response.output("scale", "X"), 1e-3, band=0.05), loop.margins)
    return loop.margins.phase


if __name__ == "__main__":
    main()
