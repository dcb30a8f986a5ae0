"""Arcs of cut against closed forms: shoulder, slot, circles, corner, trochoid, helix, ball on an inclined plane."""

from __future__ import annotations

import numpy as np
import pytest

from toolpoint.material_removal import MillShape, RemovalSettings, RemovedMaterial, Stock, remove_material, split_moves

MM = 1e-3
RADIUS, DEPTH = 5.0, 3.0  # mm, as the closed forms were computed
ARC_TOLERANCE = 0.5  # degrees
END_MILL = MillShape(2 * RADIUS * MM)


def _mill(points: list[tuple[float, float, float]], stock: Stock, *, spacing: float = 0.25, shape: MillShape = END_MILL,
          step: float = 1.0) -> RemovedMaterial:
    """Return what a polyline (mm) takes away."""
    p = np.array(points, float) * MM
    return remove_material(split_moves(p[:-1], p[1:], step * MM), stock, [shape], settings=RemovalSettings(spacing * MM))


def _turns(turns: list[tuple[float, float, float]], *, z: float = -DEPTH, step: float = 1.0) -> tuple[np.ndarray, ...]:
    """Return start, end, kind, centre, sweep of full circles (radius, centre x, centre y; mm), each joined by a line."""
    rows = []
    for k, (rho, x, y) in enumerate(turns):
        begin = (x + rho, y, z)
        if k:
            rows.append((rows[-1][1], begin, 0, begin, 0.0))
        rows.append((begin, begin, 1, (x, y, z), 2 * np.pi))
    return tuple(np.array([row[k] for row in rows]) for k in range(5))


def _circles(turns: list[tuple[float, float, float]], stock: Stock, *, sense: float = 1.0) -> RemovedMaterial:
    start, end, kind, center, sweep = _turns(turns)
    moves = split_moves(start * MM, end * MM, 1.0 * MM, kind=kind, center=center * MM, sweep=sense * sweep)
    return remove_material(moves, stock, [END_MILL], settings=RemovalSettings(0.25 * MM))


def _arc_at(result: RemovedMaterial, place: tuple[float, float], layer: int = 0) -> tuple[float, float, float]:
    """Return entry and exit of the first arc and the sum of all arcs (deg) at the end of a piece nearest to a place, mm."""
    ends = np.flatnonzero(~result.at_start)
    k = ends[np.argmin(np.linalg.norm(result.tip[ends, :2] - np.array(place) * MM, axis=1))]
    entry, leave = np.degrees(result.arcs[k, layer, 0])
    return float(entry), float(leave), float(np.degrees(result.arc_length[k, layer]))


@pytest.mark.slow
@pytest.mark.parametrize("radial_depth", [0.05, 0.5, 1.0, 2.5, 5.0, 7.3])
def test_shoulder_down_and_up(radial_depth: float) -> None:
    """Down-milling ends at 180 degrees, up-milling begins at 0; the arc is acos(1 - a/R)."""
    expected = np.degrees(np.arccos(1 - radial_depth / RADIUS))
    stock = Stock.box(np.array([0, 0, -10]) * MM, np.array([60, 30, 0]) * MM)
    y = 30 - radial_depth + RADIUS
    down = _arc_at(_mill([(-10, y, -DEPTH), (50, y, -DEPTH)], stock), (30, y))
    up = _arc_at(_mill([(70, y, -DEPTH), (10, y, -DEPTH)], stock), (30, y))
    assert down == pytest.approx((180 - expected, 180.0, expected), abs=ARC_TOLERANCE)
    assert up == pytest.approx((0.0, expected, expected), abs=ARC_TOLERANCE)


def test_slot_is_half_a_turn_at_any_direction() -> None:
    """A slot across the grid at 27 degrees has the arc 0 .. 180 degrees and its own depth."""
    way = np.array([np.cos(np.radians(27)), np.sin(np.radians(27))])
    stock = Stock.box(np.array([0, 0, -10]) * MM, np.array([80, 60, 0]) * MM)
    ends = [(15, 15, -DEPTH), (15 + 40 * way[0], 15 + 40 * way[1], -DEPTH)]
    result = _mill(ends, stock)
    place = (15 + 25 * way[0], 15 + 25 * way[1])
    assert _arc_at(result, place) == pytest.approx((0.0, 180.0, 180.0), abs=ARC_TOLERANCE)
    assert result.reach.max() == pytest.approx(DEPTH * MM, rel=1e-9)


