"""Servo loops under the joints along a path: closed forms, energy, stiff loops, coupled axes, drive files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.cutting.description import CuttingDescription
from toolpoint.io.yaml import drive_file, machine_file
from toolpoint.machine import build
from toolpoint.machine import description as d
from toolpoint.studies.accuracy.joint_servos import JointServo, servos_of
from toolpoint.studies.accuracy.milling_accuracy import MillingSetup, mill_side
from toolpoint.studies.accuracy.moving_structure import ToolStance, structure_along
from toolpoint.studies.accuracy.tool_paths import line
from toolpoint.vibration.simulation.varying import VaryingSystem, reduce_system

MACHINES = Path(__file__).resolve().parents[2] / "src/toolpoint/app/machines"
CUT = CuttingDescription.of(diameter=0.006, teeth=2, tangential=1780e6, normal=593e6, direction="slot", feed_per_tooth=1e-5)
SETUP = MillingSetup(15000, 0.5e-3, window=0.1, halved=False)
PATH = line([0, 0, 0], [0.02, 0, 0])[0]
MASS, K, C = 8.0, 4e5, 60.0
SAMPLED = JointServo(position=40.0, velocity=0.8, integral=30.0, inertia=2e-4, travel=0.01 / (2 * np.pi))
SERVO = replace(SAMPLED, sample_time=1e-9)  # loops without delay
PROPORTIONAL = replace(SERVO, integral=0.0)


def slide(way="x"):
    """A slide driven along x through a spring, on a spring along y too."""
    body = d.BodyDescription(mass=MASS, inertia=d.InertiaDescription(1, 1, 1))
    joint = d.JointDescription("ground", "slide", stiffness={"x": K, "y": 3 * K}, damping={"x": C, "y": C})
    return build(d.MachineDescription("slide", {"slide": body}, {"guide": joint}, {"X": d.AxisDescription("guide", way)},
                                      {"tip": d.PointDescription("slide")}, tool="tip", cutting=CUT))


@pytest.mark.parametrize("way", ["x", "-x"])
def test_slide_and_rotor_are_two_masses(way):
    system = structure_along(slide(way), PATH, ToolStance(), spacing=5e-3, servos={"X": PROPORTIONAL}).system
    assert system.size == 3
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(system.mass[0], system.stiffness[0])).real)
    rotor, loop = SERVO.inertia / SERVO.travel**2, 0.8 * 40 / SERVO.travel**2
    a, b = K / MASS + (K + loop) / rotor, K * loop / (MASS * rotor)
    pair = (a + np.array([-1, 1]) * np.sqrt(a**2 - 4 * b)) / 2
    assert np.allclose(squares, np.sort([*pair, 3 * K / MASS]), rtol=1e-9)
    assert system.stiffness[0][0, 2] == pytest.approx(K if way == "-x" else -K)
    # At rest the springs are in series.
    give = np.linalg.solve(system.stiffness[0], system.input_map[0][:, 0])
    assert system.output_map[0, 0] @ give == pytest.approx(1 / K + 1 / loop)


def test_the_integral_part_is_that_of_the_cascade():
    r"""Pole of the loops: det of [m s^2 + c s + k, -(c s + k); ., J s^2 + K_v s + K_v K_p + K_i + K_i K_p / s + c s + k]."""
    system = structure_along(slide(), PATH, ToolStance(), spacing=5e-3, servos={"X": SERVO}).system
    assert system.size == 4
    n, mass = system.size, system.mass[0]
    first = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, system.stiffness[0]),
                                                    -np.linalg.solve(mass, system.damping[0])]])
    poles = np.linalg.eigvals(first)
    slide_, spring = np.array([MASS, C, K]), np.array([C, K])
    rotor = np.array([SERVO.inertia, 0.8, 0.8 * 40 + 30, 30 * 40]) / SERVO.travel**2  # times s
    coupled = np.polymul([1, 0], spring)
    whole = np.polysub(np.polymul(slide_, np.polyadd(rotor, coupled)), np.polymul(coupled, spring))
    expected = np.roots(whole)
    assert all(np.abs(poles / root - 1).min() < 1e-5 for root in expected)
    # It holds a steady load as a clamp does.
    give = np.linalg.solve(system.stiffness[0], system.input_map[0][:, 0])
    assert system.output_map[0, 0] @ give == pytest.approx(1 / K)


def first_order(system):
    n, mass = system.size, system.mass[0]
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, system.stiffness[0]),
                                                    -np.linalg.solve(mass, system.damping[0])]])


@pytest.mark.parametrize("integral", [0.0, 30.0])
@pytest.mark.parametrize("times", [(1e-3, 0.0), (1e-3, 2.5e-4), (1e-9, 2.5e-4)])
def test_poles_of_sampled_loops_are_those_of_the_delay_equation(times, integral):
    r"""J s^2 + e^{-s t1} (K_v s + K_i + e^{-s t2} K_p (K_v + K_i/s)) on the rotor, exact delays: solved by Newton's method.

    Of the integral's own filter, half a sample time, the equation has the same.
    """
    servo = replace(SAMPLED, sample_time=times[0], velocity_sample_time=times[1], integral=integral)
    first, second = (1.5 * time if time > 1e-6 else 0.0 for time in times[::-1])
    system = structure_along(slide(), PATH, ToolStance(), spacing=5e-3, servos={"X": servo}).system
    assert system.size == 3 + sum(delay > 0 for delay in (first, second)) + (integral > 0)

    def characteristic(s):
        early, late = np.exp(-s * first), np.exp(-s * (first + second))
        slow = s * (1 + s * times[0] / 2)
        loop = servo.inertia * s**2 + early * (0.8 * s + integral) + late * 40 * (0.8 + integral / slow)
        spring = C * s + K
        return (MASS * s**2 + spring) * (loop / servo.travel**2 + spring) - spring**2

    checked = 0
    for pole in np.linalg.eigvals(first_order(system)):
        if not 1.0 < abs(pole) < 1.2 / max(first + second, 1e-9) or abs(pole) > 3e3:
            continue
        if abs(pole.imag) < 1e-6 or abs(abs(pole.imag) - np.sqrt(3 * K / MASS)) < 1.0:
            continue  # y, and real ones beside the branch of the logarithm
        s = pole
        for _ in range(60):
            slope = (characteristic(s * (1 + 1e-6)) - characteristic(s)) / (1e-6 * s)
            s = s - characteristic(s) / slope
        assert abs(s / pole - 1) < 1e-4
        checked += 1
    assert checked >= 2
    # Delays change nothing at rest, and much at the loop's resonance.
    give = np.linalg.solve(system.stiffness[0], system.input_map[0][:, 0])
    assert system.output_map[0, 0] @ give == pytest.approx(1 / K if integral else 1 / K + servo.travel**2 / 32)


def test_a_slow_sampled_loop_is_unstable_where_the_delay_equation_is():
    """Without it the same loop is stable: gain times delay above pi/2."""
    fast = replace(SAMPLED, integral=0.0, position=400.0, velocity=8.0, inertia=1e-3)
    for times, stable in (((1e-9, 0.0), True), ((5e-3, 0.0), False)):
        servo = replace(fast, sample_time=times[0], velocity_sample_time=times[1])
        poles = np.linalg.eigvals(first_order(structure_along(slide(), PATH, ToolStance(), spacing=5e-3,
                                                              servos={"X": servo}).system))
        assert bool(poles.real.max() < 0) == stable


def test_many_coordinates_are_reduced_and_the_motors_kept():
    rng, n, nodes = np.random.default_rng(2), 90, 5
    root = rng.normal(size=(n, n))
    stiffness = 1e5 * np.eye(n) + 1e3 * root @ root.T
    mass = np.diag(np.r_[np.ones(n - 2), 0.3, 0.3])
    stiffness[-1, :-2] = stiffness[:-2, -1] = 0
    stiffness[-2, -1], stiffness[-1, -2], stiffness[-1, -1] = 500.0, -1.0, 0.0  # an integral
    same = [np.repeat(a[None], nodes, 0) for a in (mass, 1e-5 * stiffness + 3 * mass, stiffness, rng.normal(size=(n, 3)),
                                                   rng.normal(size=(6, n)))]
    same[3][:, -2:] = 0
    whole = VaryingSystem(np.arange(nodes) * 1e-3, *same, np.zeros((nodes, 6, n)))
    small = reduce_system(whole, kept_count=2)
    assert small.size < n - 20
    answers = [s.output_map[0] @ np.linalg.solve(s.stiffness[0] + 20j * s.damping[0] - 400 * s.mass[0], s.input_map[0])
               for s in (whole, small)]
    assert np.allclose(answers[0], answers[1], atol=1e-3 * np.abs(answers[0]).max())


@pytest.mark.slow
def test_energy_balances_and_stiff_loops_change_nothing():
    """Teeth pass at 40 Hz, near the slide's 36 Hz: far above it mass alone would count, and no servo."""
    slow = replace(SETUP, speed=1200, window=0.5)
    result = mill_side(slide(), PATH, replace(slow, servos={"X": PROPORTIONAL}, with_energy=True))
    assert result.energy.gap < 1e-6 and "servo loops of X" in result.notes[-1]
    with pytest.raises(ToolpointError, match="with_energy: servos with an integral part or sampled loops"):
        mill_side(slide(), PATH, replace(slow, servos={"X": SERVO}, with_energy=True))
    plain = mill_side(slide(), PATH, slow)
    assert abs(result.position_error / plain.position_error - 1) > 1e-3
    stiff = replace(SERVO, position=1e6, velocity=1e3)
    held = mill_side(slide(), PATH, replace(slow, servos={"X": stiff}))
    assert held.position_error == pytest.approx(plain.position_error, rel=1e-4)


