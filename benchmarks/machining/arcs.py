"""Arcs of cut against closed forms at random places, directions and sizes: shoulders, circular pockets, bosses, trochoids.

    python benchmarks/machining/arcs.py [--cases 200] [--seed 1]

The last line is the figure: the largest error over all cases, and the 95 % point.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.material_removal import MillShape, RemovalSettings, RemovedMaterial, Stock, remove_material, split_moves

MM = 1e-3
DEPTH = 3.0  # mm
BLOCK = Stock.box(np.array([-60, -60, -10]) * MM, np.array([60, 60, 0]) * MM)


def _run(stock: Stock, radius: float, rows: list[tuple]) -> RemovedMaterial:
    start, end, kind, center, sweep = (np.array([row[k] for row in rows], float) for k in range(5))
    moves = split_moves(start * MM, end * MM, radius / 4 * MM, kind=kind.astype(int), center=center * MM, sweep=sweep)
    return remove_material(moves, stock, [MillShape(2 * radius * MM)], settings=RemovalSettings(radius / 20 * MM))


def _line(a: np.ndarray, b: np.ndarray) -> tuple:
    return (*(np.append(p, -DEPTH) for p in (a, b)), 0, np.append(a, -DEPTH), 0.0)


def _circle(centre: np.ndarray, rho: float, begin: float, sweep: float) -> tuple:
    a, b = (np.append(centre + rho * np.array([np.cos(t), np.sin(t)]), -DEPTH) for t in (begin, begin + sweep))
    return a, b, 1, np.append(centre, -DEPTH), sweep


def shoulder(rng: np.random.Generator) -> float:
    """Return the error (deg) of a pass beside an earlier one, at any angle to the grid."""
    radius, turn = rng.uniform(2, 8), rng.uniform(0, 2 * np.pi)
    a, side = radius * rng.uniform(0.02, 1.9), rng.choice([-1, 1])
    u = np.array([np.cos(turn), np.sin(turn)])
    across = side * np.array([-u[1], u[0]])
    origin = rng.uniform(-5, 5, 2)
    first = _line(origin - 20 * u, origin + 20 * u)
    second = _line(origin - 20 * u + a * across, origin + 20 * u + a * across)
    result = _run(BLOCK, radius, [first, second])
    k = np.flatnonzero((result.moves.block[result.piece] == 1) & ~result.at_start)
    middle = k[np.argmin(np.linalg.norm(result.tip[k, :2] / MM - origin - a * across, axis=1))]
    return float(np.degrees(result.arc_length[middle, 0]) - np.degrees(np.arccos(1 - a / radius)))


def pocket(rng: np.random.Generator) -> float:
    """Return the largest error (deg) over half a turn along the wall of a circular pocket."""
    radius = rng.uniform(2, 5)
    wall, a, centre = rng.uniform(2.2, 5) * radius, radius * rng.uniform(0.05, 0.8), rng.uniform(-5, 5, 2)
    rho, begin = wall - radius, rng.uniform(0, 2 * np.pi)
    rows = [_circle(centre, r, begin, 2 * np.pi) for r in (*np.arange(0.9 * radius, rho - a, 0.9 * radius), rho - a)]
    result = _run(BLOCK, radius, [*rows, _circle(centre, rho, begin + 1.0, np.pi)])
    arcs = np.degrees(result.arc_length[(result.moves.block[result.piece] == len(rows)) & ~result.at_start, 0])
    expected = np.degrees(np.arccos(((wall - a) ** 2 - rho**2 - radius**2) / (2 * rho * radius)))
    # The tool dives into the wall at the start: what is behind it there is not yet cut.
    free = arcs[arcs.size // 3:]
    return float(free[np.argmax(np.abs(free - expected))] - expected)


def boss(rng: np.random.Generator) -> float:
    """Return the largest error (deg) over half a turn around a boss of a round stock."""
    radius = rng.uniform(2, 5)
    wall, a = rng.uniform(8, 25), radius * rng.uniform(0.05, 1.2)
    rho = wall + radius
    stock = Stock.cylinder(2 * (wall + a) * MM, -10 * MM, 0.0, centre=(0.37 * MM, -0.21 * MM))
    result = _run(stock, radius, [_circle(np.array([0.37, -0.21]), rho, rng.uniform(0, 6), -np.pi)])
    arcs = np.degrees(result.arc_length[~result.at_start, 0])
    expected = np.degrees(np.arccos((rho**2 + radius**2 - (wall + a) ** 2) / (2 * rho * radius)))
    free = arcs[arcs.size // 3:]
    return float(free[np.argmax(np.abs(free - expected))] - expected)


def trochoid(rng: np.random.Generator) -> float:
    """Return the error (deg) at the foremost point of a turn of a trochoid."""
    radius, rho = rng.uniform(2, 5), rng.uniform(2, 6)
    s, turn, centre = radius * rng.uniform(0.05, 0.4), rng.uniform(0, 2 * np.pi), rng.uniform(-5, 5, 2)
    forward = np.array([np.cos(turn), np.sin(turn)])
    rows = [_circle(centre, rho, turn, 2 * np.pi), _circle(centre + s * forward, rho, turn - np.pi / 2, np.pi / 2)]
    result = _run(BLOCK, radius, rows)
    arc = np.degrees(result.arc_length[-1, 0])
    return float(arc - np.degrees(np.arccos(((rho + radius) ** 2 - (rho + s) ** 2 - radius**2) / (2 * (rho + s) * radius))))


def main() -> None:
    """Print the errors of every kind."""
    parser = CommandLine(__doc__)
    parser.cases("cases", 200)
    parser.seed(1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    every: list[float] = []
    for case in (shoulder, pocket, boss, trochoid):
        errors = np.array([case(rng) for _ in range(arguments.cases // 4)])
        every += errors.tolist()
        print(f"{case.__name__}: {np.abs(errors).max():.3f} deg at most, median {np.median(np.abs(errors)):.4f}", flush=True)
    sizes = np.abs(every)
    print(f"{sizes.max():.3f} deg at most, {np.quantile(sizes, 0.95):.3f} deg at 95 %, {int((sizes > 0.5).sum())} of "
          f"{sizes.size} beyond 0.5 deg")


if __name__ == "__main__":
    main()
