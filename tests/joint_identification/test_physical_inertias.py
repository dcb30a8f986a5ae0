"""A mass that a fit changes stays that of a body: no principal moment exceeds the sum of the two others."""

import numpy as np
import pytest

from toolpoint.bodies.inertia import MassProperties
from toolpoint.joint_identification import ComponentMass

SHAPES = {"cube": (1.0, 1.0, 1.0), "plate": (1.0, 1.0, 1e-3), "rod": (1e-3, 1e-3, 1.0), "box": (0.3, 0.9, 2.0),
          "sheet": (1.0, 0.5, 0.0)}


def cuboid(size, rng):
    a, b, c = np.square(size)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return ComponentMass(100.0, (0, 0, 0), turn @ np.diag(100 / 12 * np.array([b + c, a + c, a + b])) @ turn.T, 0.1, 0.3, 0.01)


@pytest.mark.parametrize("shape", list(SHAPES))
def test_any_change_gives_a_body(shape):
    rng = np.random.default_rng(1)
    for _ in range(300):
        mass = cuboid(SHAPES[shape], rng)
        changed = mass.changed(np.concatenate([rng.normal(size=1), rng.normal(size=3), 3 * rng.normal(size=3)]))
        moments = np.linalg.eigvalsh(changed.inertia)
        assert moments[0] >= -1e-9 * moments[2] and moments[2] <= (moments[0] + moments[1]) * (1 + 1e-9)
        MassProperties(changed.mass, changed.centre, changed.inertia)  # as a machine file checks it


def test_small_changes_enter_as_they_are_and_large_ones_without_a_jump():
    mass = cuboid(SHAPES["box"], np.random.default_rng(2))
    moments, axes = np.linalg.eigh(mass.inertia)
    by = np.array([0.0, 0, 0, 0, 0.002, -0.001, 0.0015])
    plain = axes @ np.diag(moments * np.exp(by[4:])) @ axes.T
    np.testing.assert_allclose(mass.changed(by).inertia, plain, rtol=1e-9, atol=1e-9)
    course = np.array([mass.changed(np.array([0, 0, 0, 0, t, -t, 0.0])).inertia for t in np.linspace(-1, 1, 4001)])
    slopes = np.diff(course, axis=0)
    assert np.abs(np.diff(slopes, axis=0)).max() < 0.01 * np.abs(slopes).max()
