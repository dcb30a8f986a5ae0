"""Joint laws that follow an axis or the speed: against the laws at each place, differences, modes, maps and charts."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.joints.angular_contact import BearingDescription
from toolpoint.joints.ball_screw import BallScrewDescription
from toolpoint.joints.law import LawDescription
from toolpoint.machine import assemble, build
from toolpoint.machine.assembly.joint_terms import stiffness_of_joint
from toolpoint.machine.derivatives import matrix_derivatives
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    ShapeDescription,
    SpinDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine
from toolpoint.studies import map_speeds
from toolpoint.studies.machines.check.law_doubts import question_laws

SCREW = BallScrewDescription(6e8, 8e8, 0.032, 0.9, 0.3, lead=0.01, follows="away")
MASS = 250.0


def table(screw=SCREW, limits=(-0.2, 0.5), factor="x", loss=0.0, **more):
    bodies = {"table": BodyDescription(mass=MASS, inertia=InertiaDescription(4.0, 6.0, 8.0))}
    guide = JointDescription("ground", "table", FrameDescription(), {"y": 5e8, "z": 6e8, "rx": 1e7, "ry": 1e7, "rz": 1e7},
                             law=LawDescription(ball_screw=screw, loss_factor=loss), **more)
    return build(MachineDescription("table", bodies, {"guide": guide}, {"X": AxisDescription("guide", factor, limits)},
                                    {"work": PointDescription("table")}))


@pytest.mark.parametrize("held", ["one end", "both ends"])
@pytest.mark.parametrize("follows", ["away", "towards"])
def test_the_screw_is_that_of_the_nut_s_place(held, follows):
    screw = replace(SCREW, held=held, follows=follows)
    at = np.array([-0.15, 0.0, 0.2])
    sign = 1 if follows == "away" else -1
    law = np.array([screw.axial(0.3 + sign * x) for x in at])
    k = assemble(table(screw), {"X": at}, ["work:+x"]).stiffness
    assert k[:, 0, 0] == pytest.approx(law, rel=1e-12)
    assert np.diff(law).any()
    assert k[:, 1, 1] == pytest.approx(5e8)


def slope_of(machine, x, rate=1.0):
    """Derivative of the stiffness that the only travelling law of a machine states, by the axis that moves it at a rate."""
    law, = (joint.travel.law for joint in machine.joints if joint.travel is not None)
    return rate * float(law(np.array([rate * x]))[1][0])


@pytest.mark.parametrize("held", ["one end", "both ends"])
def test_derivatives_of_the_law_and_of_the_machine_are_differences(held):
    screw, h = replace(SCREW, held=held), 1e-4
    x = np.array([0.2, 0.44, 0.7])
    slope = screw.axial_along(x)[1]
    assert slope == pytest.approx((screw.axial_along(x + h)[0] - screw.axial_along(x - h)[0]) / (2 * h), rel=1e-5)
    for way in ("x", "-x"):
        for follows in ("away", "towards"):
            machine = table(replace(screw, follows=follows), factor=way, limits=(-0.28, 0.28))
            exact = slope_of(machine, 0.1, -1.0 if way == "-x" else 1.0)
            ahead, back = (assemble(machine, {"X": 0.1 + step}).stiffness[0, 0] for step in (h, -h))
            assert exact == pytest.approx((ahead - back) / (2 * h), rel=1e-5)


def test_the_stiffness_of_one_joint_holds_what_follows_the_axis():
    machine, pose = table(), {"X": 0.2}
    of_joint = stiffness_of_joint(place_machine(machine, pose), "guide")
    assert of_joint == pytest.approx(assemble(machine, pose, ["work:+x"]).stiffness, rel=1e-12)
    assert of_joint[0, 0] != pytest.approx(stiffness_of_joint(place_machine(machine), "guide")[0, 0], rel=1e-3)


def test_modes_and_maps_follow_the_axis():
    machine, at = table(), np.linspace(-0.2, 0.5, 5)
    expected = np.sqrt(np.array([SCREW.axial(0.3 + x) for x in at]) / MASS) / (2 * np.pi)
    mapped = natural_frequencies(machine, {"X": at}, 6)
    assert np.abs(mapped - expected[:, None]).min(axis=1) == pytest.approx(np.zeros(5), abs=1e-9 * expected.max())
    with pytest.raises(ToolpointError, match="follows an axis"):
        natural_frequencies(machine, {"X": at}, 6, path="compiled")


def test_the_slope_of_a_frequency_by_the_axis_is_that_of_its_stiffness():
    machine, x, h = table(), 0.1, 1e-5
    slope = slope_of(machine, x)
    f = np.sqrt(SCREW.axial(0.3 + x) / MASS) / (2 * np.pi)
    maps = natural_frequencies(machine, {"X": np.array([x - h, x + h])}, 6)
    k = int(np.argmin(np.abs(maps[0] - f)))
    # The mass matrix of a table on its own guide does not depend on where it stands.
    assert slope / MASS / (8 * np.pi**2 * f) == pytest.approx((maps[1, k] - maps[0, k]) / (2 * h), rel=1e-6)


def test_the_loss_goes_with_the_stiffness():
    system = assemble(table(loss=0.05), {"X": 0.4})
    assert system.structural_damping[0, 0] == pytest.approx(0.05 * system.stiffness[0, 0], rel=1e-12)


def test_derivatives_to_other_numbers_stay_exact():
    machine = table()
    slopes = matrix_derivatives(machine, ["joints.guide.stiffness.y"], {"X": np.array([0.0, 0.3])})
    assert slopes.stiffness[0, 1, 1] == pytest.approx(1.0)


@pytest.mark.parametrize(("machine", "words"), [
    (lambda: table(limits=(-0.4, 0.5)), "joints.guide.law.*-100 mm from the thrust bearing"),
    (lambda: table(factor="y"), "no axis drives guide along x")])
def test_faults_name_the_joint(machine, words):
    with pytest.raises(ToolpointError, match=words):
        natural_frequencies(machine(), {"X": np.array([-0.4, 0.1])}, 2)


def test_a_screw_in_a_loop_is_refused():
    law = LawDescription(ball_screw=SCREW)
    base = table().description
    second = JointDescription("ground", "table", law=law, free=("y", "z", "rx", "ry", "rz"), closes_loop=True)
    with pytest.raises(ToolpointError, match="closes a loop"):
        build(replace(base, joints={"second": second, "guide": base.joints["guide"]},
                      axes={"X": AxisDescription("second", "x")}))


BEARING = BearingDescription(((0, 0, -0.05), (0, 0, 0.05)), (1, -1), 20, 0.0087, 0.07, 400.0, np.deg2rad(15), follows="spin")


def spindle(bearing=BEARING, speed=1000.0):
    form = ShapeDescription("cylinder", diameter=0.06, length=0.35)
    shaft = BodyDescription(mass=8.0, shape=form, spin=SpinDescription(speed))
    joint = JointDescription("ground", "shaft", law=LawDescription(bearing=bearing), stiffness={"rz": 1e3})
    return build(MachineDescription("spindle", {"shaft": shaft}, {"bearings": joint},
                                    points={"tool": PointDescription("shaft")}))


def test_bearings_take_the_speed_of_their_shaft():
    rpm = 20000.0
    machine = spindle(speed=rpm * np.pi / 30)
    given = spindle(replace(BEARING, follows="", speed=rpm), rpm * np.pi / 30)
    assert machine.joints[0].stiffness == pytest.approx(given.joints[0].stiffness, rel=1e-12)
    assert machine.joints[0].stiffness[0, 0] < spindle(speed=10.0).joints[0].stiffness[0, 0]


def test_a_campbell_diagram_carries_the_softening():
    speeds = np.array([100.0, 24000.0])
    follows = map_speeds(spindle(), speeds, 6)
    stands = map_speeds(spindle(replace(BEARING, follows="", speed=100.0)), speeds, 6)
    assert follows.frequency[0] == pytest.approx(stands.frequency[0], rel=1e-4)
    alone = map_speeds(spindle(replace(BEARING, follows="", speed=24000.0)), speeds, 6)
    assert follows.frequency[1] == pytest.approx(alone.frequency[1], rel=1e-12)
    assert (follows.frequency[1] < stands.frequency[1] * (1 - 1e-3)).any()


def test_a_bearing_that_follows_nothing_is_refused():
    machine = spindle().description
    still = replace(machine, bodies={"shaft": replace(machine.bodies["shaft"], spin=None)})
    with pytest.raises(ToolpointError, match=r"joints.bearings.law.bearing.follows: 'spin', but neither body spins"):
        build(still)
    with pytest.raises(ToolpointError, match="beside follows: spin"):
        spindle(replace(BEARING, speed=3000.0))


def test_laws_that_stand_still_are_doubted():
    assert not question_laws(table())
    assert not question_laws(spindle())
    assert "follows: away" in str(question_laws(table(replace(SCREW, follows="")))[0])
    assert "follows: spin" in str(question_laws(spindle(replace(BEARING, follows="")))[0])
