"""Tri-dexels of turned tools: volumes against booleans of manifold3d (Apache-2.0), arcs against closed forms, cost with
spacing.

    python benchmarks/machining/tri_dexels.py [volumes|refined|stands|arcs|cost] [--cases 10] [--seed 1]

`volumes`: random five-axis paths of cylinders, balls and bull noses; hulls of two stands hold a little more than the tool
sweeps. `refined`: first legs of these with hulls of ever smaller parts of a step, and their limit. `stands`: the same paths
against many stands of the tool, at random places. `arcs`: balls that lean anyhow on a plane, all slices. `cost`: one flank cut
of 100 steps at five spacings. The last line is the figure.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, needed_peer
from toolpoint.kinematics.tool_frame import smallest_turn
from toolpoint.material_removal import MillShape, RemovalSettings, Stock
from toolpoint.material_removal.tri_dexels.presence import has_material
from toolpoint.material_removal.tri_dexels.turned_moves import TurnedMoves
from toolpoint.material_removal.tri_dexels.turned_removal import TurnedRemoval, remove_by_turned_tool

MM = 1e-3
PLACES, STANDS_OF_STEP = 40_000, 80  # random places; stands of the tool of a step
RING, ARC_POINTS = 60, 10  # points of a circle, and of the corner of a bull nose, of the polyhedra of the boolean
STOCK = Stock.box(np.array([0, 0, -15]) * MM, np.array([40, 30, 0]) * MM)


def steps_between(tips: np.ndarray, axes: np.ndarray, count: int) -> TurnedMoves:
    """Return the steps of straight ways between tips (n, 3), m, whose axes (n, 3) turn evenly."""
    share = np.linspace(0, 1, count + 1)[:, None]
    places, ways = [tips[:1]], [axes[:1]]
    for (a, b), (u, v) in zip(pairwise(tips), pairwise(axes), strict=True):
        places.append(a + share[1:] * (b - a))
        ways.append(u + share[1:] * (v - u))
    tip, axis = np.concatenate(places), np.concatenate(ways)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    tips, axes, frames = (np.stack([values[:-1], values[1:]], axis=1) for values in (tip, axis, smallest_turn(axis)))
    n = len(tip) - 1
    return TurnedMoves(tips, axes, frames, np.repeat(np.arange(n // count), count), np.zeros(n, int), np.zeros(n, bool))


def removed(moves: TurnedMoves, shape: MillShape, spacing: float, **options: bool) -> TurnedRemoval:
    """Return the removal at a spacing, m."""
    return remove_by_turned_tool(moves, STOCK, [shape], settings=RemovalSettings(spacing), **options)


def parted(moves: TurnedMoves, parts: int) -> TurnedMoves:
    """Return the same motion in steps of which each is a part of one: the axis goes along its chord, made a unit vector."""
    share = np.linspace(0, 1, parts + 1)
    tips, axes = (values[:, :1] + share[:, None] * (values[:, 1:] - values[:, :1]) for values in (moves.tips, moves.axes))
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    tips, axes = (np.stack([values[:, :-1], values[:, 1:]], axis=2).reshape(-1, 2, 3) for values in (tips, axes))
    n = len(tips)
    return TurnedMoves(tips, axes, smallest_turn(axes), np.repeat(moves.block, parts), np.zeros(n, int), np.zeros(n, bool))


def boolean_volume(moves: TurnedMoves, shape: MillShape) -> float:
    """Return the volume (m^3) of the stock inside the hulls of the tool's stands at both ends of every step."""
    manifold3d = needed_peer("manifold3d")
    turn = np.linspace(0, 2 * np.pi, RING, endpoint=False)
    size = (np.pi / RING) / np.sin(np.pi / RING)  # the polygon has the mean width of the circle
    corner = np.linspace(0, np.pi / 2, ARC_POINTS if shape.corner_radius else 1)
    bulge = 1.0 if len(corner) == 1 else (np.pi / 4 / (ARC_POINTS - 1)) / np.sin(np.pi / 4 / (ARC_POINTS - 1))
    rings = [(shape.flat + bulge * shape.corner_radius * np.sin(a), shape.corner_radius * (1 - bulge * np.cos(a)))
             for a in corner]
    rings += [(shape.radius, shape.corner_radius), (shape.radius, shape.flute_length)]
    body = np.concatenate([np.stack([size * r * np.cos(turn), size * r * np.sin(turn), np.full(RING, z)], axis=1)
                           for r, z in rings if r > 0 or z == 0])
    solids = [manifold3d.Manifold.hull_points(np.concatenate([1e3 * (tip + body @ frame.T)
                                                              for tip, frame in zip(tips, frames, strict=True)]))
              for tips, frames in zip(moves.tips, moves.frames, strict=True)]
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    box = manifold3d.Manifold.cube((1e3 * (STOCK.upper - STOCK.lower)).tolist()).translate((1e3 * STOCK.lower).tolist())
    return float((box ^ union).volume()) / 1e9


