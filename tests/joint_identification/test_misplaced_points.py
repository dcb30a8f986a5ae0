"""A point that lies elsewhere than stated is named, placed and left out; right points, wrong channels and noise are not."""

from __future__ import annotations

import numpy as np
import pytest

from joint_identification import p1_case as p1
from toolpoint._check import ToolpointWarning
from toolpoint.joint_identification import identify_joints
from toolpoint.joint_identification.motion.measured import component, determines_motion
from toolpoint.joint_identification.motion.misplaced_points import find_misplaced
from toolpoint.joint_identification.motion.wrong_points import find_wrong_points
from toolpoint.vibration import Dof, Modes

MODES, NOISE = 5, 5e-3


def body(seed: int, *, shift=(0.0, 0.0, 0.0), factor: float = 1.0, is_known: bool = True, number: int = 6,
         noise: float = NOISE) -> dict:
    """Return a rigid body whose point 3 was stated elsewhere by a shift, m, or has one channel with a wrong factor."""
    rng = np.random.default_rng(seed)
    labels = [Dof(point, way) for point in range(number) for way in ("+x", "-y", "+z")]
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(number)}
    motions = rng.standard_normal((MODES, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions] for dof in labels])
    shape[10] *= factor
    shape += noise * rng.standard_normal(shape.shape)
    modes = Modes(10.0 * np.arange(1, MODES + 1), [0.01] * MODES, shape, labels, "unscaled",
                  shape_variance=np.full(shape.shape, noise**2) if is_known else None)
    stated = {**places, 3: places[3] - np.array(shift)}
    return {"head": component("head", modes, stated, labels=list(range(number)))}


@pytest.mark.parametrize("is_known", [True, False])
def test_a_misplaced_point_is_named_with_its_place(is_known):
    for seed in range(6):
        (misplaced,) = find_misplaced(body(seed, shift=(0.0, 0.3, 0.0), is_known=is_known))
        doubt = misplaced.doubt
        assert doubt.what == "point 3" and doubt.figure == pytest.approx(0.3, abs=0.02)
        shift = [float(value) for value in doubt.split("by (")[1].split(")")[0].split(", ")]
        assert shift == pytest.approx([0, 300, 0], abs=20)


def test_right_points_and_wrong_channels_are_not_said_to_lie_elsewhere():
    assert [doubt for seed in range(20) for doubt in find_misplaced(body(seed))] == []
    assert [doubt for seed in range(20) for doubt in find_misplaced(body(seed, factor=-1.0))] == []
    exact = [body(seed, is_known=False, noise=0.0) for seed in range(6)]  # only rounding is left, of which one point has most
    assert [doubt for parts in exact for doubt in find_misplaced(parts)] == []


def test_a_misplaced_point_of_four_is_left_out_and_stands_where_the_others_put_it():
    parts = body(2, shift=(0.05, 0.0, -0.08), number=4)
    wrong = find_wrong_points(parts)
    stated = dict(enumerate(parts["head"].at))
    points, components = wrong.left_out_of(stated, {"head": [0, 1, 2, 3]})
    assert components == {"head": [0, 1, 2]}
    assert points[3] - stated[3] == pytest.approx([0.05, 0.0, -0.08], abs=0.01)


def test_points_on_a_line_determine_no_motion_that_a_point_could_be_left_out_of():
    part = body(2, shift=(0.0, 0.3, 0.0), number=4)["head"]
    line = np.array([[0.0, 0, 0], [0.5, 0, 0], [1.0, 0, 0]])
    assert not determines_motion(np.tile(np.eye(3), (3, 1)), np.repeat(line, 3, axis=0), line)
    assert determines_motion(part.ways, part.places, part.at)


def test_joints_of_a_machine_do_not_feel_wrong_points():
    """The hinge of the published machine: a point of its column stated 0.2 m off, two points of its magazine exchanged."""
    case = p1.case(p1.machine(), np.random.default_rng(4), number=30)
    modes = p1.noisy(case.truth, 0.01, np.random.default_rng(5))
    name, (first, second) = case.components["column"][2], case.components["magazine"][1:5:3]
    points = {**case.points, name: np.add(case.points[name], [0.0, 0.12, -0.16]), first: case.points[second],
              second: case.points[first]}
    with pytest.warns(ToolpointWarning, match=f"point {name}: it moves as a point of column"):
        result = identify_joints(modes, points, case.components, chain=p1.CHAIN, masses=case.masses)
    (misplaced,), (exchanged,) = result.wrong_points.misplaced, result.wrong_points.exchanged
    assert misplaced.place == pytest.approx(case.points[name], abs=0.03) and set(exchanged.pairs[0]) == {first, second}
    assert result.doubts[0] == exchanged.doubt
    for child, kind in p1.KINDS.items():
        joint = result.joint(child)
        assert joint.kind == kind and joint.stiffness == pytest.approx(p1.STIFFNESS[child], rel=0.01)