def test_circular_pocket() -> None:
    """Final wall 20 mm after 19 mm: arc 42.26858443 degrees (down, counterclockwise, inside)."""
    stock = Stock.box(np.array([-30, -30, -10]) * MM, np.array([30, 30, 0]) * MM)
    turns = [(rho, 0.0, 0.0) for rho in (4.0, 9.0, 14.0, 15.0)]
    result = _circles(turns, stock)
    last = result.moves.block[result.piece] == result.moves.block.max()
    arcs = np.degrees(result.arc_length[last & ~result.at_start, 0])
    # The last turn begins where the line from the circle before has cut into the wall.
    assert np.median(arcs) == pytest.approx(42.26858443, abs=0.05)
    assert np.abs(arcs[10:-10] - 42.26858443).max() < ARC_TOLERANCE


def test_boss() -> None:
    """Final radius 20 mm after 21 mm, outside: arc 33.27989094 degrees."""
    stock = Stock.cylinder(42 * MM, -10 * MM, 0.0)
    result = _circles([(25.0, 0.0, 0.0)], stock, sense=-1.0)
    arcs = np.degrees(result.arc_length[~result.at_start, 0])
    assert np.abs(arcs[15:-15] - 33.27989094).max() < ARC_TOLERANCE


@pytest.mark.parametrize(("allowance", "arc"), [(0.5, 115.84193276), (1.0, 126.86989765), (2.5, 150.0)])
@pytest.mark.default_cases(1)
def test_inner_corner(allowance: float, arc: float) -> None:
    """At the corner of a pocket that the same tool has cut before, the allowance short on both walls: pi/2 + acos(1 - a/R)."""
    stock = Stock.box(np.array([-40, -40, -10]) * MM, np.array([20, 20, 0]) * MM)
    a, z = allowance, -DEPTH
    before = [(-20 + a, -15, z), (-a, -15, z), (-a, -a, z), (-15, -a, z), (-15, -15, z)]
    # The final pass goes along the wall x = R towards the corner, feed +y, the wall on its right: down-milling.
    result = _mill([*before, (0, -15, z), (0, 0, z)], stock, step=0.5)
    assert _arc_at(result, (0, 0))[2] == pytest.approx(arc, abs=ARC_TOLERANCE)


@pytest.mark.parametrize(("forward", "arc"), [(0.5, 35.54724909), (1.0, 49.45839813), (2.0, 68.19625201)])
def test_trochoid(forward: float, arc: float) -> None:
    """Circles of 5 mm, each turn `forward` mm on: the arc at the foremost point."""
    stock = Stock.box(np.array([-30, -30, -10]) * MM, np.array([30, 30, 0]) * MM)
    assert _foremost(forward, stock) == pytest.approx(arc, abs=ARC_TOLERANCE)


def _foremost(forward: float, stock: Stock) -> float:
    """Return the arc (deg) at the foremost point of a turn begun a quarter of a turn before it."""
    rho = 5.0
    starts = [(rho, 0.0, -DEPTH), (rho, 0.0, 1.0), (forward, -rho, 1.0), (forward, -rho, -DEPTH)]
    ends = [(rho, 0.0, -DEPTH), (forward, -rho, 1.0), (forward, -rho, -DEPTH), (rho + forward, 0.0, -DEPTH)]
    starts[1] = ends[0]
    moves = split_moves(np.array([starts[0], starts[2], starts[3]]) * MM, np.array([ends[0], ends[2], ends[3]]) * MM, 1 * MM,
                        kind=np.array([1, 0, 1]), center=np.array([(0, 0, -DEPTH), (0, 0, 0), (forward, 0, -DEPTH)]) * MM,
                        sweep=np.array([2 * np.pi, 0.0, np.pi / 2]))
    result = remove_material(moves, stock, [END_MILL], settings=RemovalSettings(0.25 * MM))
    return _arc_at(result, (rho + forward, 0.0))[2]


