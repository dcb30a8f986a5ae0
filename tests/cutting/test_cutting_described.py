"""Cuts from plain data: every part arrives, materials of the literature, faults name their key."""

from __future__ import annotations

import re

import numpy as np
import pytest

from toolpoint import Dof, Modes, ToolpointError
from toolpoint.cutting import Engagement
from toolpoint.cutting.build import coefficients_of, fault_of, find_material, mean_chip, words
from toolpoint.cutting.description import CuttingDescription, SpeedVariationDescription
from toolpoint.cutting.force.laws import Kienzle
from toolpoint.studies.machines.tool_point import milling_problem

FULL = CuttingDescription.of(
    diameter=0.016, teeth=4, immersion=0.4, tangential=8e8, normal=3e8, direction="up", feed="y", axial=1e8,
    edge_tangential=2e4, edge_normal=1e4, edge_axial=1e3,
    helix=(0.5, 0.4, 0.5, 0.4), pitch=tuple(np.radians([80, 100, 80, 100])), runout=5e-6, runout_angle=0.3, tilt=1e-4,
    corner_radius=2e-3, process_damping=100.0, damping_friction=0.2,
    speed_variation=SpeedVariationDescription(0.1, 3, 0.2), feed_per_tooth=1e-4)
MODES = Modes([900.0, 1000.0, 2000.0], 0.02, np.eye(3), ("tool:+x", "tool:+y", "tool:+z"))
PLAIN = CuttingDescription.of(diameter=0.016, teeth=4, immersion=0.4, tangential=8e8, normal=3e8)


def test_every_part_of_a_description_arrives_in_the_problem() -> None:
    problem = milling_problem(FULL, MODES, "tool:+x", y="tool:+y")
    tool, k = problem.tool, problem.coefficients
    assert tool.helix.tolist() == [0.5, 0.4, 0.5, 0.4] and np.degrees(tool.pitch) == pytest.approx([80, 100, 80, 100])
    assert (tool.runout, tool.runout_angle, tool.tilt, tool.corner_radius) == (5e-6, 0.3, 1e-4, 2e-3)
    assert (k.kt, k.kn, k.ka, k.edge_t, k.edge_n, k.edge_a) == (8e8, 3e8, 1e8, 2e4, 1e4, 1e3)
    assert problem.engagement == Engagement.up(0.4) and problem.feed_angle == pytest.approx(np.pi / 2)
    assert (problem.process_damping, problem.damping_friction, problem.feed_per_tooth) == (100.0, 0.2, 1e-4)
    variation = problem.speed_variation
    assert variation is not None and (variation.amplitude, variation.revolutions, variation.phase) == (0.1, 3, 0.2)
    assert problem.z == "tool:+z" and problem.plane.size == 3


def test_space_is_taken_only_where_it_matters_and_is_known() -> None:
    assert milling_problem(PLAIN, MODES, "tool:+x", y="tool:+y").plane.size == 2
    assert milling_problem(PLAIN.replaced(axial=1e8), MODES).plane.size == 3
    assert milling_problem(PLAIN.replaced(corner_radius=1e-3), MODES).z == "tool:+z"
    flat = Modes([900.0, 1000.0], 0.02, np.eye(2), (Dof("tool", "+x"), Dof("tool", "+y")))
    assert milling_problem(PLAIN.replaced(axial=1e8), flat).plane.size == 2


def test_angles_stand_for_direction_and_immersion() -> None:
    cut = PLAIN.replaced(immersion=None, entry=0.4, exit=2.0)
    assert milling_problem(cut, MODES).engagement == Engagement(0.4, 2.0)
    assert "22.92 .. 114.6 deg" in words(cut)
    assert milling_problem(PLAIN.replaced(direction="centred"), MODES).engagement == Engagement.centred(0.4)


def test_material_gives_the_coefficients_and_given_values_replace_them() -> None:
    """Al 7075 of the table: first and second set; Kienzle's tangent at the mean chip."""
    bare = PLAIN.replaced(tangential=None, normal=None, material="al7075")
    assert (coefficients_of(bare).kt, coefficients_of(bare).edge_n) == (767e6, 26.6e3)
    assert "set 1 of 4" in coefficients_of(bare).source
    second = coefficients_of(bare.replaced(material="Al 7075:2", normal=1e8))
    assert (second.kt, second.kn) == (600.5e6, 1e8)
    steel = bare.replaced(material="c45", normal=4e8, feed_per_tooth=1e-4)
    h = mean_chip(steel)
    angle = np.linspace(np.arccos(2 * 0.4 - 1), np.pi, 20001)
    assert h == pytest.approx(np.trapezoid(1e-4 * np.sin(angle), angle) / np.ptp(angle), rel=1e-6)
    assert coefficients_of(steel).kt == pytest.approx(Kienzle(1500e6, 0.22).linearised(h).kt)
    assert coefficients_of(steel).kn == 4e8
    assert find_material("ti6al4v")[0].material == "Ti6Al4V"


@pytest.mark.parametrize(("change", "key", "text"), [
    ({"pitch": (1.0, 2.0)}, ("pitch",), "one for each of the 4 teeth"), ({"pitch": (1.0,) * 4}, ("pitch",), "add up to 360"),
    ({"helix": (0.1, 0.2)}, ("helix",), "one for each"), ({"corner_radius": 0.01}, ("corner_radius",), "ball"),
    ({"entry": 0.3}, ("exit",), "belong together"), ({"entry": 0.3, "exit": 1.0}, ("immersion",), "left out"),
    ({"entry": 2.0, "exit": 1.0, "immersion": None}, ("entry",), "entry < exit"), ({"immersion": None}, ("immersion",), "a/D"),
    ({"tangential": None}, ("tangential",), "Al 7075"), ({"normal": None}, ("normal",), "missing"),
    ({"material": "al"}, ("material",), "several"), ({"material": "unobtainium"}, ("material",), "must be one of"),
    ({"material": "al7075:9"}, ("material",), "4 sets"),
    ({"material": "C45", "normal": None}, ("normal",), "tangential force only"),
    ({"material": "C45"}, ("feed_per_tooth",), "mean chip"),
    ({"speed_variation": SpeedVariationDescription(0.95)}, ("speed_variation", "amplitude"), "0.9")])
def test_faults_name_their_key(change: dict[str, object], key: tuple[str, ...], text: str) -> None:
    found = fault_of(PLAIN.replaced(**change))
    assert found is not None and found[0] == key and text in found[1]
    assert fault_of(PLAIN) is None and fault_of(FULL) is None


@pytest.mark.parametrize(("values", "text"), [
    ({"kt": 8e8}, "did you mean 'tangential'"), ({"diamter": 0.01}, "did you mean 'diameter'"),
    ({"nonsense": 1}, "which are diameter, teeth"), ({"diameter": "12 mm"}, "0.012 for 12 mm"),
    ({"tangential": "800 N/mm^2"}, "without a unit")])
def test_keys_and_numbers_that_a_person_would_type_are_answered_with_the_remedy(values: dict[str, object], text: str) -> None:
    with pytest.raises(ToolpointError, match=re.escape(text)):
        CuttingDescription.of(**{"diameter": 0.012, "teeth": 4, **values})


def test_wrong_material_is_an_error_of_the_problem() -> None:
    with pytest.raises(ToolpointError, match="material"):
        milling_problem(PLAIN.replaced(material="unobtainium"), MODES)
