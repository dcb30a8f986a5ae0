"""Components found from the shapes alone, and marked where the data do not decide."""

import warnings

import numpy as np
import pytest

from joint_identification import p1_case as p1
from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.joint_identification import identify_joints
from toolpoint.joint_identification.motion.grouping import group_points
from toolpoint.vibration import Dof, Modes


@pytest.fixture(scope="module")
def case():
    return p1.case(p1.machine(), np.random.default_rng(4))


def parts_of(grouping):
    return {frozenset(points) for points in grouping.components.values()}


@pytest.mark.parametrize("share", [0.005, 0.02])
def test_components_of_the_published_machine(case, share):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ToolpointWarning)
        found = group_points(p1.noisy(case.truth, share, np.random.default_rng(1)), case.points)
    assert parts_of(found) == {frozenset(points) for points in case.components.values()}
    # Named from the one that moves least: along the chain, here.
    assert [len(points) for points in found.components.values()] == [
        len(case.components[name]) for name in ("base", "column", "magazine")]


def test_grouped_components_give_the_joints(case):
    modes = p1.noisy(case.truth, 0.01, np.random.default_rng(2))
    found = group_points(modes, case.points)
    result = identify_joints(modes, case.points, found.components, chain=("ground", *found.components))
    assert [joint.kind for joint in result.joints] == ["spherical", "hinge", "universal"]


def test_points_that_the_data_do_not_decide_are_marked(case):
    """With one mode and much noise the parts move alike near their joints."""
    modes = p1.noisy(case.truth.selected([0]), 0.3, np.random.default_rng(3))
    with pytest.warns(ToolpointWarning, match="grouping"):
        found = group_points(modes, case.points)
    assert found.doubts


def test_faulty_channel_is_left_out(case):
    modes = p1.noisy(case.truth, 0.01, np.random.default_rng(4))
    bad = case.components["column"][5]
    shape = modes.shape.copy()
    shape[modes.dofs.index(Dof(bad, "+y"))] *= -1
    from dataclasses import replace
    with pytest.warns(ToolpointWarning, match="move with no part"):
        found = group_points(replace(modes, shape=shape), case.points)
    assert found.left_out == (bad,)


def test_noise_must_be_known(case):
    with pytest.raises(ToolpointError, match="noise"):
        group_points(case.truth, case.points)
    found = group_points(case.truth, case.points, noise=0.01)
    assert len(found.components) == 3


@pytest.mark.parametrize("stated", [pytest.param(0.01, marks=pytest.mark.slow), 0.003])
@pytest.mark.filterwarnings("ignore::toolpoint.ToolpointWarning")
def test_bodies_that_reach_into_each_other_are_parted(stated):
    """Neighbours belong to both, and the noise is stated 3.3 times too small: no part mixes them without a doubt."""
    right = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        count = int(rng.integers(6, 9))
        places, (move, turn) = rng.uniform(0, 1, (2 * count, 3)), rng.standard_normal((2, 3, 3))
        motion = move[:, None] + np.cross(turn[:, None], places)
        motion[:, count:] += rng.uniform(0.5, 2, 3)[:, None, None] * np.cross([0, 0, 1], places[count:] - [0.5, 0.2, 0])
        shape = motion.reshape(3, -1).T
        shape = shape + 0.01 * np.sqrt((shape**2).mean(axis=0)) * rng.standard_normal(shape.shape)
        modes = Modes([50.0, 80.0, 120.0], 0.02, shape, [f"{k}:+{way}" for k in range(2 * count) for way in "xyz"])
        found = group_points(modes, dict(enumerate(places)), noise=stated)
        mixed = [points for points in found.components.values() if min(points) < count <= max(points)]
        assert not mixed or found.doubts
        right += len(found.components) == 2 and not mixed
    assert right >= 4