def test_the_path_s_inertia_acts_on_the_rotor():
    loads = ("cutting", "path")
    system = structure_along(slide(), PATH, ToolStance(), spacing=5e-3, loads=loads, servos={"X": SERVO}).system
    assert np.allclose(system.input_map[:, 2, -1], -SERVO.mass) and np.allclose(system.input_map[:, 2, -2], 0, atol=1e-6)


def test_coupled_joints_of_an_arm_feel_both_motors():
    robot = machine_file.read(MACHINES / "milling_robot.yaml")
    servo = JointServo(30.0, 0.02, 0.0, 3e-5, 1 / 100, sample_time=1e-9)
    side = line([0.69, -0.01, 0.1], [0.69, 0.01, 0.1])[0]
    bare = structure_along(robot, side, ToolStance(), spacing=5e-3).system
    system = structure_along(robot, side, ToolStance(), spacing=5e-3, servos={"q2": servo, "q3": servo}).system
    assert system.size == bare.size + 2
    k2, k3 = (robot.description.joints[f"joint_q{i}"].stiffness["rz"] for i in (2, 3))
    block = system.stiffness[0][-2:, -2:]
    assert np.allclose(block, [[k2 + k3 + servo.stiffness, k3], [k3, k3 + servo.stiffness]])
    assert np.linalg.eigvalsh(system.stiffness[0]).min() > 0


