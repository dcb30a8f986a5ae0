"""Machines with identified numbers: their file, what their covariance says at any pose, joints of screws, the next test."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.io.yaml import machine_file
from toolpoint.machine import assemble, build
from toolpoint.machine.description import (
    AxisDescription,
    BodyDescription,
    FrameDescription,
    IdentifiedDescription,
    InertiaDescription,
    JointDescription,
    MachineDescription,
    PointDescription,
)
from toolpoint.machine.frequencies import natural_frequencies
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf
from toolpoint.studies.machines.machine_modes import solve_modes
from toolpoint.studies.machines.machine_responses import study_responses_of_machine
from toolpoint.studies.machines.machine_uncertainty import machine_uncertainty
from toolpoint.studies.machines.next_test import rank_tests
from toolpoint.studies.machines.pose_map import pose_map

SHARE = 0.01  # standard deviation of the stiffness over itself
K, M = 4e6, 100.0


def slider(share=SHARE):
    """A body on a spring along x: f = sqrt(k/m)/2 pi, static compliance 1/k."""
    joint = JointDescription("ground", "body", stiffness={"x": K}, loss_factor=0.04)
    body = BodyDescription(M, inertia=InertiaDescription(1.0, 1.0, 1.0))
    identified = IdentifiedDescription(("joints.guide.stiffness.x",), ((float((share * K) ** 2),),))
    return build(MachineDescription("slider", {"body": body}, {"guide": joint}, points={"tip": PointDescription("body")},
                                    tool="tip", identified=identified))


def test_a_frequency_is_half_as_uncertain_as_its_stiffness():
    result = solve_modes(slider())
    np.testing.assert_allclose(result.spread.deviation / result.frequency, SHARE / 2, rtol=1e-4)
    assert result.spread.main_part(0) == "joint guide" and "joint guide" in result.table()
    assert result.to_dict()["interval_hz"][0] == pytest.approx(1.959964 * SHARE / 2 * result.frequency[0], rel=1e-4)


def test_draws_of_a_stiffness_that_is_not_determined_are_no_machines():
    """Stiffer by ten powers they would hide all other springs in rounding; the number is named."""
    with pytest.raises(ToolpointError, match=r"gave \d+ possible machines.*guide.stiffness.x is known within 1.96e\+12 % only"):
        list(machine_uncertainty(slider(1e10)).samples(20, np.random.default_rng(1)))


def test_what_a_test_would_fit_is_said_beside_undamped_frequencies():
    """omega sqrt(1 + 0.04 i) has the size omega (1 + 0.0004): 0.04 %; without loss nothing is said."""
    assert [note for note in solve_modes(slider()).notes if "raise those that a test fits, by 0.04 % in mode 1" in note]
    description = slider().description
    still = {name: replace(joint, loss_factor=0.0) for name, joint in description.joints.items()}
    assert not any("a test fits" in note for note in solve_modes(build(replace(description, joints=still))).notes)


def test_the_static_response_is_as_uncertain_as_the_stiffness():
    result = study_responses_of_machine(slider(), outputs=["tip:+x"], frequency=[1e-3, 5.0])
    assert result.spread.deviation[0, 0, 0, 0] == pytest.approx(SHARE, rel=1e-4)
    low, high = result.band(0)
    ends = np.exp(np.array([-1, 1]) * 1.959964 * SHARE)
    np.testing.assert_allclose([low[0, 0, 0] * K, high[0, 0, 0] * K], ends, rtol=1e-3)


def test_samples_scatter_as_the_covariance_says():
    drawn = [m.value("joints.guide.stiffness.x") for m in machine_uncertainty(slider()).samples(400, np.random.default_rng(1))]
    assert np.std(drawn) == pytest.approx(SHARE * K, rel=0.1) and np.mean(drawn) == pytest.approx(K, rel=2e-3)


def test_numbers_without_room_on_one_side_have_one_sided_slopes():
    """A flat body's inertia about its normal can only shrink (triangle inequality); a loss factor of zero can only grow."""
    described = slider().description
    flat = replace(described.bodies["body"], inertia=InertiaDescription(1.0, 1.0, 2.0))
    joint = replace(described.joints["guide"], stiffness={"rz": K}, loss_factor=0.0)
    paths = ("bodies.body.inertia.zz", "joints.guide.loss_factor")
    machine = build(replace(described, bodies={"body": flat}, joints={"guide": joint}, damping_ratio=0.01,
                            identified=IdentifiedDescription(paths, ((0.02**2,), (0.0, 0.01**2)))))
    uncertainty = machine_uncertainty(machine)
    slopes = uncertainty.slopes(lambda m: np.array([np.log(assemble(m).stiffness[0, 0] / assemble(m).mass[0, 0]) / 2,
                                                    m.value("joints.guide.loss_factor")]))
    np.testing.assert_allclose(slopes, [[-0.5 * 0.02 / 2.0, 0.0], [0.0, 0.01]], rtol=2e-3, atol=1e-12)


