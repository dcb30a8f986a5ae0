"""Closed loop on the published machine: model, virtual test, identification, joints, with nobody choosing."""

from dataclasses import replace

import numpy as np
import pytest

from joint_identification import p1_case as p1
from toolpoint.joint_identification import identify_joints
from toolpoint.spatial import rotation as rot
from toolpoint.vibration import Dof


@pytest.fixture(scope="module")
def model():
    return p1.machine()


def off_axis(joint, truth):
    """Distance of the true point from the estimate, along determined directions only."""
    away = joint.position - np.array(truth)
    for direction in joint.undetermined:
        away = away - direction * (direction @ away)
    return np.linalg.norm(away)


def check(result, position_bar, stiffness_bar=0.02):
    assert result.certain, result.status
    for joint in result.joints:
        assert joint.kind == p1.KINDS[joint.child]
        assert joint.freedoms == p1.FREEDOMS[joint.child]
        assert off_axis(joint, p1.AT[joint.child]) < position_bar
        if joint.child != "base":  # a spherical joint has no direction of its own
            assert np.degrees(np.arccos(min(1.0, abs(joint.axis[0])))) < 1.0
        np.testing.assert_allclose(joint.stiffness, p1.STIFFNESS[joint.child], rtol=stiffness_bar)


@pytest.mark.slow
@pytest.mark.parametrize(("share", "bar"), [(0.02, 0.015), (0.05, 0.040)])
@pytest.mark.parametrize("seed", [1, 2])
def test_joints_from_noisy_frequency_responses(model, share, bar, seed):
    rng = np.random.default_rng(seed)
    case = p1.case(model, rng)
    modes = p1.from_responses(case.truth, share, rng)
    check(identify_joints(modes, case.points, case.components, chain=p1.CHAIN, masses=case.masses), bar)


@pytest.mark.slow
def test_joints_from_hammer_blows(model):
    rng = np.random.default_rng(5)
    case = p1.case(model, rng, 60)
    modes = p1.from_blows(case.truth, 0.02, rng)
    check(identify_joints(modes, case.points, case.components, chain=p1.CHAIN, masses=case.masses), 0.015)


@pytest.mark.slow
def test_exact_modes_give_the_model_back(model):
    case = p1.case(model, np.random.default_rng(3))
    result = identify_joints(case.truth, case.points, case.components, chain=p1.CHAIN, masses=case.masses)
    check(result, 1e-6, 1e-6)


@pytest.mark.slow
def test_intervals_hold_the_truth(model):
    hits, total = 0, 0
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        case = p1.case(model, rng)
        result = identify_joints(p1.noisy(case.truth, 0.03, rng), case.points, case.components, chain=p1.CHAIN)
        for joint in result.joints:
            error, half = np.abs(joint.position - p1.AT[joint.child]), joint.position_interval
            at = [1, 2] if joint.kind == "hinge" else [0, 1, 2]
            hits, total = hits + int((error[at] <= half[at]).sum()), total + len(at)
    # 96 intervals of 95 %: 91 expected, standard deviation 2.1 if all were independent.
    assert total == 96
    assert hits >= 84


@pytest.mark.slow
def test_without_known_variance_the_noise_is_taken_from_the_fit(model):
    rng = np.random.default_rng(8)
    case = p1.case(model, rng)
    result = identify_joints(p1.noisy(case.truth, 0.02, rng, known=False), case.points, case.components, chain=p1.CHAIN)
    assert [joint.kind for joint in result.joints] == ["spherical", "hinge", "universal"]


def test_complex_shapes_give_the_same_joints(model):
    from dataclasses import replace

    rng = np.random.default_rng(9)
    case = p1.case(model, rng)
    modes = p1.noisy(case.truth, 0.02, rng)
    turned = replace(modes, shape=modes.shape * np.exp(0.4j), scaling="unscaled",
                     shape_variance=2 * modes.shape_variance)
    noise = 0.02 * np.sqrt((np.abs(turned.shape) ** 2).mean(axis=0)) * rng.normal(size=turned.shape.shape)
    turned = replace(turned, shape=turned.shape + 1j * noise * np.exp(0.4j))
    result = identify_joints(turned, case.points, case.components, chain=p1.CHAIN)
    assert [joint.kind for joint in result.joints] == ["spherical", "hinge", "universal"]
    for joint in result.joints:
        assert off_axis(joint, p1.AT[joint.child]) < 0.015


@pytest.mark.slow
def test_a_turned_machine_gives_turned_joints(model):
    """Objectivity: rotating and moving points and sensors turns the axes and moves the positions, and changes no kind."""
    rng = np.random.default_rng(10)
    case = p1.case(model, rng)
    modes = p1.noisy(case.truth, 0.005, rng)
    turn, shift = rot.from_euler("zyx", [0.3, -0.2, 0.25]), np.array([0.5, -1.0, 2.0])
    dofs = tuple(Dof(dof.point, f"turned {dof.direction}", tuple(turn @ dof.unit[:3])) for dof in modes.dofs)
    moved = {name: turn @ at + shift for name, at in case.points.items()}
    first = identify_joints(modes, case.points, case.components, chain=p1.CHAIN)
    second = identify_joints(replace(modes, dofs=dofs), moved, case.components, chain=p1.CHAIN)
    for a, b in zip(first.joints, second.joints, strict=True):
        assert a.kind == b.kind
        away = b.position - (turn @ a.position + shift)
        for direction in b.undetermined:
            away = away - direction * (direction @ away)
        np.testing.assert_allclose(away, 0, atol=1e-5)
        np.testing.assert_allclose(np.abs(b.axis @ turn @ a.axis), np.linalg.norm(a.axis), atol=1e-6)
        np.testing.assert_allclose(rot.from_euler("zyx", b.rotation), b.frame, atol=1e-12)


def test_plain_data_for_a_machine_description(model):
    case = p1.case(model, np.random.default_rng(3))
    joint = identify_joints(case.truth, case.points, case.components, chain=p1.CHAIN, masses=case.masses).joint("magazine")
    data = joint.as_dict()
    assert data["parent"] == "column"
    assert data["freedoms"] == ["ry", "rz"]
    assert data["stiffness"]["ry"] == pytest.approx(2.68e6, rel=1e-6)
    np.testing.assert_allclose(data["rotation_zyx"], 0, atol=1e-9)
