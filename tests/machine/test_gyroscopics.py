"""Spinning bodies: closed form of a rigid rotor, spin zero, responses, Campbell diagram, lobes with modes of every speed."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint.cutting import ZeroOrder
from toolpoint.machine import assemble, build
from toolpoint.machine.assembly.gyroscopics import run_at_speed
from toolpoint.machine.description import (
    BodyDescription,
    FrameDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
    SpinDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.spatial import rotation
from toolpoint.studies.machines.campbell import map_speeds
from toolpoint.studies.machines.tool_point import lobes, speed_dynamics, tool_point
from toolpoint.vibration import eigen, frequency_response

MASS, POLAR, ACROSS, SPRING, REACH = 4.0, 0.02, 0.03, 2e7, 0.1


def rotor(speed=100.0, turn=None, damping=None, **more):
    """A rigid symmetric rotor on two bearings at +-REACH along its axis: translation 2 k, tilting 2 k a^2."""
    r = np.eye(3) if turn is None else turn
    angles = rotation_angles(r)
    joint = JointDescription("ground", "rotor", FrameDescription((0.0, 0.0, 0.0), angles), {
        "x": 2 * SPRING, "y": 2 * SPRING, "z": 5e7, "rx": 2 * SPRING * REACH**2, "ry": 2 * SPRING * REACH**2, "rz": 1e5},
        damping or {})
    body = BodyDescription(MASS, inertia=InertiaDescription(ACROSS, ACROSS, POLAR), frame=FrameDescription(rotation=angles),
                           spin=SpinDescription(speed, tuple(map(float, r[:, 2]))))
    return build(MachineDescription("rotor", {"rotor": body}, {"bearings": joint}, points={
        "nose": PointDescription("rotor", (0.0, 0.0, -0.15))}, tool="nose", **more))


def rotation_angles(r):
    return (float(np.arctan2(r[1, 0], r[0, 0])), float(-np.arcsin(r[2, 0])), float(np.arctan2(r[2, 1], r[2, 2])))


@pytest.mark.parametrize("turn", [None, rotation.from_euler("zyx", (0.4, -0.3, 0.7))])
def test_rigid_rotor_on_two_springs(turn):
    """Id w^2 -+ Ip W w - k = 0 (Genta, Dynamics of Rotating Systems, chapter 4): forward and backward whirl at 20 speeds."""
    stiffness = 2 * SPRING * REACH**2
    for speed in np.linspace(200, 4000, 20):
        middle = POLAR * speed / (2 * ACROSS)
        root = np.sqrt(middle**2 + stiffness / ACROSS)
        slide = np.sqrt([2 * SPRING / MASS] * 2 + [5e7 / MASS] + [1e5 / POLAR])
        expected = np.sort([root - middle, root + middle, *slide]) / (2 * np.pi)
        found = natural_frequencies(rotor(speed, turn), {}, 6)[0]
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_spin_zero_is_the_plain_machine_to_the_last_bit():
    still, plain = rotor(0.0), rotor()
    plain = build(replace(plain.description, bodies={"rotor": replace(plain.description.bodies["rotor"], spin=None)}))
    first, second = (assemble(machine) for machine in (still, plain))
    for name in ("mass", "stiffness", "output_map"):
        assert np.array_equal(getattr(first, name), getattr(second, name))
    assert first.damping is None
    assert second.damping is None
    assert np.array_equal(natural_frequencies(still, {}, 6), natural_frequencies(plain, {}, 6))


def test_complex_modes_sum_up_to_the_direct_response():
    damping = {"x": 900.0, "y": 400.0, "z": 300.0, "rx": 9.0, "ry": 5.0, "rz": 1.0}
    system = assemble(rotor(2500.0, damping=damping))
    modes = eigen.solve_damped(system)
    f = np.linspace(50, 1500, 40)
    direct = frequency_response.direct(system, f).values
    np.testing.assert_allclose(frequency_response.modal(modes, f).values, direct, atol=1e-9 * np.abs(direct).max())
    # Gyroscopic coupling is not symmetric: G_xy and G_yx are opposite where bearings are alike.
    assert np.abs(direct[:, 0, 1] + direct[:, 1, 0]).max() < 0.2 * np.abs(direct[:, 0, 1]).max()


def test_gyroscopic_terms_do_no_work():
    system = assemble(rotor(3000.0))
    np.testing.assert_allclose(system.damping, -system.damping.T, atol=1e-12 * np.abs(system.damping).max())


def test_bodies_that_are_not_round_may_not_spin():
    machine = rotor()
    body = replace(machine.description.bodies["rotor"], inertia=InertiaDescription(0.03, 0.031, 0.02))
    with pytest.raises(ValueError, match="symmetric about the axis"):
        assemble(build(replace(machine.description, bodies={"rotor": body})))


def test_campbell_diagram_has_the_whirl_and_the_critical_speed():
    result = map_speeds(rotor(), np.linspace(0, 40000, 21), 6, orders=(1.0,))
    stiffness = 2 * SPRING * REACH**2
    tilting = np.isclose(result.frequency[0], np.sqrt(stiffness / ACROSS) / (2 * np.pi))
    assert tilting.sum() == 2
    assert set(result.whirl[-1]) >= {-1.0, 1.0}
    axial = np.isclose(result.frequency[-1], np.sqrt(5e7 / MASS) / (2 * np.pi))
    assert axial.sum() == 1
    assert (result.whirl[-1][axial] == 0).all()
    # Backward whirl falls, forward whirl rises; with Ip < Id both meet the line of unbalance.
    backward = [row for row in result.critical if row[3] == -1]
    omega = np.sqrt(stiffness / (ACROSS + POLAR))  # Id w^2 + Ip w^2 = k at w = W
    assert min(abs(row[1] - omega * 30 / np.pi) for row in backward) < 60  # rev/min; linear between the charted speeds
    with pytest.raises(ValueError, match="no body that spins"):
        map_speeds(build(replace(rotor().description, bodies={"rotor": replace(
            rotor().description.bodies["rotor"], spin=None)})), [0, 1000])


def test_lobes_take_the_modes_of_every_speed(vertical):
    cut = vertical.description.cutting.with_values({"speeds": (4000.0, 24000.0), "diameter": 0.02, "teeth": 3})
    machine = rotor(1000.0, damping_ratio=0.03, cutting=cut)
    speeds = np.array([6000.0, 20000.0])
    chart = lobes(tool_point(machine), speeds=speeds, method=ZeroOrder())[0]
    for i, speed in enumerate(speeds):
        single = lobes(tool_point(run_at_speed(machine, speed * np.pi / 30)), speeds=speeds[i:i + 1], method=ZeroOrder())[0]
        assert chart.limit[i] == pytest.approx(single.limit[0], rel=1e-9)
    still = build(replace(machine.description, bodies={"rotor": replace(machine.description.bodies["rotor"], spin=None)}))
    plain = lobes(tool_point(still), speeds=speeds, method=ZeroOrder())[0]
    assert abs(chart.limit[1] / plain.limit[1] - 1) > 1e-3
    assert speed_dynamics(still) is None
