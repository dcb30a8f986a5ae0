"""Random paths of several axes within speed, acceleration and jerk of each: largest share of a limit by differences of
positions, and the time beside a direct solution of the same path.

    python benchmarks/drives/axis_jerk.py [--paths 12] [--seed 1]

The direct solution takes squares of the rate at 240 nodes, which lie denser at both stops, and improves them by linear programs
(the jerk's bound 1/sqrt(b) is convex, so that its tangent is a bound too); it begins with the motion that is compared. The last
line is the figure.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_matrix, diags, eye, vstack

from benchmarks.frame import CommandLine
from toolpoint.drives.program.axis_jerk import AxisMotion, MotionBounds, move_within_axes

NODES, ROUNDS = 240, 12


def random_path(rng: np.random.Generator, steps: int = 300) -> tuple[np.ndarray, MotionBounds]:
    """Return the places of 2 to 5 axes along a smooth path, and limits."""
    axes = int(rng.integers(2, 6))
    share = np.linspace(0, 1, steps + 1)[:, None]
    way = sum(rng.normal(size=axes) * np.sin(share * rng.uniform(1, 9) + rng.uniform(0, 6)) for _ in range(4))
    acceleration = rng.uniform(0.5, 9, axes)
    return np.asarray(way), MotionBounds(rng.uniform(0.3, 3, axes), acceleration, acceleration / rng.uniform(0.03, 0.3, axes))


def direct_time(motion: AxisMotion, limits: MotionBounds) -> float:
    """Return the time (s) of the path by linear programs over squares of the rate."""
    path, total = motion.path, motion.path.sigma[-1]
    u = np.linspace(0, 1, NODES + 1)
    sigma = total * u**3 * (10 - 15 * u + 6 * u**2)  # as a motion from rest to rest
    step = np.clip(np.searchsorted(path.sigma, sigma, side="right") - 1, 0, path.sigma.size - 2)
    _, first, second, third = path.derivatives(sigma, step)
    long = np.diff(sigma)
    inner = slice(1, NODES)
    left, right = long[:-1], long[1:]
    both = left + right
    slope = csr_matrix(diags([-right / (left * both), (right - left) / (left * right), left / (right * both)], [0, 1, 2],
                             shape=(NODES - 1, NODES + 1)))
    bend = csr_matrix(diags([2 / (left * both), -2 / (left * right), 2 / (right * both)], [0, 1, 2],
                            shape=(NODES - 1, NODES + 1)))
    value = eye(NODES + 1, format="csr")[1:-1]
    speed = np.minimum(1.0, (limits.speed / np.maximum(np.abs(first), 1e-12)).min(axis=1)) ** 2
    rate = np.interp(sigma, motion.sigma, motion.rate)
    b = np.maximum(0.98 * rate**2, 1e-12 * rate.max() ** 2)
    b[0] = b[-1] = 0.0
    rows, bounds = [], []
    for k in range(first.shape[1]):
        each = diags(second[inner, k]) @ value + diags(first[inner, k] / 2) @ slope
        rows += [each, -each]
        bounds += [np.full(NODES - 1, limits.acceleration[k])] * 2
    best = np.inf
    for _ in range(ROUNDS):
        held = b[inner]
        jerk_rows, jerk_bounds = [], []
        for k in range(first.shape[1]):
            each = (diags(third[inner, k]) @ value + diags(1.5 * second[inner, k]) @ slope
                    + diags(0.5 * first[inner, k]) @ bend)
            tangent = diags(limits.jerk[k] / (2 * held**1.5)) @ value
            jerk_rows += [each + tangent, -each + tangent]
            jerk_bounds += [1.5 * limits.jerk[k] / np.sqrt(held)] * 2
        # In shares of the last squares, and every row in shares of its bound: near a stop the squares are tiny.
        scale = np.maximum(b, 1e-300)
        bound = np.concatenate([*bounds, *jerk_bounds])
        matrix = diags(1 / bound) @ vstack([*rows, *jerk_rows]) @ diags(scale)
        upper = np.minimum(speed / scale, 2.0)
        cost = np.concatenate([[0.0], (left + right) / 2 / np.sqrt(held), [0.0]])  # time falls with b by b^-3/2
        result = linprog(-cost / cost.max(), A_ub=matrix, b_ub=np.ones(bound.size),
                         bounds=np.stack([np.minimum(0.5, upper), upper], axis=1), method="highs")
        if result.x is None:  # the motion breaks a limit between the nodes' differences: begun again slower
            b = 0.8 * b
            continue
        b = result.x * scale
        b[[0, -1]] = 0.0
        root = np.sqrt(b)
        best = min(best, float((2 * long / (root[1:] + root[:-1])).sum()))
    return best


def main() -> None:
    """Print the shares and ratios."""
    parser = CommandLine(__doc__)
    parser.cases("paths", 12)
    parser.seed(1)
    options = parser.parse_args()
    shares, ratios, seconds = [], [], []
    for k in range(options.paths):
        way, limits = random_path(np.random.default_rng(options.seed + k))
        n = len(way) - 1
        stops = np.array([2, *[0] * (n - 1), 2])
        begin = time.process_time()
        motion = move_within_axes(np.stack([way[:-1], way[1:]], axis=1), np.full(n, 1 / n), limits, stops=stops,
                                  corner_tolerance=np.full(way.shape[1], 1e-3))
        seconds.append((time.process_time() - begin) / n)
        sample = 2e-4
        places = motion.sample(np.arange(0, motion.duration + 4 * sample, sample))[0]
        noise = 8 * np.finfo(float).eps * np.abs(places).max()
        shares.append(max(float(((np.abs(np.diff(places, order, axis=0)).max(axis=0) - noise * 2**order) / sample**order / limit
                                 ).max()) for order, limit in ((1, limits.speed), (2, limits.acceleration), (3, limits.jerk))))
        ratios.append(motion.duration / direct_time(motion, limits))
        print(f"path {k}: {motion.duration:.3f} s, {ratios[-1]:.3f} times the direct solution, share {shares[-1]:.4f}",
              flush=True)
    print(f"{options.paths} paths: largest share of a limit {max(shares):.4f}; time {np.median(ratios):.3f} times that of the "
          f"direct solution in the median, {max(ratios):.3f} at most; {1e3 * np.median(seconds):.2f} ms a step")


if __name__ == "__main__":
    main()
