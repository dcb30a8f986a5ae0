"""Places on a solid: each moves rigidly with the body, keeps resultants, has its drawn area, and is told where it is not."""

import numpy as np
import pytest

from solid_models import brick, tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import (
    STEEL,
    CylinderFaces,
    JoinedPlaces,
    NamedNodes,
    NamedSurface,
    Patch,
    PlaneFaces,
    RingFaces,
    RoundCasting,
    RoundPart,
)
from toolpoint.bodies.solid.faces import outer_faces
from toolpoint.bodies.solid.mean_motion import area_of
from toolpoint.bodies.solid.model import SolidModel

TOP = Patch((0.15, 0.1, 0.5), (1, 0, 0), (0, 1, 0), 0.3, 0.2)
PLACES = {
    "rectangle": TOP, "surface": NamedSurface("top"), "nodes": NamedNodes("TOP"), "corners": NamedNodes("CORNERS"),
    "ring": RingFaces((0.15, 0.1, 0.5), (0, 0, 1), outer=0.18, inner=0.07), "plane": PlaneFaces((0, 0, 0.5), (0, 0, 1)),
    "two": JoinedPlaces((PlaneFaces((0, 0, 0.5), (0, 0, 1)), Patch((0.15, 0.1, 0), (1, 0, 0), (0, 1, 0), 0.1, 0.1))),
}


def named(build) -> SolidModel:
    """A box of 0.3 by 0.2 by 0.5 m with a surface and node sets on its top."""
    model = build([0.3, 0.2, 0.5], [2, 2, 2])
    is_top = np.abs(model.nodes[:, 2] - 0.5) < 1e-9
    corner = is_top & np.isin(model.nodes[:, 0], (0.0, 0.3)) & np.isin(model.nodes[:, 1], (0.0, 0.2))
    surface = tuple(group[is_top[group].all(axis=1)] for group in outer_faces(model))
    node_sets = {"TOP": np.flatnonzero(is_top), "CORNERS": np.flatnonzero(corner)}
    return SolidModel(model.nodes, model.blocks, model.materials, node_sets, {"TOP": surface})


@pytest.mark.parametrize("build", [brick, tetrahedral_brick])
@pytest.mark.parametrize("place", PLACES.values(), ids=PLACES)
def test_a_place_moves_rigidly_with_the_body_and_keeps_resultants(place, build):
    model = named(build)
    weights, centre = place.averages(model), place.centre_on(model)
    assert weights.T @ model.rigid_motion(centre) == pytest.approx(np.eye(6), abs=1e-12)
    wrench = np.array([3.0, -2, 5, 0.4, 0.7, -0.2])
    assert model.rigid_motion(centre).T @ (weights @ wrench) == pytest.approx(wrench, abs=1e-11)


@pytest.mark.parametrize("build", [brick, tetrahedral_brick])
@pytest.mark.parametrize("name", ["surface", "nodes", "plane"])
def test_a_named_face_is_the_rectangle_over_it(name, build):
    model = named(build)
    assert abs(PLACES[name].averages(model) - TOP.averages(model)).max() < 1e-12
    assert PLACES[name].note(model) == "600 cm^2 of faces"


def test_a_ring_has_the_area_between_its_circles():
    model = named(tetrahedral_brick)
    assert area_of(PLACES["ring"].pieces(model)) == pytest.approx(np.pi * (0.18**2 - 0.07**2) / 4, rel=1e-12)


@pytest.mark.parametrize("turned", [False, True])
def test_the_wall_of_a_bore_is_its_cylinder_and_not_its_ends(turned):
    axis = "x" if turned else "z"
    tube = RoundCasting((RoundPart(0.0, 0.2, 0.1), RoundPart(0.0, 0.2, 0.06, is_window=True)), axis, (0.0, 0.0, 0.0),
                        {"body": STEEL})
    model, unit = tube.meshed(0.01), np.eye(3)["xyz".index(axis)]
    bore = CylinderFaces(0.1 * unit, unit, diameter=0.06, length=0.2)
    assert area_of(bore.pieces(model)) == pytest.approx(np.pi * 0.06 * 0.2, rel=5e-3)
    assert bore.centre_on(model) == pytest.approx(0.1 * unit, abs=1e-12)
    weights = bore.averages(model)
    assert weights.T @ model.rigid_motion(0.1 * unit) == pytest.approx(np.eye(6), abs=1e-12)
    journal = CylinderFaces(0.1 * unit, unit, diameter=0.1, length=0.2)
    assert area_of(journal.pieces(model)) == pytest.approx(np.pi * 0.1 * 0.2, rel=5e-3)


@pytest.mark.parametrize(("place", "words"), [
    (NamedSurface("topp"), "surface: 'topp'; must be of those that the mesh names: TOP.*did you mean"),
    (NamedNodes("none"), "nodes: 'none'.*TOP, CORNERS"),
    (PlaneFaces((0, 0, 0.49), (0, 0, 1)), "plane: no outer face.*nearest node is 10 mm"),
    # A strip of half width h in a circle of radius r: 2 (r^2 asin(h/r) + h sqrt(r^2 - h^2)) / (pi r^2) = 0.7809.
    (RingFaces((0.15, 0.1, 0.5), (0, 0, 1), outer=0.3), "ring: 78.09 % of its 706.9 cm"),
    (CylinderFaces((0, 0, 0), (0, 0, 1), diameter=0.1, length=0.1), "cylinder: no outer face"),
    (JoinedPlaces((NamedSurface("TOP"), TOP)), "together: two of its parts on one face"),
])
def test_what_is_not_there_is_told(place, words):
    with pytest.raises(ToolpointError, match=words):
        place.averages(named(brick))


def test_nodes_in_line_tell_no_turn():
    model = named(brick)
    edge = np.flatnonzero((np.abs(model.nodes[:, 1]) < 1e-9) & (np.abs(model.nodes[:, 2] - 0.5) < 1e-9))
    line = SolidModel(model.nodes, model.blocks, model.materials, {"EDGE": edge})
    assert "all count alike" in NamedNodes("EDGE").note(line)
    with pytest.raises(ToolpointError, match="interface: a line or a single point"):
        NamedNodes("EDGE").averages(line)
