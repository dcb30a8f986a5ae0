"""Never a confident wrong joint: wrong points, wrong chain, too few modes, modes given twice, bending parts."""

from dataclasses import replace

import numpy as np
import pytest

from joint_identification import p1_case as p1
from toolpoint._check import ToolpointError, ToolpointWarning
from toolpoint.joint_identification import identify_joints


@pytest.fixture(scope="module")
def case():
    return p1.case(p1.machine(), np.random.default_rng(4))


@pytest.fixture(scope="module")
def modes(case):
    return p1.noisy(case.truth, 0.01, np.random.default_rng(5))


def test_two_points(case, modes):
    parts = {**case.components, "magazine": case.components["magazine"][:2]}
    with pytest.raises(ToolpointError, match=r"magazine.*2 points.*at least 3"):
        identify_joints(modes, case.points, parts, chain=p1.CHAIN)


def test_points_on_one_line(case, modes):
    three = case.components["magazine"][:3]
    line = {name: np.array([0.1, 1.0, 0.2]) + i * np.array([0.3, 0.1, 0.2]) for i, name in enumerate(three)}
    points = {**case.points, **line}
    with pytest.raises(ToolpointError, match="one line"):
        identify_joints(modes, points, {**case.components, "magazine": three}, chain=p1.CHAIN)


def test_one_mode_is_marked(case, modes):
    with pytest.warns(ToolpointWarning, match="one mode only"):
        result = identify_joints(modes.selected([2]), case.points, case.components, chain=p1.CHAIN)
    assert not any(joint.certain for joint in result.joints)


def test_two_modes_do_not_establish_three_freedoms(case, modes):
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(modes.selected([0, 1]), case.points, case.components, chain=p1.CHAIN)
    assert not result.joint("base").certain


def test_mode_given_twice(case, modes):
    twice = modes.selected([0, 1, 2, 2])
    with pytest.raises(ToolpointError, match=r"modes 3 and 4.*same shape"):
        identify_joints(twice, case.points, case.components, chain=p1.CHAIN)


def test_same_shape_at_another_frequency_is_marked(case, modes):
    extra = modes.selected([0, 1, 2, 2])
    rng = np.random.default_rng(0)
    extra = replace(extra, frequency=extra.frequency * [1, 1, 1, 1.3],
                    shape=extra.shape + np.sqrt(extra.shape_variance) * rng.normal(size=extra.shape.shape) * [0, 0, 0, 1])
    with pytest.warns(ToolpointWarning, match="one motion only"):
        identify_joints(extra, case.points, case.components, chain=p1.CHAIN)


def test_wrong_order_of_the_chain_is_marked_and_the_right_one_named(case, modes):
    with pytest.warns(ToolpointWarning, match=r"8 freedoms, ground - base, base - column, column - magazine only 6"):
        result = identify_joints(modes, case.points, case.components, chain=("ground", "column", "base", "magazine"))
    assert not result.certain


@pytest.mark.parametrize(("chain", "text"), [
    (("ground", "base", "column"), "magazine"), (("ground", "base", "colum", "magazine"), "colum"),
    (("ground", "base", "column", "magazine", "base"), "twice"), (("base", "ground", "column", "magazine"), "ground"),
    ({"base": "column", "column": "base", "magazine": "ground"}, "loop|starting")])
def test_wrong_chains(case, modes, chain, text):
    with pytest.raises(ToolpointError, match=text):
        identify_joints(modes, case.points, case.components, chain=chain)


def test_bending_column_is_marked(case, modes):
    shape = modes.shape.copy()
    height = np.array([case.points[dof.point][2] for dof in modes.dofs])
    column = np.array([dof.point in case.components["column"] and dof.direction == "+y" for dof in modes.dofs])
    shape[column, 1] += 0.3 * np.abs(modes.shape[:, 1]).max() * (height[column] - 0.1) ** 2 / 2.0
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(replace(modes, shape=shape), case.points, case.components, chain=p1.CHAIN)
    assert any("column: bends in mode 2" in doubt for doubt in result.joint("column").doubts)
    assert not result.joint("magazine").certain


