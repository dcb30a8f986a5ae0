"""Friction of thrust bearings that grows with their load: torque at constant feed, both ways, by file, and at any nut place."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.drives import (
    BallScrew,
    Controller,
    Coupling,
    DriveAxis,
    PositionLoop,
    Servo,
    TorqueMotor,
    VelocityLoop,
    ball_screw_axis,
    build_plant,
    compute_loops,
    four_dof_axis,
    simulate,
    simulate_moving_nut,
)
from toolpoint.drives.controller.loop_stability import check_stable
from toolpoint.drives.program.command import constant_velocity
from toolpoint.io import read_drives

SCREW = BallScrew(diameter=0.036, lead=0.02, length=1.0)
ARM, FORCE, FEED = 8e-5, 3000.0, 0.05  # m, N, m/s


def four(arm):
    return four_dof_axis(0.004, 0.001, 8.0, table_mass=300.0, lead_ratio=SCREW.ratio, coupling=(5000.0, 1.0),
                         bearing=(4e8, 2e4), nut=(5e8, 2e4), bearing_friction_arm=arm)


def chain(arm, end=None, nut=0.4):
    return ball_screw_axis(0.004, Coupling(5000.0, 1.0), SCREW, table_mass=300.0, nut_position=nut, front_bearing=4e8,
                           end_bearing=end, bearing_damping=2e4, nut_damping=2e4, bearing_friction_arm=arm)


def servo_of(mechanics):
    return Servo(build_plant([DriveAxis("X", TorqueMotor(), mechanics)]),
                 (Controller(PositionLoop(30.0), VelocityLoop(1.5, 0.02), lead=SCREW.ratio),))


def torque_at(mechanics, force, feed, substeps=4):
    """Mean torque of the motor over the last tenth of a second of a constant feed under a constant force, N m."""
    result = simulate(servo_of(mechanics), constant_velocity(feed, 1e-3, 0.5), load=np.array([[force]]), substeps=substeps)
    assert result.unconverged == 0
    return result.signal("torque_set", "X")[-400:].mean()


@pytest.mark.parametrize("make", [four, chain], ids=["four", "chain"])
@pytest.mark.parametrize("feed", [FEED, -FEED])
@pytest.mark.parametrize("force", [FORCE, -FORCE])
def test_the_motor_carries_the_load_and_what_it_rubs(make, feed, force):
    """T = -F r + arm |F| sgn(v): the friction opposes the turn whichever way the force helps or hinders."""
    assert torque_at(make(ARM), force, feed) == pytest.approx(-force * SCREW.ratio + ARM * abs(force) * np.sign(feed), rel=1e-5)


def test_an_axis_without_damping_is_not_called_unstable():
    """Its place and speed integrate: a double multiplier of one, which rounding splits by more than one of a single pole."""
    levels = compute_loops(servo_of(chain(0.0)))
    assert 1e-7 < levels.current.radius - 1 < 1e-5
    assert check_stable(servo_of(chain(0.0))).stable
    faulty = Servo(build_plant([DriveAxis("X", TorqueMotor(), chain(0.0))]),
                   (Controller(PositionLoop(30.0), VelocityLoop(150.0, 0.02), lead=SCREW.ratio),))
    with pytest.raises(ToolpointError, match="velocity loop: unstable"):
        check_stable(faulty)


def test_two_bearings_share_the_load_and_rub_as_one():
    """Held at both ends the screw gives part of the force to each: the shares follow its springs, their sum is the force."""
    one, both = (torque_at(chain(ARM, end), FORCE, FEED) for end in (None, 4e8))
    assert both == pytest.approx(one, rel=1e-6)
    front = 1 / (1 / 4e8 + 0.4 / SCREW.rod_stiffness)
    end = 1 / (1 / 4e8 + 0.6 / SCREW.rod_stiffness)
    mechanics = chain(ARM, 4e8)
    servo = servo_of(mechanics)
    result = simulate(servo, constant_velocity(FEED, 1e-3, 0.5), load=np.array([[FORCE]]), substeps=4)
    # Laws follow the turn of the screw: their last values are the torques of the front and of the end bearing.
    assert result.forces[-1] == pytest.approx(ARM * FORCE * np.array([front, end]) / (front + end), rel=1e-5)


def test_a_moving_nut_shifts_the_load_from_the_front_to_the_end():
    feed, start, time = 0.1, 0.3, 2.0
    result = simulate_moving_nut(lambda nuts: servo_of(_loaded(nuts[0])), [start], constant_velocity(feed, 1e-3, time),
                                 substeps=2, record_interval=8, estimate=False)
    lag = feed / 30.0
    for share in (0.25, 1.0):
        nut = start + feed * time * share - lag
        front, end = (1 / (1 / 4e8 + part / SCREW.rod_stiffness) for part in (nut, SCREW.length - nut))
        torque = result.forces[int(share * (len(result.time) - 1))]
        drag = GUIDE * FEED_DRAG
        assert torque == pytest.approx(ARM * drag * np.array([front, end]) / (front + end), rel=0.01)


GUIDE, FEED_DRAG = 2e4, 0.1  # N s/m, m/s


def _loaded(nut):
    return ball_screw_axis(0.004, Coupling(5000.0, 1.0), SCREW, table_mass=300.0, nut_position=nut, front_bearing=4e8,
                           end_bearing=4e8, bearing_damping=2e4, nut_damping=2e4, guide_damping=GUIDE,
                           bearing_friction_arm=ARM)


def test_the_level_follows_a_load_that_changes():
    """The level is that of the step's start: on a force that swings at 20 Hz the torque is arm |F(t)|."""
    step = 62.5e-6
    time = step * np.arange(int(0.5 / step) + 1)
    force = 2000.0 + 1500.0 * np.sin(2 * np.pi * 20 * time)
    result = simulate(servo_of(four(ARM)), constant_velocity(FEED, 1e-3, 0.5), load=force[:, None], substeps=4)
    late = (result.time > 0.25) & (result.time < 0.499)  # ends of differences are one-sided
    torque = result.forces[late, 0]
    # The bearing carries what the masses do not take: those of table and screw, at the table's own acceleration.
    table = result.output("table", "X")
    inertia = 308.0 * np.gradient(np.gradient(table, result.time), result.time)
    assert torque == pytest.approx(ARM * np.abs(force[:late.size][late] - inertia[late]), rel=0.01)


