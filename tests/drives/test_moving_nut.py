"""Nut moving along its screw: against the fixed nut, the compliance in closed form, order of the interpolation."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from drives import servo_cases as cases
from toolpoint import ToolpointError
from toolpoint.drives import (
    BallScrew,
    Command,
    Controller,
    Coulomb,
    Coupling,
    CurrentLoop,
    DriveAxis,
    LuGre,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    ball_screw_axis,
    build_plant,
    simulate,
)
from toolpoint.drives.simulation.moving_nut import simulate_moving_nut

SCREW, COUPLING = BallScrew(0.025, 0.010, 1.2), Coupling(2e4, 2.0)


def servo_at(nuts, motor=None, law=None, weight=300.0):
    """Axes with a slender screw between bearing (3e8 N/m) and nut (4e8 N/m)."""
    chain = partial(ball_screw_axis, 0.006, COUPLING, SCREW, table_mass=weight, front_bearing=3e8, nut=4e8,
                    motor_damping=0.01, bearing_damping=2e4, nut_damping=2e4, guide_friction=law)
    axes = [DriveAxis(n, motor or TorqueMotor(), chain(nut_position=float(p))) for n, p in zip("xy", nuts, strict=False)]
    current = None if motor is None else CurrentLoop.from_bandwidth(cases.MOTOR, 500.0)
    c = Controller(PositionLoop(30.0, 1e-3, 1.0), VelocityLoop(0.8, 0.03, 250e-6), SCREW.ratio, current)
    return Servo(build_plant(axes), (c,) * len(axes))


def stroke(travel, duration, axes=1):
    """There in a raised cosine."""
    t = np.arange(round(duration / 1e-3) + 1) * 1e-3
    return Command(np.tile(0.5 * travel * (1 - np.cos(np.pi * t / duration))[:, None], (1, axes)), 1e-3)


@pytest.mark.parametrize("law", [None, Coulomb(200.0), LuGre(1e7, 3e3, 200.0, 260.0, 5e-3)])
def test_screw_that_does_not_change_moves_as_a_fixed_one(law):
    motor = cases.MOTOR if law is not None else None
    fixed, command = servo_at([0.3, 0.4], motor, law), stroke(0.02, 0.2, 2)
    found = simulate_moving_nut(lambda nuts: fixed, [0.3, 0.4], command, record_interval=2, estimate=False)
    expected = simulate(fixed, command, record_interval=2)
    # Coulomb friction catches a slide within a step: rounding moves that instant, and one sample of the force with it.
    np.testing.assert_allclose(found.outputs, expected.outputs, rtol=1e-5, atol=1e-11)
    np.testing.assert_allclose(found.forces, expected.forces, rtol=1e-5, atol=1e-5)


def test_deflection_follows_the_compliance_of_the_nut_position():
    """Viscous-like constant pull of dry friction on the table: table - r theta = - F (1/k_b + p/EA + 1/k_n + r^2 torsion)."""
    force = 500.0
    law = Coulomb(force)
    found = simulate_moving_nut(lambda nuts: servo_at(nuts, law=law, weight=50.0), [0.1], stroke(0.9, 3.0), positions=17,
                                estimate=False)
    angle, table = found.output("angle", "x"), found.output("table", "x")
    nut = 0.1 + table
    torsion = 1 / COUPLING.stiffness + nut / (SCREW.shear_modulus * np.pi * SCREW.diameter**4 / 32)
    expected = force * (1 / 3e8 + nut / SCREW.rod_stiffness + 1 / 4e8 + SCREW.ratio**2 * torsion)
    gap = SCREW.ratio * angle - table
    middle = np.searchsorted(found.time, [0.8, 1.2, 1.5, 1.8, 2.2])
    # At the middle of the stroke the acceleration is small; elsewhere the table's inertia adds its own.
    inertia = 50.0 * np.gradient(np.gradient(table, found.time), found.time)
    np.testing.assert_allclose(gap[middle], (expected * (force + inertia) / force)[middle], rtol=0.01)
    assert expected[middle].max() > 1.7 * expected[middle].min()


def test_interpolation_converges_and_says_its_error():
    """Each halving of the grid divides the error by more than two; what the notes state bounds it."""
    command = stroke(0.6, 0.6)
    run = lambda n: simulate_moving_nut(lambda nuts: servo_at(nuts, law=Coulomb(300.0)), [0.2], command, positions=n,
                                        estimate=n == 9)
    runs = {n: run(n) for n in (3, 5, 9, 65)}
    error = [np.abs(runs[n].output("table") - runs[65].output("table")).max() for n in (3, 5, 9)]
    assert error[0] > 2.2 * error[1] > 2.2**2 * error[2]
    stated = float(runs[9].notes[-1].split("at most ")[1].split(" nm")[0]) * 1e-9
    assert error[2] < stated < 3 * error[2]


def test_nut_must_stay_on_its_screw():
    with pytest.raises(ToolpointError, match="above zero"):
        simulate_moving_nut(servo_at, [0.1], Command(np.linspace(0, -0.2, 200)[:, None], 1e-3))
    with pytest.raises(ToolpointError, match="inside the screw"):
        simulate_moving_nut(servo_at, [0.9], stroke(0.5, 1.0))
