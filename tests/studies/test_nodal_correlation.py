"""A virtual hammer test of a machine of finite elements and its correlation with a model that is not the tested machine."""

from dataclasses import replace

import numpy as np
import pytest

from solid_models import brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import Material, Patch
from toolpoint.spatial import transform as tf
from toolpoint.studies.finite_elements.hammer_test import plan_nodes, reachable_nodes, run_hammer_test
from toolpoint.studies.finite_elements.nodal_correlation import correlate_finite_elements, question_close_nodes
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint
from toolpoint.studies.measured.point_pairing import PointPairing, register_points

X, Y, Z = np.eye(3)
IRON = Material(5e9, 0.3, 7000.0)


def tower():
    """A column off the centre of a bed: no symmetry."""
    bed, column = brick([0.9, 0.5, 0.2], [4, 3, 1], IRON), brick([0.25, 0.2, 0.7], [1, 1, 4], IRON)
    column = type(column)(column.nodes + np.array([0.55, 0.2, 0.2]), column.blocks, column.materials)
    foot = Patch([0.45, 0.25, 0.0], X, -Y, 0.9, 0.5)
    low = Patch([0.675, 0.3, 0.2], X, -Y, 0.25, 0.2)
    high = Patch([0.675, 0.3, 0.2], X, Y, 0.25, 0.2)
    joints = (PatchJoint("floor", GROUND, "bed", np.array([4e7, 5e7, 9e7, 4e6, 7e6, 6e6]), foot),
              PatchJoint("flange", "bed", "column", np.array([1e8, 1.2e8, 2e8, 5e5, 7e5, 4e5]), low, high))
    return FiniteElementMachine({"bed": bed, "column": column}, joints, {})


@pytest.fixture(scope="module")
def tested():
    model = tower()
    pairs = model.solve(9)
    planned = plan_nodes(model, pairs, 14, struck=3)
    true = model.scaled(modulus={"column": 0.9}, joints={"flange": 0.8})
    c, s = np.cos(np.radians(3)), np.sin(np.radians(3))
    turn = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    frame = tf.transform(turn, np.array([0.3, -0.2, 0.5]))
    test = run_hammer_test(true, true.solve(9), planned, rng=np.random.default_rng(2), frame=frame, misplaced=0.002, noise=0.01)
    return model, pairs, planned, test


def test_planned_nodes_can_be_reached(tested):
    model, _, planned, _ = tested
    outside, ways = reachable_nodes(model)
    ways = dict(zip(outside.tolist(), ways, strict=True))
    assert set(planned.nodes) <= set(ways) and all(dof.direction in ways[dof.point] for dof in planned.struck)
    at = model.nodes[outside - 1]
    assert (at[:, 2] > 0).all(), "nothing under the bed"
    covered = (np.abs(at[:, 2] - 0.2) < 1e-9) & (at[:, 0] > 0.56) & (at[:, 0] < 0.79) & (at[:, 1] > 0.21) & (at[:, 1] < 0.39)
    assert not covered.any(), "nothing under the column"


def test_modes_that_nobody_chose(tested):
    *_, test = tested
    for f, ratio in zip(test.truth.frequency[:6], test.truth.damping_ratio[:6], strict=True):
        k = int(np.argmin(np.abs(test.modes.frequency - f)))
        assert test.modes.frequency[k] == pytest.approx(f, rel=1e-3)
        assert test.modes.damping_ratio[k] == pytest.approx(ratio, rel=0.05)
    assert 0.5 < test.coherence.mean() < 1


def test_correlation_finds_nodes_and_pairs(tested):
    model, pairs, planned, test = tested
    result = correlate_finite_elements(model, pairs, test)
    assert result.correlation.points.pairs == {i + 1: node for i, node in enumerate(planned.nodes)}
    assert [i for i, j in result.pairs[:6]] == [j for i, j in result.pairs[:6]] and not result.doubts
    c = result.correlation.coefficients
    assert c.mac.min() > 0.8 and (result.mix >= np.diag(result.correlation.mac)[:len(result.mix)] - 1e-9).all()
    assert c.total < c.mean < 1, "the model is stiffer than what was tested"
    # The same machine as model: all equal but noise.
    same = model.scaled(modulus={"column": 0.9}, joints={"flange": 0.8})
    again = correlate_finite_elements(same, same.solve(9), test).correlation.coefficients
    assert again.mac[:6].min() > 0.999 and again.mean > 0.9995
    assert "over all pairs" in result.table() and result.to_dict()["total"] == c.total


def test_a_point_between_two_nodes_is_doubted(tested):
    """Three points at their nodes to 1 mm, a fourth 5 mm from its own and 5.2 mm from another."""
    *_, test = tested
    nodes = {1: [0.0, 0, 0], 2: [1.0, 0, 0], 3: [0.0, 1, 0], 4: [0.0, 0, 1], 5: [0.0102, 0, 1]}
    at = {"a": [1e-3, 0, 0], "b": [1.0, 1e-3, 0], "c": [0, 1.001, 0], "d": [0.005, 0, 1]}
    moved = replace(test, coordinates={name: np.array(place) for name, place in at.items()})
    pairing = replace(PointPairing.identity(list(at)), pairs={"a": 1, "b": 2, "c": 3, "d": 4})
    assert question_close_nodes(pairing, moved, nodes).startswith("points d: lie between two nodes, within the error of places")
    assert question_close_nodes(replace(pairing, pairs={"a": 1, "b": 2, "c": 3}), moved, nodes) is None


def test_a_machine_alike_from_both_sides_is_doubted():
    box = dict(enumerate(brick([0.6, 0.3, 0.2], [4, 2, 2]).nodes))
    test = {k: at + 0.002 * np.random.default_rng(k).normal(size=3) for k, at in list(box.items())[::7]}
    assert "another placing of the test's frame fits nearly as well" in register_points(test, box)[1]


def test_a_test_without_damping_is_refused(tested):
    model, pairs, planned, _ = tested
    with pytest.raises(ToolpointError, match="damping_ratio: 0; must be above 0"):
        run_hammer_test(model, pairs, planned, rng=np.random.default_rng(0), damping_ratio=0.0)
