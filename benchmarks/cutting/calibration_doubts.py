"""Calibration of random tools: how many true inputs stay unmarked, how many wrong ones (speed, helix, teeth) are marked."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np

from benchmarks.frame import CommandLine
from toolpoint import ToolpointError
from toolpoint.cutting import CuttingCoefficients, Engagement, MillingProblem, Tool
from toolpoint.cutting.cut.plane import PlaneDynamics
from toolpoint.cutting.force.laws import rigid_forces
from toolpoint.studies.cuts.forces.calibration import CuttingTest, calibrate
from toolpoint.vibration import Dof, Record

FEEDS, RATE, TURNS, DEPTH = (0.06e-3, 0.15e-3), 10000.0, 12, 2e-3


def random_test(rng: np.random.Generator) -> tuple[list[tuple[str, Record]], CuttingTest]:
    """Return two records of a random tool, coefficients, speed, noise (0.5 to 3 %) and start, and what was cut."""
    teeth, helix, runout = int(rng.integers(2, 6)), np.radians(rng.uniform(15, 45)), rng.uniform(0, 15e-6)
    immersion, way, speed = rng.uniform(0.2, 0.9), str(rng.choice(["up", "down"])), rng.uniform(1500, 5000)
    kt = rng.uniform(5e8, 2e9)
    material = CuttingCoefficients(kt, 0.3 * kt, 0.2 * kt, 2e4, 2e4, 1e3)
    arc = Engagement.up(immersion) if way == "up" else Engagement.down(immersion)
    rigid = PlaneDynamics(np.zeros(0, complex), np.zeros((0, 2, 2), complex), np.zeros((2, 2)))
    tool = Tool(0.016, teeth, helix=helix, runout=runout, runout_angle=rng.uniform(0, 6))
    records = []
    for feed in FEEDS:
        angle = rng.uniform(0, 6) + 2 * np.pi * speed / 60 / RATE * np.arange(int(TURNS * RATE * 60 / speed))
        force = rigid_forces(MillingProblem(tool, arc, material, rigid, feed_per_tooth=feed), DEPTH, angle, slices=80).force
        force = force + rng.uniform(0.005, 0.03) * np.abs(force).max() * rng.standard_normal(force.shape)
        records.append((f"{1e3 * feed:g} mm", Record(force, RATE, tuple(Dof("tool", f"+{w}") for w in "xyz"), ("force",) * 3)))
    cut: dict[str, Any] = {"diameter": 0.016, "teeth": teeth, "helix": helix, "direction": way, "immersion": immersion}
    return records, CuttingTest(cut, speed, DEPTH, FEEDS)


def is_marked(records: list[tuple[str, Record]], test: CuttingTest) -> bool:
    """Return whether a calibration is refused or marked doubtful."""
    try:
        return calibrate(records, test).fit.status.startswith("doubtful")
    except ToolpointError:
        return True


def main() -> None:
    """Run and print."""
    parser = CommandLine(__doc__)
    parser.cases("runs", 100)
    parser.add_argument("--wrong", type=int, default=10, help="Runs that are also given wrong inputs.")
    parser.json()
    options = parser.parse_args()
    rng, marked = np.random.default_rng(0), {"true inputs": 0, "speed": 0, "helix": 0, "teeth": 0}
    for k in range(options.runs):
        records, test = random_test(rng)
        marked["true inputs"] += is_marked(records, test)
        if k < options.wrong:
            marked["speed"] += is_marked(records, replace(test, speed=1.0033 * test.speed))
            marked["helix"] += is_marked(records, replace(test, cut={**test.cut, "helix": 0.0}))
            marked["teeth"] += is_marked(records, replace(test, cut={**test.cut, "teeth": test.cut["teeth"] + 1}))
        if (k + 1) % 10 == 0 and not options.json:
            print(k + 1, marked, flush=True)
    results = {"runs": options.runs, "runs with wrong inputs": options.wrong, "marked": marked}
    print(json.dumps(results) if options.json else f"marked {marked}, of {options.runs} true and {options.wrong} wrong of each")


if __name__ == "__main__":
    main()
