"""Volumes against closed forms, and contacts that must not be: rapids, holders; stock and tools that are refused."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint import ToolpointError
from toolpoint.material_removal import (
    Holder,
    MillShape,
    RemovalSettings,
    RemovedMaterial,
    Stock,
    remove_material,
    shape_of_kind,
    split_moves,
)

MM = 1e-3
VOLUME_TOLERANCE = 1e-3  # of the exact solid
BLOCK = Stock.box(np.array([-30, -30, -20]) * MM, np.array([90, 30, 0]) * MM)


def _mill(points: list[tuple[float, float, float]], *, shape: MillShape, spacing: float = 0.25, stock: Stock = BLOCK,
          holder: Holder | None = None, rapid: list[bool] | None = None) -> RemovedMaterial:
    p = np.array(points, float) * MM
    moves = split_moves(p[:-1], p[1:], 1 * MM, rapid=None if rapid is None else np.array(rapid))
    return remove_material(moves, stock, [shape], settings=RemovalSettings(spacing * MM), holders=[holder] if holder else [])


def test_slot_of_a_flat_end() -> None:
    """b (D L + pi R^2): D 10, b 3, L 50: 1735.61944902 mm^3."""
    result = _mill([(0, 0, 1), (0, 0, -3), (50, 0, -3)], shape=MillShape(0.01))
    assert result.total_volume == pytest.approx(1735.61944902e-9, rel=VOLUME_TOLERANCE)
    assert result.total_volume + result.left_volume == pytest.approx(BLOCK.volume, rel=1e-9)


def test_circular_pocket_emptied_whole() -> None:
    """pi 20^2 x 3 = 3769.91118431 mm^3."""
    starts, ends, kinds, centers, sweeps = [], [], [], [], []
    place = np.array([0.0, 0.0, -3.0])
    for rho in (4.0, 8.0, 12.0, 15.0):
        begin = np.array([rho, 0.0, -3.0])
        starts += [place, begin]
        ends += [begin, begin]
        kinds, sweeps, centers, place = [*kinds, 0, 1], [*sweeps, 0.0, 2 * np.pi], [*centers, begin, (0.0, 0.0, -3.0)], begin
    moves = split_moves(np.array(starts) * MM, np.array(ends) * MM, 1 * MM, kind=np.array(kinds), center=np.array(centers) * MM,
                        sweep=np.array(sweeps))
    result = remove_material(moves, BLOCK, [MillShape(0.01)], settings=RemovalSettings(0.25 * MM))
    assert result.total_volume == pytest.approx(3769.91118431e-9, rel=VOLUME_TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ball", "bull", "tapered"])
def test_groove_along_a_line(kind: str) -> None:
    """Through the whole stock a level move takes the area under the profile times the length of the stock."""
    shape = {"ball": MillShape(0.008, 0.004), "bull": MillShape(0.01, 0.002),
             "tapered": MillShape(0.01, 0.001, np.radians(10), 0.012)}[kind]
    depth = 2.5
    result = _mill([(-45, 0.03, -depth), (105, 0.03, -depth)], shape=shape, spacing=0.2)
    d = np.linspace(0, shape.radius, 200001)
    s = np.sin(shape.taper)
    corner = np.clip(d - shape.flat, 0.0, shape.corner_radius * np.cos(shape.taper))
    height = shape.corner_radius - np.sqrt(shape.corner_radius**2 - corner**2)
    if s > 0:
        height = height + np.maximum(d - shape.flat - shape.corner_radius * np.cos(shape.taper), 0) / np.tan(shape.taper)
    area = 2 * np.trapezoid(np.maximum(depth * MM - height, 0.0), d)
    assert result.total_volume == pytest.approx(area * 120 * MM, rel=VOLUME_TOLERANCE)


def test_sloped_move_of_a_ball_is_the_groove_of_an_inclined_tube() -> None:
    """A ball that goes down through the whole stock: the depth below the surface at the axis is that of the tube."""
    shape = MillShape(0.008, 0.004)
    result = _mill([(-60, 0.1, 5.0), (120, 0.1, -10.0)], shape=shape, spacing=0.2)
    slope = 15.0 / 180.0
    x = 30.1
    j = int(np.rint((0.1 * MM - result.origin[1]) / (0.2 * MM)))
    i = int(np.rint((x * MM - result.origin[0]) / (0.2 * MM)))
    across = result.origin[1] + j * 0.2 * MM - 0.1 * MM
    place = result.origin[0] + i * 0.2 * MM
    # Lowest point of an inclined tube: centre line less the radius over the cosine of the slope.
    centre = (5.0 - slope * (place / MM + 60)) * MM + shape.radius
    lowest = centre - np.sqrt(shape.radius**2 - across**2) * np.hypot(1, slope)
    assert result.height[i, j] == pytest.approx(lowest, abs=1e-9)


def test_a_mesh_of_a_box_is_the_box() -> None:
    c = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * [0.04, 0.03, 0.02]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = Stock.mesh(np.array([[c[a], c[b], c[d]] for a, b, d, _ in quads] + [[c[a], c[b], c[d]] for a, _, b, d in quads]))
    points = [(-10.0, 15.0, 17.0), (50.0, 15.0, 17.0)]
    of_mesh = _mill(points, shape=MillShape(0.01), stock=mesh, spacing=0.5)
    assert mesh.volume == pytest.approx(0.04 * 0.03 * 0.02)
    assert of_mesh.total_volume == pytest.approx(0.01 * 0.04 * 0.003, rel=0.02)


def test_an_open_mesh_is_refused() -> None:
    c = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * [0.04, 0.03, 0.02]
    faces = np.array([[c[0], c[2], c[6]], [c[0], c[6], c[4]], [c[0], c[1], c[5]], [c[0], c[5], c[4]]])  # no top
    with pytest.raises(ToolpointError, match="not closed"):
        Stock.mesh(faces).laid_out(1e-3)


def test_a_rapid_through_stock_is_named_with_its_place() -> None:
    result = _mill([(-45, 0, 5), (-45, 0, -2), (20, 0, -2), (20, 0, 5)], shape=MillShape(0.01), rapid=[False, True, False])
    (contact,) = result.collisions
    assert (contact.kind, contact.block) == ("rapid through stock", 1)
    assert contact.depth == pytest.approx(2 * MM, abs=1e-6)


def test_a_rapid_over_the_stock_is_none() -> None:
    assert not _mill([(-45, 0, 0.0), (20, 0, 0.0), (20, 0, -1)], shape=MillShape(0.01), rapid=[True, False]).collisions


def test_a_holder_meets_the_wall_of_a_pocket() -> None:
    holder = Holder.of(stick_out=0.01, diameter=0.03)
    result = _mill([(0, 0, 1), (0, 0, -12), (20, 0, -12)], shape=MillShape(0.01), holder=holder)
    assert {contact.kind for contact in result.collisions} == {"holder in the work"}
    assert max(contact.depth for contact in result.collisions) == pytest.approx(2 * MM, abs=1e-6)
    longer = Holder.of(stick_out=0.013, diameter=0.03)
    assert not _mill([(0, 0, 1), (0, 0, -12), (20, 0, -12)], shape=MillShape(0.01), holder=longer).collisions


def test_a_stock_that_no_cut_meets_is_refused() -> None:
    with pytest.raises(ToolpointError, match="is met by no cutting move"):
        _mill([(500, 0, -1), (600, 0, -1)], shape=MillShape(0.01))


@pytest.mark.parametrize("kind", ["t-slot", "drill", "thread mill"])
def test_other_tools_are_refused_by_name(kind: str) -> None:
    with pytest.raises(ToolpointError, match=kind):
        shape_of_kind(kind, 0.01)


def test_a_taper_that_leaves_no_tip_is_refused() -> None:
    with pytest.raises(ToolpointError, match="must fit the tip"):
        MillShape(0.006, 0.001, np.radians(30), 0.02)
