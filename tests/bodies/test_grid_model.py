"""Laws of models over grid points: rigid motion without force, closed forms of bars, ties that do no work."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh

from toolpoint import ToolpointError
from toolpoint.bodies.beam import join_elements, ring
from toolpoint.bodies.grid.bar import BarSection, bar_frame, bar_stiffness, consistent_mass, end_mass, release_ends
from toolpoint.bodies.grid.model import Bar, GridModel, bar_part, bushing_part, mass_part, spring_part
from toolpoint.bodies.grid.tie import WAYS, MeanLeaders, TieEquation, eliminate_ties, mean_ties, rigid_ties
from toolpoint.spatial.rotation import skew
from toolpoint.vibration import Dof

STEEL = {"density": 7850.0, "poisson": 0.3}
ROUND = ring(0.05, 0.0, 210e9, shear=0.9, **STEEL)
SECTION = BarSection(ROUND.axial, ROUND.torsion, ROUND.bending_z, ROUND.bending_y, ROUND.shear_y, ROUND.shear_z, ROUND.mass,
                     ROUND.inertia_z, ROUND.inertia_y)
vectors = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array)


def rigid_motion(places):
    return np.vstack([np.block([[np.eye(3), -skew(at)], [np.zeros((3, 3)), np.eye(3)]]) for at in places])


@settings(max_examples=25, deadline=None)
@given(start=vectors, along=vectors, toward=vectors, offsets=st.tuples(vectors, vectors).map(np.array))
def test_a_bar_anywhere_resists_no_rigid_motion_and_has_its_mass(start, along, toward, offsets):
    places = {1: start, 2: start + along}
    ends = along + offsets[1] - offsets[0]
    if np.linalg.norm(np.cross(ends, toward)) < 1e-3 * np.linalg.norm(ends) or np.linalg.norm(ends) < 1e-2:
        return
    part = bar_part(places, Bar((1, 2), SECTION, toward, offsets), is_coupled=True)
    rigid = rigid_motion(places.values())
    assert np.abs(part.stiffness @ rigid).max() < 1e-9 * np.abs(part.stiffness).max()
    carried = rigid.T @ part.mass @ rigid
    np.testing.assert_allclose(carried[:3, :3], SECTION.mass * np.linalg.norm(ends) * np.eye(3), atol=1e-9 * carried.max())


def test_a_bar_deflects_by_bending_and_shear_as_the_closed_form():
    length = 0.2
    tip = np.linalg.inv(bar_stiffness(SECTION, length)[6:, 6:])
    assert tip[1, 1] == pytest.approx(length**3 / (3 * SECTION.bending_1) + length / SECTION.shear_1, rel=1e-12)
    assert tip[2, 4] == pytest.approx(-length**2 / (2 * SECTION.bending_2), rel=1e-12)
    assert tip[0, 0] == pytest.approx(length / SECTION.axial, rel=1e-12)


def test_bars_in_series_converge_to_the_timoshenko_beam_with_the_second_order():
    exact = join_elements(np.linspace(0, 1, 41), [ROUND] * 40)
    exact = np.sqrt(eigh(exact.stiffness, exact.mass, eigvals_only=True, subset_by_index=[6, 11]))
    errors = []
    for count in (10, 20):
        places = {k: np.array([k / count, 0.0, 0.0]) for k in range(count + 1)}
        parts = tuple(bar_part(places, Bar((k, k + 1), SECTION, np.array([0, 1.0, 0])), is_coupled=True) for k in range(count))
        matrices = GridModel(places, parts).assemble()
        squares = eigh(matrices.stiffness.toarray(), matrices.mass.toarray(), eigvals_only=True, subset_by_index=[6, 11])
        errors.append(np.abs(np.sqrt(squares) / exact - 1).max())
    assert errors[1] < 3e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)


@pytest.mark.parametrize("mass", [end_mass, consistent_mass])
def test_masses_of_bars_have_weight_and_centre(mass):
    rigid = rigid_motion([np.zeros(3), np.array([0.5, 0, 0])])
    carried = rigid.T @ mass(SECTION, 0.5) @ rigid
    assert carried[1, 1] == pytest.approx(SECTION.mass * 0.5)
    assert carried[1, 5] == pytest.approx(SECTION.mass * 0.5 * 0.25)


def test_a_hinged_bar_carries_no_moment_there():
    released = release_ends(bar_stiffness(SECTION, 0.5), [4, 5])
    assert np.abs(released[[4, 5]]).max() == 0
    # A bar hinged at one end has 3 E I / L^3 across it.
    assert released[1, 1] == pytest.approx(1 / (0.5**3 / (3 * SECTION.bending_1) + 0.5 / SECTION.shear_1), rel=1e-12)


def test_a_bar_that_points_along_its_orientation_is_refused():
    with pytest.raises(ToolpointError, match="must point aside"):
        bar_frame(np.zeros(3), np.array([1.0, 0, 0]), np.array([2.0, 0, 0]))


def test_a_bushing_and_a_mass_stand_at_their_place():
    places = {1: np.array([0.1, 0, 0]), 2: np.array([0.3, 0.2, 0])}
    bushing = bushing_part(places, (1, 2), centre=np.array([0.2, 0, 0]), axes=np.eye(3), stiffness=np.arange(1.0, 7) * 1e6)
    assert np.abs(bushing.stiffness @ rigid_motion(places.values())).max() < 1e-6
    grounded = bushing_part(places, (1,), centre=places[1], axes=np.eye(3), stiffness=np.arange(1.0, 7))
    np.testing.assert_allclose(grounded.stiffness, np.diag(np.arange(1.0, 7)))
    part = mass_part(1, 2.0, offset=np.array([0, 0, 0.5]), inertia=np.diag([0.1, 0.2, 0.3]))
    assert part.mass[3, 3] == pytest.approx(0.1 + 2 * 0.25)
    assert part.mass[0, 4] == pytest.approx(2 * 0.5)


@settings(max_examples=25, deadline=None)
@given(leaders=st.lists(vectors, min_size=3, max_size=6), follower=vectors,
       weights=st.lists(st.floats(0.1, 5), min_size=6, max_size=6))
def test_a_mean_tie_follows_rigid_motion_and_keeps_force_and_moment(leaders, follower, weights):
    spread = np.linalg.svd(np.array(leaders) - np.mean(leaders, axis=0), compute_uv=False)
    if spread[1] < 0.05:
        return
    places = {0: follower, **{k + 1: at for k, at in enumerate(leaders)}}
    groups = [MeanLeaders(weights[k], (0, 1, 2), (k + 1,)) for k in range(len(leaders))]
    ties = mean_ties(places, 0, range(6), leaders=groups)
    matrix = np.array([[tie.terms.get(Dof(k + 1, way), 0.0) for k in range(len(leaders)) for way in WAYS[:3]] for tie in ties])
    rigid = rigid_motion([at - follower for at in leaders]).reshape(len(leaders), 6, 6)[:, :3].reshape(-1, 6)
    np.testing.assert_allclose(matrix @ rigid, np.eye(6), atol=1e-7)
    # A load at the follower is carried by forces of the same resultant: the tie's transpose does the same work.
    np.testing.assert_allclose(rigid.T @ matrix.T, np.eye(6), atol=1e-7)


def test_a_mean_of_points_on_a_line_is_refused():
    places = {k: np.array([k / 10, 0.0, 0.0]) for k in range(4)}
    with pytest.raises(ToolpointError, match="six motions apart"):
        mean_ties(places, 0, range(6), leaders=[MeanLeaders(1.0, (0, 1, 2), (1, 2, 3))])


def test_followers_of_followers_move_as_one_piece_in_any_order():
    places = {1: np.zeros(3), 2: np.array([0, 1.0, 0]), 3: np.array([0, 1.0, 2.0])}
    chain = [*rigid_ties(places, 2, [3]), *rigid_ties(places, 1, [2])]
    dofs = [Dof(point, way) for point in (3, 2, 1) for way in WAYS]
    left, motion = eliminate_ties(dofs, chain)
    assert left == tuple(Dof(1, way) for way in WAYS)
    np.testing.assert_allclose(motion.toarray(), rigid_motion([places[3], places[2], places[1]]), atol=1e-15)


def test_ties_in_a_circle_and_double_followers_are_refused():
    first, second = Dof(1, "+x"), Dof(2, "+x")
    with pytest.raises(ToolpointError, match="circle"):
        eliminate_ties([first, second], [TieEquation(first, {second: 1.0}), TieEquation(second, {first: 1.0})])
    with pytest.raises(ToolpointError, match="follow in one"):
        eliminate_ties([first, second], [TieEquation(first, {second: 1.0}), TieEquation(first, {second: 2.0})])


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_a_lever_in_metres_or_millimetres_swings_as_the_closed_form(unit):
    """A mass 0.4 m out on a rigid lever, its pivot's spring of 90 N m/rad: sqrt(k / (m l^2)) in rad/s."""
    places = {1: np.zeros(3), 2: np.array([0.4 / unit, 0, 0])}
    mass, spring = 2.0 * unit, 90.0 / unit  # t for kg at N and mm; N mm/rad
    parts = (spring_part((Dof(1, "+rz"), None), spring), mass_part(2, mass, offset=np.zeros(3), inertia=np.zeros((3, 3))),
             *(spring_part((Dof(1, way), None), 1e9 * (unit if way in WAYS[:3] else 1 / unit)) for way in WAYS[:5]))
    matrices = GridModel(places, parts, tuple(rigid_ties(places, 1, [2]))).assemble(length=unit)
    squares = np.linalg.eigvals(np.linalg.solve(matrices.stiffness.toarray(), matrices.mass.toarray())).real
    assert np.sqrt(1 / squares.max()) == pytest.approx(np.sqrt(90 / (2 * 0.4**2)), rel=1e-6)
    follower = matrices.tied.motion[[matrices.tied.dofs.index(Dof(2, "+y"))]].toarray()[0]
    assert follower[matrices.dofs.index(Dof(1, "+rz"))] == pytest.approx(0.4)


def test_a_mean_with_rotations_does_not_hang_on_the_unit_of_length():
    places = {0: np.array([0.1, 0.2, 0.3]), 1: np.zeros(3), 2: np.array([0.4, 0.1, 0.0]), 3: np.array([0.0, 0.3, 0.1])}
    leaders = [MeanLeaders(1.0, tuple(range(6)), (1, 2, 3))]
    in_metres, in_millimetres = (mean_ties({k: scale * place for k, place in places.items()}, 0, range(6), leaders=leaders)
                                 for scale in (1.0, 1e3))
    for one_metre, one_millimetre in zip(in_metres, in_millimetres, strict=True):
        for leader, value in one_metre.terms.items():
            unit = 1e3 ** (leader.is_rotation - one_metre.follower.is_rotation)
            assert one_millimetre.terms[leader] == pytest.approx(unit * value, rel=1e-9, abs=1e-12)
