"""A rack with two pinions against each other: stiffness until one lets go, and half of it beyond."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    build_servo,
    rack_axis,
    simulate,
)
from toolpoint.drives.program.command import Command
from toolpoint.io import read_drives

STIFFNESS, PRELOAD, RADIUS = 1e8, 2000.0, 0.03


def stretch_under(force):
    """Travel of the table beyond that of the motor under a constant force, m."""
    axis = rack_axis(0.01, 500.0, RADIUS, gear_ratio=10.0, stiffness=STIFFNESS, damping=2e5, preload=PRELOAD)
    servo = Servo(build_plant([DriveAxis("X", TorqueMotor(), axis)]),
                  (Controller(PositionLoop(20.0), VelocityLoop(5.0, 0.05), lead=axis.lead),))
    zero = np.zeros((1001, 1))
    result = simulate(servo, Command(zero, 1e-3, zero, zero), load=np.array([[force]]), substeps=2)
    return result.output("table", "X")[-1] - axis.lead * result.output("angle", "X")[-1]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("force", [1000.0, 3900.0, 4100.0, 9000.0])
def test_both_pinions_carry_until_one_lets_go_at_twice_the_preload(force, sign):
    """Beyond 2 P one pinion carries alone, with half of the stiffness: x = 2 P/k + (F - 2 P)/(k/2)."""
    expected = min(force, 2 * PRELOAD) / STIFFNESS + max(force - 2 * PRELOAD, 0.0) / (STIFFNESS / 2)
    assert stretch_under(sign * force) == pytest.approx(sign * expected, rel=1e-5)


def test_the_preload_is_that_of_the_file_and_a_backlash_beside_it_is_refused(tmp_path):
    path = tmp_path / "rack.yaml"
    text = """toolpoint: 1
name: gantry rack
axes:
  X:
    mechanics: {kind: rack, inertia: 0.01 kg*m^2, table_mass: 500 kg, pinion_radius: 30 mm, gear_ratio: 10, stiffness: 100 N/um,
                preload: 2 kN}
    position: {gain: 20 1/s}
    velocity: {gain: 5 N*m*s/rad, integral_time: 50 ms}
limits: {speed: 0.5 m/s, acceleration: 3 m/s^2, jerk: 100 m/s^3}
"""
    path.write_text(text)
    (play,) = build_servo(read_drives(path)).plant.axes[0].mechanics.contacts
    assert play.law.force(9e-5) == pytest.approx(2 * PRELOAD + (9e-5 - 2 * PRELOAD / STIFFNESS) * STIFFNESS / 2, rel=1e-9)
    path.write_text(text.replace("preload: 2 kN", "preload: 2 kN, backlash: 10 um"))
    with pytest.raises(ToolpointError, match="either backlash or a preload"):
        read_drives(path)
    with pytest.raises(ToolpointError, match="must be one of the two"):
        rack_axis(0.01, 500.0, RADIUS, gear_ratio=10.0, stiffness=STIFFNESS, backlash=1e-5, preload=PRELOAD)