def test_servos_of_a_drive_file():
    drives = drive_file.read(MACHINES / "three_axis_vertical_servo.yaml")
    name = next(iter(drives.axes))
    drive = replace(drives.axes[name], mechanics=replace(drives.axes[name].mechanics, inertia=0.01))
    servo = servos_of(replace(drives, axes={"X": drive}), slide())["X"]
    assert servo.travel == pytest.approx(drive.mechanics.lead / (2 * np.pi)) and servo.position == drive.position.gain
    assert servo.integral == pytest.approx(drive.velocity.gain / drive.velocity.integral_time)
    with pytest.raises(ToolpointError, match=r"drives: Q; must share an axis with the machine \(X\)"):
        servos_of(replace(drives, axes={"Q": drive}), slide())


def test_what_has_no_servo_is_refused():
    with pytest.raises(ToolpointError, match="servos: 'Q'; must be axes of the machine: X"):
        mill_side(slide(), PATH, replace(SETUP, servos={"Q": SERVO}))
    stiff = slide().description
    joint = replace(stiff.joints["guide"], stiffness={"y": K}, damping={"y": C})
    locked = build(replace(stiff, joints={"guide": joint}))
    with pytest.raises(ToolpointError, match=r"servos: X: guide.x is locked; must be elastic there"):
        mill_side(locked, PATH, replace(SETUP, servos={"X": SERVO}))