def random_path(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return tips (m) through the stock and axes that lean by up to 40 degrees."""
    n = int(rng.integers(3, 6))
    tips = np.column_stack([rng.uniform(-3, 43, n), rng.uniform(-3, 33, n), rng.uniform(-6, -2, n)]) * MM
    lean, azimuth = rng.uniform(0, np.radians(40), n), rng.uniform(0, 2 * np.pi, n)
    return tips, np.column_stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])


def volumes(cases: int, rng: np.random.Generator) -> str:
    worst = np.zeros(2)
    for number in range(cases):
        radius = rng.uniform(2, 5) * MM
        shape = MillShape(2 * radius, (0.0, radius, 0.3 * radius)[number % 3], flute_length=40 * MM)
        moves = steps_between(*random_path(rng), 72)
        exact = boolean_volume(moves, shape)
        errors = [removed(moves, shape, spacing).total_volume / exact - 1 for spacing in (radius / 10, radius / 5)]
        worst = np.maximum(worst, np.abs(errors))
        print(f"{number}: {shape.kind}, {1e9 * exact:.2f} mm^3, {100 * errors[0]:+.3f} % (twice the spacing "
              f"{100 * errors[1]:+.3f} %)", flush=True)
    return f"{100 * worst[0]:.3f} % at most over {cases} paths at R/10 ({100 * worst[1]:.3f} % at R/5)"


def stands(cases: int, rng: np.random.Generator) -> str:
    """Return the share of random places of the stock that the lines and many stands of the tool judge otherwise."""
    worst = [0.0, 0.0]
    for number in range(cases):
        radius = rng.uniform(2, 5) * MM
        shape = MillShape(2 * radius, (0.0, radius, 0.3 * radius)[number % 3], flute_length=40 * MM)
        moves = steps_between(*random_path(rng), 24)
        result = removed(moves, shape, radius / 10, with_volume=False)
        places = STOCK.lower + rng.uniform(0, 1, (PLACES, 3)) * (STOCK.upper - STOCK.lower)
        is_left = np.array([has_material(result.lines, place) for place in places])
        is_cut = np.zeros(PLACES, bool)
        for tips, axes in zip(moves.tips, moves.axes, strict=True):
            for share in (np.arange(STANDS_OF_STEP) + 0.5) / STANDS_OF_STEP:
                axis = axes[0] + share * (axes[1] - axes[0])
                away = places - tips[0] - share * (tips[1] - tips[0])
                height = away @ (axis / np.linalg.norm(axis))
                across = np.maximum(np.sqrt(np.maximum((away**2).sum(axis=1) - height**2, 0)) - shape.flat, 0)
                corner = np.hypot(across, np.minimum(height - shape.corner_radius, 0)) <= shape.corner_radius
                is_cut |= (height >= 0) & (height <= shape.flute_length) & (corner if shape.corner_radius else across == 0)
        wrong = is_left == is_cut
        errors = wrong.sum() / is_cut.sum(), abs(is_cut.sum() - (~is_left).sum()) / is_cut.sum()
        worst = [max(a, float(b)) for a, b in zip(worst, errors, strict=True)]
        print(f"{number}: {shape.kind}, {100 * is_cut.mean():.1f} % of the stock; of that {100 * errors[0]:.3f} % judged "
              f"otherwise, volume {100 * errors[1]:.3f} %", flush=True)
    return (f"{100 * worst[1]:.3f} % of the volume at most over {cases} paths ({100 * worst[0]:.3f} % of the places judged "
            "otherwise)")


def arcs(cases: int, rng: np.random.Generator) -> str:
    """Return the errors of the arcs of all slices of balls on the stock's top, against the closed form."""
    errors: dict[float, list[float]] = {0.05: [], 0.1: [], 0.2: []}
    for _ in range(cases):
        radius, depth, azimuth, lean = rng.uniform(2, 5), rng.uniform(0.1, 0.5), rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.5)
        axis = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
        way, centre = rng.uniform(0, 2 * np.pi), np.array([20, 15, (1 - depth) * radius])
        ends = centre + np.outer([-6, 6], [np.cos(way), np.sin(way), 0]) - radius * axis
        moves = steps_between(ends * MM, np.array([axis, axis]), 12)
        for share, found in errors.items():
            result = removed(moves, MillShape(2 * radius * MM, radius * MM), share * radius * MM, with_volume=False)
            found += _ball_errors(result, radius, depth)
    return "; ".join(f"R/{1 / share:.0f}: {np.quantile(found, 0.95):.3f} degrees at 95 %, {max(found):.2f} at most"
                     for share, found in errors.items())


