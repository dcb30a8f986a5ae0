"""The unit and the frame of a test's points are questioned beside the bodies, before any fit of joints."""

from dataclasses import replace

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.machine.components import Components
from toolpoint.machine.description import BodyDescription, FrameDescription, PointDescription, ShapeDescription
from toolpoint.spatial import rotation
from toolpoint.spatial import transform as tf
from toolpoint.studies import place_test
from toolpoint.vibration import Modes
from toolpoint.vibration.dof import dofs

BOXES = {"base": ((0.0, 0.3, 0.2), (1.2, 1.8, 0.5)), "column": ((0.1, 1.0, 1.2), (0.6, 0.7, 2.0)),
         "head": ((0.1, 0.3, 1.7), (0.4, 0.8, 0.5))}


def machine_test(matrix=None, scale=1.0):
    """Return points on the surfaces of three boxes in a test's frame (matrix: test to machine), and their components."""
    rng = np.random.default_rng(1)
    points, names, bodies = {}, {}, {}
    back = np.eye(4) if matrix is None else tf.inverse(matrix)
    for name, (centre, size) in BOXES.items():
        at = rng.uniform(-0.5, 0.5, (12, 3))
        at[np.arange(12), rng.integers(0, 3, 12)] = rng.choice([-0.5, 0.5], 12)
        names[name] = list(range(len(points), len(points) + 12))
        points |= dict(zip(names[name], scale * tf.move(back, at * size + centre), strict=True))
        bodies[name] = BodyDescription(500.0, centre, shape=ShapeDescription("box", size))
    return points, Components("mill", ("ground", *BOXES), names, bodies)


def quarter_turn():
    return tf.transform(rotation.about("z", np.pi / 2), [0.4, -0.2, 0.1])


def test_points_at_their_bodies_keep_their_frame_without_a_doubt():
    placement = place_test(*machine_test())
    assert np.array_equal(placement.transform, np.eye(4)) and not placement.doubts


@pytest.mark.parametrize(("scale", "words"), [(1000.0, "mm read as m"), (1e-3, "m read as mm"), (1 / 0.0254, "inches")])
def test_another_unit_is_refused_before_the_fit_with_its_remedy(scale, words):
    points, components = machine_test(scale=scale)
    with pytest.raises(ToolpointError, match=r"x \[mm\]") as raised:
        place_test(points, components)
    assert words in str(raised.value) or "were they written in mm" in str(raised.value)


def test_a_machine_without_bodies_is_refused_by_its_span():
    points, components = machine_test(scale=1000.0)
    with pytest.raises(ToolpointError, match="span 2"):
        place_test(points, replace(components, bodies={}))


def test_a_turned_test_is_turned_back_and_the_doubt_says_the_key():
    points, components = machine_test(quarter_turn())
    placement = place_test(points, components)
    np.testing.assert_allclose(placement.transform, quarter_turn(), atol=0.05)
    (doubt,) = placement.doubts
    assert "frame" in doubt and "rotation: [90 deg, 0 deg, 0 deg]" in doubt and "turned by 90 deg" in doubt
    modes = Modes([10.0], 0.01, [[1.0], [2.0], [3.0]], dofs(["1:+x", "1:+y", "1:+z"]))
    assert [str(dof) for dof in placement.turned(modes).dofs] == ["1:+y", "1:-x", "1:+z"]


def test_a_frame_in_the_file_is_taken_without_a_doubt():
    points, components = machine_test(quarter_turn())
    told = replace(components, frame=FrameDescription((0.4, -0.2, 0.1), (np.pi / 2, 0.0, 0.0)))
    placement = place_test(points, told)
    np.testing.assert_allclose(placement.transform, quarter_turn(), atol=1e-12)
    assert not placement.doubts
    wrong = replace(components, frame=FrameDescription((0.4, -0.2, 0.1), (-np.pi / 2, 0.0, 0.0)))
    assert any("lie" in doubt and "box of its body" in doubt for doubt in place_test(points, wrong).doubts)


def test_points_of_the_same_names_fix_an_oblique_frame():
    matrix = tf.transform(rotation.from_euler("zyx", [0.5, -0.2, 0.3]), [0.3, 0.1, -0.4])
    points, components = machine_test(matrix)
    places = {str(k): PointDescription("base", tuple(tf.move(matrix, points[k][None])[0])) for k in (0, 4, 9)}
    placement = place_test(points, replace(components, places=places))
    np.testing.assert_allclose(placement.transform, matrix, atol=1e-9)


def test_two_turns_that_fit_alike_are_refused_until_the_frame_is_told():
    """A square column looks alike from four sides: on its side, nothing says how it was turned about its length."""
    rng = np.random.default_rng(2)
    at = rng.uniform(-0.5, 0.5, (40, 3)) * (0.5, 0.5, 2.0) + (0.0, 0.0, 1.0)
    points = dict(enumerate(tf.move(tf.transform(rotation.about("x", np.pi / 2)), at)))
    body = BodyDescription(500.0, (0.0, 0.0, 1.0), shape=ShapeDescription("box", (0.5, 0.5, 2.0)))
    components = Components("column", ("ground", "column"), {"column": list(points)}, {"column": body})
    with pytest.raises(ToolpointError, match="fit alike"):
        place_test(points, components)
    moved = dict(enumerate(at + np.array([5.0, 0.0, 0.0])))
    placement = place_test(moved, components)
    np.testing.assert_allclose(placement.transform[:3, 3], (-5.0, 0.0, 0.0), atol=0.1)
    assert "turned by 0 deg and moved by" in placement.doubts[0]


def test_a_turned_test_of_a_machine_about_as_wide_as_high_is_doubted_and_a_right_one_is_not():
    """Its points lie within 15 % of the machine's size either way: taken as they are, but not in silence."""
    corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T
    sizes = {"base": ((0.0, 0.0, 0.0), (1.0, 0.8, 1.2)), "head": ((0.0, 0.0, 0.1), (0.5, 0.3, 0.6))}
    turn = tf.transform(rotation.about("x", np.pi / 2), [0.0, 0.0, 0.0])
    bodies = {name: BodyDescription(500.0, centre, shape=ShapeDescription("box", size)) for name, (centre, size) in
              sizes.items()}
    names = {name: list(range(8 * k, 8 * k + 8)) for k, name in enumerate(sizes)}
    for matrix, count in ((np.eye(4), 0), (turn, 1)):
        points = {}
        for name, (centre, size) in sizes.items():
            places = tf.move(tf.inverse(matrix), corners * size + centre)
            points |= dict(zip(names[name], places, strict=True))
        placement = place_test(points, Components("mill", ("ground", *sizes), names, bodies))
        assert np.array_equal(placement.transform, np.eye(4))
        assert len(placement.doubts) == count
    assert "the test may be turned" in placement.doubts[0]
