"""Step tests beside first-order lags in closed form, limits, doubts; tuned gains keep their margins and go into the file."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from toolpoint import ToolpointError, io
from toolpoint.app.main import main
from toolpoint.drives.description import (
    CurrentDescription,
    DriveAxisDescription,
    DriveDescription,
    FrictionDescription,
    MechanicsDescription,
    MotorDescription,
    PositionDescription,
    VelocityDescription,
)
from toolpoint.studies import StepSetting, TuningTarget, step_drives, tune_drives

RIGID = MechanicsDescription("rigid", lead=0.01, inertia=0.01)
ELASTIC = MechanicsDescription("two-mass", lead=0.01, inertia=0.006, table_mass=300.0, stiffness=1e8, damping=5e3)
LAG_RISE = np.log(9)  # of a first-order lag from 10 to 90 %, over its time constant


def slide(mechanics=RIGID, gain=1.0, *, integral_time=None, with_motor=False, position=20.0, sample_time=2.5e-5, limit=None,
          friction=None, voltage=320.0):
    current = CurrentDescription(bandwidth=500.0, sample_time=sample_time, delay=0, voltage=voltage) if with_motor else None
    motor = MotorDescription(4, 0.5, 5e-3, flux=0.15) if with_motor else None
    velocity = VelocityDescription(gain=gain, integral_time=integral_time, sample_time=sample_time, limit=limit)
    axis = DriveAxisDescription(mechanics=mechanics, position=PositionDescription(gain=position, sample_time=sample_time),
                                velocity=velocity, motor=motor, current=current,
                                friction=friction or FrictionDescription(law="none"))
    return DriveDescription("slide", {"X": axis})


def step(drives, *setting):
    (test,) = step_drives(drives, [StepSetting("X", *setting)]).tests
    return test


def test_a_velocity_loop_without_integral_is_a_lag():
    """tau = J / K_p: sampled at 25 us the rise is that of the lag within half a per cent."""
    test = step(slide(gain=1.0), "velocity", 1 / 60)
    assert test.figures.rise_time == pytest.approx(LAG_RISE * 0.01 / 1.0, rel=5e-3)
    assert test.figures.overshoot < 1e-3 and abs(test.figures.steady_error) < 1e-4 / 60
    assert test.response[-1] == pytest.approx(1 / 60, rel=1e-3)
    assert np.abs(test.torque).max() == pytest.approx(1.0 * (1 / 60) / (0.01 / (2 * np.pi)), rel=1e-2)


def test_a_current_loop_of_pole_cancellation_is_a_lag():
    """tau = 1 / (2 pi 500 Hz), beside half a sample of hold."""
    test = step(slide(with_motor=True), "current", 2.0)
    assert test.figures.rise_time == pytest.approx(LAG_RISE / (2 * np.pi * 500), rel=0.06)
    assert test.figures.overshoot < 0.05 and test.unit == "A"


def test_a_position_loop_over_a_fast_velocity_loop_is_a_lag():
    test = step(slide(gain=50.0, position=20.0), "position", 1e-4)
    assert test.figures.rise_time == pytest.approx(LAG_RISE / 20.0, rel=0.01)
    assert test.set_point[0] == 0 and test.set_point[-1] == 1e-4


@pytest.mark.parametrize(("level", "height"), [("current", 0.5), ("velocity", 0.002), ("position", 2e-5)])
def test_without_friction_responses_grow_with_the_step(level, height):
    drives = slide(ELASTIC, integral_time=0.05, with_motor=True, sample_time=1.25e-4)
    one, three = step(drives, level, height), step(drives, level, 3 * height)
    assert 3 * one.response == pytest.approx(three.response, abs=1e-9 * np.abs(three.response).max())
    assert one.figures.rise_time == pytest.approx(three.figures.rise_time, rel=1e-6)


def test_a_share_is_that_of_the_current_limit():
    drives = slide(with_motor=True)
    shared = step(drives, "current", 0.03, True)
    assert shared.height == pytest.approx(0.03 * 60)
    assert shared.response == pytest.approx(step(drives, "current", 1.8).response, rel=1e-12)


def test_limits_that_are_reached_are_doubted():
    limited = step(slide(gain=1.0, limit=2.0), "velocity", 1 / 60)
    assert any("torque reaches its limit of 2 N m" in doubt for doubt in limited.doubts)
    assert limited.figures.rise_time > 1.5 * LAG_RISE * 0.01
    low_voltage = step(slide(with_motor=True, voltage=20.0), "current", 10.0)
    assert any("voltage reaches its limit" in doubt for doubt in low_voltage.doubts)
    assert not step(slide(gain=1.0), "velocity", 1 / 60).doubts


def test_a_step_that_friction_holds_is_told():
    dry = FrictionDescription(law="coulomb", coulomb=5.0)
    held = step_drives(slide(gain=1.0, friction=dry), [StepSetting("X", "velocity", 1e-4)])
    assert held.tests[0].figures is None
    assert any("does not reach 90 %" in doubt for doubt in held.doubts)
    assert "not reached" in held.table() and held.to_dict()["steps"][0]["figures"] is None


@pytest.mark.parametrize(("setting", "words"), [(("X", "current", 1.0), "motor and current loop"),
                                                (("Q", "velocity", 1.0), "must be one of X")])
def test_steps_that_cannot_be_are_refused(setting, words):
    with pytest.raises(ToolpointError, match=words):
        step_drives(slide(), [StepSetting(*setting)])


@pytest.mark.parametrize("setting", [("X", "speed", 1.0), ("X", "velocity", 0.0), ("X", "velocity", 0.1, True)])
def test_settings_are_checked(setting):
    with pytest.raises(ToolpointError):
        StepSetting(*setting)


@pytest.fixture(scope="module")
def tuned():
    return tune_drives(slide(ELASTIC, sample_time=2.5e-4, integral_time=0.02), TuningTarget(phase_margin=50.0))


def test_tuned_gains_keep_the_margins_and_are_the_largest(tuned):
    velocity = next(row for row in tuned.loops_after.figures if row[0] == "velocity")
    assert velocity[2] >= 8.0 - 1e-6 and velocity[3] >= 50.0 - 1e-6
    assert min(velocity[2] - 8.0, velocity[3] - 50.0) < 0.2  # one of the two is used up
    assert tuned.drives.axes["X"].velocity.gain > tuned.base.axes["X"].velocity.gain
    harder = tune_drives(tuned.base, TuningTarget(phase_margin=60.0))
    assert harder.drives.axes["X"].velocity.gain < tuned.drives.axes["X"].velocity.gain
    assert not any("margin" in doubt for doubt in tuned.doubts)


def test_rigid_axes_are_doubted():
    assert any("no resonance limits them" in doubt for doubt in tune_drives(slide(sample_time=2.5e-4)).doubts)


FILE = """toolpoint: 1
name: slide
axes:
  X:
    mechanics: {kind: two-mass, lead: 10 mm, inertia: 0.006 kg*m^2, table_mass: 300 kg, stiffness: 100 N/um,
                damping: 5000 N*s/m}
    position: {gain: 20 1/s}  # as delivered
    velocity: {gain: 1 N*m*s/rad, integral_time: 20 ms}