@pytest.mark.slow
def test_a_bending_column_widens_the_intervals_of_its_joints_and_spoils_no_others(case, modes):
    shape = modes.shape.copy()
    height = np.array([case.points[dof.point][2] for dof in modes.dofs])
    column = np.array([dof.point in case.components["column"] and dof.direction == "+y" for dof in modes.dofs])
    shape[column, 1] += 0.1 * np.abs(modes.shape[:, 1]).max() * (height[column] - 0.1) ** 2 / 2.0
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(replace(modes, shape=shape), case.points, case.components, chain=p1.CHAIN, masses=case.masses)
    for joint in result.joints:
        assert joint.kind == p1.KINDS[joint.child]
        assert (np.abs(joint.stiffness - p1.STIFFNESS[joint.child]) < 1.2 * joint.stiffness_interval).all()
    assert (result.joint("column").stiffness_interval > 0.05 * result.joint("column").stiffness).all()


def test_point_in_two_components_and_without_position(case, modes):
    parts = {**case.components, "magazine": [*case.components["magazine"], case.components["base"][0]]}
    with pytest.raises(ToolpointError, match="also in"):
        identify_joints(modes, case.points, parts, chain=p1.CHAIN)
    points = dict(case.points)
    del points[case.components["column"][0]]
    with pytest.raises(ToolpointError, match="no position"):
        identify_joints(modes, points, case.components, chain=p1.CHAIN)


def test_stiffness_needs_all_masses_and_the_ground(case, modes):
    with pytest.raises(ToolpointError, match="masses"):
        identify_joints(modes, case.points, case.components, chain=p1.CHAIN, masses={"base": case.masses["base"]})


def test_misgrouped_point_gives_no_confident_joint(case, modes):
    parts = {name: list(points) for name, points in case.components.items()}
    parts["base"] += [parts["magazine"].pop() for _ in range(4)]
    with pytest.warns(ToolpointWarning):
        result = identify_joints(modes, case.points, parts, chain=p1.CHAIN)
    assert not result.joint("base").certain


def test_component_of_three_points_is_rigid_by_itself_and_therefore_marked_without_variance(case, modes):
    parts = {**case.components, "magazine": case.components["magazine"][:3]}
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(replace(modes, shape_variance=None), case.points, parts, chain=p1.CHAIN)
    assert any("too few points" in doubt for doubt in result.joint("magazine").doubts)


def test_nothing_is_claimed_of_pure_noise(case, modes):
    rng = np.random.default_rng(6)
    noise = replace(modes, shape=rng.normal(size=modes.shape.shape), shape_variance=np.ones(modes.shape.shape))
    result = identify_joints(noise, case.points, case.components, chain=p1.CHAIN)
    assert all(joint.kind == "locked" for joint in result.joints)


@pytest.mark.parametrize("many", [pytest.param(1, marks=pytest.mark.slow), 4])
def test_points_of_another_component_are_named(case, modes, many):
    parts = {name: list(points) for name, points in case.components.items()}
    moved = [parts["base"].pop() for _ in range(many)]
    parts["magazine"] += moved
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(modes, case.points, parts, chain=p1.CHAIN)
    doubts = " ".join(result.joint("magazine").doubts)
    assert "do not move with magazine" in doubts
    assert all(str(point) in doubts for point in moved)


@pytest.mark.slow
def test_channels_swapped_at_one_point_are_named(case, modes):
    shape, at = modes.shape.copy(), 3 * list(case.points).index(case.components["column"][7])
    shape[at:at + 3] = shape[[at + 2, at + 1, at]]
    with pytest.warns(ToolpointWarning, match="doubtful"):
        result = identify_joints(replace(modes, shape=shape), case.points, case.components, chain=p1.CHAIN)
    assert f"points [{case.components['column'][7]}]: do not move with column" in " ".join(result.joint("column").doubts)
