"""Matrices by node pairs: the same as compressed columns in every use, and what a large body's reduction does with them."""

import numpy as np
import pytest

from solid_models import brick, tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import CAST_IRON, STEEL, Casting, Cuboid
from toolpoint.substructuring.large_body import LargeBody
from toolpoint.vibration.sparse.node_matrix import NodeMatrix
from toolpoint.vibration.sparse.pencil import Pencil


def two_sets():
    boxes = [Cuboid([0, 0, 0], [0.3, 0.2, 0.1]), Cuboid([0, 0, 0.1], [0.3, 0.05, 0.15], "rail")]
    return Casting(boxes, {"body": CAST_IRON, "rail": STEEL}).meshed(0.05)


MODELS = [two_sets(), brick((1, 1, 1), (3, 2, 2)), tetrahedral_brick((1, 1, 1), (2, 2, 2))]


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS, ids=("two sets", "hexahedra", "tetrahedra"))
def test_they_are_the_sums_of_the_parts(model):
    for matrix, columns in zip(model.node_matrices(), (model.stiffness(), model.mass()), strict=True):
        size = abs(columns).max()
        assert matrix.shape == columns.shape and matrix.largest == pytest.approx(size, rel=1e-12)
        assert abs(matrix.columns() - columns).max() < 1e-14 * size
        assert np.allclose(matrix.diagonal(), columns.diagonal(), rtol=1e-12)
        for right in (np.random.default_rng(0).standard_normal(model.size), model.rigid_motion(),
                      np.asfortranarray(np.random.default_rng(1).standard_normal((model.size, 5)))):
            assert np.allclose(matrix @ right, columns @ right, atol=1e-13 * abs(columns).sum(axis=0).max())


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["multifrontal", "SuperLU"])
def test_factors_and_counts_are_those_of_columns(solver):
    model = MODELS[0]
    blocks, columns = (Pencil(*matrices, 1e6, coordinates=model.dof_places, solver=solver)
                       for matrices in (model.node_matrices(), (model.stiffness(), model.mass())))
    right = np.random.default_rng(2).standard_normal((model.size, 3))
    exact = columns.inverse.solve(right)
    assert np.allclose(blocks.inverse.solve(right), exact, atol=1e-9 * abs(exact).max())
    assert np.allclose(blocks.stiffness @ exact + 1e6 * (blocks.mass @ exact), right, atol=1e-7)
    for square in (1.0, 1e8, 1e9):
        assert blocks.count_below(square) == columns.count_below(square) >= 6


def test_values_that_are_not_finite_are_refused():
    model = MODELS[1]
    stiffness, mass = model.node_matrices()
    blocks = stiffness.blocks.copy()
    blocks[3, 1, 1] = np.nan
    with pytest.raises(ToolpointError, match="not finite"):
        LargeBody(NodeMatrix(stiffness.pattern, blocks), mass, np.eye(model.size, 6))
