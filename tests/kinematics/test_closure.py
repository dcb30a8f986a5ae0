"""Closed chains: against closed forms, exact Jacobians, assembly modes, gaps, limits, coordinates of the tool."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import parallel_machines
from toolpoint.io import read_machine
from toolpoint.kinematics.closure import Closure
from toolpoint.kinematics.loops import LoopClosure
from toolpoint.kinematics.singularity import nearest_singularity, pose_condition
from toolpoint.kinematics.three_rps import ThreeRps
from toolpoint.machine import build
from toolpoint.machine.description import AxisDescription
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.machine.pose.placement import place_machine
from toolpoint.spatial import transform as tf

HEAD = ThreeRps(0.35, 0.25)
TORN = """toolpoint: 1
name: gantry whose sides move apart
bodies:
  left: {mass: 300 kg, centre: [-1.2, 0, 1.2], shape: {kind: box, size: [0.2, 0.5, 1.2]}}
  right: {mass: 300 kg, centre: [1.2, 0, 1.2], shape: {kind: box, size: [0.2, 0.5, 1.2]}}
  bridge: {mass: 700 kg, centre: [0, 0, 1.9], shape: {kind: box, size: [2.6, 0.4, 0.4]}}
joints:
  guide_l: {parent: ground, child: left, at: [-1.2, 0, 0.6], stiffness: {y: 1.2e8, rx: 6e7, rz: 6e7}}
  guide_r: {parent: ground, child: right, at: [1.2, 0, 0.6], stiffness: {y: 1.2e8, rx: 6e7, rz: 6e7}}
  left_bridge: {parent: left, child: bridge, at: [-1.2, 0, 1.8], stiffness: {x: 9e8, y: 9e8, z: 9e8, rx: 8e7, ry: 8e7, rz: 8e7}}
  right_bridge: {parent: right, child: bridge, closes_loop: true, at: [1.2, 0, 1.8]}
axes:
  Y1: {joint: guide_l, direction: y, limits: "-1, 1 m"}
  Y2: {joint: guide_r, direction: y, limits: "-1, 1 m"}
