"""Honesty of the stability engine's error estimate: random cuts against converged collocation.

For every problem the first loss of stability is compared with the root of the spectral radius by collocation with many
nodes (another formulation: monodromy matrix of the delay equation), and the stable/unstable verdict 1 % inside and
outside it. The last line is the share of points whose stated error bounds the true one.
"""

from __future__ import annotations

import argparse
import json
import time

import numpy as np

from toolpoint import Modes
from toolpoint.cutting import Collocation, CuttingCoefficients, Engagement, FloquetDeterminant, MillingProblem, Tool, stability


def random_problem(rng: np.random.Generator) -> MillingProblem:
    """1-20 modes in any direction of the plane, any engagement, 1-5 teeth."""
    n = int(rng.integers(1, 21))
    f, zeta, k = np.sort(rng.uniform(200, 3000, n)), rng.uniform(0.005, 0.06, n), 5e6 * rng.uniform(1, 20, n)
    angle = rng.uniform(0, np.pi, n)
    shape = 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)])
    start = rng.uniform(0, np.pi - 0.2)
    kt = rng.uniform(5e8, 2e9)
    return MillingProblem(Tool(0.016, int(rng.integers(1, 6))), Engagement(start, rng.uniform(start + 0.1, np.pi)),
                          CuttingCoefficients(kt, kt * rng.uniform(0.05, 0.7)), Modes(f, zeta, shape, ("t:+x", "t:+y")))


def radius(problem: MillingProblem, speed: float, depth: float) -> float:
    """Logarithm of the spectral radius by converged collocation."""
    return float(np.log(np.abs(Collocation(nodes=14).multipliers(problem, speed, depth)[0])))


def one(problem: MillingProblem, speed: float, method: FloquetDeterminant) -> tuple[float, float, float, bool] | None:
    """(depth, stated error, true error, verdicts right) of the first loss of stability, None where there is none."""
    chart = stability.chart(problem, [speed], method, depth_max=0.01)
    p = chart.limit_points()[0]
    if p < 0:
        return None if radius(problem, speed, 0.0099) < 1e-6 or np.isfinite(chart.limit[0]) else (0.01, 0.0, 1.0, False)
    w, error = float(chart.depth[p]), float(chart.error[p])
    a, b = w * (1 - 1e-4), w * (1 + 1e-4)
    ga, gb = radius(problem, speed, a), radius(problem, speed, b)
    true = a - ga * (b - a) / (gb - ga) if gb != ga else np.inf
    for _ in range(3):  # secant
        g = radius(problem, speed, true) if np.isfinite(true) and true > 0 else np.inf
        if abs(g) < 1e-13 or not np.isfinite(g) or g == gb:
            break
        a, ga, b, gb, true = b, gb, true, g, true - g * (true - b) / (g - gb)
    verdict = chart.intervals(0)
    outside = w * 1.01
    stable_outside = any(low <= outside <= high for low, high in verdict)
    right = radius(problem, speed, 0.99 * w) < 0 and (outside > 0.01 or (radius(problem, speed, outside) < 0) == stable_outside)
    return w, error, abs(true - w), right


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--problems", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    method, rows, start = FloquetDeterminant(), [], time.perf_counter()
    for number in range(options.problems):
        problem, speed = random_problem(rng), float(rng.uniform(3000, 15000))
        row = one(problem, speed, method)
        if row is not None:
            rows.append((number, *row))
            if row[2] > row[1] + 1e-11 * row[0] and not options.json:
                print(f"problem {number}: depth {1e3 * row[0]:.6f} mm, stated {row[1]:.2e} m, true {row[2]:.2e} m, {problem}")
            if not row[3] and not options.json:
                print(f"problem {number}: wrong verdict near {1e3 * row[0]:.6f} mm, {speed:.0f} rev/min, {problem}")
    table = np.array([r[1:] for r in rows], float)
    held = float(np.mean(table[:, 2] <= table[:, 1] + 1e-11 * table[:, 0]))
    result = {"problems": options.problems, "with a limit": len(rows), "bounded": held,
              "median true relative error": float(np.median(table[:, 2] / table[:, 0])),
              "median stated relative error": float(np.median(table[:, 1] / table[:, 0])),
              "verdicts right": float(np.mean(table[:, 3])), "seconds": time.perf_counter() - start}
    if options.json:
        print(json.dumps(result))
        return
    for name, value in result.items():
        print(f"{name:<30}{value:.6g}")
    print(f"stated error bounds the true one in {100 * held:.2f} % of {len(rows)} points (target 99 %)")


if __name__ == "__main__":
    main()
