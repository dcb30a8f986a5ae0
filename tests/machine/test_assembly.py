"""Assembly: invariance, energies, relative motion, parameters by path and their exact derivatives."""

import numpy as np
import pytest

from toolpoint.joints import linear
from toolpoint.machine import assemble, build
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
    parameters,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.vibration import eigen, sensitivity
from toolpoint.vibration import frequency_response as fr

SIX = {"x": 2e7, "y": 3e7, "z": 4e7, "rx": 5e5, "ry": 6e5, "rz": 7e5}


def angles(r):
    return np.arctan2(r[1, 0], r[0, 0]), -np.arcsin(r[2, 0]), np.arctan2(r[2, 1], r[2, 2])


def two_bodies(move=None, **joint):
    """A column and a head, the whole machine carried to another place by `move`."""
    t = np.eye(4) if move is None else move

    def frame(at):
        placed_at = t @ tf.transform(None, at)
        return FrameDescription(tuple(placed_at[:3, 3]), tuple(map(float, angles(placed_at[:3, :3]))))

    def body(mass, at, size):
        return BodyDescription(mass=mass, shape=ShapeDescription("box", size=size), frame=frame(at))
    return MachineDescription(
        "two", {"column": body(800.0, (0, 0, 1), (0.6, 0.5, 2)), "head": body(200.0, (0.5, 0, 1.5), (0.4, 0.3, 0.6))},
        {"foot": JointDescription("ground", "column", frame((0, 0, 0)), SIX, **joint),
         "guide": JointDescription("column", "head", frame((0.3, 0, 1.5)), {k: v / 2 for k, v in SIX.items()})},
        {"Z": AxisDescription("guide", "z", (-0.5, 0.5)), "B": AxisDescription("guide", "ry")},
        {"tool": PointDescription("head", (0.3, 0, -0.4)), "top": PointDescription("column", (0, 0, 1.0))})


def test_frequencies_and_responses_do_not_depend_on_the_machine_frame():
    move = tf.exponential([0.7, -1.2, 0.4, 0.5, -0.3, 0.8])
    here, there = (assemble(build(d), {"Z": 0.2, "B": 0.3}) for d in (two_bodies(), two_bodies(move)))
    np.testing.assert_allclose(eigen.solve_undamped(here).frequency, eigen.solve_undamped(there).frequency, rtol=1e-9)
    f = np.linspace(5, 90, 9)
    r = move[:3, :3]
    h, g = (fr.direct(s, f).values[:, :3, :3] for s in (here, there))
    np.testing.assert_allclose(g, r @ h @ r.T, atol=1e-9 * np.abs(h).max())


def test_mass_matrix_is_the_kinetic_energy_of_finite_differences():
    machine = build(two_bodies())
    place = place_machine(machine, {"Z": 0.1, "B": 0.4})
    rate = np.random.default_rng(0).normal(size=machine.size)
    system = assemble(machine, {"Z": 0.1, "B": 0.4})
    energy = 0.0
    for i, body in enumerate(machine.bodies):
        twist = tf.adjoint(tf.inverse(place.frames[0, i])) @ place.jacobians[0, i] @ rate
        energy += twist @ body.mass @ twist / 2
    assert rate @ system.mass @ rate / 2 == pytest.approx(energy, rel=1e-12)


def test_axis_jacobian_is_the_derivative_of_the_forward_kinematics():
    machine = build(two_bodies())
    pose, h = {"Z": 0.1, "B": 0.4}, 1e-6
    jacobian = machine.chain.jacobian(pose, 1, (0.8, 0, 1.1))[0]
    for k, name in enumerate(("Z", "B")):
        there, back = (tf.move(machine.chain.displacements({**pose, name: pose[name] + s * h})[0, 1],
                                np.array([[0.8, 0, 1.1]]))[0] for s in (1, -1))
        np.testing.assert_allclose(jacobian[:3, k], (there - back) / (2 * h), atol=1e-8)


