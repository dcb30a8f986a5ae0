"""Hulls of measured points by component, and the difference of two shapes."""

import numpy as np
import pytest

from toolpoint.plot import AnimatedShapes, Scene, ShapeView
from toolpoint.plot.shape_view.hulls import hull_of, with_hulls
from toolpoint.plot.shape_view.shape_pairs import difference_of

CUBE = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], float)


def test_the_hull_of_a_cube_is_its_six_sides_turned_outwards_with_its_twelve_edges():
    faces, edges = hull_of(CUBE)
    assert len(faces) == 12 and len(edges) == 12
    corners = CUBE[faces] - 0.5
    volume = np.linalg.det(corners).sum() / 6  # by the divergence theorem: one where every face is turned outwards
    assert volume == pytest.approx(1.0)
    assert np.linalg.norm(CUBE[edges[:, 0]] - CUBE[edges[:, 1]], axis=1) == pytest.approx(1.0)


@pytest.mark.parametrize(("points", "faces", "edges"), [
    (np.array([[0, 0, 2], [1, 0, 2], [1, 1, 2], [0, 1, 2], [0.5, 0.4, 2]]), 2, 4),  # in a plane, one within
    (np.array([[0, 0, 0], [2, 2, 2], [1, 1, 1.0]]), 0, 2), (np.zeros((3, 3)), 0, 0)])
def test_points_of_a_plane_a_line_and_a_place_give_what_they_span(points, faces, edges):
    found = hull_of(points)
    assert (len(found[0]), len(found[1])) == (faces, edges)


def test_bodies_get_hulls_but_those_that_a_geometry_joins_and_nodes_stay_where_they_are():
    points = dict(enumerate(np.vstack([CUBE, CUBE + 3, [[9, 9, 9]]])))
    scene = Scene.of_points(points, [(0, 1)], components={"bed": range(8), "column": range(8, 16), "tip": [16]})
    hulled = with_hulls(scene)
    assert np.array_equal(hulled.nodes, scene.nodes) and hulled.body_names == scene.body_names
    assert set(hulled.node_body[hulled.triangles.ravel()]) == {1} and len(hulled.triangles) == 12
    assert len(hulled.lines) == 1 + 12


def test_the_difference_of_shapes_that_differ_by_a_factor_is_none_and_has_the_scale_of_the_first():
    shape = np.random.default_rng(1).normal(size=(1, 8, 3)) + 0j
    other = shape.copy()
    other[0, 3, 1] += 0.5
    first, second = (AnimatedShapes([20.0], [0.02], values) for values in (shape, (2 - 1j) * shape))
    assert np.abs(difference_of(first, second).displacement).max() < 1e-12
    left = difference_of(AnimatedShapes([20.0], [0.02], other), first).displacement[0]
    assert np.unravel_index(np.abs(left).argmax(), left.shape) == (3, 1)
    scene = Scene.of_points(dict(enumerate(CUBE)))
    panes = ShapeView(scene, first, other=(scene, second, "model"), difference=difference_of(first, second)).payload()["panes"]
    assert [pane["title"] for pane in panes] == ["", "model", "difference"] and panes[2]["like"] == 0
