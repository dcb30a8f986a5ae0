"""Two exact engines against each other: PanelArnoldi (time, Arnoldi) and HillDeterminant (frequency, counts), general tools.

Random cuts of any arc with unequal pitch, helix (equal or each its own), process damping, corner radius and ball, straight
and helical. The engines share the tool and the force law and nothing else. A point is good where the first limits differ by
no more than the two stated errors together. The last line is the share of good points.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import Modes
from toolpoint.cutting import (
    CuttingCoefficients,
    Engagement,
    HillDeterminant,
    MillingProblem,
    PanelArnoldi,
    StabilityChart,
    Tool,
    stability,
)

TOP = 0.008
KINDS = ("pitch", "helix", "unequal helix", "damping", "corner", "ball", "helical corner", "helical ball")


def tool_of(kind: str, rng: np.random.Generator) -> Tool:
    """A random tool of 16 mm of this kind."""
    n = int(rng.integers(2, 5))
    pitch = 1 + 0.25 * rng.uniform(-1, 1, n)
    helix = rng.uniform(0.3, 0.7) if "helical" in kind or kind == "helix" else 0.0
    corner = 0.008 if "ball" in kind else rng.uniform(0.002, 0.007) if "corner" in kind else 0.0
    if kind == "pitch":
        return Tool(0.016, n, pitch=2 * np.pi * pitch / pitch.sum())
    return Tool(0.016, n, helix=rng.uniform(0.4, 0.7, n) if kind == "unequal helix" else helix, corner_radius=corner)


def problem_of(rng: np.random.Generator, kind: str) -> MillingProblem:
    """A random cut with 1-4 modes in any direction of the plane."""
    n = int(rng.integers(1, 5))
    f, zeta, k = np.sort(rng.uniform(200, 2000, n)), rng.uniform(0.01, 0.06, n), 2e6 * rng.uniform(1, 20, n)
    angle = rng.uniform(0, np.pi, n)
    shape = 2 * np.pi * f / np.sqrt(k) * np.stack([np.cos(angle), np.sin(angle)])
    entry = rng.uniform(0, np.pi - 0.3)
    kt = rng.uniform(5e8, 2e9)
    return MillingProblem(tool_of(kind, rng), Engagement(entry, rng.uniform(entry + 0.25, np.pi)),
                          CuttingCoefficients(kt, kt * rng.uniform(0.05, 0.7)), Modes(f, zeta, shape, ("tool:+x", "tool:+y")),
                          process_damping=2e4 * rng.uniform(0.1, 1) if kind == "damping" else 0.0)


def first(chart: StabilityChart) -> tuple[float, float]:
    """(limit, stated error) at the only speed; an error of zero where there is no limit."""
    point = chart.limit_points()[0]
    return float(chart.limit[0]), float(chart.error[point]) if point >= 0 else 0.0


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("problems", 160)
    parser.seed(0)
    parser.json()
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    good, compared, worst, seconds = 0, 0, 0.0, np.zeros(2)
    for number in range(options.problems):
        rng = np.random.default_rng([options.seed, number])
        kind = KINDS[number % len(KINDS)]
        problem, speed = problem_of(rng, kind), [float(rng.uniform(5000, 12000))]
        values = []
        for i, method in enumerate((PanelArnoldi(), HillDeterminant(reach=3.0))):
            start = time.process_time()
            values.append(first(stability.chart(problem, speed, method, depth_max=TOP)))
            seconds[i] += time.process_time() - start
        (a, da), (b, db) = values
        if np.isinf(a) and np.isinf(b):
            continue
        compared += 1
        fits = abs(a - b) <= da + db
        good += fits
        worst = max(worst, abs(a / b - 1)) if np.isfinite(a) and np.isfinite(b) else worst
        if not fits:
            print(f"problem {number}, {kind}: {1e3 * a:.6f} +- {1e3 * da:.1e} mm against {1e3 * b:.6f} +- {1e3 * db:.1e} mm")
    rows = {"compared": compared, "share within the stated errors": good / compared, "largest relative difference": worst,
            "PanelArnoldi, s": float(seconds[0]), "HillDeterminant, s": float(seconds[1])}
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<40}{value:.6g}")
    print(f"{100 * good / compared:.2f} % of {compared} limits agree within the stated errors (target 99 %)")


if __name__ == "__main__":
    main()
