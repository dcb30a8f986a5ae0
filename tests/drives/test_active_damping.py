"""Active damping by a drive: the damping ratio of its axial mode in closed form, in loops and in time, and by file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from conftest import MACHINES
from toolpoint import ToolpointError, studies
from toolpoint.drives import (
    Controller,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    build_plant,
    build_servo,
    compute_loops,
    simulate,
    two_mass_axis,
)
from toolpoint.drives.program.command import Command
from toolpoint.io import read_drives, read_machine

INERTIA, MASS, RATIO, STIFFNESS, GAIN = 0.008, 300.0, 3e-3, 2e7, 0.3
STEP = 1e-5  # s: sampling hardly enters


def servo_of(gain, sensor="scale", velocity_gain=1e-6):
    axis = two_mass_axis(INERTIA, MASS, RATIO, stiffness=STIFFNESS)
    loop = VelocityLoop(velocity_gain, sample_time=STEP, damping_gain=gain, damping_sensor=sensor)
    return Servo(build_plant([DriveAxis("X", TorqueMotor(), axis)]), (Controller(PositionLoop(1e-3, STEP), loop, lead=RATIO),))


@pytest.mark.parametrize("sensor", ["scale", "tool"])
def test_the_axial_mode_is_damped_by_the_gain_over_the_inertia(sensor):
    """With e = x - r theta and the torque G e'/r: e'' + G/J e' + k (1/m + r^2/J) e = 0, so zeta = G/(2 J w)."""
    poles = compute_loops(servo_of(GAIN, sensor)).velocity.closed.poles
    poles = np.log(poles[np.abs(poles) > 0.5]) / STEP
    mode = poles[np.argmax(poles.imag)]
    omega = np.sqrt(STIFFNESS * (1 / MASS + RATIO**2 / INERTIA))
    assert abs(mode) == pytest.approx(omega, rel=1e-3)
    # A difference over a sample is half a sample old, and the torque is held for another half.
    assert -mode.real / abs(mode) == pytest.approx(GAIN / (2 * INERTIA * omega), rel=0.01)


def test_a_struck_table_rings_down_as_the_loops_say():
    """By simulation: the decrement of the stretch after a blow is that of the pole."""
    servo = servo_of(GAIN)
    poles = compute_loops(servo).velocity.closed.poles
    poles = np.log(poles[np.abs(poles) > 0.5]) / STEP
    mode = poles[np.argmax(poles.imag)]
    load = np.zeros((8000, 1))
    load[1:20] = 100.0
    zero = np.zeros((8001, 1))
    result = simulate(servo, Command(zero, STEP, zero, zero), load=load, check=False)
    stretch = result.output("scale", "X") - RATIO * result.output("angle", "X")
    late = result.time > 1e-3
    waves = np.exp(mode * result.time[late])
    basis = np.column_stack([waves.real, waves.imag, np.ones(late.sum())])
    fit = np.linalg.lstsq(basis, stretch[late], rcond=None)[0]
    assert np.abs(basis @ fit - stretch[late]).max() < 1e-3 * np.abs(stretch).max()


def test_too_much_of_it_is_refused_as_any_unstable_loop():
    servo = servo_of(-5.0, velocity_gain=0.5)
    with pytest.raises(ToolpointError, match="velocity loop: unstable"):
        simulate(servo, Command(np.zeros((10, 1)), STEP))


def test_by_file_a_tool_sensor_damps_the_mode_that_the_cut_meets(tmp_path):
    """The shipped mill with its drives on: one sign of the gain lowers the peak at the tool, the other does not."""
    machine = read_machine(MACHINES / "three_axis_vertical_drives.yaml")
    text = (MACHINES / "three_axis_vertical_servo_on_structure.yaml").read_text()
    peaks, real_parts = {}, {}
    for gain in (-0.3, 0.0, 0.3, 1.0):
        path = tmp_path / "servo.yaml"
        path.write_text(text.replace("sample_time: 0.25 ms}", f"sample_time: 0.25 ms, damping_gain: {gain} N*m*s/rad, "
                                     "damping_sensor: tool}", 1))
        drives = read_drives(path)
        assert build_servo(drives, warn=False).controllers[0].velocity.damping_gain == gain
        result = studies.study_driven_responses(machine, drives, dofs=["tool-table:+x"], frequency=np.arange(10.0, 120.0, 0.5))
        assert any("ideal" in doubt for doubt in result.doubts) == (gain != 0)
        peaks[gain] = np.abs(result.frfs["on"].values[:, 0, 0]).max()
        real_parts[gain] = result.frfs["on"].values[:, 0, 0].real.min()
    # A depth limit goes with 1/(2 K |Re|) of the most negative real part (Tobias; Tlusty).
    assert real_parts[0.0] / real_parts[1.0] > 3
    assert min(peaks[-0.3], peaks[0.3]) < 0.9 * peaks[0.0] < max(peaks.values())


def test_a_sensor_that_is_none_is_refused():
    with pytest.raises(ToolpointError, match="damping_sensor"):
        replace(servo_of(0.0).controllers[0].velocity, damping_sensor="table")
