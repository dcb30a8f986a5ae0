"""The quick side of a ball's path beside its envelope, and kernels that borrow their arrays."""

import sys

import numpy as np
import pytest

from toolpoint.material_removal.envelope import ball_side, lowest
from toolpoint.material_removal.tool_shape import MillShape


def row_of(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the row of a straight move."""
    return np.array([*start, *end, 0, 0, 0, 0, 0, 0, 0.0])


@pytest.mark.parametrize("kind", ["level", "slope", "plunge", "still"])
def test_the_side_of_a_ball_is_that_of_its_envelope(kind: str) -> None:
    rng, radius = np.random.default_rng(3), 3e-3
    shape = MillShape(2 * radius, corner_radius=radius)
    assert shape.array[0] == 0
    counts = {-1: 0, 0: 0, 1: 0}
    for _ in range(300):
        start, end = rng.uniform(-5e-3, 5e-3, (2, 3))
        if kind == "level":
            end[2] = start[2]
        if kind in ("plunge", "still"):
            end[:2] = start[:2]
        if kind == "still":
            end[2] = start[2]
        row = row_of(start, end)
        x, y, z = start + rng.uniform(0, 1) * (end - start) + rng.uniform(-4e-3, 4e-3, 3)
        side, height = ball_side(row, shape.array, x, y, z), lowest(row[None], shape.array[None], 0, x, y)
        counts[int(side)] += 1
        assert side == 0 or (height <= z) == (side < 0)
    assert counts[-1] > 20 and counts[1] > 20  # most places are told without the envelope
    assert ball_side(row_of(start, end), MillShape(6e-3).array, x, y, z) == 0  # a flat end is not a ball


def test_a_place_on_the_ball_is_left_to_the_envelope() -> None:
    shape = MillShape(6e-3, corner_radius=3e-3)
    row = row_of(np.array([-0.01, 0, 0]), np.array([0.01, 0, 1e-3]))
    for y in (0.0, 1e-3, -2.5e-3):
        assert ball_side(row, shape.array, 2e-3, y, lowest(row[None], shape.array[None], 0, 2e-3, y)) == 0


def test_a_kernel_that_borrows_leaves_the_count_of_its_arrays() -> None:
    shape, rows = MillShape(6e-3, corner_radius=3e-3).array, row_of(np.zeros(3), np.ones(3))[None]
    before = sys.getrefcount(rows), sys.getrefcount(shape)
    for _ in range(50):
        lowest(rows, shape[None], 0, 0.5, 0.5)
    assert (sys.getrefcount(rows), sys.getrefcount(shape)) == before
