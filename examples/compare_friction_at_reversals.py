"""A circle with and without dry friction in both directions: quadrant peaks, hysteresis, torque, and a corner planned."""

import numpy as np

from toolpoint.drives import (
    Controller,
    Coulomb,
    DriveAxis,
    JerkLimits,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    Viscous,
    build_plant,
    check_limits,
    circular_hysteresis,
    plan_motion,
    quadrant_peaks,
    rigid_axis,
    simulate_many,
    straight_move,
    torque_comparison,
)
from toolpoint.drives.program.command import circle
from toolpoint.drives.program.path import polyline

LEAD, LIMITS = 0.01 / (2 * np.pi), JerkLimits(0.5, 3.0, 100.0)


def main() -> float:
    """Return the share of the torque's rms that dry friction of 2 N m changes."""
    control = Controller(PositionLoop(60.0, 1e-3), VelocityLoop(2.0, 0.02, 250e-6), LEAD)
    plants = [build_plant([DriveAxis(n, TorqueMotor(), rigid_axis(0.01, LEAD, friction=law)) for n in "XY"])
              for law in (Coulomb(2.0, 0.05), Viscous(0.05))]
    commands = [circle(0.05, 4 / 60, 1e-3, duration=9.5, center=(-0.05, 0.0), direction=d) for d in (1, -1)]
    runs = simulate_many([(Servo(plant, (control, control)), c) for plant in plants for c in commands], threads=2,
                         record_interval=4)
    points = [run.output("scale")[run.time > 4.75] + [0.05, 0.0] for run in runs]
    print("quadrant peaks, um", np.round(1e6 * quadrant_peaks(points[0], 0.05), 2))
    print("hysteresis, um", [round(1e6 * circular_hysteresis(*points[k:k + 2]), 2) for k in (0, 2)])
    corner = plan_motion(polyline(np.array([[0, 0], [0.03, 0], [0.06, 0.01]]), 0.05), LIMITS, corner_tolerance=2e-5,
                         corner="clothoid", straight=1e-7)
    move = straight_move(np.zeros(2), np.array([0.2, 0.1]), [LIMITS] * 2, sample_time=1e-3)
    print(check_limits(corner.command(1e-3, 2), LIMITS), check_limits(move, LIMITS))
    smooth, dry = (run.signal("torque_set")[run.time > 4.75] for run in (runs[2], runs[0]))
    return torque_comparison(smooth, dry)["relative"]


if __name__ == "__main__":
    main()
