"""Calibration from records that begin anywhere: how often the 95 % intervals of both fits hold what random cuts were made with.

Random teeth, run-out, arc, speed, coefficients, noise (0.5 to 3 %), feeds; edges straight and helical in turn.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.force.calibration import Calibration
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.studies.cuts.forces.calibration import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

RATE, TURNS, DEPTH, DIAMETER = 10000.0, 12, 2e-3, 0.016


def random_cut(rng: np.random.Generator, helical: bool) -> tuple[list[tuple[str, Record]], CuttingTest, dict[str, float]]:
    """Return the records of a random cut, what is said of it, and what it was made with."""
    teeth, helix, runout = int(rng.integers(2, 6)), np.radians(rng.uniform(15, 45)) * helical, rng.uniform(0, 15e-6)
    immersion, way, speed = rng.uniform(0.2, 0.9), str(rng.choice(["up", "down"])), rng.uniform(1500, 5000)
    kt = rng.uniform(5e8, 2e9)
    truth = {"kt": kt, "kn": 0.3 * kt, "ka": 0.2 * kt, "edge_t": 2e4, "edge_n": 2e4, "edge_a": 1e3}
    arc = Engagement.up(immersion) if way == "up" else Engagement.down(immersion)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    tool = Tool(DIAMETER, teeth, helix=helix, runout=runout, runout_angle=rng.uniform(0, 6))
    feeds, noise = tuple(np.linspace(0.06e-3, 0.15e-3, int(rng.choice([2, 4])))), rng.uniform(0.005, 0.03)
    records = []
    for feed in feeds:
        angle = rng.uniform(0, 6) + 2 * np.pi * speed / 60 / RATE * np.arange(int(TURNS * RATE * 60 / speed))
        problem = MillingProblem(tool, arc, CuttingCoefficients(**truth), rigid, feed_per_tooth=feed)
        force = rigid_forces(problem, DEPTH, angle, slices=200).force
        force = force + noise * np.abs(force).max() * rng.standard_normal(force.shape)
        records.append((f"{1e3 * feed:g} mm", Record(force, RATE, tuple(Dof("tool", f"+{w}") for w in "xyz"), ("force",) * 3)))
    cut: dict[str, Any] = {"diameter": DIAMETER, "teeth": teeth, "helix": helix, "direction": way, "immersion": immersion}
    return records, CuttingTest(cut, speed, DEPTH, feeds), truth | {"runout": runout}


def held(fit: Calibration, truth: dict[str, float]) -> list[bool]:
    """Return whether each interval holds the truth."""
    every = zip(fit.names, fit.interval, strict=True)
    return [bool(low <= truth[name] <= high) for name, (low, high) in every if name in truth]


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 60)
    parser.seed(0)
    parser.json()
    options = parser.parse_args()
    rng, inside = np.random.default_rng(options.seed), {f"{edge}, {fit}": [] for edge in ("straight", "helical")
                                                        for fit in ("forces over rotation", "mean forces")}
    doubted, begin = 0, time.process_time()
    for k in range(options.runs):
        records, test, truth = random_cut(rng, bool(k % 2))
        result, edge = calibrate(records, test), "helical" if k % 2 else "straight"
        inside[f"{edge}, forces over rotation"] += held(result.fit, truth)
        assert result.average is not None
        inside[f"{edge}, mean forces"] += held(result.average, truth)
        doubted += any("residual" in doubt for doubt in result.doubts)
    rows = {**{name: float(np.mean(values)) for name, values in inside.items()}, "true inputs doubted": doubted / options.runs,
            "CPU seconds a test": (time.process_time() - begin) / options.runs}
    if options.json:
        print(json.dumps(rows))
        return
    for name, value in rows.items():
        print(f"{name:<34}{value:.3g}")
    every = 100 * float(np.mean([value for values in inside.values() for value in values]))
    print(f"95 % intervals hold in {every:.1f} % (target 93-97 %), true inputs doubted {100 * doubted / options.runs:.0f} %")


if __name__ == "__main__":
    main()
