"""A point that lies elsewhere than stated is named with its place; right points, wrong channels and noise are not."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.joint_identification.motion.measured import component
from toolpoint.joint_identification.motion.misplaced_points import question_places
from toolpoint.vibration import Dof, Modes

POINTS, MODES, NOISE = 6, 5, 5e-3


def body(seed: int, *, shift=(0.0, 0.0, 0.0), factor: float = 1.0, is_known: bool = True) -> dict:
    """Return a rigid body whose point 3 was stated elsewhere by a shift, m, or has one channel with a wrong factor."""
    rng = np.random.default_rng(seed)
    labels = [Dof(point, way) for point in range(POINTS) for way in ("+x", "-y", "+z")]
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(POINTS)}
    motions = rng.standard_normal((MODES, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions] for dof in labels])
    shape[10] *= factor
    shape += NOISE * rng.standard_normal(shape.shape)
    modes = Modes(10.0 * np.arange(1, MODES + 1), [0.01] * MODES, shape, labels, "unscaled",
                  shape_variance=np.full(shape.shape, NOISE**2) if is_known else None)
    stated = {**places, 3: places[3] - np.array(shift)}
    return {"head": component("head", modes, stated, labels=list(range(POINTS)))}


@pytest.mark.parametrize("is_known", [True, False])
def test_a_misplaced_point_is_named_with_its_place(is_known):
    for seed in range(6):
        (doubt,) = question_places(body(seed, shift=(0.0, 0.3, 0.0), is_known=is_known))
        assert doubt.what == "point 3" and doubt.figure == pytest.approx(0.3, abs=0.02)
        shift = [float(value) for value in doubt.split("by (")[1].split(")")[0].split(", ")]
        assert shift == pytest.approx([0, 300, 0], abs=20)


def test_right_points_and_wrong_channels_are_not_said_to_lie_elsewhere():
    assert [doubt for seed in range(20) for doubt in question_places(body(seed))] == []
    assert [doubt for seed in range(20) for doubt in question_places(body(seed, factor=-1.0))] == []
