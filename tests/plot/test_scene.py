"""Scenes and animated shapes: geometry laws, and motion from Dofs in any direction."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from toolpoint import Dof, Modes, ToolpointError, ToolpointWarning
from toolpoint.plot import AnimatedShapes, Box, Scene


def volume(scene):
    a, b, c = (scene.nodes[scene.triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6  # divergence theorem: positive where normals point out


@given(st.lists(st.floats(0.1, 3), min_size=3, max_size=3), st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_box_is_closed_and_faces_point_out(size, centre):
    scene = Scene.of_boxes([Box("a", centre, size)])
    assert volume(scene) == pytest.approx(np.prod(size))
    np.testing.assert_allclose(scene.nodes.mean(axis=0), centre, atol=1e-12)
    lengths = np.linalg.norm(np.diff(scene.nodes[scene.lines], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(np.sort(lengths), np.sort(np.repeat(size, 4)))


def test_turned_box_keeps_its_edges():
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    scene = Scene.of_boxes([Box("a", (0, 0, 0), (1, 2, 3), turn)])
    np.testing.assert_allclose(np.ptp(scene.nodes, axis=0), (2, 1, 3))


def test_mesh_edges_of_a_triangulated_box_are_its_twelve():
    box = Scene.of_boxes([Box("a", (0, 0, 0), (1, 2, 3))])
    mesh = Scene.of_mesh("a", box.nodes, box.triangles)
    assert {tuple(sorted(e)) for e in mesh.lines.tolist()} == {tuple(sorted(e)) for e in box.lines.tolist()}
    assert Scene.of_mesh("a", box.nodes, box.triangles[:1]).lines.shape == (3, 2)  # a rim is drawn


def test_joined_scenes_keep_positions_and_merge_bodies(machine):
    both = Scene.joined([machine, Scene.of_boxes([Box("bed", (5, 0, 0), (1, 1, 1)), Box("new", (7, 0, 0), (1, 1, 1))])])
    assert both.body_names == ("bed", "column", "table", "head", "new")
    assert both.nodes.shape[0] == machine.nodes.shape[0] + 16
    assert volume(both) == pytest.approx(volume(machine) + 2)
    assert set(both.node_body[-16:-8]) == {0}


def test_points_with_components():
    points = {1: (0, 0, 0), "tip": (1, 0, 0), 3: (2, 0, 0)}
    scene = Scene.of_points(points, [(1, "tip")], components={"arm": [1, "tip"]})
    assert scene.body_names == ("arm", "other points")
    assert scene.node_body.tolist() == [0, 0, 1]
    assert scene.lines.tolist() == [[0, 1]]
    with pytest.raises(ToolpointError, match="point 9 has no coordinates"):
        Scene.of_points({1: (0, 0, 0)}, [(1, 9)])


@pytest.mark.parametrize(("change", "message"), [
    ({"nodes": np.zeros((0, 3))}, "at least one node"), ({"nodes": [[0, 0, np.nan]]}, "finite"),
    ({"triangles": [[0, 1, 7]]}, "index 7"), ({"lines": [[0, -1]]}, "index -1"), ({"lines": [[0.5, 1]]}, "whole"),
    ({"node_body": [0]}, "one body index"), ({"body_names": ("a", "a")}, "different names")])
def test_faulty_scenes_are_refused(change, message):
    good = {"nodes": np.eye(3), "triangles": [[0, 1, 2]], "lines": [[0, 1]]}
    with pytest.raises(ToolpointError, match=message):
        Scene(**{**good, **change})


@given(st.integers(0, 2**32 - 1))
def test_any_three_independent_directions_give_the_translation_back(seed):
    rng = np.random.default_rng(seed)
    true = rng.normal(size=3) + 1j * rng.normal(size=3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    skew = turn[:, 0] + 0.5 * turn[:, 1]
    vectors = [turn[:, 0], skew / np.linalg.norm(skew), turn[:, 2]]
    dofs = [Dof("p", f"n{i}", tuple(v)) for i, v in enumerate(vectors)]
    modes = Modes([5.0], [0.01], (np.array(vectors) @ true)[:, None], dofs, scaling="unscaled")
    shapes = AnimatedShapes.from_modes(modes, {"p": (0, 0, 0)})
    found = shapes.displacement[0, 0]
    # equal up to the free phase of a mode
    assert abs(np.vdot(found, true)) == pytest.approx(np.linalg.norm(true) * np.linalg.norm(found), rel=1e-9)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(true))
    assert np.sum(found**2).real >= 0 and abs(np.sum(found**2).imag) < 1e-9 * np.linalg.norm(true)**2


def test_signed_directions_repeated_directions_and_gaps():
    dofs = [Dof(1, "-x"), Dof(1, "+x"), Dof(1, "+y"), Dof(1, "+rz"), Dof(2, "+z")]
    modes = Modes([5.0], [0.01], np.array([[-2.0], [4.0], [1.0], [99.0], [0.5]]), dofs)
    shapes = AnimatedShapes.from_modes(modes, {1: (0, 0, 0), 2: (1, 0, 0), 3: (2, 0, 0)})
    np.testing.assert_allclose(shapes.displacement[0], [[3, 1, 0], [0, 0, 0.5], [0, 0, 0]], atol=1e-12)
    assert shapes.has_data.tolist() == [True, True, False]
    assert any("1 of 3 points have no data" in note for note in shapes.notes)
    assert any("one or two directions" in note for note in shapes.notes)


def test_data_without_coordinates_warns():
    modes = Modes([5.0], [0.01], np.ones((2, 1)), [Dof(1, "+x"), Dof("lost", "+x")])
    with pytest.warns(ToolpointWarning, match="no coordinates, for example lost"):
        shapes = AnimatedShapes.from_modes(modes, {1: (0, 0, 0)})
    assert any("lost" in note for note in shapes.notes)


def test_aligned_turns_only_the_phase(shapes):
    turned = AnimatedShapes(shapes.frequency, shapes.damping_ratio, shapes.displacement * np.exp(0.7j))
    np.testing.assert_allclose(np.abs(turned.aligned().displacement), np.abs(shapes.displacement), atol=1e-12)
    assert np.abs(turned.aligned().displacement[0].imag).max() < 1e-12 * np.abs(shapes.displacement[0]).max()


def test_faulty_shapes_are_refused():
    with pytest.raises(ToolpointError, match="must end in"):
        AnimatedShapes([1.0], [0.0], np.zeros((2, 5, 3)))
    with pytest.raises(ToolpointError, match="labels"):
        AnimatedShapes([1.0], [0.0], np.zeros((1, 5, 3)), ("a", "b"))
    with pytest.raises(ToolpointError, match="one pose"):
        AnimatedShapes.from_modes(Modes(np.ones((2, 1)), 0.0, np.ones((2, 1, 1)), [Dof(1, "x")]), {1: (0, 0, 0)})
