"""One wrong channel of a rigid component, named from three points."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.joint_identification.motion.measured import component
from toolpoint.joint_identification.motion.wrong_channels import question_channels
from toolpoint.vibration import Dof, Modes

LABELS = tuple(Dof(point, way) for point in (1, 2, 3) for way in ("+x", "+y", "+z"))


def questioned(seed: int, row: int, factor: float, *, bending: float = 0.0) -> list:
    """Three random points of a rigid body in four random motions with noise of 0.1 %, one row times a factor."""
    rng = np.random.default_rng(seed)
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in (1, 2, 3)}
    motions = rng.standard_normal((4, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions] for dof in LABELS])
    shape += bending * rng.standard_normal(shape.shape) * np.sqrt((shape**2).mean(axis=0))
    shape += 1e-3 * np.sqrt((shape**2).mean(axis=0)) * rng.standard_normal(shape.shape)
    shape[row] *= factor
    part = component("head", Modes([10.0, 20.0, 30.0, 40.0], [0.01] * 4, shape, LABELS, "unscaled"), places, labels=[1, 2, 3])
    return question_channels({"head": part}, LABELS)


@pytest.mark.parametrize(("factor", "words"), [(-1.0, "turned round"), (1.25, "multiplied by"), (0.1, "multiplied by")])
def test_the_wrong_one_of_nine_channels_is_named_with_its_factor(factor, words) -> None:
    for seed in range(20):
        (doubt,) = questioned(seed, seed % 9, factor)
        assert words in doubt and doubt.figure == pytest.approx(1 / factor, rel=0.03)
        assert doubt.what == f"channel {LABELS[seed % 9]}" or f"{LABELS[seed % 9]} " in doubt.why


def test_a_rigid_and_a_bending_body_with_right_channels_are_not_doubted() -> None:
    assert [doubt for seed in range(200) for doubt in questioned(seed, 0, 1.0)] == []
    assert len([doubt for seed in range(200) for doubt in questioned(seed, 0, 1.0, bending=0.05)]) <= 4


@pytest.mark.parametrize("factor", [1.2, -1.0, 1 / 9.80665])
def test_a_point_all_of_whose_channels_have_another_gain_is_named_with_its_factor(factor) -> None:
    labels = tuple(Dof(point, way) for point in range(1, 7) for way in ("+x", "+y", "+z"))
    for seed in range(10):
        rng = np.random.default_rng(seed)
        places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(1, 7)}
        motions = rng.standard_normal((5, 2, 3))
        shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions] for dof in labels])
        shape += 0.005 * rng.standard_normal(shape.shape)
        shape[3 * (seed % 6):3 * (seed % 6) + 3] *= factor
        part = component("head", Modes(10.0 * np.arange(1, 6), [0.01] * 5, shape, labels, "unscaled"), places,
                         labels=list(places))
        (doubt,) = question_channels({"head": part}, labels)
        assert doubt.what == f"point {seed % 6 + 1}" and doubt.figure == pytest.approx(1 / factor, rel=0.1)
