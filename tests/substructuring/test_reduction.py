"""Reduction: exact with all shapes, never better than the truth, estimates that bound, refusals; methods agree in the limit."""

import numpy as np
import pytest
from scipy.linalg import block_diag, eigh
from scipy.sparse import csc_array

from toolpoint import ToolpointError
from toolpoint.bodies.solid import CAST_IRON, Casting, Cuboid, Patch
from toolpoint.substructuring.estimate import Surroundings, choose_size, couple_reduced, reduce_automatically
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.substructuring.methods import ActingLoads, CraigBampton, ResidualFlexibility
from toolpoint.substructuring.reduction import reduce, span

SIZE = np.array([0.5, 0.16, 0.9])
COUNT = 8


@pytest.fixture(scope="module")
def model():
    wall = 0.02
    return Casting((Cuboid([0, 0, 0], SIZE), Cuboid([wall] * 3, SIZE - wall, is_window=True)),
                   {"body": CAST_IRON}).meshed(0.25)


@pytest.fixture(scope="module")
def loads(model):
    x, y, z = SIZE
    patches = [Patch([0, y / 2, 0.3 * z], [0, 1, 0], [0, 0, -1], 0.1, 0.1),
               Patch([x / 2, y / 2, z], [1, 0, 0], [0, 1, 0], 0.1, 0.1)]
    return np.hstack([patch.averages(model).toarray() for patch in patches])


@pytest.fixture(scope="module")
def around(loads):
    """Each patch on springs to a mass, the first mass on springs to the ground."""
    n = loads.shape[1]
    k = np.diag(np.tile([3e8, 5e8, 2e8, 3e6, 2e6, 4e6], n // 6))
    stiffness = np.block([[k, -k], [-k, k]])
    stiffness[n:n + 6, n:n + 6] += np.diag([2e8, 2e8, 4e8, 5e6, 5e6, 5e6])
    mass = block_diag(np.zeros((n, n)), *[np.diag([m, m, m, 0.02 * m, 0.03 * m, 0.01 * m]) for m in (60.0, 150.0)])
    return Surroundings(stiffness, mass)


@pytest.fixture(scope="module")
def body(model, loads, around):
    weights = np.sqrt(np.diag(around.stiffness)[:loads.shape[1]])
    return LargeBody(model.stiffness(), model.mass(), loads, model.rigid_motion(), weights)


@pytest.fixture(scope="module")
def truth(model, loads, around):
    n, l = model.size, loads.shape[1]
    place = block_diag(loads.T, np.eye(l))
    k = block_diag(model.stiffness().toarray(), np.zeros((l, l))) + place.T @ around.stiffness @ place
    m = block_diag(model.mass().toarray(), np.zeros((l, l))) + place.T @ around.mass @ place
    assert len(k) == n + l
    return np.sqrt(eigh(k, m, subset_by_index=[0, COUNT - 1], eigvals_only=True)) / (2 * np.pi)


@pytest.fixture(scope="module")
def shapes(body, truth):
    return span(body, ActingLoads(float(truth[-1])))


def test_reduced_matrices_are_diagonal_and_free_of_rigid_motion(body, shapes):
    v, rigid = shapes.reduced().vectors, shapes.prepared.rigid
    squares = shapes.reduced().squares
    assert np.abs(v.T @ (body.mass @ v) - np.eye(v.shape[1])).max() < 1e-8
    assert np.abs(v.T @ (body.stiffness @ v) / np.sqrt(np.outer(squares, squares)) - np.eye(v.shape[1])).max() < 1e-8
    assert np.abs(rigid.T @ (body.mass @ v)).max() < 1e-7


def test_reduced_then_coupled_is_coupled_then_solved_with_the_full_basis():
    """A chain of 30 masses, all of whose modes are among the shapes: 1e-9."""
    n = 30
    k = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    k[0, 0] = k[-1, -1] = 1e6
    loads = np.eye(n)[:, [0, n - 1]]
    chain = LargeBody(csc_array(k), csc_array(2.0 * np.eye(n)), loads, np.ones((n, 1)))
    top = np.sqrt(4e6 / 2) / (2 * np.pi)
    reduction = reduce(chain, ActingLoads(1.01 * top, 1.0, 1))
    outside = np.diag([3e5, 7e5, 0.0])
    outside[1, 2] = outside[2, 1] = -2e5
    outside[2, 2] = 4e5
    around = Surroundings(outside, np.diag([0.0, 5.0, 9.0]))
    whole = block_diag(k, 0.0)
    place = np.zeros((3, n + 1))
    place[0, 0] = place[1, n - 1] = place[2, n] = 1
    m = block_diag(2.0 * np.eye(n), 0.0) + place.T @ around.mass @ place
    exact = np.sqrt(eigh(whole + place.T @ outside @ place, m, eigvals_only=True))[:12] / (2 * np.pi)
    assert couple_reduced(reduction, around, 12).frequency == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("method", [ActingLoads, CraigBampton, ResidualFlexibility])
def test_every_method_comes_from_above_and_near(body, around, truth, method):
    solved = couple_reduced(reduce(body, method(float(truth[-1]))), around, COUNT)
    error = solved.frequency / truth - 1
    assert error.min() > -1e-8 and error.max() < (1e-6 if method is ActingLoads else 5e-3)


def test_estimates_are_bounds_and_not_far(shapes, around, truth):
    ratios = []
    for size in range(shapes.kept + 2, shapes.largest + 1):
        solved = couple_reduced(shapes.reduced(size), around, COUNT)
        error = solved.frequency / truth - 1
        if solved.is_sure:
            ratios += list((solved.error / error)[error > 1e-8])
    assert len(ratios) > 50 and min(ratios) >= 1 and np.median(ratios) < 5


def test_a_mode_that_may_be_missing_is_said(body, around, truth):
    short = couple_reduced(reduce(body, ActingLoads(float(truth[-1]), 1.0)), around, COUNT)
    assert not short.is_sure and "one may be missing" in short.status
    fixed = couple_reduced(reduce(body, CraigBampton(float(truth[-1]))), around, COUNT)
    assert fixed.status.startswith("free modes: Craig-Bampton does not say which")
    with pytest.raises(ToolpointError, match="wider band"):
        choose_size(span(body, ActingLoads(float(truth[-1]), 1.0)), around, COUNT, error=1e-3)


@pytest.mark.parametrize("error", [1e-3, 1e-4])
def test_automatic_size_keeps_its_word(body, around, truth, error):
    reduction, solved = reduce_automatically(body, around, COUNT, band=0.5 * float(truth[-1]), error=error)
    assert solved.is_sure and np.max(solved.frequency / truth - 1) <= error
    assert np.max(solved.error) <= error and reduction.size < 40


def test_faults_of_a_body_are_named(body, model, loads):
    with pytest.raises(ToolpointError, match="strain the body"):
        LargeBody(body.stiffness, body.mass, loads, model.rigid_motion() ** 2)
    with pytest.raises(ToolpointError, match=r"rigid: 3 motions given, 6 modes"):
        reduce(LargeBody(body.stiffness, body.mass, loads, model.rigid_motion()[:, :3]), ActingLoads(300.0))
    held = LargeBody(csc_array(body.stiffness + 1e9 * body.mass), body.mass, loads)
    assert reduce(held, ActingLoads(5300.0, 1.0)).rigid_participation.shape == (12, 0)
    with pytest.raises(ToolpointError, match="size: 500"):
        span(body, ActingLoads(300.0)).reduced(500)
