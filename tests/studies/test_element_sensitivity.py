"""Sensitivity of a machine to its elements: sums are those of its parameters, each slope is the difference that it makes."""

import numpy as np
import pytest

from beam_on_block import pair
from toolpoint import ToolpointError
from toolpoint.io import read_machine
from toolpoint.studies import compare_full_mesh, study_elements, study_sensitivity

POSE = {"X": 0.07}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("pair")


def test_sums_over_elements_are_the_sensitivities_of_the_materials(folder):
    machine = read_machine(pair(folder))
    result, parameters = study_elements(machine, POSE, 4), study_sensitivity(machine, None, 4, pose=POSE)
    for body in ("block", "beam"):
        for number, values in (("modulus", result.slopes[body].modulus), ("density", result.slopes[body].density)):
            row = parameters.paths.index(f"bodies.{body}.elastic.materials.body.{number}")
            # The parameters are those of the reduced bodies, whose frequencies are within 1e-4 of those of all elements.
            np.testing.assert_allclose(values.sum(axis=1), parameters.frequency[row], atol=2e-3)


@pytest.mark.slow
def test_one_elements_slope_is_the_difference_that_it_makes(folder):
    """The outer element of the beam as a set of its own: 1 % of its E and of its density, by differences of all elements."""
    text = pair(folder).read_text().replace(
        "boxes: [{low: [0, 0, 0], high: [600 mm, 100 mm, 50 mm]}]",
        "boxes: [{low: [0, 0, 0], high: [500 mm, 100 mm, 50 mm]}, "
        "{low: [500 mm, 0, 0], high: [600 mm, 100 mm, 50 mm], material: outer}]\n"
        "      materials: {body: {modulus: 110e9, density: 7200}, outer: {modulus: MODULUS, density: DENSITY}}")

    def frequencies(modulus, density):
        path = folder / "outer.yaml"
        path.write_text(text.replace("MODULUS", repr(110e9 * modulus)).replace("DENSITY", repr(7200 * density)))
        return compare_full_mesh(read_machine(path), POSE, 4).frequency, path

    base, path = frequencies(1.0, 1.0)
    slopes = study_elements(read_machine(path), POSE, 4).slopes["beam"]
    outer = [k for k, name in enumerate(slopes.set_names) if name == "outer"]
    step = 1e-3
    for changed, values in (((1 + step, 1.0), slopes.modulus), ((1.0, 1 + step), slopes.density)):
        difference = (frequencies(*changed)[0] / base - 1) / step
        np.testing.assert_allclose(values[:, outer].sum(axis=1), difference, rtol=2e-3, atol=2e-6)


def test_places_and_shapes_stand_in_the_frame_of_the_machine(folder):
    result = study_elements(read_machine(pair(folder)), POSE, 2)
    # The beam begins 0.2 m behind the block's frame, moved by the pose: its element at 50 mm stands at 50 - 200 + 70 mm.
    places = [place for name, place, _ in result.best_elements(0, 8) if name == "beam"]
    assert any(np.allclose(place, [0.05 - 0.2 + 0.07, 0.05, 0.125], atol=2e-3) for place in places)
    assert result.shape_of("beam").shape == (result.meshes.meshed["beam"].model.size, 2)
    assert result.element_masses["block"].sum() == pytest.approx(7200 * 0.2 * 0.1 * 0.1)


def test_what_a_kilogram_buys_is_thickness_in_stiffness_and_mass(folder):
    result = study_elements(read_machine(pair(folder)), POSE, 2)
    gains, slopes = result.hertz_a_kilogram("block"), result.slopes["block"]
    share = slopes.modulus + slopes.density
    np.testing.assert_allclose(gains * result.element_masses["block"] / result.frequency[:, None], share)
    assert "Where a kilogram of wall" in result.table() and len(result.to_dict()["best_elements"]) == 2


def test_a_machine_without_meshes_is_refused(folder):
    path = folder / "rigid.yaml"
    path.write_text("toolpoint: 1\nname: rigid\nbodies: {a: {mass: 1, inertia: {xx: 1, yy: 1, zz: 1}}}\n"
                    "joints: {j: {parent: ground, child: a, stiffness: {x: 1e6}}}\n")
    with pytest.raises(ToolpointError, match="must have a casting"):
        study_elements(read_machine(path))
