"""Removed volume of random programs of a flat end mill against the exact solid, by a boolean of manifold3d (Apache-2.0).

    python benchmarks/machining/volumes.py [--programs 10] [--seed 1]

The last line is the figure: the largest relative difference, and what two spacings say of it.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine, needed_peer
from toolpoint.material_removal import MillShape, RemovalSettings, Stock, remove_material, split_moves

MM = 1e-3
CIRCLE_SEGMENTS = 720  # of the polygon that stands for a circle: 1.3e-5 of its area


def exact_volume(points: np.ndarray, radius: float, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return the volume (m^3) of the box inside the union of the prisms that a flat end sweeps; moves are level or upright."""
    manifold3d = needed_peer("manifold3d")

    scale = 1e3  # in mm: the library works in single precision
    turn = np.linspace(0, 2 * np.pi, CIRCLE_SEGMENTS, endpoint=False)
    # The polygon has the area of the circle.
    size = scale * radius * np.sqrt(2 * np.pi / CIRCLE_SEGMENTS / np.sin(2 * np.pi / CIRCLE_SEGMENTS))
    ring = size * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    height = scale * (upper[2] - lower[2]) + 10
    solids = []
    for a, b in pairwise(points):
        level = scale * min(a[2], b[2])
        corners = np.concatenate([ring + scale * a[:2], ring + scale * b[:2]])
        solids.append(manifold3d.Manifold.hull_points(np.concatenate([np.column_stack([corners, np.full(len(corners), z)])
                                                           for z in (level, level + height)])))
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    box = manifold3d.Manifold.cube((scale * (upper - lower)).tolist()).translate((scale * lower).tolist())
    return float((box ^ union).volume()) / scale**3


def random_program(rng: np.random.Generator) -> np.ndarray:
    """Return points (m) of level cuts in several layers, with upright moves between them."""
    points = [np.array([*rng.uniform(-10, 60, 2), 5.0])]
    for layer in range(int(rng.integers(2, 5))):
        for _ in range(int(rng.integers(4, 12))):
            points.append(np.array([*rng.uniform(-10, 60, 2), -1.5 * (layer + 1)]) if len(points) > 1
                          and points[-1][2] == -1.5 * (
                layer + 1) else np.array([*points[-1][:2], -1.5 * (layer + 1)]))
    return np.array(points) * MM


def main() -> None:
    """Print the differences."""
    parser = CommandLine(__doc__)
    parser.cases("programs", 10)
    parser.seed(1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    stock = Stock.box(np.array([0, 0, -12]) * MM, np.array([50, 50, 0]) * MM)
    worst, coarse_worst = 0.0, 0.0
    for number in range(arguments.programs):
        points, radius = random_program(rng), rng.uniform(1.5, 6.0) * MM
        exact = exact_volume(points, radius, np.array(stock.lower), np.array(stock.upper))
        moves, sampled = split_moves(points[:-1], points[1:], radius / 4), None
        errors = []
        for spacing in (radius / 20, radius / 10):
            from toolpoint.material_removal.removal import places_of

            sampled = np.zeros(places_of(moves)[0].size, bool)
            result = remove_material(moves, stock, [MillShape(2 * radius)], settings=RemovalSettings(spacing), sampled=sampled)
            errors.append(result.total_volume / exact - 1)
        worst, coarse_worst = max(worst, abs(errors[0])), max(coarse_worst, abs(errors[1]))
        print(f"{number}: {1e9 * exact:.2f} mm^3, {100 * errors[0]:+.4f} % (twice the spacing {100 * errors[1]:+.4f} %)",
              flush=True)
    print(f"{100 * worst:.4f} % at most over {arguments.programs} programs ({100 * coarse_worst:.4f} % at twice the spacing)")


if __name__ == "__main__":
    main()