def test_without_identified_numbers_there_are_no_intervals():
    bare = build(replace(slider().description, identified=None))
    assert machine_uncertainty(bare) is None and solve_modes(bare).spread is None
    result = study_responses_of_machine(bare, outputs=["tip:+x"], frequency=[1.0, 5.0])
    assert result.band(0) is None and any("no intervals" in note for note in result.notes)


def test_the_next_frequency_narrows_the_stiffness_as_kalman_says():
    """ln k known with s; ln f, half of it, measured with r: variance s^2 / (1 + s^2/4r^2); compliance at resonance: 1/(eta
    k)."""
    r = 1e-3
    result = rank_tests(slider(), {}, [{}], points=[], frequency_deviation=r, damping_deviation=1e3)
    assert result.today == pytest.approx(1.959964 * SHARE, rel=1e-3)
    assert result.after[0] == pytest.approx(result.today / np.sqrt(1 + SHARE**2 / (4 * r**2)), rel=1e-3)
    assert "random" in result.table() and result.is_worth_measuring


def test_a_test_that_narrows_nothing_is_not_advised():
    result = rank_tests(slider(), {}, [{}], points=[], frequency_deviation=10.0, damping_deviation=1e3)
    assert not result.is_worth_measuring and result.table().startswith("no further test")


def test_a_map_states_its_intervals():
    machine = slider()
    described = replace(machine.description, axes={"Y": AxisDescription("guide", "y", (-0.1, 0.1))})
    result = pose_map(build(described), {"Y": np.linspace(-0.1, 0.1, 3)}, 1)
    np.testing.assert_allclose(result.interval() / result.frequency, 1.959964 * SHARE / 2, rtol=1e-4)
    assert "mostly of joint guide" in result.table()


def two_bodies(second):
    body = BodyDescription(80.0, (0.2, 0.1, 0.9), InertiaDescription(5.0, 6.0, 4.0))
    base = JointDescription("ground", "base", stiffness={"rx": 3e7, "ry": 5e7, "z": 6e8}, loss_factor=0.03)
    return build(MachineDescription(
        "two", {"base": BodyDescription(500.0, (0.0, 0.0, 0.3), InertiaDescription(40.0, 50.0, 45.0)), "head": body},
        {"base": base, "head": second}, {"X": AxisDescription("head", "x", (-0.3, 0.3))},
        {"tip": PointDescription("head", (0.4, 0.1, 1.2))}, tool="tip"))


