"""Sliding interfaces: a carriage on a beam of rails, reduced once; off-station positions, exact slopes, the end of the rail."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh
from scipy.sparse import csc_array

from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL, Casting, Cuboid, Patch
from toolpoint.spatial.motion_table import MotionTable
from toolpoint.substructuring.estimate import Surroundings
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads
from toolpoint.substructuring.reduction import span
from toolpoint.substructuring.sliding import SlidingBody, _lowest_eigenpairs, fit_to_surroundings, station_loads, tabulate

LENGTH, WIDTH, HEIGHT, BLOCK = 0.8, 0.06, 0.05, 0.08
LOW, HIGH = 0.05, 0.75
PLACES = np.array([0.1234, 0.3071, 0.4567, 0.6789])


@pytest.fixture(scope="module")
def beam():
    return Casting((Cuboid([0, 0, 0], [LENGTH, WIDTH, HEIGHT]),), {"body": STEEL}).meshed(0.08)


def block(beam, z):
    return Patch([z, WIDTH / 2, HEIGHT], [1, 0, 0], [0, 1, 0], BLOCK, 0.04).averages(beam)


@pytest.fixture(scope="module")
def free(beam):
    return beam.free_coordinates(np.flatnonzero(beam.nodes[:, 0] < 1e-9))


@pytest.fixture(scope="module")
def around():
    k = np.diag([4e7, 6e8, 5e8, 2e6, 2e6, 1e6])
    return Surroundings(np.block([[k, -k], [-k, k]]), block_diag(np.zeros((6, 6)), np.diag([12.0] * 3 + [0.05, 0.04, 0.06])))


@pytest.fixture(scope="module")
def sliding(beam, free):
    stiffness, mass = (csc_array(a[free][:, free]) for a in (beam.stiffness(), beam.mass()))
    loads = station_loads([lambda z: block(beam, z)], LOW, HIGH, step=BLOCK / 2)[free]
    weights = np.tile(np.sqrt([4e7, 6e8, 5e8, 2e6, 2e6, 1e6]), loads.shape[1] // 6)
    body = LargeBody(stiffness, mass, loads, None, weights)
    reduction = span(body, ActingLoads(900.0, 1.5, 1)).reduced(60)
    table = tabulate(reduction.vectors, lambda z: block(beam, z)[free], LOW, position_max=HIGH, name="block")
    return SlidingBody(reduction, {"block": table}, np.zeros((0, reduction.size)))


def test_off_station_positions_are_those_of_the_whole(beam, free, sliding, around):
    k, m = (a.toarray()[np.ix_(free, free)] for a in (beam.stiffness(), beam.mass()))
    for z in PLACES:
        place = block_diag(block(beam, z).toarray()[free].T, np.eye(6))
        whole = block_diag(k, np.zeros((6, 6))) + place.T @ around.stiffness @ place
        inertia = block_diag(m, np.zeros((6, 6))) + place.T @ around.mass @ place
        exact = np.sqrt(eigh(whole, inertia, eigvals_only=True, subset_by_index=[0, 5])) / (2 * np.pi)
        error = sliding.frequencies(z, around, 6)[0] / exact - 1
        assert error.min() > -1e-6 and error.max() < 5e-4


def test_slope_by_position_is_exact(sliding, around):
    for z in PLACES:
        slope = sliding.frequencies(z, around, 6)[1]
        ahead, back = (sliding.frequencies(z + s, around, 6)[0] for s in (1e-5, -1e-5))
        assert slope == pytest.approx((ahead - back) / 2e-5, rel=1e-5, abs=1e-6 * np.abs(slope).max())


def test_table_costs_no_digit_and_has_two_smooth_derivatives(sliding):
    table = sliding.tables["block"]
    assert table.error < 5e-3
    inside = table.positions[1:-1]
    for order in (0, 1, 2):
        jump = np.abs(table.at(inside + 1e-9, order) - table.at(inside - 1e-9, order)).max()
        assert jump < 1e-5 * np.abs(table.at(inside, order)).max() + 1e-12


def test_a_carriage_that_leaves_its_rail_is_refused(beam, sliding, around):
    with pytest.raises(ToolpointError, match=r"block: position 0\.76 m; must be within its way, 0\.05 \.\. 0\.75 m"):
        sliding.frequencies(0.76, around, 3)
    with pytest.raises(ToolpointError, match="leaves its rail"):
        tabulate(np.zeros((beam.size, 1)), lambda z: block(beam, z), LOW, position_max=0.79)
    with pytest.raises(ToolpointError, match="at least 4"):
        MotionTable(np.array([0.0, 1.0]), np.zeros((2, 6, 1)))


def test_fitted_to_its_surroundings_it_needs_fewer_coordinates(beam, free, sliding, around):
    """Nearly as good as all its shapes, with two thirds of them; and tables follow the turned coordinates."""
    small = fit_to_surroundings(sliding, around, np.linspace(LOW, HIGH, 12), modes=6, size=42, kept=8)
    assert small.reduction.size == 42
    for z in PLACES:
        assert small.frequencies(z, around, 6)[0] == pytest.approx(sliding.frequencies(z, around, 6)[0], rel=1.5e-3)
    with pytest.raises(ToolpointError, match="must be 8"):
        fit_to_surroundings(sliding, around, PLACES, modes=6, size=300, kept=8)


def test_one_place_is_the_table_at_many():
    """Value and slopes at entries, between them and at both ends; the lowest modes are those of LAPACK's whole solution."""
    rng = np.random.default_rng(3)
    table = MotionTable(np.sort(rng.random(9)), rng.standard_normal((9, 6, 4)))
    places = np.r_[table.positions, (table.positions[:-1] + table.positions[1:]) / 2]
    for order in (0, 1, 2):
        many = table.at(places, order)
        assert np.allclose([table.at(float(z), order) for z in places], many, rtol=1e-12, atol=1e-9 * abs(many).max())
    with pytest.raises(ToolpointError, match="not finite"):
        table.at(float("nan"))
    a = rng.standard_normal((90, 40))
    matrix = a @ a.T + np.diag(np.linspace(1, 9, 90))
    squares, vectors = _lowest_eigenpairs(matrix, 7)
    assert np.allclose(squares, np.linalg.eigvalsh(matrix)[:7], rtol=1e-11)
    assert np.allclose(matrix @ vectors, vectors * squares, atol=1e-10) and np.allclose(vectors.T @ vectors, np.eye(7))
