"""Two exchanged points of a body are named and left out, or the body is refused; nothing else is called an exchange."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from joint_identification.test_misplaced_points import NOISE, body
from toolpoint._check import ToolpointError
from toolpoint.joint_identification.motion.exchanged_points import find_exchanged
from toolpoint.joint_identification.motion.measured import component
from toolpoint.joint_identification.motion.wrong_points import find_wrong_points
from toolpoint.vibration import Dof, Modes

CORNERS = np.array([[0.4, 0.3, 0], [-0.4, 0.3, 0], [-0.4, -0.3, 0], [0.4, -0.3, 0]])


def exchanged_body(seed: int, pair: tuple[int, int], *, number: int = 6, is_known: bool = True, places=None,
                   noise: float = NOISE):
    """Return a rigid body in five modes, stated with the places of two of its points exchanged."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 0.5, (number, 3)) if places is None else places
    labels = [Dof(point, way) for point in range(len(places)) for way in ("+x", "-y", "+z")]
    motions = rng.standard_normal((5, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions] for dof in labels])
    shape += noise * rng.standard_normal(shape.shape)
    modes = Modes(10.0 * np.arange(1, 6), [0.01] * 5, shape, labels, "unscaled",
                  shape_variance=np.full(shape.shape, NOISE**2) if is_known else None)
    stated = dict(enumerate(places))
    stated[pair[0]], stated[pair[1]] = places[pair[1]], places[pair[0]]
    return {"head": component("head", modes, stated, labels=list(range(len(places))))}, places


@pytest.mark.parametrize(("is_known", "noise"), [(True, NOISE), (False, NOISE), (False, 0.0)])
@pytest.mark.parametrize("number", [5, 6, 30])
def test_exchanged_points_are_named_and_stand_in_each_others_place(number, is_known, noise):
    for seed in range(2):
        parts, places = exchanged_body(seed, (1, 3), number=number, is_known=is_known, noise=noise)
        wrong = find_wrong_points(parts)
        (exchanged,) = wrong.exchanged
        assert exchanged.pairs == ((1, 3),) and exchanged.doubt.what == "points 1 and 3" and not wrong.misplaced
        assert wrong.places[1] == pytest.approx(places[1]) and wrong.places[3] == pytest.approx(places[3])
        points, components = wrong.left_out_of(dict(enumerate(parts["head"].at)), {"head": list(range(number))})
        assert components == {"head": [point for point in range(number) if point not in (1, 3)]}
        assert points[1] == pytest.approx(places[1])
        assert set(wrong.restored_to(components)["head"]) == set(range(number))


def test_right_points_wrong_channels_and_misplaced_points_are_no_exchange():
    cases = [{}, {"factor": -1.0}, {"factor": 1.5}, {"shift": (0.0, 0.3, 0.0)}, {"is_known": False, "noise": 0.0}]
    assert [found for seed in range(5) for case in cases for number in (4, 6)
            for found in find_exchanged(body(seed, number=number, **case))] == []


def test_a_body_that_the_other_points_do_not_determine_is_refused():
    parts, _ = exchanged_body(2, (0, 2), number=4)
    with pytest.raises(ToolpointError, match=re.escape("points 0 and 2: exchanged, head moves as one body")):
        find_wrong_points(parts)


def test_exchanges_that_no_motion_tells_apart_are_all_named():
    """Corners of a rectangle: the exchange of one diagonal is that of the other with all rotations turned round."""
    parts, _ = exchanged_body(3, (0, 2), places=CORNERS)
    with pytest.raises(ToolpointError, match=r"points (0 and 2 or 1 and 3|1 and 3 or 0 and 2): exchanged"):
        find_wrong_points(parts)
    # With three more points on the plate, one diagonal alone explains the motions.
    others = np.array([[0.1, 0.2, 0.3], [0.2, -0.1, 0.2], [-0.3, 0.1, -0.2]])
    parts, _ = exchanged_body(3, (0, 2), places=np.vstack([CORNERS, others]))
    assert find_wrong_points(parts).exchanged[0].pairs == ((0, 2),)
    # Corners of a box: any number of diagonals, but one exchange alone is one pair.
    box = np.vstack([CORNERS + np.array([0, 0, 0.2]), CORNERS - np.array([0, 0, 0.2])])
    parts, _ = exchanged_body(4, (0, 6), places=box)
    assert find_wrong_points(parts).exchanged[0].pairs == ((0, 6),)


@pytest.mark.parametrize("number", [4, 6])
@pytest.mark.parametrize("is_known", [True, False])
def test_exchanged_names_of_two_bodies_are_told_and_strangers_are_not(number, is_known):
    bodies = {}
    for name, seed in (("bed", 1), ("head", 2)):
        parts, _ = exchanged_body(seed, (0, 0), number=number, is_known=is_known)
        bodies[name] = replace(parts["head"], name=name, points=tuple(f"{name} {k}" for k in range(number)))
    assert find_wrong_points(bodies).places == {}
    rows = {"bed": slice(3, 6), "head": slice(6, 9)}  # of point 1 of the bed and point 2 of the head
    values = {name: body.values.copy() for name, body in bodies.items()}
    values["bed"][rows["bed"]], values["head"][rows["head"]] = (bodies["head"].values[rows["head"]],
                                                                bodies["bed"].values[rows["bed"]])
    swapped = {name: replace(body, values=values[name]) for name, body in bodies.items()}
    wrong = find_wrong_points(swapped)
    assert set(wrong.places) == {"bed 1", "head 2"} and len(wrong.doubts) == 1 and not wrong.misplaced
    assert "bed 1 moves as the place of head 2 on head does" in wrong.doubts[0]
    assert wrong.places["bed 1"] == pytest.approx(bodies["bed"].at[1])
    # A point that moves with the other body at another place is a stranger, no exchange.
    values["bed"][rows["bed"]] = bodies["head"].values[0:3]
    assert find_wrong_points({name: replace(body, values=values[name]) for name, body in bodies.items()}).exchanged == ()


def test_a_turned_channel_of_three_points_is_no_exchange():
    """Three points leave three conditions a mode: an exchange and a wrong channel may both mend them."""
    for seed, channel in ((11, 3), (39, 4), (68, 5), (219, 1), (0, 0), (1, 4)):
        parts, _ = exchanged_body(seed, (0, 0), number=3)
        values = parts["head"].values.copy()
        values[channel] *= -1
        assert find_exchanged({"head": replace(parts["head"], values=values)}) == [], seed
