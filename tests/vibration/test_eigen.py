"""Eigenvalues alone beside those with shapes."""

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.vibration.eigen import mass_normalised, natural_squares


@pytest.mark.parametrize("size", [5, 29, 30, 60])
def test_squares_alone_are_those_with_shapes(size):
    """Small matrices in one batch, large ones one by one; a stiffness of lower rank and one that is broadcast."""
    rng = np.random.default_rng(size)
    root = rng.standard_normal((3, size, size))
    mass = root @ np.swapaxes(root, -1, -2) + np.eye(size)
    part = rng.standard_normal((3, size, size - 2))
    stiffness = part @ np.swapaxes(part, -1, -2)
    for heavy, stiff in ((mass, stiffness), (mass[0], stiffness), (mass, stiffness[0]), (mass[0], stiffness[0])):
        shape = np.broadcast_shapes(heavy.shape, stiff.shape)
        expected = mass_normalised(np.broadcast_to(heavy, shape), np.broadcast_to(stiff, shape))[0]
        found = natural_squares(heavy, stiff)
        assert found.shape == shape[:-1]
        assert np.abs(found - expected).max() < 1e-13 * size * expected.max()
    with pytest.raises(ToolpointError, match="not positive definite"):
        natural_squares(mass - 1e3 * np.eye(size), stiffness)
