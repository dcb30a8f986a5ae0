"""Round castings: area, mass and inertia of stepped cylinders with bores, and what is refused."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.bodies.solid import Material, Patch, RoundCasting, RoundPart
from toolpoint.bodies.solid.checks import check_solid

STEEL = {"body": Material(210e9, 0.3, 7850.0, 0.0), "flange": Material(210e9, 0.3, 4000.0, 0.0)}
PARTS = (RoundPart(0.0, 0.3, 0.08), RoundPart(0.3, 0.35, 0.12, "flange"), RoundPart(0.05, 0.3, 0.05, is_window=True))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.default_cases(1)
def test_mass_and_moments_are_those_of_cylinders(axis):
    model = RoundCasting(PARTS, axis, (0.1, -0.2, 0.3), STEEL).meshed(0.02)
    check = check_solid(model)
    tube, bore, flange = 7850 * np.pi / 4 * 0.08**2 * 0.3, 7850 * np.pi / 4 * 0.05**2 * 0.25, 4000 * np.pi / 4 * 0.12**2 * 0.05
    assert check.mass == pytest.approx(tube - bore + flange, rel=1e-12)
    rigid = model.rigid_motion()
    mass = rigid.T @ (model.assembled()[1] @ rigid)
    along = "xyz".index(axis)
    centre = np.array([0.1, -0.2, 0.3])
    centre[along] = 0.0
    shift = mass[0, 0] * (centre @ centre)  # about the axis: polar moment by the parallel axis theorem
    polar = tube * 0.04**2 / 2 - bore * 0.025**2 / 2 + flange * 0.06**2 / 2
    assert mass[3 + along, 3 + along] - shift == pytest.approx(polar, rel=2e-3)


def test_ends_are_flat_faces_over_the_bore_s_edge():
    model = RoundCasting(PARTS, "z", (0.0, 0.0, 0.0), STEEL).meshed(0.03)
    weights = Patch(np.zeros(3), np.array([0, 1.0, 0]), np.array([1.0, 0, 0]), 0.05, 0.05).averages(model)
    assert np.allclose(weights.T @ model.rigid_motion(), np.eye(6), atol=1e-12)


@pytest.mark.parametrize(("parts", "words"), [
    ((RoundPart(0.0, 0.1, 0.05), RoundPart(0.2, 0.3, 0.05)), "2 pieces"),
    ((RoundPart(0.0, 0.1, 0.05, is_window=True),), "no material")])
def test_what_is_refused(parts, words):
    with pytest.raises(ToolpointError, match=words):
        RoundCasting(parts, "z", (0.0, 0.0, 0.0), STEEL).meshed(0.02)