def _ball_errors(result: TurnedRemoval, radius: float, depth: float) -> list[float]:
    k = result.piece.size - 3  # beyond the entry, within the stock
    assert result.frame is not None
    normal, total = result.frame[k].T @ [0, 0, 1.0], np.arccos(1 - 1e3 * result.reach[k] / radius)
    way = result.feed[k, :2] / np.linalg.norm(result.feed[k, :2])
    phi, out, rise = np.linspace(0, np.pi, 40001), [], result.feed[k, 2] / np.linalg.norm(result.feed[k, :2])
    for m, arc in enumerate(result.arc_length[k]):
        kappa = total * (m + 0.5) / result.arcs.shape[1]
        start = np.arcsin(np.clip(rise / np.tan(kappa), -1, 1))
        angle = start + phi * (np.pi - 2 * start) / np.pi
        n = np.sin(angle)[:, None] * way + np.cos(angle)[:, None] * np.array([-way[1], way[0]])
        below = (1 - depth) + np.sin(kappa) * (n @ normal[:2]) - np.cos(kappa) * normal[2] < 0
        out.append(float(np.degrees(abs(arc - (np.pi - 2 * start) * below.mean()))))
    return out


def cost(_: int, rng: np.random.Generator) -> str:
    """Return the time of a flank cut over the spacing."""
    axes = np.array([[0.2, 0.1, 1.0], [-0.1, 0.25, 1.0]])
    moves = steps_between(np.array([[-8, 28, -12], [48, 28, -12]]) * MM, axes, 100)
    shape, rows = MillShape(10 * MM, flute_length=30 * MM), []
    removed(moves, shape, 2 * MM, with_volume=False)  # loads the kernels
    for share in (1 / 5, 1 / 7, 1 / 10, 1 / 14, 1 / 20):
        begin = time.process_time()
        result = removed(moves, shape, share * shape.radius, with_volume=False)
        rows.append((1 / share, 1e3 * (time.process_time() - begin) / moves.count))
        assert result.lines is not None
        lines = sum(part.size for part in result.lines.numbers)
        print(f"R/{1 / share:.0f}: {lines} dexels, {rows[-1][1]:.2f} ms a step", flush=True)
    x, y = np.log(rows).T
    return f"{rows[2][1]:.1f} ms a step at R/10, {rows[-1][1]:.1f} at R/20; spacing^-{np.polyfit(x, y, 1)[0]:.2f}"


def refined(cases: int, rng: np.random.Generator) -> str:
    """Return by how much the lines differ from the limit of hulls of ever smaller parts of the same steps."""
    largest = 0.0
    for number in range(cases):
        radius = rng.uniform(2, 5) * MM
        shape = MillShape(2 * radius, (0.0, radius, 0.3 * radius)[number % 3], flute_length=40 * MM)
        tips, axes = random_path(rng)
        moves = steps_between(tips[:2], axes[:2], 36)
        volume = removed(moves, shape, radius / 10).total_volume
        hulls = [boolean_volume(parted(moves, parts), shape) for parts in (1, 2, 4, 8)]
        # The excess halves from one to the next, or falls faster: what is left of a geometric row.
        ratio = np.clip((hulls[3] - hulls[2]) / (hulls[2] - hulls[1]), 0.0, 0.75) if hulls[2] != hulls[1] else 0.0
        limit = hulls[3] + (hulls[3] - hulls[2]) * ratio / (1 - ratio)
        row = [100 * (volume / each - 1) for each in (*hulls, limit)]
        largest = max(largest, abs(row[-1]))
        print(f"{number}: {shape.kind}, {1e9 * volume:.2f} mm^3; against hulls of 1, 2, 4, 8 parts of a step "
              + ", ".join(f"{value:+.3f}" for value in row[:4]) + f" %, their limit {row[4]:+.3f} %", flush=True)
    return f"{largest:.3f} % at most over {cases} paths at R/10, against the limit of hulls"


PARTS = {"volumes": volumes, "refined": refined, "stands": stands, "arcs": arcs, "cost": cost}


def main() -> None:
    """Print the figure of one part."""
    parser = CommandLine(__doc__)
    parser.add_argument("what", nargs="?", default="volumes", choices=sorted(PARTS))
    parser.cases("cases", 10)
    parser.seed(1)
    arguments = parser.parse_args()
    print(PARTS[arguments.what](arguments.cases, np.random.default_rng(arguments.seed)))


if __name__ == "__main__":
    main()
