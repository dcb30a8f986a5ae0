"""Tools of any and of changing direction over tri-dexels: closed volumes and arcs, and the engine of three axes beside it."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.material_removal import (
    Holder,
    MillShape,
    RemovalSettings,
    Stock,
    remove_material,
    split_moves,
)
from toolpoint.material_removal.tri_dexels.turned_moves import TurnedMoves
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval, remove_by_turned_tool

MM = 1e-3
BOX = Stock.box(np.array([0, 0, -10]) * MM, np.array([40, 20, 0]) * MM)
UP = np.array([0.0, 0.0, 1.0])


def steps(tips: np.ndarray, axes: np.ndarray, *, frames: np.ndarray | None = None, rapid: bool = False) -> TurnedMoves:
    """Return the steps between places of a tip (n, 3), m, and its axes (n, 3)."""
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    frames = smallest_turn(axes) if frames is None else frames
    n = len(tips) - 1
    pairs = [np.stack([values[:-1], values[1:]], axis=1) for values in (tips, axes, frames)]
    return TurnedMoves(*pairs, np.zeros(n, int), np.zeros(n, int), np.full(n, rapid))


def straight(start: tuple[float, ...], end: tuple[float, ...], axis: np.ndarray, count: int) -> TurnedMoves:
    """Return a straight way (mm) of a tool of one direction."""
    share = np.linspace(0, 1, count + 1)[:, None]
    tips = MM * (np.array(start) + share * (np.array(end) - np.array(start)))
    return steps(tips, np.tile(axis, (count + 1, 1)))


def cut(moves: TurnedMoves, shape: MillShape, spacing: float, stock: Stock = BOX, **options: bool) -> TurnedRemoval:
    return remove_by_turned_tool(moves, stock, [shape], settings=RemovalSettings(spacing * MM), **options)


@pytest.mark.parametrize("shape", [
    MillShape(10 * MM, 2 * MM, flute_length=20 * MM),
    pytest.param(MillShape(10 * MM, flute_length=20 * MM), marks=pytest.mark.slow),
    pytest.param(MillShape(10 * MM, 5 * MM, flute_length=20 * MM), marks=pytest.mark.slow),
    pytest.param(MillShape(10 * MM, 1 * MM, 0.1, 20 * MM), marks=pytest.mark.slow)])
def test_an_upright_tool_cuts_as_with_three_axes(shape: MillShape) -> None:
    """Cylinder, bull nose, ball and cone on a slope into a shoulder: volume, reach and arcs of the engine of three axes."""
    start, end = (-8.0, 18.0, -2.0), (48.0, 16.0, -4.0)
    turned = cut(straight(start, end, UP, 30), shape, 0.5)
    moves = split_moves(np.array([start]) * MM, np.array([end]) * MM, 57 / 30 * MM)
    upright = remove_material(moves, BOX, [shape], settings=RemovalSettings(0.25 * MM))
    assert turned.total_volume == pytest.approx(upright.total_volume, rel=3e-3)
    for place in (8, 15, 22):
        other = int(np.argmin(np.linalg.norm(upright.tip - turned.tip[place], axis=1)))
        assert turned.reach[place] == pytest.approx(upright.reach[other], abs=0.05 * MM)
        assert np.degrees(turned.arc_length[place]) == pytest.approx(np.degrees(upright.arc_length[other]), abs=1.5)


@pytest.mark.slow
def test_volumes_of_leaning_tools_are_closed() -> None:
    """A leaning cylinder's slot by its polygon across the feed, a ball's groove by the segment of its circle."""
    lean = np.array([0, np.sin(0.3), np.cos(0.3)])
    groove = cut(straight((-6, 10, 2 - 3 * lean[2]), (46, 10, 2 - 3 * lean[2]), lean, 60), MillShape(6 * MM, 3 * MM), 0.4)
    segment = 9 * np.arccos(2 / 3) - 2 * np.sqrt(9 - 4)
    assert 1e9 * groove.total_volume == pytest.approx(40 * segment, rel=4e-3)
    slot = cut(straight((-10, 10, -2), (50, 10, -2), lean, 2), MillShape(10 * MM, flute_length=30 * MM), 0.5)
    # The floor leans by 0.3 and meets the top where the wall does not: the part of a rectangle below z = 0.
    lower = np.array([[-5, 0], [5, 0], [5, 30], [-5, 30]]) @ np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    assert 1e9 * slot.total_volume == pytest.approx(40 * _area_below(lower - [0, 2]), rel=2e-3)


def _area_below(polygon: np.ndarray) -> float:
    """Return the area of a polygon (n, 2) below zero of its second coordinate."""
    kept = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        kept += [a] if a[1] <= 0 else []
        kept += [a + (b - a) * a[1] / (a[1] - b[1])] if a[1] * b[1] < 0 else []
    x, y = np.array(kept).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


@pytest.mark.parametrize("lean", [0.0, 0.5])
def test_arcs_of_a_leaning_ball_on_a_plane_are_closed(lean: float) -> None:
    """Its point at kappa and phi is below the face where (R - a) + R n.e < 0, n the normal, e the point's direction."""
    radius, depth = 3.0, 1.0
    axis = np.array([0, np.sin(lean), np.cos(lean)])
    centre = np.array([[-6.0, 10, radius - depth], [46, 10, radius - depth]])
    result = cut(straight(*(centre - radius * axis), axis, 52), MillShape(6 * MM, 3 * MM), 0.3, with_volume=False)
    k = int(np.argmin(np.abs(result.tip[:, 0] - 20 * MM)))
    normal, total = result.frame[k].T @ UP, radius * np.arccos(1 - 1e3 * result.reach[k] / radius)
    phi = np.linspace(0, np.pi, 20001)
    for m in range(10):
        kappa = total * (m + 0.5) / 10 / radius
        below = (radius - depth) + radius * (np.sin(kappa) * np.cos(phi) * normal[1] - np.cos(kappa) * normal[2]) < 0
        assert np.degrees(result.arc_length[k, m]) == pytest.approx(180 * below.mean(), abs=0.1)