"""


@pytest.fixture(scope="module")
def head():
    return parallel_machines.three_rps()


def random_poses(number, seed=0):
    rng = np.random.default_rng(seed)
    return {"Z": rng.uniform(0.7, 1.1, number), "tilt": np.radians(rng.uniform(0, 35, number)),
            "azimuth": rng.uniform(-np.pi, np.pi, number)}


def test_legs_and_parasitic_motion_of_the_reference_cases():
    """A7, A7b of the reference cases: base radius 350, platform 250 mm, z 0.9 m."""
    legs = HEAD.inverse(0.9, np.radians([20, 10]), np.radians([30, 0]))
    np.testing.assert_allclose(legs, [[0.83392857, 0.90473706, 0.98082372], [0.86308447, 0.92711487, 0.92711487]], atol=5e-9)
    aside = 1e3 * HEAD.parasitic(np.radians([20, 10]), np.radians([30, 0]))
    np.testing.assert_allclose(aside, [[-3.769211, 6.528465], [-1.899031, 0]], atol=5e-7)


def test_general_closure_equals_the_closed_form(head):
    poses = random_poses(2000)
    legs = HEAD.inverse(*poses.values())
    np.testing.assert_allclose(head.chain.positions(poses), legs, atol=1e-12)
    place = place_machine(head, {"Z": poses["Z"][:50], "tilt": poses["tilt"][:50], "azimuth": poses["azimuth"][:50]})
    aside = place.position(head.description.points["centre"])[:, :2]
    np.testing.assert_allclose(aside, HEAD.parasitic(poses["tilt"][:50], poses["azimuth"][:50]), atol=1e-12)


@pytest.mark.slow
def test_forward_undoes_inverse_at_ten_thousand_poses(head):
    poses = random_poses(10_000, 1)
    legs = HEAD.inverse(*poses.values())
    back = head.chain.coordinates({f"L{i + 1}": legs[:, i] for i in range(3)})
    for name in ("Z", "tilt"):
        np.testing.assert_allclose(back[name], poses[name], atol=1e-12)
    np.testing.assert_allclose(np.sin(poses["tilt"]) * (back["azimuth"] - poses["azimuth"]), 0, atol=1e-12)


def test_closed_form_forward_solution_has_the_pose_among_all_that_the_legs_allow():
    for z, tilt, azimuth in np.stack(list(random_poses(12, 2).values()), axis=-1):
        poses = HEAD.forward(HEAD.inverse(z, tilt, azimuth))
        assert np.abs(poses - [z, tilt, azimuth]).max(axis=1).min() < 1e-9
        for pose in poses:
            np.testing.assert_allclose(HEAD.inverse(*pose), HEAD.inverse(z, tilt, azimuth), atol=1e-9)


@pytest.mark.parametrize("free", [(), ("rx",), ("rz",), ("rx", "ry"), ("rz", "rx"), ("y", "rz"), ("rx", "ry", "rz")])
def test_rate_of_a_gap_is_its_derivative(free):
    rng = np.random.default_rng(3)
    place = tf.transform(Rotation.random(random_state=4).as_matrix(), rng.normal(size=3))
    loop = LoopClosure("loop", -1, 0, place, free)
    moved = tf.exponential(np.array([0.1, -0.2, 0.15, 0.3, -0.4, 0.2]))[None, None]
    base, relative = loop.relative(moved)
    twists, h = rng.normal(size=(4, 6)), 1e-6
    local = np.swapaxes(tf.adjoint(tf.inverse(base[0])) @ twists.T, 0, 1)
    rate = loop.gap_rate(relative, local[:, :3].T[None], local[:, 3:].T[None])[0]
    for k, twist in enumerate(twists):
        ahead, back = (loop.gap(loop.relative(tf.exponential(s * h * twist) @ moved)[1])[0] for s in (1, -1))
        np.testing.assert_allclose(rate[:, k], (ahead - back) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("make", [parallel_machines.three_rps, parallel_machines.hexapod, parallel_machines.three_prs])
def test_jacobians_against_differences(make):
    machine = make()
    chain = machine.chain
    legs = [axis.name for axis in chain.driven_axes]
    pose = {"Z": np.array([chain.axis("Z").reference_position + 0.03]), "tilt": np.array([0.2]), "azimuth": np.array([0.5])}
    at = dict(zip(legs, chain.positions(pose)[0], strict=True))
    link = machine.link("platform")
    point = np.array([0.05, 0.02, chain.axis("Z").reference_position])
    jacobian, h = chain.jacobian(at, link, point)[0], 1e-6
    for k, name in enumerate(legs):
        ahead, back = (chain.displacements({**at, name: at[name] + s * h})[0, link] for s in (1, -1))
        slide = (tf.move(ahead, point[None]) - tf.move(back, point[None]))[0] / (2 * h)
        turn = Rotation.from_matrix(ahead[:3, :3] @ back[:3, :3].T).as_rotvec() / (2 * h)
        np.testing.assert_allclose(jacobian[:, k], [*slide, *turn], atol=2e-8)


def test_equations_with_a_task_have_exact_derivatives(head):
    chain = head.chain
    closure, values = Closure(chain, chain.task), np.array(chain.step_values({"Z": [0.95], "tilt": [0.3], "azimuth": [0.4]}))
    targets = {"z": np.array([0.9]), "tilt": np.array([0.1]), "azimuth": np.array([1.0])}
    rate, h = closure.evaluate(values, targets)[1][0], 1e-6
    balls = {k for ball in chain.balls for k in ball}
    for k in range(len(chain.steps)):
        if k not in balls:  # the steps of a ball turn about moved directions, see the Jacobians of the platform
            ahead, back = (closure.evaluate(values + s * h * np.eye(len(chain.steps))[k], targets)[0][0] for s in (1, -1))
            np.testing.assert_allclose(rate[:, k], (ahead - back) / (2 * h), atol=1e-7)


def test_published_modes_of_the_head_at_home(head):
    """Rigid platform on massless legs, closed form of the reference: three pairs and three single frequencies."""
    found = natural_frequencies(head, {}, 6)[0]
    np.testing.assert_allclose(found, [158.803859, 158.803859, 298.415518, 387.463984, 485.400740, 485.400740], atol=6e-7)


def test_modes_have_the_threefold_symmetry_and_split_with_tilt(head):
    azimuth = np.radians(np.array([17.0, 137.0, 257.0]))
    found = natural_frequencies(head, {"Z": np.full(3, 0.85), "tilt": np.full(3, 0.4), "azimuth": azimuth}, 6)
    np.testing.assert_allclose(found, np.tile(found[0], (3, 1)), rtol=1e-9)
    assert found[0, 1] - found[0, 0] > 1.0
    home = natural_frequencies(head, {}, 2)[0]
    assert home[1] - home[0] < 1e-6


MAKERS = [parallel_machines.three_rps, parallel_machines.hexapod, parallel_machines.three_prs]


@pytest.fixture
def interpreted_frequencies(interpreted):
    """The kernels of frequencies at many poses as plain Python."""
    interpreted(*(f"machine.frequencies.{name}" for name in ("closed_kernel", "condense_kernel", "kernel")))


@pytest.mark.parametrize("make", MAKERS)
def test_interpreted_kernels_equal_the_general_path(make, interpreted_frequencies):
    compare_paths(make(), 2)


@pytest.mark.slow
@pytest.mark.parametrize("make", MAKERS)
def test_compiled_path_equals_the_general_one(make):
    compare_paths(make(), 60)


def compare_paths(machine, number):
    z = machine.chain.axis("Z").reference_position
    poses = random_poses(number, 5) | {"Z": np.linspace(z - 0.08, z + 0.08, number)}
    legs = machine.chain.positions(poses)
    named = {axis.name: legs[:, i] for i, axis in enumerate(machine.chain.driven_axes)}
    expected = natural_frequencies(machine, named, 6)
    np.testing.assert_allclose(natural_frequencies(machine, named, 6, path="compiled"), expected, rtol=1e-10)


def test_kernels_give_the_reason_of_a_pose_that_cannot_be(head, interpreted_frequencies):
    with pytest.raises(ValueError, match="cannot be reached"):
        natural_frequencies(head, {"L1": [0.9, 0.4], "L2": [0.9, 1.4], "L3": [0.9, 1.4]}, path="compiled")


def test_torn_gantry_is_refused_with_its_gap(tmp_path):
    (tmp_path / "torn.yaml").write_text(TORN)
    torn = read_machine(tmp_path / "torn.yaml")
    with pytest.raises(ValueError, match=r"Y1 0\.5 m: loop joint right_bridge is torn open by 500 mm .*one axis drive"):
        natural_frequencies(torn, {"Y1": [0.5]})
    assert np.isfinite(natural_frequencies(torn, {"Y1": [0.5], "Y2": [0.5]})).all()


def test_poses_that_cannot_be_say_why(head):
    chain = head.chain
    ok, reasons = chain.reachable({"L1": [0.9, 0.4, 1.0], "L2": [0.9, 1.4, 1.0], "L3": [0.9, 1.4, 0.9]})
    assert list(ok) == [True, False, True]
    assert "cannot be reached" in reasons[1] and "%" in reasons[1]
    assert "beyond 0.3 m .. 1.5 m" in chain.reachable({"Z": [1.39], "tilt": [0.9], "azimuth": [np.pi]})[1][0]
    with pytest.raises(ValueError, match="must not be given together"):
        chain.step_values({"Z": 0.9, "L1": 0.9})
    with pytest.raises(ValueError, match=r"L1 0\.4 m"):
        chain.step_values({"L1": 0.4, "L2": 1.4, "L3": 1.4})


def test_order_and_size_of_the_batch_change_nothing(head):
    poses = random_poses(40, 7)
    whole = head.chain.positions(poses)
    for i in (0, 13, 39):
        single = head.chain.positions({name: at[i] for name, at in poses.items()})
        np.testing.assert_allclose(single[0], whole[i], atol=1e-14)


def other_way_round(number):
    """The hexapod with a leg described from the platform down: its loop closes at the universal joint instead of the ball."""
    machine = parallel_machines.hexapod()
    joints = dict(machine.description.joints)
    ball, slide, knuckle = (joints[f"{name}{number}"] for name in ("ball", "slide", "knuckle"))
    joints[f"ball{number}"] = replace(ball, parent="platform", child=f"limb{number}", closes_loop=False)
    joints[f"slide{number}"] = replace(slide, parent=f"limb{number}", child=f"collar{number}")
    joints[f"knuckle{number}"] = replace(knuckle, closes_loop=True)
    axes = dict(machine.description.axes)
    leg = axes[f"L{number}"]
    axes[f"L{number}"] = replace(leg, direction="-z")
    return replace(machine.description, joints=joints, axes=axes)


@pytest.mark.parametrize("gravity", [None, (0.0, 0.0, -9.81), (3.0, -5.0, -400.0)])
def test_where_a_loop_is_cut_changes_nothing_also_under_load(gravity):
    """Preload stiffness through universal joints: closed at the ball, or at the universal joint with its order of turns."""
    cut_at_ball = build(replace(parallel_machines.hexapod().description, gravity=gravity))
    cut_at_knuckle = build(replace(other_way_round(2), gravity=gravity))
    z = cut_at_ball.chain.axis("Z").reference_position
    for pose in ({}, {"Z": z + 0.03, "tilt": 0.25, "azimuth": 0.8, "torsion": 0.1, "X": 0.04}):
        first, second = (natural_frequencies(machine, pose, 6)[0] for machine in (cut_at_ball, cut_at_knuckle))
        np.testing.assert_allclose(first, second, rtol=1e-8)


def test_another_assembly_mode_is_kept():
    four_bar = parallel_machines.four_bar()
    up, down = build(four_bar), build(parallel_machines.four_bar("crossed"))
    angle = np.radians(np.linspace(0, 25, 6))
    for machine, sign in ((up, 1), (down, -1)):
        place = place_machine(machine, {"q": angle})
        pin = place.position(machine.description.points["pin"])
        # Crank and rocker pivots 0.5 m apart, crank 0.2, coupler 0.45, rocker 0.4: two circles meet above or below.
        crank = 0.2 * np.stack([np.cos(angle + np.pi / 2), np.zeros(6), np.sin(angle + np.pi / 2)], axis=-1) * [-1, 1, 1]
        np.testing.assert_allclose(np.linalg.norm(pin - [0.5, 0, 0], axis=1), 0.4, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(pin - crank, axis=1), 0.45, atol=1e-12)
        across = np.cross(crank - [0.5, 0, 0], pin - [0.5, 0, 0])[:, 1]
        assert (sign * across > 0).all() or (sign * across < 0).all()
    assert np.abs(place_machine(up, {"q": 0.1}).frames - place_machine(down, {"q": 0.1}).frames).max() > 0.1


def rocker_driven():
    """The four-bar driven at its rocker: dead where crank and coupler are in line."""
    bars = parallel_machines.four_bar()
    joints = dict(bars.joints)
    joints["a"] = replace(joints["a"], stiffness={}, free=("ry",))
    joints["c"] = replace(joints["c"], stiffness={"ry": 1e4}, free=())
    return build(replace(bars, joints=joints, axes={"q": AxisDescription("c", "ry")}, assembly_modes={}))


@pytest.mark.slow
def test_nearest_singular_pose_is_where_crank_and_coupler_are_in_line():
    machine = rocker_driven()
    pin = np.array(machine.description.points["pin"].at) - [0.5, 0, 0]
    here = np.arctan2(pin[0], pin[2])
    # The pin is then 0.45 + 0.2 (or 0.45 - 0.2) from the crank's pivot: the angle at the rocker's pivot by the cosine law.
    inner = [np.arccos((0.5**2 + 0.4**2 - reach**2) / (2 * 0.5 * 0.4)) for reach in (0.65, 0.25)]
    dead = [np.arctan2(-np.cos(angle), np.sin(angle)) for angle in inner]
    distance, kind = nearest_singularity(machine.chain, {}, "q")
    assert kind == "actuation"
    assert distance == pytest.approx(min(abs(angle - here) for angle in dead), abs=1e-4)
    way = min((angle - here for angle in dead), key=abs)
    near = pose_condition(machine.chain, {"q": [0.0, way - 1e-3 * np.sign(way)]})
    assert near.actuation[1] > 5 * near.actuation[0]


@pytest.mark.slow
def test_a_path_over_a_singular_pose_is_refused_where_it_happens():
    machine = rocker_driven()
    distance, _ = nearest_singularity(machine.chain, {}, "q")
    def follow(way):
        machine.chain.follow({"q": way * np.linspace(0, 1.05 * distance, 5)})
    refused = 0
    for way in (1, -1):
        with contextlib.suppress(ValueError):
            follow(way)
            continue
        with pytest.raises(ValueError, match=r"of the path: cannot be reached.*singular"):
            follow(way)
        refused += 1
    assert refused == 1


def test_a_followed_path_equals_single_poses(head):
    poses = {"Z": np.linspace(0.8, 1.0, 7), "tilt": np.linspace(0, 0.5, 7), "azimuth": np.linspace(0, 3, 7)}
    np.testing.assert_allclose(head.chain.follow(poses), head.chain.step_values(poses), atol=1e-11)


def test_rates_of_the_legs_are_those_of_the_task(head):
    pose, h = {"Z": 0.92, "tilt": 0.3, "azimuth": 0.7}, 1e-6
    ahead, back = (head.chain.positions({**pose, "Z": pose["Z"] + s * h})[0] for s in (1, -1))
    rates = np.linalg.solve(head.chain.task_rates(pose)[0], [1.0, 0.0, 0.0])
    np.testing.assert_allclose(rates, (ahead - back) / (2 * h), atol=1e-7)


def test_constraint_singularity_counts_all_joints(head):
    poses = {"Z": [0.9, 0.9], "tilt": [0.0, 0.5], "azimuth": [0.0, 0.4]}
    condition = pose_condition(head.chain, poses, head.link("platform"))
    assert (condition.constraint < 100).all() and (condition.actuation < 100).all()
    assert condition.reasons() == ["", ""]
