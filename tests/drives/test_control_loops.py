"""Control loops of one axis: steps, PRBS against the linear loops, inverter, limits, encoders, batches, wrong servos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drives import servo_cases as cases
from toolpoint import ToolpointError
from toolpoint.drives import (
    BallScrew,
    Controller,
    CurrentLoop,
    DriveAxis,
    Encoders,
    Inverter,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    compute_loops,
    linear_motor_axis,
    measure_loop,
    rigid_axis,
    simulate,
    simulate_many,
    two_mass_axis,
)
from toolpoint.drives.program.command import constant_velocity, rest, step


def p2_servo(inverter=None, law=None):
    """A single axis with all three loops; the parameters are chosen, the thesis' are not at hand."""
    axis = DriveAxis("x", cases.MOTOR, two_mass_axis(0.008, 300.0, cases.RATIO, stiffness=1.2e8, damping=6e3,
                                                     motor_damping=0.01,
                                                guide_friction=law))
    c = Controller(PositionLoop(50.0, 1e-3), VelocityLoop(1.5, 0.02, 250e-6), cases.RATIO,
                   CurrentLoop.from_bandwidth(cases.MOTOR, 500.0), inverter=inverter or Inverter(320.0))
    return Servo(build_plant([axis]), (c,))


@pytest.mark.parametrize(("level", "amplitude", "top"), [("current", 0.5, 700.0), ("velocity", 0.3, 150.0),
                                                         ("position", 1e-5, 150.0)])
def test_prbs_bode_equals_the_transfer_function(level, amplitude, top):
    """P2: within 0.5 dB and 3 deg of the linear transfer function."""
    servo = p2_servo()
    found = measure_loop(servo, level, amplitude, order=11, settle=3).between(5.0, top)
    linear = getattr(compute_loops(servo), level)
    for measured, expected in ((found.closed, linear.closed_response(found.frequency)),
                               (found.open, linear.open_response(found.frequency))):
        ratio = measured / expected
        assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.5
        assert np.abs(np.degrees(np.angle(ratio))).max() < 3.0
    assert found.coherence.min() > 0.99


def test_prbs_of_the_position_loop_while_the_axis_slides():
    """Friction adds nothing while the axis never stops; the margins are those of the linear loop. Motor feedback too."""
    law = cases.lugre(150.0)
    base = p2_servo(law=law)
    for feedback in ("motor", "scale"):
        c = replace(base.controllers[0], position=replace(base.controllers[0].position, feedback=feedback,
                                                          velocity_feedforward=1.0))
        servo = Servo(base.plant, (c,))
        found = measure_loop(servo, "position", 2e-6, order=10, settle=4, offset_velocity=0.03).between(5.0, 150.0)
        linear = compute_loops(servo).position
        ratio = found.closed / linear.closed_response(found.frequency)
        assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.5
        assert np.abs(np.degrees(np.angle(ratio))).max() < 3.0
        assert found.margins.phase == pytest.approx(linear.margins().phase, abs=2.0)
        assert found.coherence.min() > 0.99


@pytest.mark.parametrize("share", [0.03, 0.10])
def test_current_step(share):
    """P2: steps of 3 and 10 % of the limit settle on the set point, and equal the linear response."""
    from toolpoint.drives.simulation.simulate import Excitation

    servo = p2_servo()
    height = share * 60.0
    result = simulate(servo, rest(1, 1e-3, 0.02), excitation=Excitation("current", np.full((160, 1), height)))
    level, x, expected = compute_loops(servo).current.closed, None, []
    x = np.zeros(level.size)
    for k in range(20):
        expected.append(level.c[0] @ x)
        x = level.a @ x + level.b[:, 0] * (height + result.signal("current_set", "x")[k])
    np.testing.assert_allclose(result.output("i_q", "x")[:20], expected, rtol=0.02, atol=0.02 * height)


@pytest.mark.parametrize("feed", [200.0, 500.0])
def test_velocity_step(feed):
    """P2: the axis reaches 200 and 500 mm/min, with friction."""
    servo = p2_servo(law=cases.lugre(150.0))
    result = simulate(servo, constant_velocity(feed / 60e3, 1e-3, 0.8))
    assert result.output("speed", "x")[-400:].mean() * cases.RATIO == pytest.approx(feed / 60e3, rel=1e-3)