@pytest.mark.slow
def test_a_turned_copy_of_path_and_stock_has_the_same_arcs_and_volume() -> None:
    turn = smallest_turn(np.array([0.36, 0.48, 0.8])) @ np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    corners = np.array([[(BOX.lower, BOX.upper)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = corners[[triangle for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))]]
    moves = straight((-8, 17, -3), (48, 15, -4), np.array([0.1, 0.2, 1.0]), 40)
    shape = MillShape(10 * MM, 1.5 * MM, flute_length=20 * MM)
    first = cut(moves, shape, 0.5)
    copy = TurnedMoves(moves.tips @ turn.T, moves.axes @ turn.T, turn @ moves.frames, moves.block, moves.shape, moves.rapid)
    second = cut(copy, shape, 0.5, Stock.mesh(triangles @ turn.T))
    assert second.total_volume == pytest.approx(first.total_volume, rel=4e-3)
    inner = slice(8, 34)
    assert second.reach[inner] == pytest.approx(first.reach[inner], abs=0.06 * MM)
    difference = np.degrees(second.arc_length[inner] - first.arc_length[inner])
    assert np.median(np.abs(difference)) < 0.2 and np.quantile(np.abs(difference), 0.9) < 2.0


@pytest.mark.slow
def test_the_flank_of_a_tool_leaves_a_cone() -> None:
    """The axis runs around a cone that stands on its tip circle: what is left is the cone's frustum, in closed form."""
    slope, radius, height = 0.25, 4.0, 10.0  # of the wall, rad; of the tool and the stock, mm
    foot = 6.0  # radius of the cone at the tips' height, mm
    turn = np.linspace(0, 2 * np.pi, 181)
    around = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    axes = np.cos(slope) * UP - np.sin(slope) * around
    # The tool's side touches the wall: its axis stands R / cos(slope) beside the cone at every height.
    tips = (foot + radius / np.cos(slope)) * around - (height + 2) * UP
    stock = Stock.cylinder(16 * MM, -height * MM, 0.0)
    result = cut(steps(tips * MM, axes), MillShape(2 * radius * MM, flute_length=30 * MM), 0.5, stock)
    lower, upper = foot - 2 * np.tan(slope), foot - (height + 2) * np.tan(slope)
    frustum = np.pi * height / 3 * (lower**2 + lower * upper + upper**2)
    assert 1e9 * result.left_volume == pytest.approx(frustum, rel=4e-3)


def test_a_tool_that_swings_about_its_tip_takes_a_sector() -> None:
    """A disc-like wedge: a cylinder that swings in the plane x z about its tip sweeps the sector between its two stands."""
    angles = np.linspace(-0.4, 0.4, 47)
    axes = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    stock = Stock.box(np.array([-20, -1, 0]) * MM, np.array([20, 1, 12]) * MM)
    result = cut(steps(np.zeros((47, 3)), axes), MillShape(8 * MM, flute_length=40 * MM), 0.4, stock)
    x = np.linspace(-20, 20, 401)[:, None]
    z = np.linspace(0, 12, 121)
    inside = np.zeros((401, 121), bool)
    for a in np.linspace(-0.4, 0.4, 200):
        along, across = x * np.sin(a) + z * np.cos(a), x * np.cos(a) - z * np.sin(a)
        inside |= (along >= 0) & (np.abs(across) <= np.sqrt(16 - 1 / 3))  # mean over the thickness
    assert 1e9 * result.total_volume == pytest.approx(2 * 40 * 12 * inside.mean(), rel=1e-2)
    # Turned about its tip, the edge's upper end advances; the feed of the middle is half the reach times the rate.
    k = 24
    assert result.feed_way[k] == pytest.approx(0.5 * result.reach[k] * 0.8 / 46, rel=1e-2)


def test_rapids_and_holders_in_the_work_are_told_with_depth() -> None:
    moves = straight((-8, 10, -2), (20, 10, -2), UP, 4)
    rapid = TurnedMoves(moves.tips, moves.axes, moves.frames, moves.block, moves.shape, np.ones(4, bool))
    contacts = cut(rapid, MillShape(10 * MM), 1.0, with_volume=False).collisions
    assert contacts and all(contact.kind == "rapid through stock" for contact in contacts)
    # The face of a holder 15 mm above the tip of a tool that leans by 1.2 rad: the stock's edge (20, 0) is 0.84 mm in it.
    lean = np.array([0, np.sin(1.2), np.cos(1.2)])
    holder = Holder((15 * MM,), (40 * MM,), 15 * MM, ("holder",))
    held = remove_by_turned_tool(straight((5, 3, 0), (20, 3, 0), lean, 4), BOX, [MillShape(10 * MM, flute_length=15 * MM)],
                                 settings=RemovalSettings(0.6 * MM), holders=[holder], with_volume=False)
    depths = [contact.depth for contact in held.collisions if contact.body == "holder"]
    assert depths and 0.4 * MM < max(depths) < 0.85 * MM