"""


def test_gains_go_into_the_file_and_comments_stay(tmp_path, capsys):
    source, target = tmp_path / "s.yaml", tmp_path / "t.yaml"
    source.write_text(FILE)
    main(["drive", str(source), "--tune", "--save", str(target), "-o", str(tmp_path / "page"), "--json"])
    gains = json.loads(capsys.readouterr().out)["after"]["gains"]["X"]
    again = io.read_drives(target).axes["X"]
    assert again.velocity.gain == pytest.approx(gains["velocity_gain"], rel=1e-5)
    assert again.position.gain == pytest.approx(gains["position_gain"], rel=1e-5)
    assert again.velocity.integral_time == pytest.approx(gains["integral_time_s"], rel=1e-5)
    assert "# as delivered" in target.read_text()
    delivered = io.read_drives(source).axes["X"]
    assert replace(again, position=delivered.position, velocity=delivered.velocity) == delivered
    assert not list(tmp_path.glob(".*draft"))


def test_steps_by_command(tmp_path, capsys):
    source = tmp_path / "s.yaml"
    source.write_text(FILE)
    main(["drive", str(source), "--step", "X:velocity=500 mm/min", "--step", "X:position=0.5mm", "-o", str(tmp_path), "--json"])
    steps = json.loads(capsys.readouterr().out)["steps"]
    assert [each["level"] for each in steps] == ["velocity", "position"]
    assert steps[0]["height"] == pytest.approx(0.5 / 60)
    assert "Step tests" in (tmp_path / "index.html").read_text()


def test_larger_gains_settle_faster():
    times = [step(slide(gain=gain), "velocity", 1 / 60).figures.settling_time for gain in (0.5, 1.0, 2.0)]
    assert all(later < earlier for earlier, later in pairwise(times))