@pytest.mark.parametrize("elastic_at", ["child", "parent"])
def test_directions_written_as_screws_of_another_frame_are_the_same_joint_at_every_pose(elastic_at):
    """Law: free twists and their stiffness do not hang on the frame that they are written in."""
    axes, at = rot.from_euler("zyx", [0.4, -0.3, 0.2]), np.array([0.1, -0.2, 0.6])
    turned = tf.transform(axes, at)
    ways, k = ("y", "rx", "rz"), np.diag([2e8, 4e6, 7e6])
    units = np.eye(6)[:, [1, 3, 5]]
    directions = JointDescription("base", "head", FrameDescription(tuple(at), (0.4, -0.3, 0.2)),
                                  dict(zip(ways, np.diag(k), strict=True)), loss_factor=0.05, elastic_at=elastic_at)
    # The axis of this one moves along the x of its frame, the machine's; so it is told by a frame of its own.
    straight = tf.transform(None, at)
    twists = tf.adjoint(tf.inverse(straight)) @ tf.adjoint(turned) @ units
    as_screws = JointDescription("base", "head", FrameDescription(tuple(at)), screws=tuple(map(tuple, twists.T.tolist())),
                                 stiffness_matrix=tuple(map(tuple, k.tolist())), loss_factor=0.05, elastic_at=elastic_at)
    first, second = two_bodies(directions), two_bodies(as_screws)
    np.testing.assert_allclose(natural_frequencies(first, {"X": 0.0}), natural_frequencies(second, {"X": 0.0}), rtol=1e-9)
    # At a pose the axes differ, so the oblique one is driven along the same way by its own direction cosines: only the
    # compiled and the plain path of the screws must agree there.
    pose = {"X": np.array([-0.2, 0.0, 0.25])}
    compiled = natural_frequencies(second, pose, path="compiled")
    np.testing.assert_allclose(natural_frequencies(second, pose), compiled, rtol=1e-9)
    assert second.coordinates[-3:] == ("head.s1", "head.s2", "head.s3")
    np.testing.assert_allclose(assemble(first).structural_damping[-3:, -3:], 0.05 * k, rtol=1e-12)


def test_screws_and_identified_numbers_go_through_a_file(tmp_path):
    joint = JointDescription("base", "head", screws=((0.0, 0.0, 0.02, 0.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
                             stiffness_matrix=((4e6, 1e5), (1e5, 3e8)), loss_factor=0.04)
    paths = ("joints.head.screws.0.2", "joints.head.stiffness_matrix.1.0")
    identified = IdentifiedDescription(paths, ((1e-6,), (0.0, 1e6)), "a test")
    described = replace(two_bodies(joint).description, identified=identified)
    machine_file.write(described, tmp_path / "m.yaml")
    back = machine_file.read(tmp_path / "m.yaml")
    assert back.description == described
    changed = back.with_values({paths[1]: 2e5}).description.joints["head"].stiffness_matrix
    assert changed[0][1] == changed[1][0] == 2e5


@pytest.mark.parametrize(("paths", "covariance", "words"), [
    (("joints.head.screws.7.2",), ((1e-6,),), "no '7' there"), (("joints.head.screws.0.2",), ((-1.0,),), "negative"),
    (("joints.head.screws.0.2",), ((1e-6,), (0.0, 1.0)), "rows"), (("joints.head.parent",), ((1.0,),), "not a number")])
def test_faults_of_identified_numbers(tmp_path, paths, covariance, words):
    joint = JointDescription("base", "head", screws=((0.0, 0.0, 0.02, 0.0, 0.0, 1.0),), stiffness_matrix=((4e6,),))
    described = replace(two_bodies(joint).description, identified=IdentifiedDescription(paths, covariance))
    machine_file.write(described, tmp_path / "m.yaml")
    with pytest.raises(ToolpointError, match=words):
        machine_file.read(tmp_path / "m.yaml")


@pytest.mark.parametrize(("changes", "words"), [
    ({"stiffness_matrix": None}, "a joint of screws needs it"), ({"stiffness": {"x": 1e6}}, "given beside screws"),
    ({"screws": ((0.0,) * 6,)}, "independent twists"), ({"stiffness_matrix": ((-1.0,),)}, "positive definite")])
def test_faults_of_screws(changes, words):
    joint = JointDescription("base", "head", screws=((0.0, 0.0, 0.02, 0.0, 0.0, 1.0),), stiffness_matrix=((4e6,),))
    with pytest.raises(ToolpointError, match=words):
        two_bodies(replace(joint, **changes))
