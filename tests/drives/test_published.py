"""Published servo parameters read critically: P1 (Machines 10 (2022) 1102), its variants and quadrant glitches."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointWarning
from toolpoint.drives import (
    Controller,
    DriveAxis,
    LuGre,
    PositionLoop,
    Servo,
    Stribeck,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    check_plausibility,
    circular_test,
    friction_variants,
    rigid_axis,
    simulate,
)
from toolpoint.drives.program.command import circle, constant_velocity

R_L, GAIN = 0.001591, 0.0766 * 15.1
X, Y = Stribeck(0.0115, 4.7318, 0.5, 0.1), Stribeck(0.0069, 1.3374, 0.5, 0.16)
# Presliding stiffness and damping of the bristles are not published: 4000 N m/rad, 5 N m s/rad are chosen.
STIFFNESS, DAMPING = 4000.0, 5.0


def bristled(law):
    static = getattr(law, "static", law.coulomb)
    return LuGre(STIFFNESS, DAMPING, law.coulomb, static, getattr(law, "stribeck_velocity", 0.5), law.viscous)


def servo(inertia, name):
    laws = (friction_variants(X)[name], friction_variants(Y)[name])
    axes = [DriveAxis(n, TorqueMotor(), rigid_axis(inertia, R_L, 0.0, friction=bristled(law))) for n, law in zip("xy", laws)]
    c = Controller(PositionLoop(60.0, 1e-4), VelocityLoop(GAIN, 0.0766 / 3.8282, 1e-4), R_L)
    return Servo(build_plant(axes), (c, c))


@pytest.mark.parametrize(("name", "expected"), [("literal", 46.0), ("F_c = F_s/1.5", 70.0), ("Coulomb", 88.0)])
def test_quadrant_glitches(name, expected):
    """R 50 mm at 4000 mm/min, J 0.01 kg m2: circular deviation within 10 %."""
    result = simulate(servo(0.01, name), circle(0.05, 4 / 60, 1e-4, duration=9.6, center=(-0.05, 0.0)), record_interval=10)
    points = result.output("scale")[result.time > 4.8] + [0.05, 0.0]
    assert 1e6 * circular_test(points, 0.05).deviation == pytest.approx(expected, rel=0.10)


def test_literal_parameters_warn_and_stick_slip_below_the_critical_feed():
    with pytest.warns(ToolpointWarning, match="critical feed") as caught:
        report = check_plausibility(X, GAIN, R_L)
    assert "86.8 mm/min" in str(caught[0].message)
    spread = {}
    for factor in (0.5, 2.0):
        speed = factor * report.critical_feed
        result = simulate(servo(0.01, "literal"), constant_velocity(np.array([speed, 0.0]), 1e-4, 4.0), record_interval=10)
        v = result.output("speed", "x")[result.time > 2.0] * R_L
        spread[factor] = v.std() / speed
    assert spread[0.5] > 0.5
    assert spread[2.0] < 0.05
