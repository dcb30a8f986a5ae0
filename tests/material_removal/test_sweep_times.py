"""Times at which places of a part go: beside the geometry of straight moves, beside dexels, and walls that are only touched."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.material_removal import MillShape, RemovalSettings, Stock, remove_material, split_moves
from toolpoint.material_removal.sweep_times import SweepTimes

MM = 1e-3


def test_the_first_sweep_is_that_of_the_nearest_moves_in_their_order():
    """Flat ends on level lines sweep what is within a radius of the line and above it; the bins of places change nothing."""
    rng = np.random.default_rng(3)
    ends = rng.uniform(-20, 20, (12, 2, 3)) * MM
    ends[:, 1, 2] = ends[:, 0, 2]
    moves = split_moves(ends[:, 0], ends[:, 1], step=1.0)
    places = rng.uniform(-22, 22, (4000, 3)) * MM
    times = SweepTimes(moves, (MillShape(6 * MM),)).first_pieces(places)
    way = ends[:, 1, :2] - ends[:, 0, :2]
    share = np.einsum("pkc,kc->pk", places[:, None, :2] - ends[:, 0, :2], way) / (way**2).sum(axis=1)
    nearest = ends[:, 0, :2] + np.clip(share, 0, 1)[:, :, None] * way
    swept = (np.linalg.norm(places[:, None, :2] - nearest, axis=2) <= 3 * MM) & (places[:, None, 2] >= ends[:, 0, 2])
    expected = np.where(swept.any(axis=1), swept.argmax(axis=1), 12)
    assert np.array_equal(times, expected)
    assert 0.1 < (times < 12).mean() < 0.9


@pytest.mark.slow
def test_what_goes_is_what_dexels_lose():
    """A ball on slopes and an arc: the mean over places is the removed volume within the scatter of their number."""
    tips = np.array([[0, 0, -3], [20, 10, -1], [10, 20, -4], [0, 5, -2]]) * MM
    moves = split_moves(tips[:-1], tips[1:], step=2 * MM)
    shape, stock = MillShape(8 * MM, 4 * MM), Stock.box(np.array([-5, -5, -8]) * MM, np.array([25, 25, 0]) * MM)
    removed = remove_material(moves, stock, [shape], settings=RemovalSettings(0.2 * MM))
    rng = np.random.default_rng(1)
    places = rng.uniform(stock.lower, stock.upper, (200_000, 3))
    share = (SweepTimes(moves, (shape,)).first_pieces(places) < moves.count).mean()
    assert share * stock.volume == pytest.approx(removed.total_volume, rel=0.01)


@pytest.mark.parametrize("lower_level", [20.0])
def test_a_second_level_along_the_same_wall_cuts_its_own_height_alone(lower_level):
    """Where a level above has left the wall, the tool touches it: no chip, and no depth of cut."""
    levels = np.array([30.0, lower_level])
    start = np.stack([np.full(2, -10.0), np.full(2, 8.5), levels], axis=1) * MM
    moves = split_moves(start, start + np.array([90, 0, 0]) * MM, step=2 * MM)
    removed = remove_material(moves, Stock.box(np.zeros(3), np.array([60, 4, 40]) * MM), [MillShape(10 * MM)],
                              settings=RemovalSettings(0.25 * MM))
    inside = (np.abs(removed.tip[:, 0] - 30 * MM) < 15 * MM) & (removed.reach > 0)
    for level, height in ((30.0, 10.0), (lower_level, 30.0 - lower_level)):
        rows = inside & (np.abs(removed.tip[:, 2] - level * MM) < 1e-9)
        assert removed.depth[rows] == pytest.approx(height * MM, rel=0.02)