def test_helical_ramp_of_a_flat_end() -> None:
    """The front of a ramp in full stock is half a turn wide at its lower end and deepens with the way."""
    stock = Stock.box(np.array([-30, -30, -10]) * MM, np.array([30, 30, 0]) * MM)
    moves = split_moves(np.array([(8.0, 0, 0)]) * MM, np.array([(8.0, 0, -2)]) * MM, 1 * MM, kind=np.array([1]),
                        center=np.array([(0.0, 0, 0)]) * MM, sweep=np.array([2 * np.pi]))
    result = remove_material(moves, stock, [END_MILL], settings=RemovalSettings(0.25 * MM))
    k = np.flatnonzero(~result.at_start)
    depth = -result.tip[k, 2]
    before_first_overlap = slice(3, int(0.6 * k.size))
    assert np.allclose(result.reach[k][before_first_overlap], depth[before_first_overlap], rtol=1e-6)
    arcs = np.degrees(result.arc_length[k, 0])
    assert np.abs(arcs[before_first_overlap] - 180).max() < ARC_TOLERANCE


@pytest.mark.parametrize("tilt", [0.0, 15.0, 40.0])
@pytest.mark.default_cases(1)
def test_ball_on_an_inclined_plane(tilt: float) -> None:
    """A ball along a plane inclined across the feed: the arc of each slice is where the sphere is below the plane."""
    radius, depth = 3.0, 0.4
    slope = np.tan(np.radians(tilt))
    y = np.array([-20.0, 20.0])
    corners = {(i, j): np.array([(-20, 20)[i], y[j], slope * y[j]]) for i in (0, 1) for j in (0, 1)}
    bottom = {key: np.array([p[0], p[1], -30.0]) for key, p in corners.items()}
    stock = Stock.mesh(_prism(corners, bottom) * MM)
    normal = np.array([0.0, -np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    centre = normal * (radius - depth)
    tip = centre - [0, 0, radius]
    shape = MillShape(2 * radius * MM, radius * MM)
    result = _mill([(-15 + tip[0], tip[1], tip[2]), (10 + tip[0], tip[1], tip[2])], stock, shape=shape, spacing=0.1, step=0.7)
    k = int(np.argmin(np.abs(result.tip[:, 0])))
    total = result.reach[k] / MM
    length = radius * np.arccos(max(1 - total / radius, 0.0)) + max(total - radius, 0.0)
    worst = 0.0
    for layer in range(result.arcs.shape[1]):
        kappa = (layer + 0.5) / result.arcs.shape[1] * length / radius
        if kappa > np.pi / 2:
            continue
        r, z = radius * np.sin(kappa), -radius * np.cos(kappa)  # from the centre
        # phi clockwise from y, feed x: the point is r (sin, cos); below the plane where its height over it is negative.
        phi = np.linspace(0, np.pi, 20001)
        is_in = r * np.cos(phi) * normal[1] + z * normal[2] < -(radius - depth)
        worst = max(worst, abs(np.degrees(is_in.mean() * np.pi - result.arc_length[k, layer])))
    assert worst < ARC_TOLERANCE


def _prism(top: dict[tuple[int, int], np.ndarray], bottom: dict[tuple[int, int], np.ndarray]) -> np.ndarray:
    """Return the triangles of a closed prism between two quadrilaterals."""
    ring = [(0, 0), (1, 0), (1, 1), (0, 1)]
    faces = [(top[ring[0]], top[ring[1]], top[ring[2]]), (top[ring[0]], top[ring[2]], top[ring[3]]),
             (bottom[ring[0]], bottom[ring[2]], bottom[ring[1]]), (bottom[ring[0]], bottom[ring[3]], bottom[ring[2]])]
    for k in range(4):
        a, b = ring[k], ring[(k + 1) % 4]
        faces += [(bottom[a], bottom[b], top[b]), (bottom[a], top[b], top[a])]
    return np.array(faces)
