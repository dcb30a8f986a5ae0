"""Rigid motion by three methods, screw axes, all kinds of joint from made motions, stiffness from a closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from joint_identification import p1_case as p1
from toolpoint._check import ToolpointError
from toolpoint.joint_identification import (
    ClosestPoint,
    ComponentMass,
    FiniteRotation,
    SmallMotion,
    identify_joints,
)
from toolpoint.joint_identification.joints.kinds import WAYS as KINDS
from toolpoint.joint_identification.joints.kinds import effective_moves, screw_chart, unit_twists
from toolpoint.joint_identification.motion.finite_motion import bisector_axis, meeting_point, relative_bisector_axes
from toolpoint.joint_identification.motion.measured import component
from toolpoint.joint_identification.motion.relative_motion import screw_axis
from toolpoint.joint_identification.motion.rigid_motion import rigid_motion
from toolpoint.spatial import rotation as rot
from toolpoint.spatial import transform as tf
from toolpoint.vibration import Dof, Modes

WAYS = ("+x", "+y", "+z")


def made(basis, noise, rng, modes=5, points=20, moving_base=True):
    """Modes of two components, base and part, whose relative twists are `basis` (6, f) times random numbers."""
    at = {i: rng.uniform(-1, 1, 3) + ([0, 0, 0] if i < points else [0, 0, 1.5]) for i in range(2 * points)}
    base = rng.normal(size=(6, modes)) if moving_base else np.zeros((6, modes))
    part = base + basis @ rng.normal(size=(basis.shape[1], modes))
    shape = np.concatenate([tf.point_velocity(at[i]) @ (base if i < points else part) for i in at])
    spread = noise * np.sqrt((shape**2).mean(axis=0)) * np.ones_like(shape)
    labels = [Dof(i, way) for i in at for way in WAYS]
    found = Modes(np.arange(1, modes + 1) * 10.0, 0.01, shape + spread * rng.normal(size=shape.shape), labels,
                  shape_variance=spread**2)
    return found, at, {"base": list(range(points)), "part": list(range(points, 2 * points))}


def turns(point, *directions):
    return np.stack([np.concatenate([np.cross(point, d), d]) for d in directions], axis=1)


def slides(*directions):
    return np.stack([np.concatenate([d, np.zeros(3)]) for d in directions], axis=1)


POINT = np.array([0.2, -0.1, 0.9])
FRAME = rot.from_euler("zyx", [0.2, 0.15, -0.25])
X, Y, Z = FRAME.T
CASES = {
    "locked": np.zeros((6, 0)), "hinge": turns(POINT, X), "slide": slides(Y), "universal": turns(POINT, X, Z),
    "cylindrical": np.hstack([turns(POINT, X), slides(X)]), "spherical": turns(POINT, X, Y, Z),
    "planar": np.hstack([slides(X, Y), turns(POINT, Z)]),
}
FREE = {"locked": (), "hinge": ("rx",), "slide": ("y",), "universal": ("rx", "rz"), "cylindrical": ("x", "rx"),
        "spherical": ("rx", "ry", "rz"), "planar": ("x", "y", "rz")}
AXIS = {"hinge": X, "slide": Y, "universal": Y, "cylindrical": X, "planar": Z}


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))])
def test_every_kind_is_told_with_its_position_and_direction(kind, seed):
    modes, points, parts = made(CASES[kind], 0.01, np.random.default_rng(seed))
    result = identify_joints(modes, points, parts, chain=("base", "part"))
    joint = result.joint("part")
    assert joint.kind == kind, joint.status
    assert joint.freedoms == FREE[kind]
    assert joint.certain
    if kind in AXIS:
        assert np.arccos(min(1.0, abs(joint.axis @ AXIS[kind]))) < 5 * joint.axis_deviation + 1e-9
        assert joint.axis_deviation < 0.02
    if kind in ("hinge", "universal", "spherical", "cylindrical"):
        away = joint.position - POINT
        for direction in joint.undetermined:
            away = away - direction * (direction @ away)
        assert np.linalg.norm(away) < 4 * np.sqrt(np.trace(joint.position_covariance)) + 1e-9


@pytest.mark.parametrize(("basis", "kind", "free"), [
    (np.vstack([turns(POINT, X)[:3] + 0.3 * X[:, None], X[:, None]]), "screw", ()),  # 0.3 m/rad
    (np.hstack([slides(X, Y)]), "two slides", ("x", "y")),
    (np.hstack([slides(X), turns(POINT, Z)]), "turn and slide", ("x", "rz")),
    (np.hstack([turns(POINT, X, Y, Z), slides(X)]), "free in x rx ry rz", ("x", "rx", "ry", "rz")),
    (np.hstack([turns(POINT, X, Y, Z), slides(Y, Z)]), "guide", ("y", "z", "rx", "ry", "rz")),
    (np.eye(6), "mount", ("x", "y", "z", "rx", "ry", "rz"))], ids=lambda v: v if isinstance(v, str) else "")
@pytest.mark.default_cases(3)
def test_any_set_of_directions_is_a_kind(basis, kind, free):
    modes, points, parts = made(basis, 0.01, np.random.default_rng(3), modes=7)
    joint = identify_joints(modes, points, parts, chain=("base", "part")).joint("part")
    assert (joint.kind, joint.freedoms) == (kind, free) and joint.certain
    assert np.linalg.svd(np.linalg.qr(joint.screws)[0].T @ np.linalg.qr(basis)[0])[1].min() > 0.999
    if kind == "screw":
        assert joint.pitches[0] == pytest.approx(0.3, abs=0.01) and "screw" in joint.free_text


def test_there_are_twenty_sets_of_directions_and_the_parameters_of_each_are_those_of_its_subspace():
    """Law: motions of the frame that the chart leaves out do not move the span; with them the parameters are six."""
    assert len(KINDS) == 20
    for ways in KINDS.values():
        units, moves = unit_twists(ways), effective_moves(ways)
        still = np.linalg.svd(moves, full_matrices=True)[0][:, moves.shape[1]:] if moves.shape[1] else np.eye(6)
        for twist in still.T:
            moved = tf.adjoint(tf.exponential(0.7 * twist)) @ units
            assert np.linalg.matrix_rank(np.hstack([units, moved]), tol=1e-9) == len(ways)


def test_skew_axes_are_general_and_marked():
    basis = np.hstack([turns(POINT, X), turns(POINT + 0.5 * Y, Z)])
    modes, points, parts = made(basis, 0.01, np.random.default_rng(3), modes=6)
    with pytest.warns(UserWarning, match="doubtful"):
        joint = identify_joints(modes, points, parts, chain=("base", "part")).joint("part")
    assert joint.kind == "general" and joint.screws.shape == basis.shape
    # The subspace of free twists is the made one.
    assert np.linalg.svd(np.linalg.qr(joint.screws)[0].T @ np.linalg.qr(basis)[0])[1].min() > 0.999


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_rigid_motion_is_found_exactly(seed, twist):
    """Law: displacements of a twist give the twist back, by the closed form for any points and directions."""
    rng, twist = np.random.default_rng(seed), np.array(twist)
    at = {i: rng.uniform(-1, 1, 3) for i in range(6)}
    shape = np.concatenate([tf.point_velocity(p) @ twist for p in at.values()])[:, None]
    modes = Modes([10.0], 0.01, shape, [Dof(i, way) for i in at for way in WAYS])
    found = SmallMotion().twists(component("part", modes, at, labels=list(at)))
    np.testing.assert_allclose(found[:, 0], twist, atol=1e-9)


def test_finite_methods_agree_with_the_closed_form_as_the_amplitude_falls():
    rng = np.random.default_rng(4)
    at = dict(enumerate(np.stack(np.meshgrid([0, 1.0], [0, 0.7], [0, 0.4, 0.9]), -1).reshape(-1, 3)))
    twist = rng.normal(size=6)
    shape = np.concatenate([tf.point_velocity(p) @ twist for p in at.values()])[:, None]
    part = component("part", Modes([10.0], 0.01, shape, [Dof(i, way) for i in at for way in WAYS]), at, labels=list(at))
    errors = [np.abs(FiniteRotation(a).twists(part)[:, 0] - twist).max() for a in (0.1, 0.01, 0.001)]
    # A straight displacement is no arc: the error of the logarithm falls with the amplitude, here at least linearly.
    assert errors[0] > 8 * errors[1] > 64 * errors[2]
    np.testing.assert_allclose(ClosestPoint(0.01).twists(part), FiniteRotation(0.01).twists(part), atol=1e-9)
    judged = rigid_motion(part, FiniteRotation(0.001).twists(part))
    assert judged.residual[0] < 1e-2


def test_closest_point_fails_where_points_move_past_each_other():
    """Unknown correspondence: displacements beyond half the spacing match wrong points; the residual shows it not."""
    rng = np.random.default_rng(5)
    at = dict(enumerate(rng.uniform(-1, 1, (60, 3))))
    twist = np.array([0, 0, 0, 0.2, -0.3, 1.0])
    shape = np.concatenate([tf.point_velocity(p) @ twist for p in at.values()])[:, None]
    part = component("part", Modes([10.0], 0.01, shape, [Dof(i, way) for i in at for way in WAYS]), at, labels=list(at))
    near, far = ClosestPoint(0.01).twists(part)[:, 0], ClosestPoint(0.9).twists(part)[:, 0]
    assert np.linalg.norm(near - twist) < 0.02 < np.linalg.norm(far - twist)


def test_perpendicular_bisectors_find_the_axis_of_a_finite_rotation():
    rng = np.random.default_rng(6)
    rest = rng.uniform(-1, 1, (20, 3))
    turn = rot.about(X, 0.05)
    axis = bisector_axis(rest, (rest - POINT) @ turn.T + POINT)
    assert abs(axis.direction @ X) == pytest.approx(1, abs=1e-9)
    away = axis.point - POINT
    assert np.linalg.norm(away - X * (X @ away)) < 1e-9
    other = bisector_axis(rest, (rest - POINT) @ rot.about(Y, 0.05).T + POINT)
    np.testing.assert_allclose(meeting_point((axis, other)), POINT, atol=1e-9)
    with pytest.raises(ToolpointError, match="no rotation"):
        bisector_axis(rest, rest)


def test_naive_axes_of_the_published_magazine_pass_near_its_joint_without_noise():
    case = p1.case(p1.machine(), np.random.default_rng(1))
    parts = {name: component(name, case.truth, case.points, labels=case.components[name]) for name in ("column", "magazine")}
    axes = relative_bisector_axes(parts["column"], parts["magazine"], 1e-4)
    assert np.linalg.norm(meeting_point(axes) - p1.AT["magazine"]) < 0.01


@pytest.mark.slow
def test_screw_axis_and_its_uncertainty_against_random_errors():
    twist = np.concatenate([np.cross(POINT, X) + 0.1 * X, X]) * 2.0
    rng = np.random.default_rng(8)
    root = 1e-3 * rng.normal(size=(6, 6))
    axis = screw_axis(twist, root @ root.T)
    assert axis.screw.pitch == pytest.approx(0.1)
    tried = [screw_axis(twist + root @ rng.normal(size=6), root @ root.T).screw for _ in range(4000)]
    np.testing.assert_allclose(np.std([one.point for one in tried], axis=0), axis.point_deviation, rtol=0.06)
    np.testing.assert_allclose(np.std([one.direction for one in tried], axis=0), axis.direction_deviation, rtol=0.06)
    assert np.std([one.pitch for one in tried]) == pytest.approx(axis.pitch_deviation, rel=0.06)


@pytest.mark.filterwarnings("ignore:doubtful")  # two modes load no more than two of the directions that are held
def test_stiffness_of_a_hinged_body_in_closed_form():
    """One freedom: k = omega^2 (J + m r^2); two equal modes cannot be, so a second hinge carries a second body."""
    basis = turns(np.zeros(3), np.array([0, 0, 1.0]))
    rng = np.random.default_rng(9)
    at = {i: rng.uniform(-1, 1, 3) for i in range(20)}
    m, r, j, k = np.array([3.0, 2.0]), 0.5, np.array([0.4, 0.3]), np.array([5e3, 2e3])
    # Both bodies turn about the z axis; the second one on the first: M and K are written down by hand.
    own = j + m * r**2
    mass, stiff = np.array([[own.sum(), own[1]], [own[1], own[1]]]), np.diag(k)
    values, vectors = np.linalg.eig(np.linalg.solve(mass, stiff))
    turn = np.array([vectors[0], vectors.sum(axis=0)])
    shape = np.concatenate([tf.point_velocity(at[i]) @ basis * turn[i // 10] for i in at])
    modes = Modes(np.sqrt(values) / (2 * np.pi), 0.01, shape, [Dof(i, way) for i in at for way in WAYS])
    masses = {name: ComponentMass(m[i], [r, 0, 0], j[i] * np.eye(3)) for i, name in enumerate(("first", "second"))}
    parts = {"first": list(range(10)), "second": list(range(10, 20))}
    result = identify_joints(modes, at, parts, chain=("ground", "first", "second"), masses=masses)
    np.testing.assert_allclose([joint.stiffness[0] for joint in result.joints], k, rtol=1e-6)


def test_joined_masses_of_two_halves_are_those_of_the_whole():
    box = lambda size, mass: mass / 12 * np.diag((np.array(size) ** 2).sum() - np.array(size) ** 2)
    halves = [ComponentMass(5, [x, 0, 0], box([1, 1, 1], 5)) for x in (-0.5, 0.5)]
    whole = ComponentMass.joined(halves)
    assert whole.mass == 10
    np.testing.assert_allclose(whole.inertia, box([2, 1, 1], 10))


def made_chain(stiff, rng):
    """Modes of one body (uniform box) on a spherical joint at the origin with a full rotational stiffness (3, 3)."""
    centre, inertia = np.array([0.1, 0.2, 0.8]), np.diag([30.0, 25.0, 12.0])
    body = ComponentMass(100.0, centre, inertia)
    values, vectors = np.linalg.eigh(np.linalg.solve(np.linalg.cholesky(body.matrix[3:, 3:]), np.linalg.solve(
        np.linalg.cholesky(body.matrix[3:, 3:]), stiff).T))
    turn = np.linalg.solve(np.linalg.cholesky(body.matrix[3:, 3:]).T, vectors)
    at = {i: rng.uniform(-0.5, 0.5, 3) + centre for i in range(20)}
    shape = np.concatenate([tf.point_velocity(p)[:, 3:] @ turn for p in at.values()])
    spread = 0.01 * np.sqrt((shape**2).mean(axis=0)) * np.ones_like(shape)
    modes = Modes(np.sqrt(values) / (2 * np.pi), 0.01, shape + spread * rng.normal(size=shape.shape),
                  [Dof(i, way) for i in at for way in WAYS], shape_variance=spread**2)
    return modes, at, {"body": list(at)}, {"body": body}


def test_three_modes_cannot_exclude_more_freedoms_but_give_the_stiffness():
    k = np.array([4e6, 2e6, 1e6])
    modes, at, parts, masses = made_chain(np.diag(k), np.random.default_rng(10))
    with pytest.warns(UserWarning, match="doubtful"):
        joint = identify_joints(modes, at, parts, chain=("ground", "body"), masses=masses).joint("body")
    assert joint.kind == "spherical"
    assert any("more freedoms cannot be excluded" in doubt for doubt in joint.doubts)
    np.testing.assert_allclose(joint.stiffness, k, atol=4 * joint.stiffness_deviation.max())


@pytest.mark.slow
def test_principal_directions_off_the_machine_s_axes_are_found():
    turn = rot.from_euler("zyx", [0.6, 0.3, 0.5])
    full = turn @ np.diag([4e6, 2e6, 1e6]) @ turn.T
    modes, at, parts, masses = made_chain(full, np.random.default_rng(11))
    with pytest.warns(UserWarning, match="doubtful"):  # three modes do not exclude more freedoms
        joint = identify_joints(modes, at, parts, chain=("ground", "body"), masses=masses).joint("body")
    assert joint.freedoms == ("rx", "ry", "rz")
    np.testing.assert_allclose(joint.frame @ np.diag(joint.stiffness) @ joint.frame.T, full, atol=0.02 * 4e6)


def test_a_rotation_alone_is_a_hinge_and_with_a_translation_along_its_axis_cylindrical():
    """The rule of names: by the freedoms that the modes show. A slide too small to be seen leaves a hinge."""
    turn, slide = turns(POINT, X), slides(X)
    for share, kind in ((0.0, "hinge"), (1e-5, "hinge"), (0.3, "cylindrical")):
        modes, points, parts = made(np.hstack([turn, share * slide]), 0.005, np.random.default_rng(3))
        joint = identify_joints(modes, points, parts, chain=("base", "part")).joint("part")
        assert joint.kind == kind and joint.freedoms == FREE[kind]


@pytest.mark.slow
def test_beside_a_general_joint_the_others_get_their_stiffness():
    """Each line of K q = w^2 M q holds for itself: a hinge on a body that a general joint carries has its own stiffness."""
    rng = np.random.default_rng(12)
    first = np.hstack([turns(np.array([0.0, 0, 0]), X, Y, Z), slides(X)])
    second = turns(np.array([0.1, 0.2, 1.0]), Y)
    masses = {"first": ComponentMass(80.0, [0.1, 0.0, 0.5], np.diag([9.0, 8.0, 6.0])),
              "second": ComponentMass(30.0, [0.0, 0.4, 1.3], np.diag([2.0, 3.0, 2.5]))}
    jacobian = {"first": np.hstack([first, np.zeros((6, 1))]), "second": np.hstack([first, second])}
    mass = sum(j.T @ masses[name].matrix @ j for name, j in jacobian.items())
    root = rng.normal(size=(4, 4))
    stiff = np.zeros((5, 5))
    stiff[:4, :4], stiff[4, 4] = 1e6 * (root @ root.T + 4 * np.eye(4)), 4e5
    lower = np.linalg.cholesky(mass)
    squares, vectors = np.linalg.eigh(np.linalg.solve(lower, np.linalg.solve(lower, stiff).T))
    q = np.linalg.solve(lower.T, vectors)
    at = {i: rng.uniform(-1, 1, 3) + np.array([0, 0, 0.5 if i < 20 else 1.5]) for i in range(40)}
    shape = np.concatenate([tf.point_velocity(at[i]) @ jacobian["first" if i < 20 else "second"] @ q for i in at])
    spread = 0.002 * np.sqrt((shape**2).mean(axis=0)) * np.ones_like(shape)
    modes = Modes(np.sqrt(squares) / (2 * np.pi), 0.01, shape + spread * rng.normal(size=shape.shape),
                  [Dof(i, way) for i in at for way in WAYS], shape_variance=spread**2)
    parts = {"first": list(range(20)), "second": list(range(20, 40))}
    result = identify_joints(modes, at, parts, chain=("ground", "first", "second"), masses=masses)
    first_joint = result.joint("first")
    assert first_joint.freedoms == ("x", "rx", "ry", "rz")
    turn = np.linalg.lstsq(first_joint.screws, first, rcond=None)[0]
    np.testing.assert_allclose(turn.T @ first_joint.stiffness_matrix @ turn, stiff[:4, :4], atol=0.03 * stiff[:4, :4].max())
    hinge = result.joint("second")
    assert hinge.kind == "hinge"
    assert abs(hinge.stiffness[0] - 4e5) < 4 * hinge.stiffness_deviation[0] < 4e4


@pytest.mark.parametrize("turn", [0.0, 1e-14, 1e-8, 0.3])
def test_the_frame_of_a_screw_is_a_frame_also_where_it_only_slides(turn):
    """Modes without noise give a slide no turn at all: its axis is its direction."""
    twist = np.array([0.6, 0.0, 0.8, 0.0, turn, 0.0])
    chart = screw_chart((twist / np.linalg.norm(twist))[:, None])
    frame = chart.frame(np.zeros(5))
    np.testing.assert_allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3), atol=1e-12)
    axis = [0.0, 1.0, 0.0] if turn > 1e-9 else [0.6, 0.0, 0.8]  # its sign is free
    assert abs(frame[:3, 0] @ axis) == pytest.approx(1.0, abs=1e-12)