def test_springs_ride_with_the_child_or_stay_with_the_parent():
    base = two_bodies()
    fixed = JointDescription("column", "head", base.joints["guide"].frame, base.joints["guide"].stiffness, elastic_at="parent")
    stay = MachineDescription(base.name, base.bodies, {**base.joints, "guide": fixed}, base.axes, base.points)
    home = [eigen.solve_undamped(assemble(build(d), {"Z": 0.0})).frequency for d in (base, stay)]
    away = [eigen.solve_undamped(assemble(build(d), {"Z": 0.4})).frequency for d in (base, stay)]
    np.testing.assert_allclose(home[0], home[1], rtol=1e-12)
    assert np.abs(away[0] / away[1] - 1).max() > 1e-3


def test_relative_points_are_differences():
    machine = build(two_bodies())
    f = np.linspace(5, 90, 5)
    both = fr.direct(assemble(machine, outputs=["tool:+x", "top:+x"]), f).values
    relative = fr.direct(assemble(machine, outputs=["tool-top:+x"]), f).values[:, 0, 0]
    t = np.array([1, -1])
    np.testing.assert_allclose(relative, t @ both @ t, rtol=1e-9)


def test_full_stiffness_matrix_equals_the_same_values_by_direction():
    base = two_bodies()
    matrix = tuple(map(tuple, np.diag(list(SIX.values()))))
    full = MachineDescription(base.name, base.bodies, {**base.joints, "foot": JointDescription(
        "ground", "column", base.joints["foot"].frame, stiffness_matrix=matrix)}, base.axes, base.points)
    np.testing.assert_allclose(assemble(build(full)).stiffness, assemble(build(base)).stiffness)


def test_loss_factor_and_dampers_enter_their_matrices():
    machine = build(two_bodies(loss_factor=0.1, damping={"x": 300.0}))
    system = assemble(machine)
    np.testing.assert_allclose(system.structural_damping[:6, :6], 0.1 * system.stiffness[:6, :6])
    assert system.damping[0, 0] == 300.0
    with pytest.raises(ValueError, match="locked"):
        linear({"x": 1e6}, damping={"y": 3.0})


PATHS = ["joints.foot.stiffness.rx", "joints.guide.stiffness.z", "bodies.column.mass", "bodies.head.shape.size.2",
         "bodies.head.centre.0"]


@pytest.mark.parametrize("path", PATHS)
def test_exact_derivatives_against_differences(path):
    machine = build(two_bodies())
    poses = {"Z": np.array([0.0, 0.3]), "B": np.array([0.2, -0.4])}
    slopes = sensitivity.frequencies(assemble(machine, poses), matrix_derivatives(machine, [path], poses))[:, 0]
    value = machine.value(path)
    h = 1e-3 * (abs(value) or 0.1)

    def at(x):
        return eigen.solve_undamped(assemble(machine.with_values({path: x}), poses)).frequency
    expected = (8 * (at(value + h) - at(value - h)) - (at(value + 2 * h) - at(value - 2 * h))) / (12 * h)
    np.testing.assert_allclose(slopes, expected, atol=1e-6 * np.abs(expected).max())


def test_derivative_paths_that_are_not_there_say_what_is():
    machine = build(two_bodies())
    with pytest.raises(ValueError, match="did you mean 'foot'"):
        matrix_derivatives(machine, ["joints.fot.stiffness.rx"])
    with pytest.raises(ValueError, match="no exact derivative"):
        matrix_derivatives(machine, ["joints.foot.frame.at.0"])
    assert "bodies.column.mass" in set(parameters(machine.description))
    with pytest.raises(ValueError, match="not a number"):
        machine.with_values({"joints.foot.parent": 3.0})


@pytest.mark.parametrize(("pose", "message"), [
    ({"Z": 0.9}, "within -0.5 .. 0.5"), ({"Q": 0.0}, "no axis"), ({"Z": np.array([0.0, np.nan])}, "finite"),
    ({"Z": np.zeros(3), "B": np.zeros(2)}, "same number")])
def test_poses_that_cannot_be_are_refused(pose, message):
    with pytest.raises(ValueError, match=message):
        assemble(build(two_bodies()), pose)


def test_compiled_path_refuses_what_it_cannot_do():
    description = two_bodies()
    loose = build(MachineDescription(description.name, description.bodies, {**description.joints, "foot": JointDescription(
        "ground", "column", free=("x",))}, description.axes, description.points))
    with pytest.raises(ValueError, match="path='numpy'"):
        natural_frequencies(loose, {"Z": np.zeros(2)}, path="compiled")
    assert natural_frequencies(loose, {"Z": np.zeros(2)})[0, 0] == pytest.approx(0, abs=1e-6)


