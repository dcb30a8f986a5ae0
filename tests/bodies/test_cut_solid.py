"""Solids that lose material: modes and compliance beside fresh meshes of what is left, closed forms, loose pieces, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from solid_models import tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import Casting, Cuboid, Material, PlaneFaces, SolidModel
from toolpoint.bodies.solid.cut_solid import CutSolid, CutState
from toolpoint.bodies.solid.element_places import locate
from toolpoint.material_removal import MillShape, split_moves
from toolpoint.material_removal.sweep_times import SweepTimes
from toolpoint.studies.machining.thin_walls.clamped_part import ClampSpring
from toolpoint.vibration.sparse import factorise, modes

MM = 1e-3
ALUMINIUM = Material(70e9, 0.33, 2700.0, 0.01)
RADIUS = 5 * MM
LENGTH, HEIGHT = 48 * MM, 30 * MM
NOWHERE = SweepTimes(split_moves([[9.0, 9, 9]], [[9.1, 9, 9]], step=1.0), (MillShape(2 * RADIUS),))


def plate(thickness: float, size: float = 6 * MM, height: float = HEIGHT) -> SolidModel:
    return Casting([Cuboid((0, 0, 0), (LENGTH, thickness, height))], {"body": ALUMINIUM}).meshed(size)


def foot(model: SolidModel) -> np.ndarray:
    return model.nodes_in((-1, -1, 0), (1, 1, 0))


def along(y: float, levels: list[float], turn: float = 0.0) -> SweepTimes:
    """Return passes of a flat end along x whose wall stands at y, the plate on its right; turn : rise of y over x."""
    start = np.array([[-0.02, y + RADIUS * np.hypot(1, turn) - 0.02 * turn, z] for z in levels])
    return SweepTimes(split_moves(start, start + np.array([0.09, 0.09 * turn, 0.0]), step=2 * MM), (MillShape(2 * RADIUS),))


def frequencies(state: CutState, count: int = 4) -> np.ndarray:
    inverse = factorise(state.stiffness)
    return modes(state.stiffness, state.mass, count, shift=0, inverse=inverse, is_counted=False).frequency[:count]


def compliance(model: SolidModel, state: CutState, place: tuple[float, float, float]) -> float:
    """Return the static compliance along y at a node, m/N."""
    row = int(np.flatnonzero(state.free == 3 * int(np.linalg.norm(model.nodes - place, axis=1).argmin()) + 1)[0])
    load = np.zeros(state.free.size)
    load[row] = 1.0
    return float(factorise(state.stiffness).solve(load)[row])


@pytest.mark.parametrize("left", [2.0, 1.1])
def test_a_plate_milled_thinner_is_the_fresh_plate_of_that_thickness(left):
    """One element of 4 mm follows the wall to a quarter of it: frequencies as thickness, compliance as 1/t^3, mass as t."""
    model, fresh = plate(4 * MM), plate(left * MM)
    state = (cut := CutSolid(model, foot(model), along(left * MM, [15 * MM - 1e-9, -1e-9]))).at(cut.sweep.count)
    other = CutSolid(fresh, foot(fresh), NOWHERE).at(0)
    assert state.volume == pytest.approx(LENGTH * HEIGHT * left * MM, rel=1e-5)
    assert float(state.mass.sum()) == pytest.approx(float(other.mass.sum()), rel=0.02)  # of the rows that move
    assert frequencies(state) == pytest.approx(frequencies(other), rel=5e-4)
    corner = (0.0, 0.0, HEIGHT)
    assert compliance(model, state, corner) == pytest.approx(compliance(fresh, other, corner), rel=1e-3)


@pytest.mark.slow
def test_frequencies_go_with_thickness_and_compliance_with_its_third_power():
    """The laws of a thin plate; the torsion of a strip of breadth b adds 0.63 t/b / 2, 0.7 %, to the second frequency."""
    model = plate(2 * MM, 3 * MM)
    cut = CutSolid(model, foot(model), along(1 * MM, [15 * MM - 1e-9, -1e-9]))
    whole, half = cut.at(0), cut.at(cut.sweep.count)
    assert frequencies(half, 2) / frequencies(whole, 2) == pytest.approx(0.5, rel=0.015)
    corner = (0.0, 0.0, HEIGHT)
    assert compliance(model, half, corner) / compliance(model, whole, corner) == pytest.approx(8.0, rel=0.03)


def test_half_the_height_is_the_plate_of_half_the_height():
    """Cut from above within elements."""
    model, fresh = plate(3 * MM, 4.3 * MM), plate(3 * MM, 4.3 * MM, 0.5 * HEIGHT)
    rows = np.array([[-0.02, y, 0.5 * HEIGHT] for y in (0.0, 3 * MM)])
    sweep = SweepTimes(split_moves(rows, rows + np.array([0.09, 0, 0]), step=2 * MM), (MillShape(2 * RADIUS),))
    state, other = CutSolid(model, foot(model), sweep).at(sweep.count), CutSolid(fresh, foot(fresh), NOWHERE).at(0)
    assert frequencies(state) == pytest.approx(frequencies(other), rel=0.01)


@pytest.mark.slow
def test_a_tapered_wall_is_the_mesh_that_tapers():
    """Oblique to all elements, against a mesh whose nodes were moved to the taper."""
    turn = 1.5 * MM / LENGTH
    model, fresh = plate(4 * MM, 4 * MM), plate(4 * MM, 4 * MM)
    nodes = np.array(fresh.nodes)
    nodes[:, 1] *= (1.5 * MM + turn * nodes[:, 0]) / (4 * MM)
    fresh = replace(fresh, nodes=nodes)
    cut = CutSolid(model, foot(model), along(1.5 * MM, [15 * MM - 1e-9, -1e-9], turn))
    state, other = cut.at(cut.sweep.count), CutSolid(fresh, foot(fresh), NOWHERE).at(0)
    assert state.volume == pytest.approx(other.volume, rel=1e-4)
    assert frequencies(state) == pytest.approx(frequencies(other), rel=5e-3)


@pytest.mark.slow
def test_tetrahedra_follow_the_wall_too():
    """A mesh of tetrahedra of a 4 mm plate cut to 2.2 mm, against bricks of 2.2 mm."""
    model, fresh = tetrahedral_brick((LENGTH, 4 * MM, HEIGHT), (9, 1, 6), ALUMINIUM), plate(2.2 * MM, 4 * MM)
    cut = CutSolid(model, foot(model), along(2.2 * MM, [15 * MM - 1e-9, -1e-9]))
    state, other = cut.at(cut.sweep.count), CutSolid(fresh, foot(fresh), NOWHERE).at(0)
    assert state.volume == pytest.approx(LENGTH * HEIGHT * 2.2 * MM, rel=2e-3)
    assert frequencies(state, 2) == pytest.approx(frequencies(other, 2), rel=0.03)


def test_pieces_that_come_loose_are_left_out_and_said():
    """A slot through the plate at half its height: the upper half is no part of the response."""
    model, fresh = plate(3 * MM, 3 * MM), plate(3 * MM, 3 * MM, 9 * MM)
    start = np.array([[-0.02, 1.5 * MM, 9 * MM]])
    slot = SweepTimes(split_moves(start, start + np.array([0.09, 0, 0]), step=2 * MM), (MillShape(2 * RADIUS),))

    class Slot:
        """The slot with its roof: columns above 15 mm stay, as those of a T-slot."""

        count, box = slot.count, slot.box

        def first_pieces(self, places):
            return np.where(places[:, 2] > 15 * MM, slot.count, slot.first_pieces(places))

        def is_swept(self, places, owner, stage):
            return slot.is_swept(places, owner, stage) & (places[:, 2] <= 15 * MM)

    state = CutSolid(model, foot(model), Slot()).at(slot.count)
    assert state.loose_volume == pytest.approx(LENGTH * 3 * MM * 15 * MM, rel=1e-3)
    assert frequencies(state) == pytest.approx(frequencies(CutSolid(fresh, foot(fresh), NOWHERE).at(0)), rel=1e-3)


def test_what_holds_no_body_is_refused():
    model = plate(3 * MM)
    with pytest.raises(ToolpointError, match="three at least"):
        CutSolid(model, foot(model)[:2], NOWHERE)
    with pytest.raises(ToolpointError, match="no element is left at the held faces"):
        CutSolid(model, foot(model), along(-1 * MM, [-1 * MM])).at(45)


def test_places_are_found_in_their_elements():
    """A linear motion is that of every place, also in skewed elements; one beside the body is moved to its face."""
    model = plate(4 * MM, 4 * MM)
    skewed = np.array(model.nodes)
    skewed[:, 0] += 0.4 * skewed[:, 2] + 3.0 * skewed[:, 1] * skewed[:, 2]
    block, rng = model.blocks[0], np.random.default_rng(2)
    inside = rng.uniform(0.001, 0.999, (200, 3)) * [LENGTH, 4 * MM, HEIGHT]
    inside[:, 0] += 0.4 * inside[:, 2] + 3.0 * inside[:, 1] * inside[:, 2]
    located = locate([(block.kind, block.nodes, skewed[block.nodes])], inside)
    assert located.distance.max() < 1e-9
    assert located.motion(skewed.reshape(-1, 1))[:, :, 0] == pytest.approx(inside, abs=1e-9)
    beside = locate([(block.kind, block.nodes, model.nodes[block.nodes])], np.array([[0.02, 6 * MM, 0.01]]))
    assert beside.distance == pytest.approx(2 * MM, rel=1e-6)


def test_a_block_on_springs_has_their_frequencies_and_their_compliance():
    """Soft springs at the foot: the block moves as a rigid one, with sqrt(k/m) along z and about it sqrt(k/J); stiff ones add
    1/k and the square of the arm over the turning stiffness to the compliance of the held block."""
    model = Casting([Cuboid((0, 0, 0), (0.04, 0.04, 0.02))], {"body": ALUMINIUM}).meshed(0.02)
    face, mass = PlaneFaces((0, 0, 0), (0, 0, 1)), 2700 * 0.04 * 0.04 * 0.02
    soft = ClampSpring(face, np.diag([1e6, 1e6, 1e5, 1e4, 1e4, 20.0]), (0.02, 0.02, 0.0))
    state = CutSolid(model, np.zeros(0, int), NOWHERE, [soft.on(model)]).at(0)
    expected = [np.sqrt(1e5 / mass), np.sqrt(20.0 / (mass * 0.04**2 / 6))]
    assert frequencies(state, 2) * 2 * np.pi == pytest.approx(sorted(expected), rel=2e-3)
    place = (0.04, 0.0, 0.02)
    stiff = {size: compliance(model, CutSolid(model, np.zeros(0, int), NOWHERE, [ClampSpring(
        face, np.diag([1e9, size, 1e9, turn, 1e9, 1e9]), (0.02, 0.02, 0.0)).on(model)]).at(0), place)
        for size, turn in ((1e9, 1e9), (1e8, 1e9))}
    assert stiff[1e8] - stiff[1e9] == pytest.approx(1 / 1e8 - 1 / 1e9, rel=1e-6)
    # About a line 30 mm above the face the same turning spring gives way without an arm of the lower one.
    low, high = (compliance(model, CutSolid(model, np.zeros(0, int), NOWHERE, [ClampSpring(
        face, np.diag([1e9, 1e9, 1e9, 1e5, 1e9, 1e9]), (0.02, 0.02, z)).on(model)]).at(0), place) for z in (0.0, 0.02))
    assert low - high == pytest.approx(0.02**2 / 1e5, rel=1e-3)
    with pytest.raises(ToolpointError, match="three at least"):
        CutSolid(model, np.zeros(0, int), NOWHERE)
