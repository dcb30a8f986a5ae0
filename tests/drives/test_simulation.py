"""Simulation kernel: against DOP853, its plain twin, the linear loops, order of convergence, laws of the plant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drives import reference_step
from drives import servo_cases as cases
from toolpoint.drives import (
    BallScrew,
    Contact,
    Controller,
    Coupling,
    DriveAxis,
    Encoders,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    ball_screw_axis,
    build_plant,
    circular_test,
    compute_loops,
    four_dof_axis,
    linear_motor_axis,
    rack_axis,
    rigid_axis,
    simulate,
    two_mass_axis,
)
from toolpoint.drives.program.command import circle, constant_velocity, rest, step
from toolpoint.drives.simulation.free_motion import simulate_free_motion
from toolpoint.drives.simulation.kernel import run
from toolpoint.drives.simulation.simulate import prepare


@pytest.fixture(scope="module")
def reversal():
    """Continuous solution around a reversal of the x axis."""
    servo, command = cases.benchmark_servo(), cases.benchmark_command(0.05, -0.12)
    states, _ = cases.continuous(servo, command, 0.05)
    return servo, command, states[:, :servo.plant.a.shape[0]] @ servo.plant.outputs.T


def error(servo, command, exact, substeps):
    result = simulate(servo, command, substeps=substeps, record_interval=substeps)
    n = min(len(exact), len(result.time))
    return np.abs(result.outputs.reshape(len(result.time), -1)[:n] - exact[:n]).reshape(n, 2, 7)


def test_error_and_order_against_dop853(reversal):
    """Bars of the reference: 1 nm, order 2."""
    errors = [error(*reversal, n)[:, :, [2, 6]].max() for n in (2, 4, 8)]
    assert errors[0] < 1e-9
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.15)


def test_error_with_extreme_static_friction():
    """F_s/F_c = 400 as published for P1: same step, still converged and near the continuous solution."""
    servo, command = cases.benchmark_servo(cases.lugre(2.0, 400.0)), cases.benchmark_command(0.03, -0.06)
    states, _ = cases.continuous(servo, command, 0.03)
    exact = states[:, :servo.plant.a.shape[0]] @ servo.plant.outputs.T
    result = simulate(servo, command)
    assert result.unconverged == 0
    assert error(servo, command, exact, 4)[:, :, 2].max() < 1e-9


def test_kernel_equals_its_plain_twin():
    servo = cases.benchmark_servo()
    p, rng = servo.plant, np.random.default_rng(2)
    laws = [rub.law for axis in p.axes for rub in axis.mechanics.friction]
    x = np.zeros(p.a.shape[0])
    x[0:2], x[6:8] = (0.5, 8.0), (-0.3, 5.0)
    x += 1e-6 * rng.standard_normal(x.size)
    z = np.zeros(2)
    s = p.scalars @ x
    dz = s[:2] - 0.0
    u = np.zeros(4)
    ready = prepare(servo, rest(2, 1e-3, 0.01), start=x)
    start, _, *arguments = ready.arguments
    assert run(start, 1, *arguments) == 0
    u[0::2], u[1::2] = ready.control.states["voltage_d"], ready.control.states["voltage_q"]
    twin, _, _ = reference_step.advanced(p, laws, x, z, dz, u, ready.matrices.step)
    np.testing.assert_allclose(ready.result(0).state, twin, rtol=1e-9, atol=1e-13)


def test_linear_servo_equals_the_loops_built_independently():
    servo = cases.benchmark_servo(cases.smooth(cases.lugre()))
    level = compute_loops(servo).position.closed
    result = simulate(servo, step(np.array([1e-6, 0.0]), 1e-3, 0.15))
    x, expected = np.zeros(level.size), []
    for _ in range(150):
        expected.append(level.c @ x)
        x = level.a @ x + level.b @ np.array([1e-6, 0.0])
    np.testing.assert_allclose(result.output("scale")[::8][:150], expected, atol=1e-15)


def test_filters_delays_and_differences_equal_the_loops():
    """The same with two filters, delays in both inner loops, velocity from encoder differences, motor feedback."""
    from toolpoint.drives import low_pass, notch

    base = cases.controller(feedback="motor", velocity=1.0)
    c = replace(base, velocity=replace(base.velocity, filters=(notch(300.0, 0.3, 0.2), low_pass(900.0)), delay=2),
                current=replace(base.current, delay=2), encoders=Encoders(difference=True))
    servo = Servo(cases.benchmark_plant(cases.smooth(cases.lugre())), (c, c))
    level = compute_loops(servo).position.closed
    result = simulate(servo, step(np.array([1e-6, -2e-6]), 1e-3, 0.1))
    x, expected = np.zeros(level.size), []
    for _ in range(100):
        expected.append(level.c @ x)
        x = level.a @ x + level.b @ np.array([1e-6, -2e-6])
    np.testing.assert_allclose(cases.RATIO * result.output("angle")[::8][:100], expected, atol=1e-14)


def test_feed_forward_reduces_errors():
    """Velocity feed-forward takes the following error, inertia its acceleration part, friction the quadrant peak."""
    law = cases.lugre(300.0)
    peaks = []
    for level in (0.0, 300.0 * cases.RATIO):
        base = cases.controller()
        c = replace(base, position=replace(base.position, friction_feedforward=level, friction_velocity=2e-4))
        result = simulate(Servo(cases.benchmark_plant(law), (c, c)), cases.benchmark_command(2.0))
        peaks.append(circular_test(result.output("scale")[result.time > 1], 0.01).deviation)
    assert peaks[1] < 0.6 * peaks[0]
    ramps = []
    for share in (0.0, 1.0):
        base = cases.controller(ff=share)
        servo = Servo(cases.benchmark_plant(law), (base, base))
        ramps.append(abs(simulate(servo, constant_velocity(np.array([0.05, 0.0]), 1e-3, 0.5)).signal(
            "following_error", "x")[-1]))
    assert ramps[0] == pytest.approx(0.05 / 60, rel=0.02)
    assert ramps[1] < 0.02 * ramps[0]


def test_hundreds_of_structural_states():
    """A structure of 200 modes (400 states): the same motion as with the 20 modes that are driven."""
    from toolpoint.drives import Structure
    from toolpoint.vibration import Modes

    rng = np.random.default_rng(0)
    f = np.sort(rng.uniform(40, 2000, 200))
    shape = 1e-2 * rng.standard_normal((2, 200))
    shape[:, 20:] = 0.0
    made = []
    for n in (200, 20):
        modes = Modes(f[:n], np.full(n, 0.02), shape[:, :n], ("base:+x", "tool:+x"))
        frame = Structure.from_modes(modes, {"x.base": "base:+x"}, {"x": "tool:+x"})
        axis = DriveAxis("x", cases.MOTOR, two_mass_axis(0.008, 300.0, cases.RATIO, stiffness=1.2e8, damping=6e3,
                                                         guide_friction=cases.lugre()))
        c = cases.controller()
        made.append(simulate(Servo(build_plant([axis], frame), (c,)), constant_velocity(0.02, 1e-3, 0.05)))
    np.testing.assert_allclose(made[0].outputs, made[1].outputs, rtol=1e-7, atol=1e-9)


def test_benchmark_circle():
    """Reference: 8.046 um at the scale, 9.776 um at the tool point; without dry friction 0.065 and 1.441 um; all in 1 %.

    Open in the reference and chosen: friction level, mass ratio, the frame's mobility, and how far the tool moves with each
    mode. The first three fix both values at the scale. At the tool, without dry friction the frame answers the table's
    inertia alone, almost statically; with it the reversals also ring its low modes: two numbers for the tool's amplitude
    and phase along the modes. One amplitude and phase for both axes (1.4, 0.5 rad) gave 9.776 but 1.98 in place of 1.441 um.
    """
    command = cases.benchmark_command(2.0)
    deviation = []
    for law in (None, cases.smooth(cases.lugre())):
        result = simulate(cases.benchmark_servo(law), command)
        last = result.time > 1.0
        deviation += [1e6 * circular_test(result.output(name)[last], 0.01).deviation for name in ("scale", "tool")]
    np.testing.assert_allclose(deviation, [8.046, 9.776, 0.065, 1.441], rtol=0.01)


def test_radius_loss_and_following_error():
    """R (1 - 1/sqrt(1 + (w/Kv)^2)): 12.341 um at 4000 mm/min, R 50 mm, Kv 60; following error v/Kv."""
    axes = [DriveAxis(n, TorqueMotor(), rigid_axis(0.001, 1e-3)) for n in "xy"]
    c = Controller(PositionLoop(60.0, 1e-5), VelocityLoop(60.0, np.inf, 1e-5), 1e-3)
    servo = Servo(build_plant(axes), (c, c))
    result = simulate(servo, circle(0.05, 4 / 60, 1e-5, duration=1.5, center=(-0.05, 0.0)), record_interval=100)
    radius = np.hypot(*(result.output("scale")[result.time > 1] + [0.05, 0]).T)
    assert 1e6 * (0.05 - radius.mean()) == pytest.approx(12.341, rel=0.01)
    ramp = simulate(servo, constant_velocity(np.array([0.05, 0.0]), 1e-5, 1.0), record_interval=100)
    assert ramp.signal("following_error", "x")[-1] == pytest.approx(0.05 / 60, rel=1e-6)


def test_rigid_axis_damping():
    """P-PI rigid axis (P velocity loop): damping 0.5 sqrt(w_v/K_v) of the dominant poles."""
    c = Controller(PositionLoop(100.0, 1e-5), VelocityLoop(2.0, np.inf, 1e-5), 1e-3)
    servo = Servo(build_plant([DriveAxis("x", TorqueMotor(), rigid_axis(0.01, 1e-3))]), (c,))
    poles = np.log(np.array([z for z in compute_loops(servo).position.closed.poles if abs(z) > 0.5])) / 1e-5
    pair = poles[np.abs(poles.imag) > 1]
    np.testing.assert_allclose(-pair.real / np.abs(pair), 0.5 * np.sqrt(200.0 / 100.0), rtol=5e-3)


def test_printed_axis_poles():
    """CJME 36:119 (2023) table 1, x: poles -76.1 +- 139.3j and -8.3; P with integral velocity loop, continuous."""
    ka, kt, rg, j, b, kp, kv, tv = 3.1201, 0.8910, 1.5915, 3.3177e-3, 0.0192, 102.2, 0.1846, 0.12
    # Kp rad/s per mm, rg mm/rad; torque = Ka Kt Kv (1 + 1/(Tv s)) (w* - w)
    g = ka * kt * kv
    poles = np.sort_complex(np.roots([j, b + g, g / tv + g * kp * rg, g * kp * rg / tv]))
    np.testing.assert_allclose(poles, [-76.1 - 139.3j, -76.1 + 139.3j, -8.3], atol=0.06)
    c = Controller(PositionLoop(kp * rg, 1e-6), VelocityLoop(g, tv, 1e-6), rg * 1e-3)
    servo = Servo(build_plant([DriveAxis("x", TorqueMotor(), rigid_axis(j, rg * 1e-3, b))]), (c,))
    found = np.log(np.array([z for z in compute_loops(servo).position.closed.poles if abs(z) > 0.5])) / 1e-6
    for pole in poles:
        assert np.abs(found - pole).min() < 0.2


def test_feed_drive_library_axis():
    """FeedDriveLibrary axis: encoder 3e-6 kg m2 on 3000 N m/rad (5033 Hz), shaft 2000 N m/rad, screw, nut, 4000 kg."""
    from toolpoint.drives.axis.mechanics import MassChain

    ratio = 0.020 / (2 * np.pi)
    chain = MassChain(("encoder", "motor", "screw", "table"))
    for name, value in (("encoder", 3e-6), ("motor", 0.260), ("screw", 0.01), ("table", 4000.0)):
        chain.inertia(name, value)
    chain.spring({"encoder": 1, "motor": -1}, 3000.0)
    chain.spring({"motor": 1, "screw": -1}, 2000.0)
    axial = 1 / (1 / 2e9 + 0.85 / 0.6e9)
    chain.spring({"screw": ratio, "table": -1}, axial)
    axis = chain.build(motor={"motor": 1.0}, table={"table": 1.0}, scale={"table": 1.0}, lead=ratio, boundaries=())
    f = axis.natural_frequencies
    assert f[0] == pytest.approx(0.0, abs=1e-2)
    assert f[-1] == pytest.approx(5033, abs=1)
    # Without the encoder, in closed form: the two roots of the chain of three inertias (table reflected to the screw).
    j, k = (0.260, 0.01, 4000 * ratio**2), (2000.0, axial * ratio**2)
    b = k[0] * (1 / j[0] + 1 / j[1]) + k[1] * (1 / j[1] + 1 / j[2])
    c = k[0] * k[1] * (j[0] + j[1] + j[2]) / (j[0] * j[1] * j[2])
    roots = np.sqrt(np.roots([1.0, -b, c])) / (2 * np.pi)
    np.testing.assert_allclose(f[1:3], np.sort(roots), rtol=1e-4)


@pytest.mark.parametrize("position", [0.1, 0.4, 0.7])
def test_ball_screw_static_stiffness(position):
    """Force at the table, motor held: bearing, rod, nut in series with the torsion seen through the lead."""
    screw, coupling = BallScrew(0.04, 0.02, 0.8), Coupling(5e3)
    axis = ball_screw_axis(0.01, coupling, screw, table_mass=300.0, nut_position=position, front_bearing=5e8,
                           end_bearing=None, nut=4e8)
    keep = [i for i, n in enumerate(axis.coordinates) if n not in ("motor", "base")]
    force = axis.vector({"table": 1.0})[keep]
    compliance = force @ np.linalg.solve(axis.stiffness[np.ix_(keep, keep)], force)
    torsion = 1 / 5e3 + position / (79.4e9 * np.pi * 0.04**4 / 32)
    expected = 1 / 5e8 + position / screw.rod_stiffness + 1 / 4e8 + torsion * screw.ratio**2
    assert compliance == pytest.approx(expected, rel=1e-9)


def test_motor_inertia_of_a_chain():
    screw = BallScrew(0.04, 0.02, 0.8)
    axis = ball_screw_axis(0.01, Coupling(5e3, inertia=1e-3), screw, table_mass=300.0, nut_position=0.4, front_bearing=5e8)
    expected = 0.011 + 7850 * np.pi * 0.8 * 0.04**4 / 32 + 300 * screw.ratio**2
    assert axis.motor_inertia == pytest.approx(expected, rel=1e-9)


def test_preloaded_nut_opens_and_backlash_plays():
    """Preloaded: stiffness 2k until the preload deflection, then k; backlash: free travel in between."""
    nut = Contact.preloaded(2e8, 1e4)
    inside, outside = 0.5e-4, 3e-4
    assert nut.force(inside) == pytest.approx(2e8 * inside)
    assert nut.force(outside) - nut.force(outside - 1e-6) == pytest.approx(1e8 * 1e-6)
    play = Contact.with_backlash(1e8, 2e-5)
    assert play.force(0.9e-5) == 0.0
    axis = two_mass_axis(0.01, 100.0, 1e-3, stiffness=1.0, damping=5e3, play=play)
    # A force of 100 N on the table with the motor free: the pair accelerates together after the gap closes.
    result = simulate_free_motion(build_plant([DriveAxis("x", TorqueMotor(), axis)]), np.full((20000, 1), 100.0), 1e-5)
    acceleration = result.output("table", "x")[-1] * 2 / result.time[-1] ** 2
    assert acceleration == pytest.approx(100 / (100 + 0.01 / 1e-6), rel=0.1)
    gap = result.output("table", "x") - 1e-3 * result.output("angle", "x")
    assert gap[-1] == pytest.approx(1e-5 + 99 / 1e8, rel=0.01)


def test_reaction_on_a_structure_keeps_momentum():
    """Axis and frame free of ground: no outer force, so the sum of momenta stays zero when the motor force acts."""
    from toolpoint.drives import Structure
    from toolpoint.vibration import Modes

    frame = Structure.from_modes(Modes([0.0], [0.0], np.array([[1 / np.sqrt(50.0)]]), ("bed:+x",)), {"x.base": "bed:+x"})
    p = build_plant([DriveAxis("x", TorqueMotor(), linear_motor_axis(10.0, 30.0))], frame)
    momentum = np.zeros(p.a.shape[0])
    momentum[1], momentum[3] = 10.0, np.sqrt(50.0)
    np.testing.assert_allclose(momentum @ p.a, 0.0, atol=1e-12)
    np.testing.assert_allclose(momentum @ p.b_input, 0.0, atol=1e-12)


def test_rack_and_four_dof_chain():
    rack = rack_axis(0.01, 500.0, 0.03, gear_ratio=10.0, stiffness=5e7, damping=1e4, backlash=1e-5)
    assert rack.lead == pytest.approx(0.003)
    chain = four_dof_axis(0.01, 0.002, 20.0, table_mass=400.0, lead_ratio=1.5915e-3, coupling=(2e4, 2.0), bearing=(2e8, 1e4),
                          nut=(3e8, 1e4))
    assert len(chain.free) == 4
    assert chain.motor_inertia == pytest.approx(0.012 + 400 * 1.5915e-3**2, rel=1e-9)
    assert chain.natural_frequencies[0] == pytest.approx(0.0, abs=1e-2)