def test_paths_agree_with_a_full_stiffness_matrix():
    base = two_bodies()
    a = np.random.default_rng(0).normal(size=(6, 6))
    matrix = tuple(map(tuple, np.diag(list(SIX.values())) + 1e4 * a @ a.T))
    full = build(MachineDescription(base.name, base.bodies, {**base.joints, "foot": JointDescription(
        "ground", "column", base.joints["foot"].frame, stiffness_matrix=matrix)}, base.axes, base.points))
    poses = {"Z": np.linspace(-0.5, 0.5, 65)}
    expected = eigen.solve_undamped(assemble(full, poses), 6).frequency
    for path in ("numpy", "compiled"):
        np.testing.assert_allclose(natural_frequencies(full, poses, 6, path=path), expected, rtol=1e-9)


def test_turned_joint_frames_turn_the_stiffness():
    # One body on one joint: turning the joint frame by R turns the translational stiffness to R K R^T.
    r = rotation.from_euler("zyx", (0.3, -0.4, 0.6))
    body = BodyDescription(mass=1.0, shape=ShapeDescription("sphere", diameter=0.2))
    machine = build(MachineDescription("one", {"b": body}, {"j": JointDescription(
        "ground", "b", FrameDescription(rotation=(0.3, -0.4, 0.6)), {"x": 1e4, "y": 2e4, "z": 3e4})},
        points={"p": PointDescription("b")}))
    flexibility = fr.direct(assemble(machine), [0.0]).values[0].real
    np.testing.assert_allclose(np.linalg.inv(flexibility), r @ np.diag([1e4, 2e4, 3e4]) @ r.T, rtol=1e-9, atol=1e-6)


def test_derivatives_of_dampers_and_loss_factors_are_the_matrices_they_scale():
    machine = build(two_bodies(damping={"x": 300.0, "rz": 50.0}, loss_factor=0.04))
    paths = ["joints.foot.damping.x", "joints.foot.loss_factor", "joints.foot.stiffness.rz"]
    found = matrix_derivatives(machine, paths)
    system = assemble(machine)
    unit = np.zeros((machine.size, machine.size))
    unit[0, 0] = 1.0
    np.testing.assert_allclose(found.damping[0], unit, atol=1e-12)
    expected = np.zeros_like(unit)
    expected[:6, :6] = system.stiffness[:6, :6]
    np.testing.assert_allclose(found.structural_damping[1], expected, rtol=1e-9, atol=1e-3)
    assert found.stiffness[2, 5, 5] == pytest.approx(1.0)
    assert found.structural_damping[2, 5, 5] == pytest.approx(0.04)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.3, -0.5, 0.8)])
def test_derivatives_to_the_inertia_of_a_flat_plate(turn):
    """Izz = Ixx + Iyy leaves no room for a difference; the mass matrix is linear and homogeneous in mass and tensor (Euler)."""
    tensor = rotation.from_euler("zyx", turn) @ np.diag([2.0, 3.0, 5.0]) @ rotation.from_euler("zyx", turn).T
    entries = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    plate = BodyDescription(mass=40.0, centre=(0.1, 0.2, -0.3), frame=FrameDescription((0.4, 0.0, 0.2), (0.2, 0.1, -0.3)),
                            inertia=InertiaDescription(**{name: float(tensor[at]) for name, at in entries.items()}))
    machine = build(MachineDescription("plate", {"plate": plate}, {"foot": JointDescription(
        "ground", "plate", FrameDescription((0.0, 0.1, 0.0), (0.5, 0.0, 0.0)), SIX)},
        points={"edge": PointDescription("plate")}))
    paths = ["bodies.plate.mass", *(f"bodies.plate.inertia.{name}" for name in entries)]
    slopes = matrix_derivatives(machine, paths).mass
    values = np.array([machine.value(path) for path in paths])
    np.testing.assert_allclose(np.tensordot(values, slopes, 1), assemble(machine).mass, rtol=1e-9, atol=1e-9)
    for slope, at in zip(slopes[1:], entries.values(), strict=True):
        # One moment of inertia adds one square, a product of inertia a difference of two.
        assert np.linalg.matrix_rank(slope, tol=1e-9) == (1 if at[0] == at[1] else 2)
