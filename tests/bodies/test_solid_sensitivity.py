"""Sensitivities of elements: sum rules, differences, sets; and what is refused before a solution."""

import numpy as np
import pytest

from solid_models import brick, tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, ElementBlock, Material, SolidModel
from toolpoint.bodies.solid.checks import check_solid
from toolpoint.bodies.solid.sensitivity import frequency_sensitivity
from toolpoint.vibration.sparse import modes


def held_modes(model, number=4, **scales):
    free = model.free_coordinates(model.nodes_in([-1, -1, 0], [9, 9, 0]))
    k, m = model.stiffness(scales.get("modulus"))[free][:, free], model.mass(scales.get("density"))[free][:, free]
    pairs = modes(k, m, number)
    full = np.zeros((model.size, pairs.count))
    full[free] = pairs.vectors
    return pairs, full


def split(model):
    """The same model with every element its own set."""
    blocks = [ElementBlock(block.nodes[i:i + 1], f"e{i}") for block in model.blocks for i in range(len(block))]
    return SolidModel(model.nodes, blocks, {f"e{i}": STEEL for i in range(len(blocks))})


@pytest.mark.parametrize("build", [brick, tetrahedral_brick])
def test_sum_rules(build):
    """Frequencies go with sqrt(E / rho): the sums over all elements are 1/2 and -1/2."""
    model = build([0.1, 0.07, 0.3], [2, 1, 4])
    pairs, full = held_modes(model)
    found = frequency_sensitivity(model, pairs.squares, full)
    assert np.allclose(found.modulus.sum(axis=1), 0.5, atol=1e-9) and np.allclose(found.density.sum(axis=1), -0.5, atol=1e-9)
    assert (found.modulus >= 0).all() and (found.density <= 0).all()


def test_each_element_against_differences():
    model = split(brick([0.1, 0.07, 0.3], [2, 1, 3]))
    pairs, full = held_modes(model)
    found = frequency_sensitivity(model, pairs.squares, full)
    h = 1e-4
    for i, name in enumerate(model.set_names):
        for values, kind in ((found.modulus, "modulus"), (found.density, "density")):
            f = [held_modes(model, **{kind: {name: 1 + s}})[0].frequency for s in (h, -h, 2 * h, -2 * h)]
            slope = (8 * (f[0] - f[1]) - (f[2] - f[3])) / (12 * h) / pairs.frequency
            assert np.allclose(values[:, i], slope, atol=1e-6 * abs(values).max())


def test_sets_are_the_sums_of_their_elements():
    casting = Casting([Cuboid([0, 0, 0], [0.2, 0.1, 0.2], "bed"), Cuboid([0, 0, 0.2], [0.2, 0.1, 0.3], "head")],
                      {"bed": STEEL, "head": Material(70e9, 0.33, 2700.0)})
    model = casting.meshed(0.1)
    pairs, full = held_modes(model)
    found = frequency_sensitivity(model, pairs.squares, full)
    sums = found.by_set()
    assert list(sums) == ["bed", "head"]
    assert np.allclose(sum(m for m, _ in sums.values()), 0.5)
    assert np.allclose(sums["head"][1], found.density[:, np.array(found.set_names) == "head"].sum(axis=1))


def test_rigid_modes_have_no_sensitivity_to_e():
    model = brick([0.1, 0.1, 0.1], [1, 1, 1])
    with pytest.raises(ToolpointError, match="1 rigid-body modes"):
        frequency_sensitivity(model, np.zeros(1), np.zeros((model.size, 1)))


def test_check_of_a_sound_model():
    check = check_solid(brick([0.4, 0.3, 0.2], [2, 2, 1]))
    assert check.jacobian_ratio == pytest.approx(1) and check.mass == pytest.approx(0.024 * STEEL.density)


def test_a_drawing_in_mm_read_as_m_is_refused():
    with pytest.raises(ToolpointError, match=r"size: 400 m; must be within 0.002 .. 30 m .*read it with unit='mm'"):
        check_solid(brick([400.0, 300, 200], [1, 1, 1]))


def test_two_bodies_in_one_mesh_are_refused():
    a = brick([0.1, 0.1, 0.1], [1, 1, 1])
    nodes = np.vstack([a.nodes, a.nodes + 1])
    elements = np.vstack([a.blocks[0].nodes, a.blocks[0].nodes + len(a.nodes)])
    with pytest.raises(ToolpointError, match="mesh: 2 bodies of 20, 20 nodes; must be one"):
        check_solid(SolidModel(nodes, [ElementBlock(elements)], {"body": STEEL}))
