"""Slopes of shapes and of MAC by every element: differences, sum rules, and what is refused."""

import numpy as np
import pytest

from solid_models import brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import ElementBlock, Material, Patch, SolidModel
from toolpoint.studies.finite_elements.shape_sensitivity import accumulate, mac_sensitivity, motion_sensitivity
from toolpoint.studies.finite_elements.whole_machine import GROUND, FiniteElementMachine, PatchJoint
from toolpoint.vibration import Dof
from toolpoint.vibration.correlation import mac

SOFT = Material(2e8, 0.3, 1000.0)
X, Y, Z = np.eye(3)
K = np.array([1e6, 2e6, 3e6, 4e4, 5e4, 6e4])


def leaning_blocks():
    """Two blocks off each other's centre, the upper one of two sets of one element each; no symmetry, no repeated modes."""
    low, high = brick([0.2, 0.15, 0.3], [2, 1, 2], SOFT), brick([0.15, 0.1, 0.25], [1, 1, 2], SOFT)
    nodes = high.blocks[0].nodes
    high = SolidModel(high.nodes + np.array([0.03, 0.02, 0.3]), [ElementBlock(nodes[:1], "a"), ElementBlock(nodes[1:], "b")],
                      {"a": SOFT, "b": SOFT})
    top = np.array([0.1, 0.07, 0.3])
    joints = (PatchJoint("foot", GROUND, "low", K, Patch([0.1, 0.075, 0.0], X, -Y, 0.2, 0.15)),
              PatchJoint("flange", "low", "high", 2 * K, Patch(top, X, -Y, 0.1, 0.08), Patch(top, X, Y, 0.1, 0.08)))
    return FiniteElementMachine({"low": low, "high": high}, joints, {})


DOFS = [Dof(i, way) for i in (3, 11, 40, 60, 75) for way in ("+x", "+y", "+z")]
MODES = [0, 1, 2, 4]


@pytest.fixture(scope="module")
def measured():
    """Shapes that are like the model's, complex, with a mix of neighbours and noise."""
    rng = np.random.default_rng(3)
    machine = leaning_blocks()
    pairs = machine.solve(10)
    shape = machine.modes_at(pairs, DOFS, 0.0).shape[:, MODES]
    other = rng.normal(size=(2, *shape.shape)) * np.abs(shape).max(axis=0)
    return machine, pairs, (shape + 0.2 * other[0] + 0.1j * other[1]) * np.exp(0.7j)


def macs(machine, shapes):
    pairs = machine.solve(10)
    return np.diag(mac(shapes, machine.modes_at(pairs, DOFS, 0.0).shape[:, MODES]))


def slope(value, h=2e-3):
    f = [value(1 + s) for s in (h, -h, 2 * h, -2 * h)]
    return (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h)


@pytest.mark.parametrize(("kind", "name"), [("modulus", "high.a"), ("modulus", "low"), ("density", "high.b"),
                                            ("density", "low"), ("joints", "flange")])
@pytest.mark.default_cases(2)
def test_mac_against_differences(measured, kind, name):
    machine, pairs, shapes = measured
    result = mac_sensitivity(machine, pairs, DOFS, measured=shapes, which=MODES)
    assert np.allclose(result.values, macs(machine, shapes), atol=1e-9) and result.values.min() < 0.95
    expected = slope(lambda factor: macs(machine.scaled(**{kind: {name: factor}}), shapes))
    part, _, group = name.partition(".")
    if kind == "joints":
        ours = result.joints[name]
    else:
        which = ("modulus", "density").index(kind)
        ours = result.parts[part].by_set()[group][which] if group else result.by_part()[part][which]
    assert np.allclose(ours, expected, atol=1e-6 * np.abs(expected).max()), (ours, expected)


def test_mac_does_not_change_where_all_stiffness_or_all_density_does(measured):
    machine, pairs, shapes = measured
    result = mac_sensitivity(machine, pairs, DOFS, measured=shapes, which=MODES)
    size = sum(np.abs(p.modulus).sum(axis=1) for p in result.parts.values())
    stiff = sum(m for m, _ in result.by_part().values()) + sum(result.joints.values())
    assert (size > 1e-3).all()
    assert np.allclose(stiff / size, 0, atol=1e-9)
    assert np.allclose(sum(d for _, d in result.by_part().values()) / size, 0, atol=1e-9)


def test_shapes_at_unit_modal_mass(measured):
    """All densities together: motion goes with 1 / sqrt(density); one set against differences."""
    machine, pairs, _ = measured
    weights = machine.motion_of(DOFS[:2])
    motions = {"first": weights[:, [0]], "second": weights[:, [1]]}
    result = motion_sensitivity(machine, pairs, motions, which=MODES)
    assert result.names[:3] == ("first in mode 1", "second in mode 1", "first in mode 2")
    total, size = sum(d for _, d in result.by_part().values()), np.abs(result.values).max()
    assert np.allclose(total, -result.values / 2, atol=1e-9 * size)

    def motion(factor):
        vectors = machine.scaled(density={"high.a": factor}).solve(10).vectors[:, MODES]
        signs = np.sign((vectors * pairs.vectors[:, MODES]).sum(axis=0))
        return (weights.T @ (vectors * signs)).T.ravel()

    expected = slope(motion)
    assert np.allclose(result.parts["high"].by_set()["a"][1], expected, atol=1e-6 * np.abs(expected).max())


def test_cumulated_values_end_at_the_sum():
    values = np.array([[1.0, -4.0, 2.0]])
    assert accumulate(values).tolist() == [[-4.0, -2.0, -1.0]]


def test_one_mode_more_than_is_studied(measured):
    machine, pairs, shapes = measured
    with pytest.raises(ToolpointError, match="10 modes; must be at least 11"):
        mac_sensitivity(machine, pairs, DOFS, measured=shapes[:, :1], which=[9])


def test_a_part_alone_keeps_what_carries_it():
    alone = leaning_blocks().part_alone("high")
    assert list(alone.parts) == ["high"] and [j.parent for j in alone.joints] == [GROUND]
    assert alone.solve(2).rigid_count == 0
    with pytest.raises(ToolpointError, match="'ground'; must be carried by a joint"):
        leaning_blocks().part_alone("ground")


def test_unknown_names_of_factors():
    with pytest.raises(ToolpointError, match=r"modulus: 'high.c'; must be of high, high.a, high.b, low"):
        leaning_blocks().scaled(modulus={"high.c": 1.0})