def test_position_step():
    """P2: 0.5 mm, no overshoot at these gains."""
    result = simulate(p2_servo(), step(0.5e-3, 1e-3, 0.5))
    scale = result.output("scale", "x")
    assert scale[-1] == pytest.approx(0.5e-3, rel=1e-3)
    assert scale.max() < 0.52e-3


def test_switched_inverter_converges_to_the_averaged_one():
    command = constant_velocity(0.05, 1e-3, 0.05)
    averaged = simulate(p2_servo(), command, substeps=32, record_interval=32)
    differences = []
    for carrier in (1, 2, 4):
        switched = simulate(p2_servo(Inverter(320.0, "six-pulse", carrier)), command, substeps=32, record_interval=1,
                            check=False)
        now = switched.output("i_q", "x")[:-1].reshape(-1, 32)
        smooth = simulate(p2_servo(), command, substeps=32, record_interval=1).output("i_q", "x")[:-1].reshape(-1, 32)
        differences.append(np.sqrt(((now - smooth) ** 2).mean()))
    assert differences[1] < 0.7 * differences[0]
    assert differences[2] < 0.7 * differences[1]
    end = abs(switched.output("scale", "x")[-1] - averaged.output("scale", "x")[-1])
    assert end < 2e-6


def test_saturation_keeps_limits_and_recovers():
    servo = p2_servo()
    result = simulate(servo, step(0.05, 1e-3, 1.5))
    assert np.abs(result.signal("current_set", "x")).max() <= 60.0 + 1e-12
    assert np.hypot(result.signal("u_d", "x"), result.signal("u_q", "x")).max() <= 320.0 + 1e-9
    assert result.output("scale", "x")[-1] == pytest.approx(0.05, rel=1e-3)


def test_encoder_resolution_bounds_the_error():
    axis = DriveAxis("x", TorqueMotor(), rigid_axis(0.01, 1e-3, 0.05))
    c = Controller(PositionLoop(50.0, 1e-3), VelocityLoop(1.0, 0.02, 2.5e-4), 1e-3, encoders=Encoders(motor=2e-3))
    result = simulate(Servo(build_plant([axis]), (c,)), step(1e-4, 1e-3, 1.0))
    assert abs(result.output("scale", "x")[-1] - 1e-4) <= 2e-3 * 1e-3


def test_batch_equals_single_runs():
    command = cases.benchmark_command(0.05)
    servos = [cases.benchmark_servo(cases.lugre(level)) for level in (100.0, 300.0)]
    both = simulate_many([(s, command) for s in servos], threads=2)
    for servo, result in zip(servos, both, strict=True):
        np.testing.assert_array_equal(result.outputs, simulate(servo, command).outputs)


def test_bad_servos():
    good = p2_servo()
    with pytest.raises(ToolpointError, match=r"velocity loop: unstable.*gain margin"):
        simulate(Servo(good.plant, (good.controllers[0].with_gains(velocity=80.0),)), rest(1, 1e-3, 0.01))
    with pytest.raises(ToolpointError, match=r"position loop: unstable.*gain margin -\d"):
        simulate(Servo(good.plant, (good.controllers[0].with_gains(position=3000.0),)), rest(1, 1e-3, 0.01))
    c = Controller(PositionLoop(50.0, 1.1e-3), VelocityLoop(1.0, 0.02, 250e-6), 1e-3)
    rigid = build_plant([DriveAxis("x", TorqueMotor(), rigid_axis(0.01, 1e-3))])
    with pytest.raises(ToolpointError, match="whole multiple"):
        Servo(rigid, (c,))
    with pytest.raises(ToolpointError, match=r"must be one of x\.base"):
        build_plant([DriveAxis("x", TorqueMotor(), linear_motor_axis(10.0))], cases.frame())
    with pytest.raises(ToolpointError, match="lead: missing"):
        Controller(PositionLoop(50.0), VelocityLoop(1.0), None)
    with pytest.raises(ToolpointError, match="inertia"):
        rigid_axis(0.0, 1e-3)
    with pytest.raises(ToolpointError, match="lead"):
        BallScrew(0.04, 0.0, 1.0)
    with pytest.raises(ToolpointError, match="resampled"):
        simulate(good, rest(1, 5e-4, 0.01))
