"""Responses with drives on, off, shorted and braked: by the simulation in time, and by closed forms of a rigid axis."""

from dataclasses import replace

import numpy as np
import pytest

from drives.servo_cases import MOTOR, RATIO, benchmark_servo, controller, lugre, smooth
from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    low_pass,
    rigid_axis,
)
from toolpoint.drives.axis.motor import Inverter
from toolpoint.drives.controller.drive_states import DRIVE_STATES, respond_to_forces
from toolpoint.drives.controller.servo import Servo
from toolpoint.drives.controller.settings import CurrentLoop
from toolpoint.drives.program.command import Command
from toolpoint.drives.simulation.simulate import simulate

LINES = np.array([3.0, 20.0, 55.0, 130.0, 310.0])


def response(servo, state, frequency=LINES, output="table"):
    """Motion of the first axis' table under a force on it."""
    outputs = servo.plant.output(0, output)[None]
    return respond_to_forces(servo, servo.plant.b_force[:, :1], outputs, frequency=frequency, state=state)[:, 0, 0]


def slow_loops(feedback):
    """Loops whose sampling, holds and delays weigh: current 0.5 ms with a delay, velocity 1 ms with two, position 4 ms."""
    current = CurrentLoop.from_bandwidth(MOTOR, 120.0, sample_time=5e-4, delay=1, limit=60.0)
    return Controller(PositionLoop(25.0, 4e-3, 0.0, feedback=feedback), VelocityLoop(0.9, 0.05, 1e-3, delay=2), RATIO, current,
                      inverter=Inverter(320.0))


def damped_loops(loops, sensor, gain, *filters):
    """The loops with active damping by a sensor behind the motor, through filters of the torque."""
    return replace(loops, velocity=replace(loops.velocity, damping_gain=gain, damping_sensor=sensor, filters=filters))


LOOPS = {"scale": controller(ff=0.0), "motor": controller(ff=0.0, feedback="motor"), "slow": slow_loops("scale"),
         "slow motor": slow_loops("motor"),
         "damping": damped_loops(controller(ff=0.0), "scale", 0.5, low_pass(400.0)),
         "damping at the tool": damped_loops(slow_loops("motor"), "tool", -0.1)}


def steady_motion(servo, frequency):
    """Motion of the first table under a sine on it, by simulation in time after the start has died away."""
    times, periods, settling = servo.controllers[0].sample_times, 8, 4.0
    duration = settling + periods / frequency
    time = np.arange(round(duration / times.current)) * times.current
    load = np.zeros((time.size, 2))
    load[:, 0] = np.sin(2 * np.pi * frequency * time)
    zero = np.zeros((round(duration / times.position) + 1, 2))
    result = simulate(servo, Command(zero, times.position, zero, zero), load=load, duration=duration)
    last = result.time > settling
    # The force is held over each step: it comes half a step late.
    wave = np.exp(1j * 2 * np.pi * frequency * (result.time[last] - times.current / 2))
    basis = np.column_stack([wave.imag, wave.real, np.ones(last.sum())])
    sine, cosine, _ = np.linalg.lstsq(basis, result.output("table", "x")[last], rcond=None)[0]
    return sine + 1j * cosine


@pytest.mark.parametrize("loops", LOOPS.values(), ids=LOOPS)
@pytest.mark.parametrize("frequency", [4.0, 20.0, 45.0])
@pytest.mark.default_cases(9)
def test_loops_that_are_on_answer_a_force_as_the_simulation_does(loops, frequency):
    """Friction is viscous alone, so that all is linear."""
    servo = Servo(benchmark_servo(smooth(lugre())).plant, (loops,) * 2)
    assert response(servo, "on", np.array([frequency]))[0] == pytest.approx(steady_motion(servo, frequency), rel=2e-3, abs=0)


def rigid_servo(motor, current=None):
    axis = rigid_axis(0.005, 2e-3)
    plant = build_plant([DriveAxis("x", motor, axis)])
    return Servo(plant, (Controller(PositionLoop(20.0), VelocityLoop(1.0, 0.05), lead=2e-3, current=current),))


def test_a_rigid_axis_by_its_closed_forms():
    """Off: a free mass. Shorted: the winding's resistance and inductance brake it. Braked: it does not move."""
    inertia, ratio, omega = 0.005, 2e-3, 2 * np.pi * LINES
    mass = inertia / ratio**2
    free = rigid_servo(TorqueMotor())
    assert response(free, "off") == pytest.approx(-1 / (mass * omega**2), rel=1e-9, abs=0)
    wound = rigid_servo(MOTOR, controller().current)
    assert response(wound, "off") == pytest.approx(-1 / (mass * omega**2), rel=1e-9, abs=0)
    impedance = MOTOR.resistance + 1j * omega * MOTOR.inductance_q
    brake = MOTOR.torque_constant * MOTOR.pole_pairs * MOTOR.flux / impedance / ratio**2
    assert response(wound, "shorted") == pytest.approx(1 / (-mass * omega**2 + 1j * omega * brake), rel=1e-9, abs=0)
    assert np.abs(response(wound, "braked")).max() < 1e-12 * np.abs(response(wound, "off")).max()


def test_a_braked_motor_leaves_the_springs_between_it_and_the_table():
    """Far below the modes the table yields by the springs of its axis and the frame; the loops cannot do better."""
    servo = benchmark_servo(smooth(lugre()))
    at_rest = response(servo, "braked", np.array([0.5]))[0]
    assert at_rest.real > 1 / 1.2e8  # the axis' own spring, 1.2e8 N/m, and the frame beside it
    closed = abs(response(servo, "on", np.array([0.05]))[0])
    assert abs(response(servo, "off", np.array([0.5]))[0]) > 10 * at_rest.real
    assert closed < 0.5 * at_rest.real  # the scale stands on the table: the integral part takes the spring out


def test_every_state_is_reciprocal_where_no_controller_acts():
    servo = benchmark_servo(smooth(lugre()))
    tables = np.vstack([servo.plant.output(axis, "table") for axis in (0, 1)])
    for state in DRIVE_STATES[1:]:
        both = respond_to_forces(servo, servo.plant.b_force, tables, frequency=LINES, state=state)
        assert both[:, 0, 1] == pytest.approx(both[:, 1, 0], rel=1e-6, abs=1e-9 * np.abs(both).max())