def write(folder, arm):
    path = folder / "servo.yaml"
    path.write_text(f"""toolpoint: 1
name: one screw
axes:
  X:
    mechanics: {{kind: screw, lead: 20 mm, inertia: 0.004 kg*m^2, table_mass: 300 kg, screw_diameter: 36 mm, screw_length: 1 m,
                nut_position: 0.4 m, coupling_stiffness: 5000 N*m/rad, bearing_stiffness: 400 N/um, nut_stiffness: 500 N/um,
                bearing_friction_arm: {arm}}}
    position: {{gain: 30 1/s}}
    velocity: {{gain: 1.5 N*m*s/rad, integral_time: 20 ms}}
limits: {{speed: 0.5 m/s, acceleration: 3 m/s^2, jerk: 100 m/s^3}}
""")
    return path


def test_the_arm_is_that_of_the_file_and_one_beyond_the_lead_is_refused(tmp_path):
    from toolpoint.drives import build_servo

    rubs = build_servo(read_drives(write(tmp_path, "0.08 mm"))).plant.axes[0].mechanics.friction
    assert [(rub.name, rub.load_arm) for rub in rubs] == [("bearing", pytest.approx(8e-5, rel=1e-12))]
    with pytest.raises(ToolpointError, match=r"bearing_friction_arm.*must be below the travel per radian"):
        read_drives(write(tmp_path, "4 mm"))
    path = write(tmp_path, "0.08 mm")
    path.write_text(path.read_text().replace("kind: screw", "kind: rigid"))
    with pytest.raises(ToolpointError, match="no thrust bearing"):
        read_drives(path)
