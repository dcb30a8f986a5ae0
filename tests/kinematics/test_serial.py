"""Serial arms: tables against chains, closed-form inverse with all branches, numeric inverse, five axes, rigid dynamics."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import elastic_robot
import parallel_machines
from serial_arms import arm_forward
from toolpoint import ToolpointError
from toolpoint.kinematics import Axis, Drive, TreeChain
from toolpoint.kinematics.arms.denavit_hartenberg import ArmRow, arm_chain, arm_frames
from toolpoint.kinematics.arms.inverse import ToolOnWork, solve_all_inverse, solve_inverse, tool_on_work
from toolpoint.kinematics.arms.spherical_wrist import SphericalWrist, move_tool
from toolpoint.machine.assembly.inverse_dynamics import axis_mass_matrix, gravity_force, inverse_dynamics
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf

# Published table of a milling robot (P5): axis 3 turns with axis 2 too.
TABLE = [("q1", 0, 0, 0.15, -90, {}), ("q2", -90, 0, 0.25, 180, {}), ("q3", 0, 0, 0.075, -90, {"q2": 1.0}),
         ("q4", 0, -0.29, 0, 90, {}), ("q5", 0, 0, 0, -90, {}), ("q6", 0, -0.08, 0, 180, {})]


def rows(coupled=True, lower=-np.inf, upper=np.inf):
    return [ArmRow(axis, np.radians(theta), d, a, np.radians(alpha), coupled=more if coupled else {}, lower=lower, upper=upper)
            for axis, theta, d, a, alpha, more in TABLE]


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("coupled", [True, False])
def test_chain_of_a_table_is_the_product_of_its_rows(convention, coupled):
    table, q = rows(coupled), np.random.default_rng(0).uniform(-3, 3, (50, 6))
    chain = arm_chain(table, convention)
    moved = chain.displacements({f"q{i + 1}": q[:, i] for i in range(6)})[:, 5]
    expected = arm_forward(table, q, convention)
    np.testing.assert_allclose(moved @ arm_frames(table, convention)[1][-1], expected, atol=1e-13)


def test_modified_table_of_a_planar_arm():
    """Craig, 3rd ed., example 3.3: three turning joints with links 1 and 2; the last frame sits at the third joint."""
    table = [ArmRow("a"), ArmRow("b", a=0.5), ArmRow("c", a=0.3)]
    angle = np.radians([20.0, 30.0, -10.0])
    place = arm_forward(table, angle, "modified")
    x = 0.5 * np.cos(angle[0]) + 0.3 * np.cos(angle[:2].sum())
    y = 0.5 * np.sin(angle[0]) + 0.3 * np.sin(angle[:2].sum())
    np.testing.assert_allclose(place[:3, 3], [x, y, 0], atol=1e-15)
    np.testing.assert_allclose(place[:3, :3], rot.about("z", angle.sum()), atol=1e-15)


def check_branches(count, seed):
    arm, rng = SphericalWrist.of(arm_chain(rows())), np.random.default_rng(seed)
    numbers = set()
    for q in rng.uniform(-3, 3, (count, 6)):
        goal = arm.forward(q)
        branches = arm.inverse(goal)
        assert len({branch.name for branch in branches}) == len(branches)
        reached = arm.forward(np.array([branch.positions for branch in branches]))
        np.testing.assert_allclose(reached, np.broadcast_to(goal, reached.shape), atol=1e-9)
        apart = [np.abs(np.angle(np.exp(1j * (branch.positions - q)))).max() for branch in branches]
        assert min(apart) < 1e-8
        numbers.add(len(branches))
    assert numbers == {4, 8}


def test_every_branch_of_the_closed_form_reaches_the_target():
    check_branches(150, 0)


@pytest.mark.slow
def test_closed_form_at_ten_thousand_poses():
    check_branches(10_000, 1)


def test_branches_say_where_the_wrist_is_singular_and_what_is_beyond_limits():
    arm = SphericalWrist.of(arm_chain(rows(lower=-1.5, upper=1.5)))
    goal = arm.forward(np.array([0.3, 0.4, -0.2, 0.0, 0.0, 0.7]))
    branches = arm.inverse(goal)
    assert all("arbitrary" in branch.note for branch in branches if branch.name.endswith("no flip")
               and branch.name.startswith("front up"))
    assert {branch.within_limits for branch in branches} == {True, False}
    assert arm.inverse(move_tool(tf.transform(None, [9.0, 0, 0]), np.eye(4))) == []


def test_arms_without_a_spherical_wrist_are_refused_with_the_other_way():
    table = rows()
    table[4] = ArmRow("q5", d=0.05, alpha=table[4].alpha)
    with pytest.raises(ValueError, match=r"miss each other by .*solve_inverse"):
        SphericalWrist.of(arm_chain(table))


@pytest.mark.parametrize(("row", "message"), [
    (lambda: ArmRow("q", theta=-90.0), "did you mean -90 deg"), (lambda: ArmRow("q", d=np.nan), "must be finite")])
def test_angles_in_degrees_and_missing_numbers_are_refused(row, message):
    with pytest.raises(ValueError, match=message):
        row()


def test_two_axes_that_drive_one_direction_alike_are_refused():
    with pytest.raises(ValueError, match="A and B both drive direction rz"):
        TreeChain((-1,), np.eye(4)[None], (Axis("A", (Drive(0, "rz"),)), Axis("B", (Drive(0, "-rz"),))))


@pytest.mark.slow
def test_numeric_inverse_finds_the_closed_form_solution_near_its_start():
    chain = arm_chain(rows(lower=-3.0, upper=3.0))
    reference = arm_frames(rows())[1][-1]
    pair = ToolOnWork(5, reference[:3, 3], reference[:3, 2])
    rng = np.random.default_rng(4)
    for q in rng.uniform(-1.0, 1.0, (4, 6)) + np.array([0, 0, 0, 0, 1.2, 0]):
        pose = {f"q{i + 1}": v for i, v in enumerate(q)}
        tip, direction = (v[0] for v in tool_on_work(chain, pose, pair))
        near = {name: v + 0.05 for name, v in pose.items()}
        free = solve_inverse(chain, pair, tip, direction=direction, start=near)
        assert free.is_reached, free.status
        tip_again, direction_again = (v[0] for v in tool_on_work(chain, free.pose, pair))
        np.testing.assert_allclose(tip_again, tip, atol=1e-9)
        np.testing.assert_allclose(direction_again, direction, atol=1e-9)
    far = solve_inverse(chain, pair, [3.0, 0, 0], direction=[0, 0, 1.0])
    assert not far.is_reached and "mm" in far.status and "start on another branch" in far.status


def five_axis():
    """Table on A (about x) and C (about z) on Y; tool on X and Z: a trunnion."""
    frames = np.array([np.eye(4), np.eye(4), np.eye(4), tf.transform(None, [0, 0, 0.1]), tf.transform(None, [0, 0, 0.15])])
    axes = (Axis("X", (Drive(0, "x"),), -0.5, 0.5), Axis("Z", (Drive(1, "z"),), -0.5, 0.5),
            Axis("Y", (Drive(2, "-y"),), -0.5, 0.5),
            Axis("A", (Drive(3, "-rx"),), -2.0, 2.0), Axis("C", (Drive(4, "-rz"),), -3.2, 3.2))
    chain = TreeChain((-1, 0, -1, 2, 3), frames, axes)
    return chain, ToolOnWork(1, np.array([0.0, 0, 0.5]), np.array([0, 0, 1.0]), 4, np.array([0.0, 0, 0.2]))


def test_five_axis_machine_finds_both_ways_to_a_tilted_tool():
    chain, pair = five_axis()
    tip, direction = np.array([0.05, 0.03, 0.02]), np.array([0.3, -0.2, 0.9])
    direction /= np.linalg.norm(direction)
    solutions = solve_all_inverse(chain, pair, tip, direction=direction)
    assert len(solutions) == 2
    tilt = np.arccos(direction[2])
    assert sorted(round(s.pose["A"], 9) for s in solutions) == sorted([round(-tilt, 9), round(tilt, 9)])
    for solution in solutions:
        place, way = tool_on_work(chain, solution.pose, pair)
        np.testing.assert_allclose(place[0], tip, atol=1e-9)
        np.testing.assert_allclose(way[0], direction, atol=1e-9)


def test_mass_matrix_and_gravity_follow_from_energies():
    machine = elastic_robot.robot()
    rng = np.random.default_rng(5)
    q, h = rng.uniform(-2, 2, 6), 1e-5
    pose = {f"q{i + 1}": v for i, v in enumerate(q)}
    mass = axis_mass_matrix(machine, pose)[0]
    for k in range(6):
        unit = np.eye(6)[k]
        np.testing.assert_allclose(inverse_dynamics(machine, pose, np.zeros(6), acceleration=unit)[0], mass[:, k], atol=1e-10)
        ahead, back = (_potential(machine, {**pose, f"q{k + 1}": q[k] + s * h}) for s in (1, -1))
        assert gravity_force(machine, pose, [0, 0, -9.81])[0, k] == pytest.approx((ahead - back) / (2 * h), abs=1e-5)


def _potential(machine, pose):
    moved = machine.chain.displacements(pose)[0] @ machine.body_frames
    total = 0.0
    for frame, body in zip(moved, machine.bodies, strict=True):
        first = body.mass[3:6, :3] / body.mass[0, 0]
        centre = np.array([first[2, 1], first[0, 2], first[1, 0]])
        total += 9.81 * body.mass[0, 0] * tf.move(frame, centre[None])[0, 2]
    return total


@pytest.mark.parametrize("make", [elastic_robot.robot, lambda: parallel_machines.three_rps(limb_mass=5.0),
                                  parallel_machines.hexapod])
def test_power_of_the_axes_is_the_rate_of_the_kinetic_energy(make):
    machine = make()
    axes = machine.chain.driven_axes
    rng = np.random.default_rng(6)
    q = np.array([axis.reference_position for axis in axes]) + 0.004 * rng.normal(size=len(axes))
    qd, qdd = 0.3 * rng.normal(size=(2, len(axes)))

    def energy(t):
        at = q + qd * t + qdd * t**2 / 2
        rate = qd + qdd * t
        return rate @ axis_mass_matrix(machine, dict(zip((a.name for a in axes), at, strict=True)))[0] @ rate / 2
    h = 1e-4
    force = inverse_dynamics(machine, dict(zip((a.name for a in axes), q, strict=True)), qd, acceleration=qdd)[0]
    assert force @ qd == pytest.approx((energy(h) - energy(-h)) / (2 * h), rel=1e-5, abs=1e-8)


def pinocchio_robot():
    """The robot of B2 with its link inertias, rigid joints, in Pinocchio; its last frame is the flange."""
    pin = pytest.importorskip("pinocchio")
    model, parent, before = pin.Model(), 0, np.eye(4)
    for i in range(6):
        joint = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(before), f"q{i}")
        step = elastic_robot.link(*elastic_robot.LINKS[i])
        inertia = pin.Inertia(elastic_robot.MASSES[i], np.array(elastic_robot.CENTRES[i]), np.diag(elastic_robot.INERTIAS[i]))
        model.appendBodyToJoint(joint, inertia, pin.SE3(step))
        parent, before = joint, step
    return pin, model, parent, step


@pytest.mark.slow
def test_pinocchio_agrees_at_a_thousand_poses():
    pin, model, last, step = pinocchio_robot()
    machine, data = elastic_robot.robot(), model.createData()
    rng = np.random.default_rng(7)
    q, qd, qdd = rng.uniform(-3, 3, (3, 1000, 6))
    poses = {f"q{i + 1}": q[:, i] for i in range(6)}
    g = np.array([0, 0, -9.81])
    model.gravity.linear = g
    flange = machine.chain.displacements(poses)[:, 5] @ machine.body_frames[5]
    jacobian = machine.chain.jacobian(poses, 5, machine.body_frames[5][:3, 3])
    mass, weight = axis_mass_matrix(machine, poses), gravity_force(machine, poses, g)
    force = inverse_dynamics(machine, poses, qd, acceleration=qdd, gravity=g)
    for k in range(1000):
        pin.computeAllTerms(model, data, q[k], qd[k])
        place = data.oMi[last] * pin.SE3(step)
        np.testing.assert_allclose(flange[k], place.homogeneous, atol=1e-10)
        local = pin.getJointJacobian(model, data, last, pin.ReferenceFrame.LOCAL)
        world = pin.SE3(place.rotation, np.zeros(3)).toActionMatrix()
        np.testing.assert_allclose(jacobian[k], world @ pin.SE3(step).inverse().toActionMatrix() @ local, atol=1e-10)
        upper = pin.crba(model, data, q[k])
        np.testing.assert_allclose(mass[k], np.triu(upper) + np.triu(upper, 1).T, atol=1e-10)
        np.testing.assert_allclose(weight[k], pin.computeGeneralizedGravity(model, data, q[k]), atol=1e-10)
        torque = pin.rnea(model, data, q[k], qd[k], qdd[k])
        np.testing.assert_allclose(force[k], torque, atol=1e-10 * max(1.0, np.abs(torque).max()))


def test_turn_about_the_tool_is_the_redundancy_of_six_axes():
    chain = arm_chain(rows(lower=-3.0, upper=3.0))
    reference = arm_frames(rows())[1][-1]
    pair = ToolOnWork(5, reference[:3, 3], reference[:3, 2])
    pose = {"q1": 0.2, "q2": 0.3, "q3": -0.4, "q4": 0.5, "q5": 0.9, "q6": 0.1}
    tip, direction = (v[0] for v in tool_on_work(chain, pose, pair))
    turns = [solve_inverse(chain, pair, tip, direction=direction, turn=t, start=pose) for t in (0.0, 0.4)]
    assert all(s.is_reached for s in turns)
    frames = [chain.displacements(s.pose)[0, 5, :3, :3] for s in turns]
    angle = Rotation.from_matrix(frames[1] @ frames[0].T).as_rotvec()
    np.testing.assert_allclose(angle, 0.4 * direction, atol=1e-8)


@pytest.mark.slow
def test_all_branches_are_those_of_eaik():
    """The peer's closed form (EAIK 1.2, where installed) finds the same set of angles, no more and no less."""
    pytest.importorskip("eaik", reason="EAIK is not installed: pip install --no-deps eaik")
    dh = pytest.importorskip("eaik.IK_DH")
    table = rows(coupled=False)
    peer = dh.DhRobot(np.array([row.alpha for row in table]), np.array([row.a for row in table]),
                      np.array([row.d for row in table]))
    arm, offset = SphericalWrist.of(arm_chain(table)), np.array([row.theta for row in table])
    home, rng = arm_frames(table)[1][-1], np.random.default_rng(8)
    for q in rng.uniform(-3, 3, (300, 6)):
        goal = arm.forward(q)
        np.testing.assert_allclose(peer.fwdKin(q + offset), goal @ home, atol=1e-12)
        answer = peer.IK(goal @ home)  # among its answers are nearest ones that do not reach the target
        theirs = np.array(answer.Q)[~np.array(answer.is_LS)] - offset
        ours = np.array([branch.positions for branch in arm.inverse(goal)])
        apart = np.abs(np.angle(np.exp(1j * (ours[:, None] - theirs[None])))).max(axis=-1)
        assert apart.min(axis=1).max() < 1e-7 and apart.min(axis=0).max() < 1e-7, q


@pytest.mark.parametrize(("value", "words"), [
    (-0.6 + 5e-7, "-0.6 m, 0.5 µm beyond its travel; must be within -1.1 .. -0.6 m"),
    (-1.1 - 2e-8, "-1.1 m, 0.02 µm beyond its travel; must be within"), (-0.55, "-0.55 m; must be within")])
def test_position_just_beyond_its_travel_is_told_with_its_excess(value: float, words: str) -> None:
    """Rounding to the limit's own digits would refuse a position in the words that allow it."""
    with pytest.raises(ToolpointError, match=re.escape(words)):
        Axis("X", (Drive(0, "x"),), -1.1, -0.6).checked(np.array([value]))
