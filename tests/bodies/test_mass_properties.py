"""Mass properties: closed forms of solids, meshes against them, and what no body can have."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint.bodies import MassProperties, mesh, shapes
from toolpoint.bodies.inertia import combine, without
from toolpoint.spatial import transform as tf

sizes = st.lists(st.floats(0.05, 3), min_size=3, max_size=3)


def box_mesh(size):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - 0.5
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
             (1, 5, 7), (1, 7, 3)]
    return corners * size, np.array(faces)


@given(sizes, st.lists(st.floats(-5, 5), min_size=6, max_size=6))
def test_mesh_of_a_box_anywhere_is_the_box(size, xi):
    nodes, faces = box_mesh(np.array(size))
    t = tf.exponential(np.array(xi))
    found = mesh.mass_properties(tf.move(t, nodes), faces, 7200.0)
    expected = shapes.box(size, 7200.0).moved(t)
    assert found.mass == pytest.approx(expected.mass, rel=1e-9)
    np.testing.assert_allclose(found.centre, expected.centre, atol=1e-9)
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=1e-7, atol=1e-9 * np.trace(expected.inertia))


def test_mesh_of_a_sphere_converges_with_second_order():
    def error(n):
        phi, theta = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * n + 1)[:-1], np.linspace(0, np.pi, n + 1)[1:-1])
        ring = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
        nodes = np.concatenate([ring.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
        m, faces = 2 * n, []
        top, bottom = len(nodes) - 2, len(nodes) - 1
        for j in range(m):
            k = (j + 1) % m
            faces += [(top, j, k), (bottom, (n - 2) * m + k, (n - 2) * m + j)]
            for i in range(n - 2):
                a, b, c, d = i * m + j, i * m + k, (i + 1) * m + j, (i + 1) * m + k
                faces += [(a, c, b), (b, c, d)]
        found = mesh.mass_properties(nodes, np.array(faces), 1000.0)
        return abs(found.mass / shapes.sphere(2.0, 1000.0).mass - 1)
    assert error(16) / error(32) == pytest.approx(4, rel=0.1)


@pytest.mark.parametrize(("change", "message"), [
    (lambda f: f[1:], "open edges"), (lambda f: f[:, ::-1], "inside out"),
    (lambda f: np.concatenate([f[:1, ::-1], f[1:]]), "same direction"), (lambda f: f + 5, "node number")])
def test_meshes_that_bound_no_solid_are_refused(change, message):
    nodes, faces = box_mesh(np.ones(3))
    with pytest.raises(ValueError, match=message):
        mesh.mass_properties(nodes, change(faces), 7800.0)


def test_stl_corners_become_nodes():
    nodes, faces = box_mesh(np.ones(3))
    merged_nodes, merged_faces = mesh.merge_corners(nodes[faces])
    assert len(merged_nodes) == 8
    assert mesh.mass_properties(merged_nodes, merged_faces, 2.0).mass == pytest.approx(2.0)


def test_tube_is_cylinder_without_its_core():
    tube = shapes.cylinder(0.2, 0.5, 7800.0, bore=0.1)
    rest = without(shapes.cylinder(0.2, 0.5, 7800.0), shapes.cylinder(0.1, 0.5, 7800.0))
    assert tube.mass == pytest.approx(rest.mass)
    np.testing.assert_allclose(tube.inertia, rest.inertia, rtol=1e-12)
    whole = combine(tube, shapes.cylinder(0.1, 0.5, 7800.0))
    np.testing.assert_allclose(whole.inertia, shapes.cylinder(0.2, 0.5, 7800.0).inertia, rtol=1e-12)


@given(sizes, st.lists(st.floats(-2, 2), min_size=6, max_size=6), st.lists(st.floats(-2, 2), min_size=6, max_size=6))
def test_kinetic_energy_does_not_depend_on_the_frame(size, xi, velocity):
    body, t, v = shapes.box(size, 1000.0, (0.1, 0.2, 0.3)), tf.exponential(np.array(xi)), np.array(velocity)
    here = v @ body.spatial @ v
    moved = tf.adjoint(t) @ v
    assert moved @ body.moved(t).spatial @ moved == pytest.approx(here, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize(("mass", "inertia", "message"), [
    (-1.0, np.eye(3), "above zero"), (1.0, np.diag([1, 1, 3.0]), "triangle"), (1.0, np.diag([-1, 1, 1.0]), "negative"),
    (1.0, np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "symmetric"), (np.nan, np.eye(3), "finite")])
def test_impossible_bodies_are_refused(mass, inertia, message):
    with pytest.raises(ValueError, match=message):
        MassProperties(mass, np.zeros(3), inertia)


def test_taking_away_more_than_there_is_is_refused():
    with pytest.raises(ValueError, match=r"triangle|negative"):
        without(shapes.box((1, 1, 1), 1000.0), shapes.box((0.1, 0.1, 5.0), 1000.0))
