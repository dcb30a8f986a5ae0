"""Gains of the directions of a moved sensor, told by rigid bodies together."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from toolpoint.joint_identification import ComponentMass
from toolpoint.joint_identification.machine.refined import fit_doubts, question_masses
from toolpoint.joint_identification.motion.direction_gains import question_gains
from toolpoint.joint_identification.motion.measured import component
from toolpoint.vibration import Dof, Modes

POINTS, MODES = 6, 5


def bodies(seed: int, gains: tuple[float, float, float], bending: float = 0.0) -> dict:
    """Two rigid bodies in random motions, noise of 1 %, the directions of the sensor with these gains."""
    rng = np.random.default_rng(seed)
    labels = [Dof(point, way) for point in range(2 * POINTS) for way in ("+x", "-y", "+z")]
    places = {point: rng.uniform(-0.5, 0.5, 3) for point in range(2 * POINTS)}
    motions = rng.standard_normal((2, MODES, 2, 3))
    shape = np.array([[(v + np.cross(w, places[dof.point])) @ dof.unit[:3] for v, w in motions[int(dof.point) // POINTS]]
                      for dof in labels])
    shape += bending * rng.standard_normal(shape.shape)
    shape *= np.array([gains["xyz".index(dof.direction[1])] for dof in labels])[:, None]
    shape += 0.01 * rng.standard_normal(shape.shape)
    modes = Modes(10.0 * np.arange(1, MODES + 1), [0.01] * MODES, shape, labels, "unscaled")
    return {name: component(name, modes, places, labels=list(range(k * POINTS, (k + 1) * POINTS)))
            for k, name in enumerate(("column", "head"))}


@pytest.mark.parametrize("gains", [(1.0, 0.2, 5.0), (1.0, 1.0, 9.80665), (1.0, 0.7, 1.0)])
def test_wrong_gains_of_directions_are_named_with_their_factors(gains) -> None:
    for seed in range(5):
        (doubt,) = question_gains(bodies(seed, gains))
        named = {word.split(" by ")[0][-1]: float(word.split(" by ")[1].split()[0]) for word in
                 doubt.why.split("along ")[1].split(" multiplied")[0].split(", ")}
        wrong = {axis: 1 / gain for axis, gain in zip("xyz", gains, strict=True) if gain != 1.0}
        assert doubt.grave and named == pytest.approx(wrong, rel=0.05)


def test_right_gains_and_bending_bodies_are_not_doubted() -> None:
    assert [doubt for seed in range(30) for doubt in question_gains(bodies(seed, (1.0, 1.02, 0.99)))] == []
    assert [doubt for seed in range(30) for doubt in question_gains(bodies(seed, (1.0, 1.0, 1.0), bending=0.3))] == []


@pytest.mark.parametrize(("likeness", "lonely", "is_grave"), [
    ((0.99, 0.98, 0.97, 0.3), (), False), ((0.99, 0.3, 0.3), (), True), ((0.99, 0.99), (2, 3, 4), True),
    ((0.99,) * 3, (3,), False)])
def test_a_machine_that_explains_less_than_half_of_its_test_stops_what_rests_on_it(likeness, lonely, is_grave) -> None:
    count = len(likeness)
    fit = SimpleNamespace(mac=np.array(likeness), mac_noise=np.zeros(count), frequency=np.arange(1.0, count + 1), widened=1.0,
                          damping_excess=1.0, mass_scale=None, converged=True, x=np.zeros(0),
                          model=SimpleNamespace(forms=(), masses=(), slices=()))
    doubts = fit_doubts(fit, SimpleNamespace(lonely=lonely, fit=fit, names=()), np.arange(1.0, 10.0))
    assert any(doubt.grave for doubt in doubts) is is_grave


def test_a_mass_that_the_fit_moves_beyond_its_stated_deviation_is_doubted_by_name() -> None:
    masses = [ComponentMass(400.0, [0, 0, 1.2], np.diag([30.0, 30.0, 20.0]), mass_deviation=share)
              for share in (0.02, 0.0, 0.05)]
    model = SimpleNamespace(forms=(0, 0, 0), masses=masses, slices=(slice(0, 2), slice(2, 3), slice(3, 3), slice(3, 4),
                                                                    slice(4, 4), slice(4, 5)))
    fit = SimpleNamespace(model=model, x=np.array([0.0, 0.0, 0.0, -0.08, 0.1]))
    (doubt,) = question_masses(SimpleNamespace(names=("bed", "column", "head"), fit=fit))
    assert doubt.what == "mass of bed" and "-7.7 %" in doubt.why and doubt.figure == pytest.approx(4.0)
