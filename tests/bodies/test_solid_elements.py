"""Solid elements: shape functions, patch test, rigid motion, mass, and weighted averages of a patch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, ElementBlock, Material, Patch, SolidModel, matrices
from toolpoint.bodies.solid import element_kinds as kinds
from toolpoint.vibration.sparse import modes

KINDS = (kinds.HEXAHEDRON, kinds.TETRAHEDRON, kinds.STRAIGHT_TETRAHEDRON)


def block(size, step, name="body"):
    return Casting([Cuboid([0, 0, 0], size, name)], {name: STEEL}).meshed(step)


def distorted(kind, seed=3):
    """One element with corners moved about and straight sides, m."""
    rng = np.random.default_rng(seed)
    nodes = kind.nodes.copy()
    corners = kind.corner_count
    nodes[:corners] += 0.15 * rng.standard_normal((corners, 3)) * np.ptp(nodes[:, 0]) / 2
    nodes[corners:] = nodes[kind.sides].mean(axis=1)
    return nodes


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: f"{k.name} {len(k.points)}")
def test_shape_functions_are_one_at_their_node_and_slopes_are_theirs(kind):
    assert np.allclose(kind.values(kind.nodes), np.eye(kind.node_count), atol=1e-14)
    at, h = np.random.default_rng(0).random((5, 3)) * 0.3, 1e-6
    for axis in range(3):
        step = h * np.eye(3)[axis]
        assert np.allclose((kind.values(at + step) - kind.values(at - step)) / (2 * h), kind.slopes(at)[:, :, axis], atol=1e-8)


def test_tetrahedron_rules_integrate_their_degree():
    """Integral of x^a y^b z^c over the unit tetrahedron is a! b! c! / (a + b + c + 3)! (Stroud 1971)."""
    from math import factorial as f

    for kind, degree in ((kinds.STRAIGHT_TETRAHEDRON, 2), (kinds.TETRAHEDRON, 4)):
        for a in range(degree + 1):
            for b in range(degree + 1 - a):
                for c in range(degree + 1 - a - b):
                    value = kind.weights @ np.prod(kind.points ** [a, b, c], axis=1)
                    assert value == pytest.approx(f(a) * f(b) * f(c) / f(a + b + c + 3), rel=1e-12), (a, b, c)


@pytest.mark.parametrize("kind", KINDS[:2], ids=lambda k: k.name)
def test_patch_test_of_a_distorted_element(kind):
    """A linear displacement field gives the energy of its uniform strain, exactly (Irons' patch test)."""
    nodes = distorted(kind)
    slope = np.random.default_rng(1).standard_normal((3, 3))
    u = (nodes @ slope.T).ravel()
    k = matrices.stiffness(kind, nodes[None], STEEL)[0]
    volume = matrices.scalar_mass(kind, nodes[None], 1.0).sum()
    e = (slope + slope.T) / 2
    strain = np.array([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[2, 0]])
    elasticity = np.diag([2 * STEEL.shear_modulus] * 3 + [STEEL.shear_modulus] * 3)  # stress per engineering strain
    elasticity[:3, :3] += STEEL.lame
    assert u @ k @ u == pytest.approx(volume * strain @ elasticity @ strain, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS[:2], ids=lambda k: k.name)
def test_element_has_six_rigid_motions_and_no_more(kind):
    nodes = distorted(kind, 5)
    values = np.linalg.eigvalsh(matrices.stiffness(kind, nodes[None], STEEL)[0])
    assert abs(values[:6]).max() < 1e-12 * values[-1] and values[6] > 1e-6 * values[-1]


def test_inverted_element_is_refused():
    nodes = kinds.TETRAHEDRON.nodes[[0, 2, 1, 3, 6, 5, 4, 7, 9, 8]]
    model = SolidModel(nodes, [ElementBlock(np.arange(10)[None])], {"body": STEEL})
    with pytest.raises(ToolpointError, match=r"element 0 of 1.*inside out"):
        model.stiffness()


def test_poisson_one_half_is_refused():
    with pytest.raises(ToolpointError, match=r"Material.poisson: 0.5; must be above -1 and below 0.4999"):
        Material(1e6, 0.5, 1000.0)


def test_box_has_the_mass_and_inertia_of_its_geometry():
    model = block([0.3, 0.2, 0.1], 0.1)
    mass = STEEL.density * 0.006
    assert model.mass_properties.mass == pytest.approx(mass, rel=1e-12)
    assert np.allclose(model.mass_properties.inertia, mass / 12 * np.diag([0.05, 0.1, 0.13]), rtol=1e-12)
    rigid = model.rigid_motion(model.mass_properties.centre)
    assert np.allclose(rigid.T @ (model.mass() @ rigid), np.diag([mass] * 3 + list(mass / 12 * np.array([0.05, 0.1, 0.13]))))
    assert abs(model.stiffness() @ rigid).max() < 1e-12 * abs(model.stiffness().data).max()


def test_parts_scale_with_modulus_and_density():
    casting = Casting([Cuboid([0, 0, 0], [0.2, 0.1, 0.1], "bed"), Cuboid([0.2, 0, 0], [0.4, 0.1, 0.1], "arm")],
                      {"bed": STEEL, "arm": Material(70e9, 0.33, 2700.0)})
    model = casting.meshed(0.1)
    stiff = Casting(casting.cuboids, {"bed": STEEL, "arm": Material(140e9, 0.33, 8100.0)}).meshed(0.1)
    assert abs(model.stiffness({"arm": 2}) - stiff.stiffness()).max() < 1e-9 * abs(stiff.stiffness()).max()
    assert abs(model.mass({"arm": 3}) - stiff.mass()).max() < 1e-12
    with pytest.raises(ToolpointError, match="no set 'leg'"):
        model.mass({"leg": 2})


def test_free_cube_has_the_lame_mode():
    """f = sqrt(G / rho) / (sqrt(2) a), the Lame mode of a free cube, exact."""
    model = block([1, 1, 1], 0.25)
    exact = np.sqrt(STEEL.shear_modulus / STEEL.density) / np.sqrt(2)
    pairs = modes(model.stiffness(), model.mass(), 18)
    assert pairs.rigid_count == 6 and pairs.is_complete
    assert abs(pairs.frequency / exact - 1).min() < 6e-4


def test_casting_in_two_pieces_is_refused():
    with pytest.raises(ToolpointError, match="2 pieces of 1, 1 elements"):
        Casting([Cuboid([0, 0, 0], [1, 1, 1]), Cuboid([2, 0, 0], [3, 1, 1])], {"body": STEEL}).meshed(1)


RAIL = block([0.4, 0.1, 0.06], 0.05)


@given(st.floats(0.06, 0.34), st.floats(0.03, 0.07))
def test_patch_moves_rigidly_with_the_body_and_keeps_resultants(x, y):
    patch = Patch([x, y, 0.06], [1, 0, 0], [0, 1, 0], 0.1, 0.05)
    weights = patch.averages(RAIL)
    assert np.allclose(weights.T @ RAIL.rigid_motion(patch.centre), np.eye(6), atol=1e-12)


def test_patch_weights_change_smoothly():
    """The weights of a patch that slides over a mesh have no jump of their slope: face integrals, not nodes inside."""
    at = np.arange(0.07, 0.2, 0.002)  # half of a rail that is the same from both ends
    weights = np.array([Patch([x, 0.05, 0.06], [1, 0, 0], [0, 1, 0], 0.1, 0.05).averages(RAIL).toarray()[:, 0] for x in at])
    jumps = abs(np.diff(weights, 2, axis=0)).max()
    assert jumps < 40 * (at[1] - at[0]) ** 2 * abs(weights).max() / 0.05**2


def test_patch_off_its_face_is_refused():
    with pytest.raises(ToolpointError, match=r"50 % of its 0.005 m\^2 lie on outer faces"):
        Patch([0.4, 0.05, 0.06], [1, 0, 0], [0, 1, 0], 0.1, 0.05).averages(RAIL)


def test_a_patch_that_is_a_point_beside_its_elements_is_refused():
    """Its yielding is that of the mesh: without limit as that gets finer."""
    size = 0.01
    coarse = block([0.3, 0.2, 0.1], 0.1)
    for length, is_point in ((2e-3, True), (size, False)):
        patch = Patch([0.15, 0.05, 0.1], [1, 0, 0], [0, 1, 0], length, length)
        if is_point:
            with pytest.raises(ToolpointError, match="a point beside elements of 100 mm"):
                patch.averages(coarse)
        else:
            assert patch.averages(coarse).shape == (coarse.size, 6)
    assert Patch([0.15, 0.05, 0.1], [1, 0, 0], [0, 1, 0], 2e-3, 2e-3).averages(block([0.3, 0.2, 0.1], 0.02)).shape[1] == 6
