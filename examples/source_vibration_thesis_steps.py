"""Steps of a drive as the thesis commissions one: 3 and 10 % of current, 200 and 500 mm/min, 0.5 mm, and gains for margins."""

from typing import Any

from toolpoint.drives.description import (
    CurrentDescription,
    DriveAxisDescription,
    DriveDescription,
    MechanicsDescription,
    MotorDescription,
    PositionDescription,
    VelocityDescription,
)
from toolpoint.studies import StepSetting, step_drives, tune_drives

MECHANICS = MechanicsDescription("two-mass", lead=0.01, inertia=0.008, table_mass=300.0, stiffness=1.2e8, damping=2e4)
MOTOR = MotorDescription(4, 0.5, 5e-3, flux=0.15)  # chosen, and so is the loop: theirs are not at hand
CURRENT = CurrentDescription(bandwidth=500.0)
AXIS = DriveAxisDescription(mechanics=MECHANICS, position=PositionDescription(gain=20.0), motor=MOTOR, current=CURRENT,
                            velocity=VelocityDescription(gain=2.0, integral_time=0.02))
STEPS = {"current_3": StepSetting("X", "current", 0.03, True), "current_10": StepSetting("X", "current", 0.10, True),
         "velocity_200": StepSetting("X", "velocity", 0.2 / 60), "velocity_500": StepSetting("X", "velocity", 0.5 / 60)}


def main(draws: int = 2) -> dict[str, Any]:
    """Return the numbers of the page, by name; nothing is drawn here."""
    drives, numbers = DriveDescription("axis of a machining centre", {"X": AXIS}), {}
    for name, test in zip(STEPS, step_drives(drives, list(STEPS.values())).tests, strict=True):
        assert test.figures is not None
        numbers |= {f"{name}_rise_ms": 1e3 * test.figures.rise_time, f"{name}_over": 100 * test.figures.overshoot,
                    f"{name}_settled_ms": 1e3 * test.figures.settling_time}
    gains = tune_drives(drives).drives.axes["X"]
    return numbers | {"tuned_position": gains.position.gain, "tuned_velocity": gains.velocity.gain}


if __name__ == "__main__":
    print(main())
